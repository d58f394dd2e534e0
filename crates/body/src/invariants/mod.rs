//! Exact condensation of the nodal equations of motion: primary data, invariants, frames, lumped comparators,
//! identities. No I/O, no eigen-solver.

mod alignment;
mod cauchy_schwarz;
mod certified;
mod comparison;
mod condense;
mod condense_linear;
mod dense;
mod derived;
mod frame;
mod general;
mod groups;
mod identities;
mod identity_terms;
mod inertia_stiffness;
mod lumped;
mod numbered;
mod primary;
mod principal_axes;
mod restriction;
mod rigid_modes;
mod softening;
mod transform;
mod validate;

pub use alignment::{Alignment, align, compare_invariants};
pub use cauchy_schwarz::{CauchySchwarz, primary_differences};
pub use certified::{CertifiedInvariants, DIGITS, condense_certified};
pub use comparison::{ERROR_NORMS, error_norms};
pub use condense::condense;
pub use condense_linear::{condense_linear, condense_lumped_linear};
pub use derived::Derived;
pub use frame::{
    BodyFrame, Frame, FrameChoice, MassProperties, choose_frame, choose_general_frame, choose_plane_frame,
};
pub use general::rigid_first_moment;
pub use general::{MassProduct, RigidMotion, condense_general, condense_general_linear};
pub use groups::{TermGroup, TermGroups};
pub use identities::{Expected, IdentityCheck, Turning, derived_identities, identities};
pub use inertia_stiffness::{InertiaShares, InertiaStiffness};
pub use lumped::{LumpedMasses, LumpedScheme, condense_lumped};
pub use numbered::Numbered;
pub use primary::{GeneralTerms, Invariants, MassKind, PrimaryData};
pub use principal_axes::principal_axes;
pub use restriction::{UnitFactors, ibar_of_c2, s_of_modal_mass, symmetric_part};
pub use softening::relative_norm;

//! Exact condensation of the nodal equations of motion: primary data, invariants, frames, lumped comparators,
//! identities. No I/O, no eigen-solver.

mod certified;
mod comparison;
mod condense;
mod derived;
mod frame;
mod general;
mod identities;
mod identity_terms;
mod inertia_stiffness;
mod lumped;
mod numbered;
mod primary;
mod transform;

pub use certified::{CertifiedInvariants, DIGITS, condense_certified, digits_of_error};
pub use comparison::{
    Alignment, CauchySchwarz, ERROR_NORMS, align, compare_invariants, error_norms, primary_differences,
};
pub use condense::{condense, condense_linear};
pub use derived::Derived;
pub use frame::{
    BodyFrame, Frame, FrameChoice, MassProperties, choose_frame, choose_general_frame, choose_plane_frame,
    principal_axes,
};
pub use general::{MassProduct, RigidMotion, condense_general, condense_general_linear, rigid_first_moment};
pub use identities::{
    BoundsBroken, Expected, IdentityCheck, Turning, bounds_broken, derived_identities, identities,
};
pub use inertia_stiffness::{InertiaShares, InertiaStiffness, relative_norm};
pub use lumped::{LumpedMasses, LumpedScheme, condense_lumped, condense_lumped_linear};
pub use numbered::Numbered;
pub use primary::{GeneralTerms, Invariants, MassKind, PrimaryData, TermGroup, TermGroups};
pub use transform::{ibar_of_c2, s_of_modal_mass, symmetric_part};

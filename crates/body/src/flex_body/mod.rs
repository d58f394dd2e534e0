//! Validated flexible body, independent of the files it came from and goes to.

mod body;
mod carried;
mod carried_stiffness;
mod carrier;
mod fewer_fixed_modes;
mod frame_change;
mod held_modes;
mod held_response;
mod identities;
mod interface;
mod missing_stiffness;
mod modal_change;
mod model_axes;
mod motion_columns;
mod named_load;
mod parts;
mod recovery;
mod reference_conditions;
mod rotated_stiffness;
mod rounding;
mod softening;
mod stated_damping;
mod static_response;
mod storage;
mod subset;
mod terms;
mod validate;

pub use crate::basis::{FixedInterface, FreeEstimate, InterfaceCoordinates, Truncation};
pub use crate::invariants::{Frame, TermGroup, TermGroups};
pub use body::{FlexBody, MAX_TURNING_PART};
pub use carrier::Carrier;
pub use flexbody_model::{
    Coupling, GeometricStiffness, LoadKind, Quantity, RecoveryRow, SurfaceMesh, UnitLoad,
};
pub use held_modes::HeldMode;
pub use held_response::RigidAccelerations;
pub(crate) use identities::{magnitudes, worst_entry};
pub use interface::{Interface, InterfaceRows};
pub use modal_change::{ModalChange, RigidMotions, diagonal_eigenvalues, reduced_residuals, rigid_motions};
pub use model_axes::{along, stiffness_about};
pub use motion_columns::{ModalMotion, MotionColumns, MotionLoad, modes_respond};
pub use named_load::NamedLoad;
pub use parts::{
    Certificate, Guarantee, InternalRows, LumpedBody, MassStructure, Modes, Parts, Source, is_static,
};
pub use recovery::{LOAD_COMPONENTS, LoadColumns, Recovery, RecoveryState};
pub use reference_conditions::ReferenceConditions;
pub use rotated_stiffness::{RotatedStiffness, SplitStiffness, joined, split};
pub use softening::{SOFTENING, axis_in_words};
pub use stated_damping::diagonal_ratios;
pub(crate) use stated_damping::proportional_damping;
pub use static_response::StaticCoordinates;
pub use storage::Storage;
pub use subset::Subset;
pub use terms::TermDecision;

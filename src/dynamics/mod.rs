//! The equations of motion of one flexible body: reduced, from its invariants (theory sections 3, 4 and 6), and of all nodes. Forces,
//! momenta, energies, accelerations and Jacobians, without an allocation per evaluation. No integrators.

mod accelerations;
mod equations;
mod evaluation;
mod jacobian;
mod kernels;
mod loads;
mod modal_matrix;
mod nodal;
mod orientation;
mod terms;

pub use accelerations::NotPositiveDefinite;
pub use equations::EquationsOfMotion;
pub use evaluation::Evaluation;
pub use loads::NodeShapes;
pub use nodal::{
    FrameMotion, NodalEquations, NodalError, NodalEvaluation, NodalModes, NodalMotion, ReferenceConditions,
};
pub use orientation::{AngularVelocity, EulerParameters, Orientation, PlaneAngle, RotationVector};
pub use terms::Terms;

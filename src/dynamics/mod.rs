//! The reduced equations of motion of one flexible body from its invariants (theory sections 3, 4 and 6): forces, momenta,
//! energies, accelerations and Jacobians, without an allocation per evaluation; and its motion as a system to integrate.

mod accelerations;
mod equations;
mod evaluation;
mod geometric;
mod jacobian;
mod kernels;
mod load_jacobian;
mod loads;
mod modal_matrix;
mod motion;
mod orientation;
mod points;
mod terms;

pub use accelerations::{NotPositiveDefinite, Prescribed};
pub use equations::EquationsOfMotion;
pub use evaluation::Evaluation;
pub use load_jacobian::{LoadAxes, LoadJacobian};
pub use motion::{Balance, Configuration, EmptySpace, Motion, Place, Surroundings};
pub use orientation::{AngularVelocity, EulerParameters, Orientation, PlaneAngle, RotationVector};
pub use points::BodyPoint;
pub use terms::Terms;

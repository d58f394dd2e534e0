//! The equations of motion of one flexible body: reduced, from its invariants (theory sections 3, 4 and 6),
//! and of all its nodes. Forces, momenta, energies, accelerations and Jacobians, without an allocation per
//! evaluation; and its motion as a system to integrate.

mod accelerations;
mod constants;
mod cost;
mod equations;
mod evaluation;
mod geometric;
mod jacobian;
mod kernels;
mod load_jacobian;
mod loads;
mod modal_matrix;
mod motion;
mod nodal;
mod orientation;
mod points;
mod prescribed;
mod snapshot;
mod terms;

pub use constants::Constants;
pub use equations::EquationsOfMotion;
pub use evaluation::Evaluation;
pub use geometric::{Stiffening, stiffness_under};
pub use load_jacobian::{LoadAxes, LoadJacobian};
pub use motion::{EmptySpace, Motion, Surroundings};
pub use nodal::{
    NodalConfiguration, NodalEquations, NodalError, NodalEvaluation, NodalModes, NodalMotion, NodalPoint,
    ReferenceConditions,
};
pub use orientation::{AngularVelocity, EulerParameters, Orientation, PlaneAngle, RotationVector};
pub use points::BodyPoint;
pub use prescribed::{AlongFrame, NotPositiveDefinite, Prescribed};
pub use snapshot::{Balance, Configuration, Place, Snapshot};
pub use terms::Terms;

//! The equations of motion of one flexible body: reduced, from its invariants (theory sections 3, 4 and 6),
//! and of all its nodes. Forces, momenta, energies, accelerations and Jacobians, without an allocation per
//! evaluation; and its motion as a system to integrate.

mod definiteness;
mod equations;
mod evaluation;
mod jacobian;
mod kernels;
mod motion;
mod natural_modes;
mod nodal;
mod orientation;
mod points;
mod prescribed;
mod snapshot;

pub use definiteness::{deflection_of_indefinite_inertia, indefinite_inertia};
pub use equations::{Constants, EquationsOfMotion, Stiffening, Terms, stiffness_under};
pub use evaluation::Evaluation;
pub use jacobian::{LoadAxes, LoadJacobian};
pub use motion::{EmptySpace, Motion, NotPositiveDefinite, Surroundings};
pub use nodal::{
    NodalConfiguration, NodalEquations, NodalError, NodalEvaluation, NodalModes, NodalMotion, NodalPoint,
    ReferenceConditions,
};
pub use orientation::{AngularVelocity, EulerParameters, Orientation, PlaneAngle, RotationVector};
pub use points::BodyPoint;
pub use prescribed::{AlongFrame, Prescribed};
pub use snapshot::{Balance, Configuration, Place, Snapshot};

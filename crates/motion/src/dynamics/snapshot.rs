//! A body at one state of its motion, as a reader thinks of it.

use super::{EulerParameters, Evaluation};
use nalgebra::{Matrix3, Vector3};

/// Where a body is: its frame in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// A: body axes to world axes.
    pub axes: Matrix3<f64>,
}

/// A state in the velocities that a reader thinks in.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// Attitude of the frame, of unit length.
    pub attitude: EulerParameters,
    /// Velocity of the origin, world axes.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the frame, body axes.
    pub omega: Vector3<f64>,
    /// Modal coordinates (nf).
    pub q: Vec<f64>,
    /// Their rates (nf).
    pub qd: Vec<f64>,
}

/// What the motion of a body keeps or exchanges, at one time. Momenta in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Elastic energy.
    pub elastic: f64,
    /// Kinetic energy of the flight, P^2 / 2m: what is left of the rest does not depend on who looks.
    pub flight: f64,
    /// Work of forces, damping and prescribed motion since the start.
    pub work: f64,
    /// Linear momentum.
    pub linear: Vector3<f64>,
    /// Angular momentum about where the origin of the body was at the start.
    pub angular: Vector3<f64>,
    /// Impulse of the forces since the start.
    pub impulse: Vector3<f64>,
    /// Their angular impulse about the same point.
    pub angular_impulse: Vector3<f64>,
}

/// A body at one state of its [`Motion`](super::Motion).
#[derive(Debug)]
pub struct Snapshot<'m> {
    pub(super) place: Place,
    pub(super) attitude: EulerParameters,
    pub(super) evaluation: &'m Evaluation<'m>,
    pub(super) reference: Vector3<f64>,
    pub(super) mass: f64,
    pub(super) work: f64,
    pub(super) impulse: Vector3<f64>,
    pub(super) angular_impulse: Vector3<f64>,
    pub(super) reaction: (Vector3<f64>, Vector3<f64>),
}

impl Snapshot<'_> {
    /// Where the frame is.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// The equations of motion at this state.
    pub fn evaluation(&self) -> &Evaluation<'_> {
        self.evaluation
    }

    /// The state as positions and velocities.
    pub fn configuration(&self) -> Configuration {
        let (velocity, omega) = self.evaluation.rigid_velocity();
        Configuration {
            origin: self.place.origin,
            attitude: self.attitude,
            velocity: self.place.axes * velocity,
            omega,
            q: self.evaluation.modal_coordinates().to_vec(),
            qd: self.evaluation.modal_velocity().to_vec(),
        }
    }

    /// Energies, momenta and what the surroundings put in.
    pub fn balance(&self) -> Balance {
        let linear = self.place.axes * self.evaluation.linear_momentum();
        let angular = self.place.axes * self.evaluation.angular_momentum();
        Balance {
            kinetic: self.evaluation.kinetic_energy(),
            elastic: self.evaluation.elastic_energy(),
            flight: 0.5 * linear.norm_squared() / self.mass,
            work: self.work,
            linear,
            angular: angular + (self.place.origin - self.reference).cross(&linear),
            impulse: self.impulse,
            angular_impulse: self.angular_impulse,
        }
    }

    /// Force and torque about the origin that the prescribed motion takes, body axes; zero where nothing is
    /// prescribed.
    pub fn reaction(&self) -> (Vector3<f64>, Vector3<f64>) {
        self.reaction
    }
}

//! Positions, velocities and energies of a body at one state of its motion.

use super::{EulerParameters, Evaluation};
use nalgebra::{Matrix3, Vector3};

/// Position and orientation of the body frame in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// Rotation A from body axes to world axes.
    pub axes: Matrix3<f64>,
}

/// State in positions and velocities.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// Attitude of the body frame: Euler parameters, of unit length, of the rotation from body axes to world axes.
    pub attitude: EulerParameters,
    /// Velocity of the origin of the body frame, world axes.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the body frame in the world, body axes.
    pub omega: Vector3<f64>,
    /// Modal coordinates (nf), of the modes in the body frame.
    pub q: Vec<f64>,
    /// Rates of the modal coordinates (nf).
    pub qd: Vec<f64>,
}

/// Energies, momenta, work and impulses of a motion at one time. Vectors are along world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Elastic energy.
    pub elastic: f64,
    /// Kinetic energy of translation, P^2 / 2m; the remainder of the kinetic energy is independent of the
    /// inertial frame.
    pub flight: f64,
    /// Work of forces, damping and prescribed motion since the start.
    pub work: f64,
    /// Linear momentum, world axes.
    pub linear: Vector3<f64>,
    /// Angular momentum about the position of the body origin at the start, world axes.
    pub angular: Vector3<f64>,
    /// Impulse of the forces since the start, world axes.
    pub impulse: Vector3<f64>,
    /// Angular impulse of the forces since the start about the position of the body origin at the start, world axes.
    pub angular_impulse: Vector3<f64>,
}

/// Body at one state of its [`Motion`](super::Motion).
#[derive(Debug)]
pub struct Snapshot<'m> {
    /// Position and orientation of the body frame in the world.
    pub(super) place: Place,
    /// Euler parameters of the rotation from body axes to world axes.
    pub(super) attitude: EulerParameters,
    /// Equations of motion at this state; their vectors are along body axes.
    pub(super) evaluation: &'m Evaluation<'m>,
    /// Position of the body origin at the start, world axes: the point of the angular momentum.
    pub(super) reference: Vector3<f64>,
    pub(super) mass: f64,
    /// Work of forces, damping and prescribed motion since the start.
    pub(super) work: f64,
    /// Impulse of the forces since the start, world axes.
    pub(super) impulse: Vector3<f64>,
    /// Angular impulse of the forces since the start about `reference`, world axes.
    pub(super) angular_impulse: Vector3<f64>,
    /// Force and torque (about the body origin) of the prescribed motion, body axes.
    pub(super) reaction: (Vector3<f64>, Vector3<f64>),
}

impl Snapshot<'_> {
    /// Returns position and orientation of the frame.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Returns the equations of motion at this state.
    pub fn evaluation(&self) -> &Evaluation<'_> {
        self.evaluation
    }

    /// Returns the state in positions and velocities.
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

    /// Returns energies and momenta, and the work and impulses of the surroundings.
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

    /// Returns the force of the prescribed motion and its torque about the origin of the body frame, body axes; zero
    /// without prescribed motion.
    pub fn reaction(&self) -> (Vector3<f64>, Vector3<f64>) {
        self.reaction
    }
}

//! Kinematics of one node with directors.

use crate::dynamics::{Orientation, RotationVector};
use nalgebra::{Matrix3, Vector3};

/// Node with rotation vector theta: R = exp(theta~) with the directors d_a = R e_a as columns, and J with
/// the angular velocity J theta' of the directors relative to the frame, along the axes of the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurnedNode {
    theta: Vector3<f64>,
    directors: Matrix3<f64>,
    /// J' = G(theta).
    map: Matrix3<f64>,
}

impl TurnedNode {
    /// Creates the node at `theta`.
    pub(super) fn new(theta: Vector3<f64>) -> Self {
        let rotation = RotationVector(theta);
        Self { theta, directors: rotation.axes(), map: rotation.map() }
    }

    /// Returns the rotation vector theta.
    pub(super) fn theta(&self) -> Vector3<f64> {
        self.theta
    }

    /// Returns the director d_a = R e_a.
    pub(super) fn director(&self, a: usize) -> Vector3<f64> {
        self.directors.column(a).into_owned()
    }

    /// Returns J theta', the angular velocity relative to the frame.
    pub(super) fn spin(&self, rate: &Vector3<f64>) -> Vector3<f64> {
        self.map.tr_mul(rate)
    }

    /// Returns J'm: its power on theta' is that of the moment m on the directors.
    pub(super) fn onto_rotations(&self, moment: &Vector3<f64>) -> Vector3<f64> {
        self.map * moment
    }

    /// Returns D with D dtheta = d(J(theta) x) for a constant x.
    pub(super) fn spin_derivative(&self, x: &Vector3<f64>) -> Matrix3<f64> {
        // J(theta) = G(-theta).
        -RotationVector(-self.theta).map_derivative(x)
    }

    /// Returns d/dt (J') m for a constant m, where theta changes with `rate`.
    pub(super) fn moment_drift(&self, moment: &Vector3<f64>, rate: &Vector3<f64>) -> Vector3<f64> {
        RotationVector(self.theta).map_derivative(moment) * rate
    }
}

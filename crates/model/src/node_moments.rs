//! Moments of the mass that turns with a node, and the stiffness due to the inertia of a rigid motion.

use nalgebra::{Matrix3, Vector3};

/// Moments of the mass that turns with a node, about the origin of a frame and along its axes: the products
/// of the rows of its directors with the rigid motions of the whole body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeMoments {
    /// h_a = sum over the points of E_s with director a. Unit: mass length.
    pub first: Vector3<f64>,
    /// Row a: z_a = sum of E_s of director a with the positions of points and directors. Unit: mass
    /// length^2.
    pub second: Matrix3<f64>,
}

impl NodeMoments {
    /// Returns H = sym(G) - tr(G) I with G = sum_a e_a g_a', g_a = h_a a + alpha x z_a + omega x (omega x
    /// z_a): the stiffness for the rotations of the node due to the inertia of a rigid motion. `motion` is
    /// about the point and along the axes of the moments.
    pub fn of(&self, motion: &RigidAcceleration) -> Matrix3<f64> {
        // omega x (omega x z) = (omega omega' - omega^2 I) z.
        let turning = motion.angular.cross_matrix() + motion.spin - Matrix3::identity() * motion.spin.trace();
        let g = self.first * motion.linear.transpose() + self.second * turning.transpose();
        0.5 * (g + g.transpose()) - Matrix3::identity() * g.trace()
    }
}

/// Acceleration of a rigid motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidAcceleration {
    /// Acceleration of the reference point of the motion minus gravity. Unit: length/time^2.
    pub linear: Vector3<f64>,
    /// Angular acceleration. Unit: 1/time^2.
    pub angular: Vector3<f64>,
    /// omega omega', the products of the angular velocity. Unit: 1/time^2.
    pub spin: Matrix3<f64>,
}

impl RigidAcceleration {
    /// Creates the acceleration of a motion with the angular velocity `omega`.
    pub fn new(linear: Vector3<f64>, angular: Vector3<f64>, omega: &Vector3<f64>) -> Self {
        Self { linear, angular, spin: omega * omega.transpose() }
    }
}

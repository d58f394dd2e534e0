//! Rigid motion that is given, and what a solution for the rest can fail by.

use nalgebra::Vector3;

/// The mass matrix at a state is not positive definite: terms were dropped and the deformation is too large
/// for what is left, or the invariants are not those of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositiveDefinite;

impl std::fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the mass matrix of the deformed body is not positive definite")
    }
}

impl std::error::Error for NotPositiveDefinite {}

/// Rigid motion that is given instead of following from forces, in body axes: velocities of the frame or,
/// where accelerations are asked for, their rates of change. What is `None` is free.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Prescribed {
    /// V or V'.
    pub linear: Option<Vector3<f64>>,
    /// omega or omega'.
    pub angular: Option<Vector3<f64>>,
}

impl Prescribed {
    /// Nothing: a free body.
    pub const NOTHING: Self = Self { linear: None, angular: None };

    /// What is given of entry `axis` of (V, omega).
    pub(super) fn entry(&self, axis: usize) -> Option<f64> {
        if axis < 3 { self.linear.map(|v| v[axis]) } else { self.angular.map(|w| w[axis - 3]) }
    }
}

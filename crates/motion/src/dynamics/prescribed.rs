//! Rigid motion that is given, and what a solution for the rest can fail by.

use nalgebra::{Matrix3, Vector3};

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

/// A vector along the axes of the frame of a body. What is along those of the world is a plain vector: one becomes the
/// other by [`AlongFrame::in_world`] alone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AlongFrame(pub Vector3<f64>);

impl AlongFrame {
    /// This vector along the axes of the world, A v.
    ///
    /// * `axes`: A, the axes of the frame in the world, in columns.
    pub fn in_world(&self, axes: &Matrix3<f64>) -> Vector3<f64> {
        axes * self.0
    }
}

/// Rigid motion that is given instead of following from forces: velocities of the frame or, where accelerations are
/// asked for, the rates of change of their components. What is `None` is free.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Prescribed {
    /// V or V'.
    pub linear: Option<AlongFrame>,
    /// omega or omega'.
    pub angular: Option<AlongFrame>,
}

impl Prescribed {
    /// Nothing: a free body.
    pub const NOTHING: Self = Self { linear: None, angular: None };

    /// What is given of entry `axis` of (V, omega).
    pub(super) fn entry(&self, axis: usize) -> Option<f64> {
        if axis < 3 { self.linear.map(|v| v.0[axis]) } else { self.angular.map(|w| w.0[axis - 3]) }
    }
}

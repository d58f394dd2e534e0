//! Prescribed motion of the frame of a body.

use nalgebra::{Matrix3, Vector3};

/// Vector along the axes of the frame of a body. Vectors along world axes are plain vectors; only
/// [`AlongFrame::in_world`] converts one into the other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AlongFrame(pub Vector3<f64>);

impl AlongFrame {
    /// Returns the vector along the axes of the world, A v.
    ///
    /// * `axes`: A, the axes of the frame in the world, in columns.
    pub fn in_world(&self, axes: &Matrix3<f64>) -> Vector3<f64> {
        axes * self.0
    }
}

/// Prescribed rigid motion: velocities of the frame or, for accelerations, the rates of their components. A
/// part that is `None` is free.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Prescribed {
    /// Prescribed V or V'.
    pub linear: Option<AlongFrame>,
    /// Prescribed omega or omega'.
    pub angular: Option<AlongFrame>,
}

impl Prescribed {
    /// No prescribed motion: a free body.
    pub const NOTHING: Self = Self { linear: None, angular: None };

    /// Returns the prescribed value of entry `axis` of (V, omega).
    pub(super) fn entry(&self, axis: usize) -> Option<f64> {
        if axis < 3 { self.linear.map(|v| v.0[axis]) } else { self.angular.map(|w| w.0[axis - 3]) }
    }
}

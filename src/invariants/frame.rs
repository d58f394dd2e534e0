//! The body frame.

use nalgebra::{Matrix3, Vector3};

/// The body frame in model coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin in model axes. Unit: length.
    pub origin: Vector3<f64>,
    /// Columns are the body axes in model axes, right-handed: x_model = origin + axes x_body.
    pub axes: Matrix3<f64>,
}

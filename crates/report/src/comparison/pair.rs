//! Two bodies in one frame.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::Invariants;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Two bodies brought into one frame.
pub(super) struct Pair<'a> {
    pub a: &'a FlexBody,
    pub b: &'a FlexBody,
    pub change: FrameChange,
    /// Invariants of `b` in the frame of `a`, in the modal basis of `b`.
    pub in_a: Invariants,
    /// Clusters of close eigenvalues.
    pub groups: Vec<Range<usize>>,
}

/// Transformation from the frame of `b` to that of `a`: x_a = axes' (x_b - shift).
pub(super) struct FrameChange {
    pub shift: Vector3<f64>,
    pub axes: Matrix3<f64>,
}

impl FrameChange {
    pub(super) fn new(a: &FlexBody, b: &FlexBody) -> Self {
        let (a, b) = (a.frame(), b.frame());
        // Equal frames must change nothing, not even the last bit.
        let axes = if a.axes == b.axes { Matrix3::identity() } else { b.axes.transpose() * a.axes };
        Self { shift: b.axes.transpose() * (a.origin - b.origin), axes }
    }

    pub(super) fn point(&self, x: &[f64; 3]) -> Vector3<f64> {
        self.axes.transpose() * (Vector3::from(*x) - self.shift)
    }
}

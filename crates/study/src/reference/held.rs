//! The point that carries a body, expressed in the rows of its model.

use faer::Mat;
use flexbody_linalg::{combine, gram, subtract_combination};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::NodalPoint;
use nalgebra::DMatrix;

/// Conditions C u = 0 of a point that is at rest in the frame that it carries. There are as many conditions as rigid
/// motions R. The projection T = 1 - R (C R)^-1 C removes from a displacement the motion of the point. T' adds to
/// forces the reaction at the point, so that the sum is in balance.
pub(super) struct Held {
    /// C' (N x 6, in the plane N x 3).
    conditions: Mat<f64>,
    rigid: Mat<f64>,
    /// (C R)^-1.
    inverse: Mat<f64>,
}

impl Held {
    /// Builds the conditions for `point` of `model`, whose rigid motions are `rigid`. Returns `None` if C R is
    /// singular: the point has no orientation.
    pub(super) fn new(model: &FeModel, point: &NodalPoint, rigid: &Mat<f64>) -> Option<Self> {
        let conditions = point.unit_loads(model);
        let product = gram(conditions.as_ref(), rigid.as_ref());
        let count = product.nrows();
        let inverse = DMatrix::from_fn(count, count, |i, j| product[(i, j)]).try_inverse()?;
        let inverse = Mat::from_fn(count, count, |i, j| inverse[(i, j)]);
        Some(Self { conditions, rigid: rigid.clone(), inverse })
    }

    /// Returns C' (N x 6, in the plane N x 3).
    pub(super) fn conditions(&self) -> &Mat<f64> {
        &self.conditions
    }

    /// Applies T' to forces in place.
    pub(super) fn balance(&self, forces: &mut Mat<f64>) {
        let resultants = gram(self.rigid.as_ref(), forces.as_ref());
        let taken = gram(self.inverse.as_ref(), resultants.as_ref());
        subtract_combination(forces.as_mut(), self.conditions.as_ref(), taken.as_ref());
    }

    /// Applies T to displacements in place.
    pub(super) fn hold(&self, displacements: &mut Mat<f64>) {
        let moved = gram(self.conditions.as_ref(), displacements.as_ref());
        let motion = combine(self.inverse.as_ref(), moved.as_ref());
        subtract_combination(displacements.as_mut(), self.rigid.as_ref(), motion.as_ref());
    }
}

//! The point that carries a body, in the rows of its model.

use faer::Mat;
use flexbody_linalg::{combine, gram, subtract_combination};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::NodalPoint;
use nalgebra::DMatrix;

/// The conditions C u = 0 of a point that rests in the frame which it carries. There are as many of them as
/// rigid motions R, so that T = 1 - R (C R)^-1 C takes every displacement to the one without motion of the
/// point, and T' takes forces to those together with what the point carries of them, which are balanced.
pub(super) struct Held {
    /// C' (N x 6, in the plane N x 3).
    conditions: Mat<f64>,
    rigid: Mat<f64>,
    /// (C R)^-1.
    inverse: Mat<f64>,
}

impl Held {
    /// `point` of `model`, whose rigid motions are `rigid`; `None` where the point has no orientation.
    pub(super) fn new(model: &FeModel, point: &NodalPoint, rigid: &Mat<f64>) -> Option<Self> {
        let conditions = point.unit_loads(model);
        let product = gram(conditions.as_ref(), rigid.as_ref());
        let count = product.nrows();
        let inverse = DMatrix::from_fn(count, count, |i, j| product[(i, j)]).try_inverse()?;
        let inverse = Mat::from_fn(count, count, |i, j| inverse[(i, j)]);
        Some(Self { conditions, rigid: rigid.clone(), inverse })
    }

    /// C' (N x 6, in the plane N x 3).
    pub(super) fn conditions(&self) -> &Mat<f64> {
        &self.conditions
    }

    /// f <- T'f.
    pub(super) fn balance(&self, forces: &mut Mat<f64>) {
        let resultants = gram(self.rigid.as_ref(), forces.as_ref());
        let taken = gram(self.inverse.as_ref(), resultants.as_ref());
        subtract_combination(forces.as_mut(), self.conditions.as_ref(), taken.as_ref());
    }

    /// u <- T u.
    pub(super) fn hold(&self, displacements: &mut Mat<f64>) {
        let moved = gram(self.conditions.as_ref(), displacements.as_ref());
        let motion = combine(self.inverse.as_ref(), moved.as_ref());
        subtract_combination(displacements.as_mut(), self.rigid.as_ref(), motion.as_ref());
    }
}

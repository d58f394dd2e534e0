//! Displacements and rotations of points by the modes.

use flexbody_body::flex_body::FlexBody;
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Evaluation, Terms};
use nalgebra::{DMatrix, Vector3};

/// Displacements of points of a body at rest by its modes.
pub(super) struct PointRows<'b> {
    body: &'b FlexBody,
    equations: EquationsOfMotion,
}

impl<'b> PointRows<'b> {
    pub(super) fn new(body: &'b FlexBody) -> Self {
        Self { body, equations: EquationsOfMotion::new(body, Terms::NONE) }
    }

    /// Returns Psi of a point (3 x nf), body axes.
    pub(super) fn of(&self, point: &BodyPoint) -> DMatrix<f64> {
        self.works(|rest, axis, forces| point.add_force(rest, axis, forces))
    }

    /// Returns the rotations of a point by the modes (3 x nf), body axes. The point must have an orientation.
    pub(super) fn of_rotation(&self, point: &BodyPoint) -> DMatrix<f64> {
        self.works(|rest, axis, forces| point.add_torque(rest, axis, forces))
    }

    /// Returns the modal forces of a unit load along each axis.
    fn works(&self, add: impl Fn(&Evaluation<'_>, &Vector3<f64>, &mut [f64])) -> DMatrix<f64> {
        let rest = Evaluation::new(&self.equations);
        let rows = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
            let mut forces = vec![0.0; self.equations.n_velocities()];
            add(&rest, &axis, &mut forces);
            forces.split_off(self.equations.n_rigid())
        });
        DMatrix::from_fn(3, self.body.n_modes(), |k, j| rows[k][j])
    }

    /// Returns Psi of a node (3 x nf).
    pub(super) fn of_node(&self, node: usize) -> DMatrix<f64> {
        let shape = &self.body.modes().shape;
        DMatrix::from_fn(3, self.body.n_modes(), |k, j| shape[(3 * node + k, j)])
    }

    /// Returns the rows with column j multiplied by `weight(j)`.
    pub(super) fn weighted(rows: &DMatrix<f64>, weight: impl Fn(usize) -> f64) -> DMatrix<f64> {
        DMatrix::from_fn(rows.nrows(), rows.ncols(), |k, j| rows[(k, j)] * weight(j))
    }

    /// Returns the largest singular value of a few rows.
    pub(super) fn norm(rows: &DMatrix<f64>) -> f64 {
        (rows * rows.transpose()).symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}

//! Derivatives of loads.

use super::EquationsOfMotion;
use nalgebra::Vector3;

/// Axes in which a load is constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LoadAxes {
    /// World axes: the load keeps its direction while the body turns.
    World,
    /// Body axes: the load turns with the body.
    Body,
}

/// Accumulated derivatives of the generalised forces of loads; n = 6 + nf rows, for a plane body 3 + nf.
///
/// The derivatives belong to the right-hand side; [`Evaluation::jacobian`](super::Evaluation::jacobian)
/// gives those of the left. Constant loads do not depend on the position R of the body.
#[derive(Debug)]
pub struct LoadJacobian<'m> {
    /// Derivatives by q (n x nf), row-major.
    pub by_q: &'m mut [f64],
    /// Derivatives by a small rotation phi in body axes, A becoming A (I + phi~): n x 3, for a plane body n
    /// x 1, row-major.
    pub by_turn: &'m mut [f64],
}

impl LoadJacobian<'_> {
    pub(super) fn check(&self, body: &EquationsOfMotion) {
        let n = body.n_velocities();
        assert!(
            self.by_q.len() == n * body.nf && self.by_turn.len() == n * body.axes.len(),
            "n x nf and n x 3 entries, in the plane n x 1"
        );
    }

    /// Adds a torque to column j of `by_q`.
    pub(super) fn add_by_q(&mut self, body: &EquationsOfMotion, j: usize, torque: &Vector3<f64>) {
        for (i, &axis) in body.rigid.iter().enumerate().filter(|(_, axis)| **axis >= 3) {
            self.by_q[i * body.nf + j] += torque[axis - 3];
        }
    }

    /// Returns the row of mode `i` in `by_q`.
    pub(super) fn modal_row(&mut self, body: &EquationsOfMotion, i: usize) -> &mut [f64] {
        &mut self.by_q[(body.rigid.len() + i) * body.nf..][..body.nf]
    }

    /// Adds a force, a torque about the origin and modal forces to column `at` of `by_turn`, which belongs
    /// to one axis.
    pub(super) fn add_by_turn(
        &mut self,
        body: &EquationsOfMotion,
        at: usize,
        force: &Vector3<f64>,
        torque: &Vector3<f64>,
        modal: impl Fn(usize) -> f64,
    ) {
        let (width, r) = (body.axes.len(), body.rigid.len());
        for (i, &axis) in body.rigid.iter().enumerate() {
            self.by_turn[i * width + at] += if axis < 3 { force[axis] } else { torque[axis - 3] };
        }
        (0..body.nf).for_each(|j| self.by_turn[(r + j) * width + at] += modal(j));
    }
}

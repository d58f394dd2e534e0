//! Where the derivatives of loads are collected.

use super::EquationsOfMotion;
use nalgebra::Vector3;

/// In which axes a load is constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LoadAxes {
    /// In world axes: it stays as the body turns.
    World,
    /// In body axes: it turns with the body.
    Body,
}

/// Derivatives of the generalised forces of loads, which add up here; n = 6 + nf rows, of a plane body 3 +
/// nf.
///
/// They belong to the right-hand side: [`Evaluation::jacobian`](super::Evaluation::jacobian) has those of the
/// left. Constant loads do not depend on the place R of the body.
#[derive(Debug)]
pub struct LoadJacobian<'m> {
    /// By q (n x nf), row-major.
    pub by_q: &'m mut [f64],
    /// By a small rotation phi in body axes, A becoming A (I + phi~): n x 3, of a plane body n x 1,
    /// row-major.
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

    /// Row of mode `i` in `by_q`.
    pub(super) fn modal_row(&mut self, body: &EquationsOfMotion, i: usize) -> &mut [f64] {
        &mut self.by_q[(body.rigid.len() + i) * body.nf..][..body.nf]
    }

    /// Adds a force, a torque about the origin and modal forces to the column of axis number `at` of
    /// `by_turn`.
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

//! Named loads: nodal forces that act on the body as one load with an amplitude.

use super::modal_change::ModalChange;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// Nodal forces f with a name. With the amplitude a, the forces a f keep their directions in the frame of the body, and
/// their points of application follow the nodes: power a f'(rigid motion + Psi qd) on the deformed body, so that
///
/// ```text
/// force a F,    torque a (T + L q) about the origin of the frame,    modal forces a Psi'f
/// ```
///
/// Forces of a preload act between parts of the body, so that their resultant stays zero while the body deforms: of a
/// preload there are the modal forces only.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedLoad {
    /// Name, different from those of the interfaces.
    pub name: String,
    /// True if the load acts always, with amplitude 1.
    pub preload: bool,
    /// Modal load Psi'f (nf).
    pub modal: Vec<f64>,
    /// Resultant force F, body axes.
    pub force: Vector3<f64>,
    /// Resultant torque T about the origin of the frame, body axes.
    pub torque: Vector3<f64>,
    /// First moments of the forces, sum_i x_i f_i' over the nodes, body axes.
    pub moments: Matrix3<f64>,
    /// L (3 x nf): torque sum_i psi_ij x f_i of the forces on the nodes that a unit modal coordinate displaces.
    pub turning: Mat<f64>,
    /// Compliance f'G f with the static flexibility G of the free body; `None` if it is not known.
    pub compliance: Option<f64>,
}

impl NamedLoad {
    /// Returns the torque about the origin of the frame per unit amplitude at the modal coordinates `q`, body axes; zero
    /// for a preload.
    ///
    /// # Panics
    /// When the number of modes differs.
    pub fn torque_at(&self, q: &[f64]) -> Vector3<f64> {
        assert_eq!(q.len(), self.turning.ncols(), "modes of the same body");
        if self.preload {
            return Vector3::zeros();
        }
        let of_modes = |k: usize| q.iter().enumerate().map(|(j, q)| self.turning[(k, j)] * q).sum::<f64>();
        self.torque + Vector3::from_fn(|k, _| of_modes(k))
    }

    /// Returns the resultant force per unit amplitude, body axes; zero for a preload.
    pub fn resultant_force(&self) -> Vector3<f64> {
        if self.preload { Vector3::zeros() } else { self.force }
    }

    /// Returns force and torque about the origin as six numbers.
    pub(super) fn resultant(&self) -> [f64; 6] {
        let (f, t) = (self.force, self.torque);
        [f.x, f.y, f.z, t.x, t.y, t.z]
    }

    /// Returns the load for a frame at `origin` with the columns of `axes` as its axes, both in the present frame.
    pub(super) fn in_frame(&self, origin: &Vector3<f64>, axes: &Matrix3<f64>) -> Self {
        let to_new = axes.transpose();
        let moments = self.moments - origin * self.force.transpose();
        Self {
            force: to_new * self.force,
            torque: to_new * (self.torque - origin.cross(&self.force)),
            moments: to_new * moments * axes,
            turning: Mat::from_fn(3, self.turning.ncols(), |k, j| {
                (0..3).map(|l| to_new[(k, l)] * self.turning[(l, j)]).sum()
            }),
            ..self.clone()
        }
    }

    /// Returns the load of the modes `kept` (indices).
    pub(super) fn of_modes(&self, kept: &[usize]) -> Self {
        Self {
            modal: kept.iter().map(|&j| self.modal[j]).collect(),
            turning: Mat::from_fn(3, kept.len(), |k, j| self.turning[(k, kept[j])]),
            ..self.clone()
        }
    }

    /// Returns the load after a change of the modes: psi' = (psi - rigid motion) X.
    pub(super) fn with_modes(&self, change: &ModalChange) -> Self {
        let relative = change.taken().map(|taken| self.without_rigid_motion(taken));
        let relative = relative.as_ref().unwrap_or(self);
        let modal = change.combined(&Mat::from_fn(1, self.modal.len(), |_, j| relative.modal[j]));
        Self {
            modal: (0..modal.ncols()).map(|j| modal[(0, j)]).collect(),
            turning: change.combined(&relative.turning),
            ..self.clone()
        }
    }

    /// Returns the load of the modes without the rigid motions `taken` (6 x nf) about the origin.
    pub(super) fn without_rigid_motion(&self, taken: &Mat<f64>) -> Self {
        let (mut new, resultant) = (self.clone(), self.resultant());
        for j in 0..self.modal.len() {
            let part = |first: usize| Vector3::from_fn(|k, _| taken[(first + k, j)]);
            let (moved, turned) = (part(0), part(3));
            new.modal[j] -= (0..6).map(|k| taken[(k, j)] * resultant[k]).sum::<f64>();
            // sum_i (phi x x_i) x f_i = (sum_i x_i f_i') phi - phi sum_i x_i . f_i
            let torque = moved.cross(&self.force) + self.moments * turned - turned * self.moments.trace();
            (0..3).for_each(|k| new.turning[(k, j)] -= torque[k]);
        }
        new
    }
}

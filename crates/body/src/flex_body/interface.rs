//! Interfaces of a body with the data that a joint needs.

use super::modal_change::{NodesWithRotations, stacked};
use faer::{Mat, MatRef};
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{combine, larger};
use flexbody_model::{Coupling, InterfaceMotion, Nodes};

/// Named interface of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Name.
    pub name: String,
    /// Indices into the nodes of the body.
    pub nodes: Vec<usize>,
    /// Coupling of the nodes to the reference point, if stated.
    pub coupling: Option<Coupling>,
    /// Reference point in the body frame; `None` for a free interface.
    pub reference: Option<[f64; 3]>,
}

/// Displacement relative to the largest of the modes below which an interface counts as at rest, such as
/// the interface that carries the frame: its rounding errors are no deformation.
const MAX_MOTION_AT_REST: f64 = 1e-6;

/// Motion of the reference point of an interface in the modes, body axes: the rigid motion that best fits
/// the motion of the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceRows {
    /// Translation (3 x nf).
    pub translation: Mat<f64>,
    /// Rotation (3 x nf); `None` if the nodes lie on one line and do not determine it.
    pub rotation: Option<Mat<f64>>,
    /// Root mean square over the nodes of the deviation from the fit (nf): zero if the nodes move as a
    /// rigid body.
    pub misfit: Vec<f64>,
    /// Root mean square over the nodes of their largest displacement in any mode, at least that of an
    /// interface at rest.
    largest: f64,
}

impl InterfaceRows {
    /// Returns translation and rotation of the reference point in every mode (6 x nf); `None` if the
    /// rotation is not determined.
    pub fn rigid_motion(&self) -> Option<Mat<f64>> {
        self.rotation.as_ref().map(|rotation| stacked(&self.translation, rotation))
    }

    /// Returns the mode in which the interface deforms most, and this deformation relative to the largest
    /// motion of the interface in any mode.
    pub fn deformation(&self) -> (usize, f64) {
        let by_mode = self.misfit.iter().copied().enumerate();
        let (mode, misfit) = first_largest(by_mode, |pair| pair.1).unwrap_or((0, 0.0));
        (mode, if self.largest > 0.0 { misfit / self.largest } else { 0.0 })
    }

    /// Returns the largest deformation of the interface, relative to its largest motion in any mode or to `motion` if that is
    /// larger.
    pub(crate) fn deformation_beside(&self, motion: f64) -> f64 {
        let misfit = self.misfit.iter().copied().fold(0.0, larger);
        if misfit == 0.0 { 0.0 } else { misfit / self.largest.max(motion) }
    }
}

impl Interface {
    /// Computes the motion of the reference point in the modes (`shape` and, if nodes have rotations,
    /// `rotation`: 3n x nf). Returns `None` without a reference point, or if a result is not finite.
    pub fn rows(
        &self,
        nodes: &Nodes,
        shape: MatRef<'_, f64>,
        rotation: Option<MatRef<'_, f64>>,
        dimension: usize,
    ) -> Option<InterfaceRows> {
        let (d, k, nf) = (dimension, self.nodes.len(), shape.ncols());
        let positions: Vec<[f64; 3]> = self.nodes.iter().map(|&i| nodes.positions[i]).collect();
        let rotation = rotation.filter(|rotation| {
            let known = NodesWithRotations::new(shape, *rotation);
            self.nodes.iter().all(|&node| known.has(node))
        });
        let motion = InterfaceMotion::new(&positions, rotation.is_some(), d, Some(self.reference?));
        let all =
            Mat::from_fn(motion.rigid().nrows(), nf, |row, j| match (row.checked_sub(d * k), rotation) {
                (Some(row), Some(rotation)) if d == 2 => rotation[(3 * self.nodes[row] + 2, j)],
                (Some(row), Some(rotation)) => rotation[(3 * self.nodes[row / 3] + row % 3, j)],
                _ => shape[(3 * self.nodes[row / d] + row % d, j)],
            });
        // Best-fitting rigid motion, and the deviation of the displacements from it.
        let q = motion.fit(all.as_ref());
        let u = all.as_ref().subrows(0, d * k).to_owned();
        let left = &u - combine(motion.rigid().subrows(0, d * k), q.as_ref());
        let root_mean_square = |a: &Mat<f64>, j: usize| a.col(j).norm_l2() / (k as f64).sqrt();
        let misfit: Vec<f64> = (0..nf).map(|j| root_mean_square(&left, j)).collect();
        let at_rest = MAX_MOTION_AT_REST * shape.norm_max();
        let largest = (0..nf).map(|j| root_mean_square(&u, j)).fold(at_rest, f64::max);
        let translation = Mat::from_fn(3, nf, |i, j| if i < d { q[(i, j)] } else { 0.0 });
        let rotation = Mat::from_fn(3, nf, |i, j| match (d, i) {
            (2, 0 | 1) => 0.0,
            (2, _) => q[(2, j)],
            _ => q[(3 + i, j)],
        });
        let finite = |a: &Mat<f64>| a.col_iter().all(|column| column.iter().all(|v| v.is_finite()));
        let rotation = motion.is_determined().then_some(rotation);
        let rows = InterfaceRows { translation, rotation, misfit, largest };
        (finite(&rows.translation)
            && rows.rotation.as_ref().is_none_or(finite)
            && rows.misfit.iter().all(|v| v.is_finite()))
        .then_some(rows)
    }
}

//! Reactions of the reference conditions of a body: the forces that keep its frame in the position that the
//! conditions define.

use super::framed_scene::{UNCOUPLED, is_uncoupled};
use flexbody_body::flex_body::FlexBody;
use nalgebra::{DMatrix, DVector, Vector3};

/// Reaction of mean axes (Tisserand), the reference conditions of free-surface modes.
///
/// Displacements u of the nodes refer to a frame that conditions C u = 0 tie to the body, with multipliers
/// lambda in the equations of all nodes (theory 6.10). C'lambda has no resultant force and the torque about
/// the origin of the frame
///
/// ```text
/// sum_i u_i x (K u + D u')_i = Q'W3 m_ff^-1 (K_ff q + D_ff qd)
/// ```
///
/// (theory 6.12): the moment of linear elastic and damping forces about the deformed body. It does no work
/// and acts on no mode. It measures the difference, of second order in q, between elasticity that is linear
/// in a floating frame and elasticity that turns with the material. The right side equals the left one if
/// the modes are eigenvectors (K Psi = M Psi Lambda); for other shapes it contains the part of the elastic
/// forces in the span of the modes.
#[derive(Debug, Clone)]
pub(super) struct MeanAxes {
    /// Blocks of W3 for the axes about which the body turns.
    w3: Vec<(usize, DMatrix<f64>)>,
    /// m_ff^-1 K_ff and m_ff^-1 D_ff.
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
}

impl MeanAxes {
    /// Creates the reaction for `body`. Returns `None` if its frame is no mean-axis frame (C1 and C2 do not
    /// vanish, as for a carried body), if it does not hold W3, or if its mass matrix is general: couples on
    /// nodes that turn are no sums over the invariants.
    pub(super) fn new(body: &FlexBody) -> Option<Self> {
        let (invariants, nf) = (body.invariants(), body.n_modes());
        let w3 = invariants.w3()?;
        if invariants.general().is_some() || !is_uncoupled(body) || !turns_no_mode(body) {
            return None;
        }
        let m = invariants.modal_mass();
        let mass = DMatrix::from_fn(nf, nf, |i, j| m[(i, j)]).cholesky()?;
        let (k, d) = (invariants.modal_stiffness(), body.damping());
        let axes = if body.dimension() == 2 { 2..3 } else { 0..3 };
        Some(Self {
            w3: axes.map(|a| (a, DMatrix::from_fn(nf, nf, |i, j| w3[(a * nf + i, j)]))).collect(),
            stiffness: mass.solve(&DMatrix::from_fn(nf, nf, |i, j| k[(i, j)])),
            damping: mass.solve(&DMatrix::from_fn(nf, nf, |i, j| d[(i, j)])),
        })
    }

    /// Returns the torque about the origin of the frame, axes of the frame.
    pub(super) fn torque(&self, q: &[f64], qd: &[f64]) -> Vector3<f64> {
        let (q, qd) = (DVector::from_column_slice(q), DVector::from_column_slice(qd));
        let internal = &self.stiffness * &q + &self.damping * qd;
        let mut torque = Vector3::zeros();
        self.w3.iter().for_each(|(a, w3)| torque[*a] = q.dot(&(w3 * &internal)));
        torque
    }
}

/// Returns true if angular accelerations of the frame excite no mode.
fn turns_no_mode(body: &FlexBody) -> bool {
    let invariants = body.invariants();
    let (c2, inertia, modal) = (invariants.c2(), invariants.inertia(), invariants.modal_mass());
    let largest = inertia.trace();
    (0..body.n_modes())
        .all(|j| (0..3).all(|k| c2[(k, j)].abs() <= UNCOUPLED * (largest * modal[(j, j)]).sqrt()))
}

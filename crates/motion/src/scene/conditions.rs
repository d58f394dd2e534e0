//! What the reference conditions of a body carry: the forces that keep its frame where the conditions say
//! that it is.

use super::stage::{UNCOUPLED, is_uncoupled};
use flexbody_body::flex_body::FlexBody;
use nalgebra::{DMatrix, DVector, Vector3};

/// The reaction of mean axes (Tisserand), the reference conditions of free-surface modes.
///
/// Displacements u of the nodes count from a frame that conditions C u = 0 tie to the body, with multipliers
/// lambda in the equations of all nodes (theory 6.10). What C'lambda carries has no force and the torque
/// about the origin of the frame
///
/// ```text
/// sum_i u_i x (K u + D u')_i = Q'W3 m_ff^-1 (K_ff q + D_ff qd)
/// ```
///
/// (theory 6.12): the moment that linear elastic forces and those of the damping have about the deformed
/// body. It does no work and acts on no mode; it says how far elasticity that is linear in a floating frame
/// is from one that turns with the material, of second order in q. The right side is the left one where the
/// modes are eigenvectors (K Psi = M Psi Lambda); of other shapes it has that part of the elastic forces
/// which the modes hold.
#[derive(Debug, Clone)]
pub(super) struct MeanAxes {
    /// The blocks of W3 that belong to axes about which the body turns.
    w3: Vec<(usize, DMatrix<f64>)>,
    /// m_ff^-1 K_ff and m_ff^-1 D_ff.
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
}

impl MeanAxes {
    /// Of `body`, or `None` where its frame is no mean frame (C1 and C2 do not vanish, as where something
    /// carries the body), it does not hold W3, or its mass matrix is general: couples on nodes that turn are no sums
    /// over the invariants.
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

    /// The torque, axes of the frame, about its origin.
    pub(super) fn torque(&self, q: &[f64], qd: &[f64]) -> Vector3<f64> {
        let (q, qd) = (DVector::from_column_slice(q), DVector::from_column_slice(qd));
        let internal = &self.stiffness * &q + &self.damping * qd;
        let mut torque = Vector3::zeros();
        self.w3.iter().for_each(|(a, w3)| torque[*a] = q.dot(&(w3 * &internal)));
        torque
    }
}

/// Whether angular accelerations of the frame excite no mode.
fn turns_no_mode(body: &FlexBody) -> bool {
    let invariants = body.invariants();
    let (c2, inertia, modal) = (invariants.c2(), invariants.inertia(), invariants.modal_mass());
    let largest = inertia.trace();
    (0..body.n_modes())
        .all(|j| (0..3).all(|k| c2[(k, j)].abs() <= UNCOUPLED * (largest * modal[(j, j)]).sqrt()))
}

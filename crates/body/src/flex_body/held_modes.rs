//! Natural modes of a body in its frame, and of a body that is held at one of its interfaces with their effective masses.
//!
//! With the motion A (6 x nf) of the interface in the modes, as rigid motion about the origin, the body held there has the
//! modal mass and the coupling to its rigid motion
//!
//! ```text
//! m' = m_ff - C'A - A'C + A'M_rr A,        C' = C - M_rr A
//! ```
//!
//! and its modes are the eigenvectors X of (K_ff, m') with X'm'X = 1. A base acceleration along a direction drives mode j by
//! its participation g_j, the entry of X'C' of this direction; g_j^2 is its effective mass.

use super::carrier::CarriedPoint;
use super::{Carrier, FlexBody};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_linalg::{dense_cholesky, gram, solve_lower, solve_upper, symmetric_eigen};
use nalgebra::Vector3;

/// Natural mode of a body held at an interface or node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldMode {
    /// Eigenvalue. Unit: 1/time^2.
    pub eigenvalue: f64,
    /// Effective masses along the axes of the model, relative to the mass of the body.
    pub effective_mass: [f64; 3],
}

impl FlexBody {
    /// Returns the natural modes of the body held at `carrier`, lowest first, as far as its modes represent them; empty if
    /// the modal mass is singular there.
    ///
    /// # Errors
    /// FB212 if the body has no interface or node of this name; FB214 if `carrier` has no reference point or no orientation.
    pub fn held_modes(&self, carrier: &Carrier) -> Result<Vec<HeldMode>> {
        let CarriedPoint { reference, motion } = self.place_of(carrier)?;
        let nf = self.n_modes();
        // The rigid motion about the origin that moves the reference point as the interface moves.
        let rigid = Mat::from_fn(6, nf, |i, j| {
            let turn = Vector3::new(motion[(3, j)], motion[(4, j)], motion[(5, j)]);
            if i < 3 { motion[(i, j)] - turn.cross(&reference)[i] } else { motion[(i, j)] }
        });
        let mass = self.invariants().mass_matrix();
        let of_rigid = mass.as_ref().submatrix(0, 0, 6, 6).to_owned();
        let coupling = mass.as_ref().submatrix(0, 6, 6, nf).to_owned();
        let moved = &of_rigid * &rigid;
        let shared = gram(coupling.as_ref(), rigid.as_ref());
        let turned = gram(rigid.as_ref(), moved.as_ref());
        let modal = self.invariants().modal_mass();
        let held =
            Mat::from_fn(nf, nf, |i, j| modal[(i, j)] - shared[(i, j)] - shared[(j, i)] + turned[(i, j)]);
        let coupling = coupling - moved;
        let Some(lower) = dense_cholesky(held) else { return Ok(Vec::new()) };
        let half = solve_lower(&lower, self.invariants().modal_stiffness());
        let whole = solve_lower(&lower, &half.transpose().to_owned());
        let Some(eigen) = symmetric_eigen(whole.as_ref()) else { return Ok(Vec::new()) };
        // Participations along the axes of the model.
        let shapes = solve_upper(&lower, &eigen.vectors);
        let participation = &coupling * &shapes;
        let total = self.invariants().mass();
        let mode = |j: usize| {
            let along_body =
                Vector3::new(participation[(0, j)], participation[(1, j)], participation[(2, j)]);
            let effective_mass = (self.frame().axes * along_body).map(|g| g * g / total).into();
            HeldMode { eigenvalue: eigen.values[j], effective_mass }
        };
        Ok((0..nf).map(mode).collect())
    }

    /// Returns the eigenvalues lambda of (K_ff, m_ff), ascending: for free modes their eigenvalues, for a
    /// carried body those of the body held at its interface. Unit: 1/time^2.
    pub fn eigenvalues_in_frame(&self) -> Option<Vec<f64>> {
        Some(self.eigenpairs_in_frame()?.0)
    }

    /// Returns eigenvalues and m_ff-orthonormal eigenvectors of (K_ff, m_ff).
    pub(super) fn eigenpairs_in_frame(&self) -> Option<(Vec<f64>, Mat<f64>)> {
        let lower = dense_cholesky(self.invariants().modal_mass())?;
        let half = solve_lower(&lower, self.invariants().modal_stiffness());
        let eigen = symmetric_eigen(solve_lower(&lower, &half.transpose().to_owned()).as_ref())?;
        Some((eigen.values, solve_upper(&lower, &eigen.vectors)))
    }
}

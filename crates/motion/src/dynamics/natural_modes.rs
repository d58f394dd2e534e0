//! Natural oscillators of a body whose modes are not mass-normalised.

use super::prescribed::Prescribed;
use super::{EquationsOfMotion, Evaluation};
use nalgebra::{DMatrix, DVector};

/// Natural oscillators of a body in a frame whose motion is prescribed in part: shapes T with T'mT = I and T'K T
/// diagonal, where m is the modal mass that is left after the free motions of the frame are eliminated.
///
/// With q = T x and pi = m T p the stiff linear part of the equations is x' = p, p' = -diag(T'KT) x - diag(T'DT) p,
/// which implicit steps solve without iteration. Without it steps of a carried body could not be longer than its
/// shortest period.
#[derive(Debug, Clone)]
pub(super) struct NaturalModes {
    /// T, and its inverse T'm.
    shapes: DMatrix<f64>,
    inverse: DMatrix<f64>,
    /// Stiffness and damping of each oscillator.
    pub oscillators: Vec<(f64, f64)>,
}

impl NaturalModes {
    /// Creates the oscillators of the undeformed body. Returns `None` if the mass matrix is not positive definite.
    ///
    /// * `prescribed`: motions of the frame that are prescribed; the others are free.
    pub(super) fn new(equations: &EquationsOfMotion, prescribed: &Prescribed) -> Option<Self> {
        let (nf, n, r) = (equations.n_modes(), equations.n_velocities(), equations.n_rigid());
        let mut mass = vec![0.0; n * n];
        Evaluation::new(equations).mass_matrix(&mut mass);
        let mass = DMatrix::from_row_slice(n, n, &mass);
        // Modal mass without the free motions of the frame.
        let free: Vec<usize> = (0..r).filter(|&i| prescribed.entry(equations.rigid[i]).is_none()).collect();
        let mut modal = mass.view((r, r), (nf, nf)).into_owned();
        if !free.is_empty() {
            let rigid = DMatrix::from_fn(free.len(), free.len(), |i, j| mass[(free[i], free[j])]);
            let coupling = DMatrix::from_fn(free.len(), nf, |i, j| mass[(free[i], r + j)]);
            modal -= coupling.tr_mul(&rigid.cholesky()?.solve(&coupling));
        }
        // T = L^-T U, with m = L L' and the eigenvectors U of L^-1 K L^-T.
        let factor = modal.clone().cholesky()?.l();
        let stiffness = DMatrix::from_fn(nf, nf, |i, j| equations.stiffness.get(i, j));
        let half = factor.solve_lower_triangular(&stiffness)?;
        let whitened = factor.solve_lower_triangular(&half.transpose())?;
        let eigen = (0.5 * (&whitened + whitened.transpose())).symmetric_eigen();
        let shapes = factor.tr_solve_lower_triangular(&eigen.eigenvectors)?;
        let damping = DMatrix::from_fn(nf, nf, |i, j| equations.damping.get(i, j));
        let rate = |j: usize| (shapes.column(j).transpose() * &damping * shapes.column(j))[0];
        let oscillators = (0..nf).map(|j| (eigen.eigenvalues[j].max(0.0), rate(j).max(0.0))).collect();
        Some(Self { inverse: shapes.tr_mul(&modal), shapes, oscillators })
    }

    /// Replaces residuals of q and pi by those of the oscillators.
    pub(super) fn transform(&self, q: &mut [f64], pi: &mut [f64]) {
        let x = &self.inverse * DVector::from_column_slice(q);
        let p = self.shapes.tr_mul(&DVector::from_column_slice(pi));
        q.copy_from_slice(x.as_slice());
        pi.copy_from_slice(p.as_slice());
    }

    /// Replaces residuals of the oscillators by those of q and pi.
    pub(super) fn transform_back(&self, q: &mut [f64], pi: &mut [f64]) {
        let x = &self.shapes * DVector::from_column_slice(q);
        let p = self.inverse.tr_mul(&DVector::from_column_slice(pi));
        q.copy_from_slice(x.as_slice());
        pi.copy_from_slice(p.as_slice());
    }
}

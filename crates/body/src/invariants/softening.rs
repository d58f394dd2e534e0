//! Softening by the centrifugal term, which tells if geometric stiffness is needed (theory section 7).

use super::Invariants;
use faer::{Mat, MatRef};
use flexbody_linalg::{combine, gram, symmetric_eigen};
use nalgebra::Vector3;

/// Returns the largest |kappa| of A v = kappa K v for symmetric A and K (nf x nf), K positive definite: the
/// largest relative change of the stiffness of any motion by a unit of A. Returns `None` if K is not
/// positive definite or entries are not finite.
pub fn relative_norm(a: MatRef<'_, f64>, k: MatRef<'_, f64>) -> Option<f64> {
    let projected = relative_to(&[a], k)?.pop()?;
    symmetric_eigen(projected.as_ref())?.values.into_iter().map(f64::abs).reduce(f64::max)
}

/// Returns an upper bound of |kappa| in A v = kappa K v for A = sum_i a_i A_i and every a of unit length:
/// the root of the largest eigenvalue of the sum of the squares of the A_i relative to K. The bound is
/// equal in all axes. Returns `None` in the cases of [`relative_norm`].
pub(super) fn largest_relative_norm(all: &[MatRef<'_, f64>], k: MatRef<'_, f64>) -> Option<f64> {
    let n = k.nrows();
    let squares = relative_to(all, k)?;
    let sum = squares.iter().fold(Mat::zeros(n, n), |sum: Mat<f64>, a| sum + gram(a.as_ref(), a.as_ref()));
    Some(symmetric_eigen(sum.as_ref())?.values.into_iter().fold(0.0, f64::max).sqrt())
}

/// Returns K^-1/2 A K^-1/2 of every A, up to one common rotation.
fn relative_to(all: &[MatRef<'_, f64>], k: MatRef<'_, f64>) -> Option<Vec<Mat<f64>>> {
    let root = inverse_root(k)?;
    let projected = |a: &MatRef<'_, f64>| gram(root.as_ref(), combine(*a, root.as_ref()).as_ref());
    Some(all.iter().map(projected).collect())
}

/// Returns X with X'K X = 1; `None` if K is not positive definite.
fn inverse_root(k: MatRef<'_, f64>) -> Option<Mat<f64>> {
    let n = k.nrows();
    // Scale to a unit diagonal first: stiffnesses of modes spread over many orders of magnitude.
    let size: Vec<f64> = (0..n).map(|i| k[(i, i)].sqrt().recip()).collect();
    let scaled = Mat::from_fn(n, n, |i, j| k[(i, j)] * size[i] * size[j]);
    let eigen = symmetric_eigen(scaled.as_ref())?;
    if eigen.values.first().is_some_and(|v| *v <= 0.0) {
        return None;
    }
    Some(Mat::from_fn(n, n, |i, j| size[i] * eigen.vectors[(i, j)] / eigen.values[j].sqrt()))
}

impl Invariants {
    /// Returns the largest part mu of the stiffness of any motion lost to the centrifugal term at the
    /// angular velocity w, the largest eigenvalue of (sum_ab w_a w_b (W2)_ab) v = mu K_ff v, and v with
    /// v'K_ff v = 1. Returns `None` if K_ff is not positive definite, or if the body does not hold W2.
    ///
    /// * `of_inertia`: stiffness of inertia at this angular velocity, if the body has it; it belongs to the
    ///   same term.
    ///
    /// # Panics
    /// When a matrix has another size.
    pub fn softening(&self, omega: &Vector3<f64>, of_inertia: Option<&Mat<f64>>) -> Option<(f64, Vec<f64>)> {
        let (nf, w2) = (self.n_modes(), self.w2()?);
        let mut term = of_inertia.map_or_else(|| Mat::zeros(nf, nf), |stiffness| -stiffness);
        for a in 0..3 {
            for b in 0..3 {
                let block = w2.as_ref().submatrix(a * nf, b * nf, nf, nf);
                let weight = 0.5 * omega[a] * omega[b];
                term += Mat::from_fn(nf, nf, |i, j| weight * (block[(i, j)] + block[(j, i)]));
            }
        }
        let root = inverse_root(self.0.modal_stiffness.as_ref())?;
        let projected = gram(root.as_ref(), combine(term.as_ref(), root.as_ref()).as_ref());
        let eigen = symmetric_eigen(projected.as_ref())?;
        let last = eigen.values.len().checked_sub(1)?;
        let softest = combine(root.as_ref(), eigen.vectors.as_ref().subcols(last, 1));
        Some((eigen.values[last].max(0.0), (0..nf).map(|i| softest[(i, 0)]).collect()))
    }
}

//! When the centrifugal term needs geometric stiffness beside it (theory section 7).

use super::Invariants;
use crate::numerics::linalg::{combine, gram, symmetric_eigen};
use faer::{Mat, MatRef};

/// Part of the stiffness of a motion at which the centrifugal term counts.
const PART: f64 = 0.01;

/// Largest |kappa| of A v = kappa K v for symmetric A and K (nf x nf), K positive definite: by which part of
/// its own a unit of A changes the stiffness of any motion at the most. `None` when K is not positive
/// definite or entries are not finite.
pub fn relative_norm(a: MatRef<'_, f64>, k: MatRef<'_, f64>) -> Option<f64> {
    let projected = relative_to(&[a], k)?.pop()?;
    symmetric_eigen(projected.as_ref())?.values.into_iter().map(f64::abs).reduce(f64::max)
}

/// Bound of |kappa| in A v = kappa K v for A = sum_i a_i A_i and every a of unit length: the root of the largest
/// eigenvalue of the sum of the squares of the A_i relative to K. The same in all axes. `None` as
/// [`relative_norm`].
pub(super) fn largest_relative_norm(all: &[MatRef<'_, f64>], k: MatRef<'_, f64>) -> Option<f64> {
    let n = k.nrows();
    let squares = relative_to(all, k)?;
    let sum = squares.iter().fold(Mat::zeros(n, n), |sum: Mat<f64>, a| sum + gram(a.as_ref(), a.as_ref()));
    Some(symmetric_eigen(sum.as_ref())?.values.into_iter().fold(0.0, f64::max).sqrt())
}

/// K^-1/2 A K^-1/2 of every A, up to a rotation that is the same for all.
fn relative_to(all: &[MatRef<'_, f64>], k: MatRef<'_, f64>) -> Option<Vec<Mat<f64>>> {
    let n = k.nrows();
    // To a unit diagonal first: stiffnesses of modes spread over many orders of magnitude.
    let size: Vec<f64> = (0..n).map(|i| k[(i, i)].sqrt().recip()).collect();
    let scaled = |m: MatRef<'_, f64>| Mat::from_fn(n, n, |i, j| m[(i, j)] * size[i] * size[j]);
    let eigen = symmetric_eigen(scaled(k).as_ref())?;
    if eigen.values.first().is_some_and(|v| *v <= 0.0) {
        return None;
    }
    let root = Mat::from_fn(n, n, |i, j| eigen.vectors[(i, j)] / eigen.values[j].sqrt());
    let projected =
        |a: &MatRef<'_, f64>| gram(root.as_ref(), combine(scaled(*a).as_ref(), root.as_ref()).as_ref());
    Some(all.iter().map(projected).collect())
}

impl Invariants {
    /// The spin rate about frame axis `axis` at which the centrifugal term w^2 (W2)_kk takes 1 % of the
    /// stiffness K_ff of the motion that it softens most: w = sqrt(0.01 / mu), mu the largest eigenvalue of
    /// (W2)_kk v = mu K_ff v. The stiffness of that motion is lost at ten times this rate unless geometric
    /// stiffness makes up for it. `None` when nothing moves across the axis, when K_ff is not positive
    /// definite, or when the body does not hold W2. Unit: 1/time.
    ///
    /// # Panics
    /// When `axis` is not below 3, or a matrix has another size.
    ///
    /// * `of_inertia`: the stiffness of inertia for spin about the axis, where the body has it: a part of the
    ///   same term.
    pub fn softening_rate(&self, axis: usize, of_inertia: Option<&Mat<f64>>) -> Option<f64> {
        let (nf, w2) = (self.n_modes(), self.w2()?);
        let mut block = w2.as_ref().submatrix(axis * nf, axis * nf, nf, nf).to_owned();
        if let Some(stiffness) = of_inertia {
            block -= stiffness;
        }
        let mu = relative_norm(block.as_ref(), self.0.modal_stiffness.as_ref())?;
        (mu > 0.0).then(|| (PART / mu).sqrt())
    }
}

//! Small dense kernels on one thread, so that no result depends on the number of threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use flexbody_linalg::largest_entry;

/// Returns A B.
pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// Returns A' B.
pub(super) fn transpose_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    product(a.transpose(), b)
}

/// Returns all entries, column by column.
pub(super) fn entries<'a>(a: MatRef<'a, f64>) -> impl Iterator<Item = f64> + 'a {
    (0..a.ncols()).flat_map(move |q| (0..a.nrows()).map(move |p| a[(p, q)]))
}

/// Returns the Frobenius norm, safe against overflow.
pub(super) fn frobenius_norm(a: MatRef<'_, f64>) -> f64 {
    let scale = largest_entry(a);
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    scale * entries(a).map(|v| (v / scale) * (v / scale)).sum::<f64>().sqrt()
}

/// Returns the spectral norm: the square root of the largest eigenvalue of the smaller Gram matrix. NaN if
/// an entry is not finite.
pub(super) fn spectral_norm(a: MatRef<'_, f64>) -> f64 {
    let scale = largest_entry(a);
    if scale == 0.0 {
        return 0.0;
    }
    let scaled = Mat::from_fn(a.nrows(), a.ncols(), |p, q| a[(p, q)] / scale);
    let tall = if a.nrows() < a.ncols() { scaled.as_ref().transpose() } else { scaled.as_ref() };
    let largest = symmetric_eigenvalues(transpose_product(tall, tall).as_ref())
        .and_then(|values| values.last().copied());
    largest.map_or(f64::NAN, |value| scale * value.max(0.0).sqrt())
}

/// Returns the eigenvalues of a symmetric matrix (its lower triangle), ascending; `None` if an entry is not
/// finite or the iteration fails.
pub(super) fn symmetric_eigenvalues(a: MatRef<'_, f64>) -> Option<Vec<f64>> {
    let n = a.nrows();
    if !largest_entry(a).is_finite() {
        return None;
    }
    let mut values = faer::diag::Diag::<f64>::zeros(n);
    let scratch = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::No, Par::Seq, Default::default());
    let mut buffer = MemBuffer::new(scratch);
    self_adjoint_evd(a, values.as_mut(), None, Par::Seq, MemStack::new(&mut buffer), Default::default())
        .ok()?;
    Some((0..n).map(|i| values[i]).collect())
}

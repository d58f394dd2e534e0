//! Dense matrices: symmetric eigenproblems and singular values of moderate size, and maxima that keep
//! NaN.

use super::combine;
use dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::cholesky::llt::inverse::{inverse as invert, inverse_scratch};
use faer::linalg::evd::{
    ComputeEigenvectors, SelfAdjointEvdParams, self_adjoint_evd, self_adjoint_evd_scratch,
};
use faer::linalg::householder;
use faer::linalg::qr::no_pivoting::factor as qr;
use faer::{Auto, Col, Conj, Mat, MatRef, Par};
use libm::hypot;

/// Largest backward error |A V - V L| / |A| (maximum norms) of an accepted decomposition.
const MAX_BACKWARD_ERROR: f64 = 3e-14;

/// Eigenvalues and orthonormal eigenvectors of a symmetric matrix.
#[derive(Debug, Clone)]
pub struct SymmetricEigen {
    /// Eigenvalues, ascending.
    pub values: Vec<f64>,
    /// Eigenvectors; column i belongs to value i.
    pub vectors: Mat<f64>,
}

/// Returns eigenvalues and eigenvectors of the symmetric matrix whose lower triangle is that of `a`. Returns `None` if
/// the iteration does not converge or the matrix has non-finite entries.
///
/// The divide-and-conquer method of faer (0.24.4) returns eigenvectors that are wrong by up to 1e-3 for clustered or
/// strongly graded spectra, which a Krylov basis has. Every decomposition is therefore verified, and the QR iteration
/// is used if it fails.
pub fn symmetric_eigen(a: MatRef<'_, f64>) -> Option<SymmetricEigen> {
    let n = a.nrows();
    if n == 0 {
        return Some(SymmetricEigen { values: Vec::new(), vectors: Mat::zeros(0, 0) });
    }
    let full = Mat::from_fn(n, n, |i, j| a[(i.max(j), i.min(j))]);
    // The maximum norm ignores NaN.
    if !(0..n).all(|j| (0..n).all(|i| full[(i, j)].is_finite())) {
        return None;
    }
    // Divide and conquer, accepted if its backward error is small; otherwise the QR iteration.
    let automatic = <SelfAdjointEvdParams as Auto<f64>>::auto();
    let only_qr = SelfAdjointEvdParams { recursion_threshold: usize::MAX, ..automatic };
    decompose(&full, automatic)
        .filter(|eigen| {
            n < automatic.recursion_threshold || backward_error(&full, eigen) <= MAX_BACKWARD_ERROR
        })
        .or_else(|| decompose(&full, only_qr))
}

/// Computes one decomposition on one thread: its bits must not depend on the number of threads.
fn decompose(a: &Mat<f64>, params: SelfAdjointEvdParams) -> Option<SymmetricEigen> {
    let n = a.nrows();
    let mut values = Col::<f64>::zeros(n);
    let mut vectors = Mat::zeros(n, n);
    let mut memory =
        MemBuffer::new(self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, params.into()));
    self_adjoint_evd(
        a.as_ref(),
        values.as_diagonal_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        params.into(),
    )
    .ok()?;
    Some(SymmetricEigen { values: values.iter().copied().collect(), vectors })
}

/// Returns the lower Cholesky factor of the dense symmetric matrix whose lower triangle is that of `a`; `None` if it is
/// not positive definite.
pub fn dense_cholesky(mut a: Mat<f64>) -> Option<Mat<f64>> {
    let params = <LltParams as Auto<f64>>::auto().into();
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(a.nrows(), Par::Seq, params));
    cholesky_in_place(a.as_mut(), LltRegularization::default(), Par::Seq, MemStack::new(&mut memory), params)
        .ok()?;
    // The factor has zeros above the diagonal.
    for j in 1..a.ncols() {
        for i in 0..j {
            a[(i, j)] = 0.0;
        }
    }
    Some(a)
}

/// Returns the inverse of the dense symmetric positive definite matrix whose lower triangle is that of `a`, exactly
/// symmetric; `None` if it is not positive definite.
pub fn dense_inverse(a: Mat<f64>) -> Option<Mat<f64>> {
    let n = a.nrows();
    let lower = dense_cholesky(a)?;
    let mut inverse = Mat::zeros(n, n);
    let mut memory = MemBuffer::new(inverse_scratch::<f64>(n, Par::Seq));
    invert(inverse.as_mut(), lower.as_ref(), Par::Seq, MemStack::new(&mut memory));
    Some(Mat::from_fn(n, n, |i, j| inverse[(i.max(j), i.min(j))]))
}

/// Returns |A V - V L| / |A| in maximum norms.
fn backward_error(a: &Mat<f64>, eigen: &SymmetricEigen) -> f64 {
    let n = a.nrows();
    let scaled = Mat::from_fn(n, n, |i, j| eigen.vectors[(i, j)] * eigen.values[j]);
    let difference = combine(a.as_ref(), eigen.vectors.as_ref()) - scaled;
    largest_entry(difference.as_ref()) / a.norm_max().max(f64::MIN_POSITIVE)
}

/// Returns the QR decomposition A = Q R of A (n x m), n >= m: Q (n x n) is orthogonal, R (m x m) stands above zeros.
/// Runs on one thread.
pub fn full_qr(mut a: Mat<f64>) -> (Mat<f64>, Mat<f64>) {
    let (n, m) = (a.nrows(), a.ncols());
    let block = qr::recommended_block_size::<f64>(n, m);
    let params = <qr::QrParams as Auto<f64>>::auto().into();
    let mut factor = Mat::zeros(block, m);
    let mut memory =
        MemBuffer::new(qr::qr_in_place_scratch::<f64>(n, m, block, Par::Seq, params).or(
            householder::apply_block_householder_sequence_on_the_left_in_place_scratch::<f64>(n, block, n),
        ));
    let stack = MemStack::new(&mut memory);
    // Householder vectors below the diagonal of `a`, R on and above it.
    qr::qr_in_place(a.as_mut(), factor.as_mut(), Par::Seq, stack, params);
    // Q is the product of the reflections.
    let mut q = Mat::identity(n, n);
    householder::apply_block_householder_sequence_on_the_left_in_place_with_conj(
        a.as_ref(),
        factor.as_ref(),
        Conj::No,
        q.as_mut(),
        Par::Seq,
        stack,
    );
    (q, Mat::from_fn(m, m, |i, j| if i <= j { a[(i, j)] } else { 0.0 }))
}

/// Returns L^-1 B for a lower triangle L.
pub fn solve_lower(lower: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut x = b.clone();
    for j in 0..x.ncols() {
        for i in 0..x.nrows() {
            let before: f64 = (0..i).map(|k| lower[(i, k)] * x[(k, j)]).sum();
            x[(i, j)] = (x[(i, j)] - before) / lower[(i, i)];
        }
    }
    x
}

/// Returns L^-T B for a lower triangle L.
pub fn solve_upper(lower: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut x = b.clone();
    for j in 0..x.ncols() {
        for i in (0..x.nrows()).rev() {
            let after: f64 = (i + 1..x.nrows()).map(|k| lower[(k, i)] * x[(k, j)]).sum();
            x[(i, j)] = (x[(i, j)] - after) / lower[(i, i)];
        }
    }
    x
}

/// Cosine between two columns up to which they count as orthogonal. A smaller value may prevent convergence.
const ORTHOGONAL_COSINE: f64 = 4.0 * f64::EPSILON;

/// Largest number of sweeps. Graded matrices of 500 columns take 7 to 10.
const MAX_SWEEPS: usize = 60;

/// Computes left singular vectors U and singular values of `g` = U diag(s) V' (n x n, of full rank), with the values in
/// ascending order.
///
/// Rotations of pairs of columns make the columns orthogonal (Hestenes 1958). For G = B D with a diagonal D, every
/// singular value is accurate to the rounding of the well-conditioned B, however widely the entries of D differ
/// (Demmel, Veselic 1992). A stiffness in modes of 1 Hz and of 1 MHz needs this accuracy; a decomposition of G G' loses
/// the small values.
///
/// Returns `None` if a column is zero or an entry is not finite.
pub fn left_singular_vectors(mut g: Mat<f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = g.ncols();
    for _ in 0..MAX_SWEEPS {
        if !sweep(&mut g) {
            break;
        }
    }
    let norms: Vec<f64> = (0..n).map(|j| g.col(j).norm_l2()).collect();
    if norms.iter().any(|norm| !(*norm > 0.0 && norm.is_finite())) {
        return None;
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| norms[a].total_cmp(&norms[b]));
    let vectors = Mat::from_fn(g.nrows(), n, |i, j| g[(i, order[j])] / norms[order[j]]);
    Some((order.iter().map(|&j| norms[j]).collect(), vectors))
}

/// Rotates every pair of columns once. Returns true if some pair was not orthogonal.
fn sweep(g: &mut Mat<f64>) -> bool {
    let mut rotated = false;
    for p in 0..g.ncols() {
        for q in p + 1..g.ncols() {
            let (a, b) = (g.col(p).squared_norm_l2(), g.col(q).squared_norm_l2());
            let mixed: f64 = g.col(p).iter().zip(g.col(q).iter()).map(|(x, y)| x * y).sum();
            if mixed.abs() <= ORTHOGONAL_COSINE * (a.sqrt() * b.sqrt()) || !mixed.is_finite() {
                continue;
            }
            rotated = true;
            // Use the smaller of the two angles that make the columns orthogonal.
            let ratio = (b - a) / (2.0 * mixed);
            let tangent = ratio.signum() / (ratio.abs() + hypot(ratio, 1.0));
            let cosine = 1.0 / hypot(tangent, 1.0);
            let sine = cosine * tangent;
            for i in 0..g.nrows() {
                let (x, y) = (g[(i, p)], g[(i, q)]);
                g[(i, p)] = cosine * x - sine * y;
                g[(i, q)] = sine * x + cosine * y;
            }
        }
    }
    rotated
}

// Maxima that keep NaN. `f64::max` and `norm_max` of faer ignore a NaN, so that a later check of their result would
// pass.

/// Returns the larger of two numbers; NaN if one of them is NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Returns zero for a number that is negative by rounding only; keeps NaN.
pub fn not_negative(value: f64) -> f64 {
    larger(value, 0.0)
}

/// Returns the largest of zero and some numbers; NaN if one of them is NaN.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, larger)
}

/// Returns the largest magnitude among the entries of a matrix; NaN if one of them is NaN.
pub fn largest_entry(a: MatRef<'_, f64>) -> f64 {
    largest((0..a.ncols()).flat_map(|j| (0..a.nrows()).map(move |i| a[(i, j)].abs())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Spectra over 14 decades in triples, for which the divide-and-conquer method of faer 0.24.4 loses ten digits.
    #[test]
    fn graded_and_clustered_spectra_keep_their_backward_error() {
        for n in [5, 130, 210] {
            let mut graded =
                Mat::from_fn(
                    n,
                    n,
                    |i, j| {
                        if i == j { 10f64.powf(7.0 * (i / 3) as f64 / n as f64) } else { 0.0 }
                    },
                );
            for i in 0..n {
                for j in 0..i {
                    let value = 1e-9 * (((i * 31 + j * 17) % 101) as f64 - 50.0);
                    graded[(i, j)] = value;
                    graded[(j, i)] = value;
                }
            }
            let eigen = symmetric_eigen(graded.as_ref()).expect("finite");
            assert!(backward_error(&graded, &eigen) < MAX_BACKWARD_ERROR, "n = {n}");
            assert!(eigen.values.windows(2).all(|w| w[0] <= w[1]));
        }
    }

    #[test]
    fn an_inverse_is_symmetric_and_one() {
        let n = 70;
        let a = Mat::from_fn(n, n, |i, j| if i == j { 3.0 } else { 1.0 / (1.0 + i.abs_diff(j) as f64) });
        let inverse = dense_inverse(a.clone()).expect("positive definite");
        let product = combine(a.as_ref(), inverse.as_ref());
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            assert_eq!(inverse[(i, j)], inverse[(j, i)]);
            assert!((product[(i, j)] - f64::from(u8::from(i == j))).abs() < 1e-14, "({i}, {j})");
        }
        assert!(dense_inverse(Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 })).is_none());
    }

    #[test]
    fn a_full_qr_has_all_directions() {
        for (n, m) in [(5, 5), (9, 6), (140, 130), (7, 0)] {
            let a =
                Mat::from_fn(n, m, |i, j| ((i * 7 + j * 13) as f64).sin() + if i == j { 2.0 } else { 0.0 });
            let (q, r) = full_qr(a.clone());
            assert!((q.transpose() * &q - Mat::<f64>::identity(n, n)).norm_max() < 1e-14 * n as f64);
            assert!((q.as_ref().subcols(0, m) * &r - &a).norm_max() < 1e-14 * n as f64, "{n} x {m}");
            assert!((0..m).all(|j| (j + 1..m).all(|i| r[(i, j)] == 0.0)), "{n} x {m}");
        }
    }

    #[test]
    fn matrices_that_are_not_finite_are_refused() {
        assert!(symmetric_eigen(Mat::from_fn(3, 3, |_, _| f64::NAN).as_ref()).is_none());
    }

    #[test]
    fn graded_columns_keep_their_digits() {
        // G = B D with an orthogonal B has the known singular values D.
        let n = 6;
        let reflection = |i: usize, j: usize| f64::from(i == j) - 2.0 / n as f64;
        let scale = |j: usize| 10f64.powi(3 * j as i32 - 9);
        let g = Mat::from_fn(n, n, |i, j| reflection(i, j) * scale(j));
        let (values, vectors) = left_singular_vectors(g).expect("full rank");
        for (j, value) in values.iter().enumerate() {
            assert!((value / scale(j) - 1.0).abs() < 1e-14, "{value}");
        }
        let gram = vectors.transpose() * &vectors;
        assert!((gram - Mat::<f64>::identity(n, n)).norm_max() < 1e-14);
        assert!(left_singular_vectors(Mat::zeros(2, 2)).is_none());
        assert!(left_singular_vectors(Mat::from_fn(2, 2, |_, _| f64::NAN)).is_none());
    }

    #[test]
    fn a_nan_stays_wherever_it_stands() {
        for at in 0..5 {
            let values: Vec<f64> =
                (0..5).map(|i| if i == at { f64::NAN } else { 1.0 + f64::from(i) }).collect();
            assert!(largest(values.iter().copied()).is_nan());
            assert!(largest_entry(Mat::from_fn(5, 1, |i, _| values[i]).as_ref()).is_nan());
        }
        assert_eq!((largest([]), largest([1.0, 3.0, 2.0]), larger(-1.0, -2.0)), (0.0, 3.0, -1.0));
        assert_eq!(largest_entry(Mat::from_fn(2, 2, |i, j| i as f64 - 3.0 * j as f64).as_ref()), 3.0);
    }
}

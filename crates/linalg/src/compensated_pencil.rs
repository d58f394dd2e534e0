//! Small symmetric eigenproblems in double-double arithmetic.

use super::compensated::DoubleDouble;
use faer::Mat;

/// Largest number of Jacobi sweeps. Convergence is quadratic and the input is nearly diagonal, so that few are needed.
const MAX_JACOBI_SWEEPS: usize = 30;

/// Off-diagonal entries count as zero below this part of the diagonal.
const NEGLIGIBLE_OFF_DIAGONAL: f64 = 1e-33;

/// Rows of a full matrix.
type Rows = Vec<Vec<DoubleDouble>>;

/// Eigenpairs of a small pencil.
#[derive(Debug, Clone)]
pub struct SmallEigen {
    /// Eigenvalues, ascending.
    pub values: Vec<DoubleDouble>,
    /// Eigenvectors, rounded to f64: one column per eigenvalue, orthonormal in the second matrix.
    pub vectors: Mat<f64>,
}

/// Computes the eigenpairs of P x = kappa Q x. P and Q are rows of full matrices, symmetric positive definite and
/// scaled so that their diagonals dominate. Returns `None` if they are not positive definite or not finite.
///
/// The method is Cholesky of Q, then Jacobi on L^-1 P L^-T. For such matrices both are accurate relative to every
/// single eigenvalue (J. Demmel, K. Veselic, *Jacobi's method is more accurate than QR*, SIAM J. Matrix Anal. Appl. 13,
/// 1992): the relative error is a small multiple of the order of the pencil times 2^-106.
pub fn small_pencil(mut p: Rows, q: &Rows) -> Option<SmallEigen> {
    let n = q.len();
    let l = cholesky(q)?;
    // P <- L^-1 P L^-T: solve with L for the rows, then for the columns.
    for _ in 0..2 {
        solve_lower(&l, &mut p);
        p = transposed(&p);
    }
    // Rows of `turned` are the eigenvectors J of the transformed matrix.
    let mut turned = identity(n);
    jacobi(&mut p, &mut turned)?;
    // X = L^-T J, and X' = J' L^-1.
    let mut inverse = identity(n);
    solve_lower(&l, &mut inverse);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| p[a][a].hi.total_cmp(&p[b][b].hi).then(p[a][a].lo.total_cmp(&p[b][b].lo)));
    let entry = |row: usize, place: usize| {
        let terms = turned[order[place]].iter().zip(&inverse);
        terms.fold(DoubleDouble::default(), |sum, (&j, inverse)| sum + j * inverse[row]).hi
    };
    let vectors = Mat::from_fn(n, n, entry);
    Some(SmallEigen { values: order.iter().map(|&i| p[i][i]).collect(), vectors })
}

fn identity(n: usize) -> Rows {
    let entry = |i: usize, j: usize| DoubleDouble::from(if i == j { 1.0 } else { 0.0 });
    (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
}

fn transposed(a: &Rows) -> Rows {
    (0..a.len()).map(|i| a.iter().map(|row| row[i]).collect()).collect()
}

/// Solves in place: A <- L^-1 A.
fn solve_lower(l: &Rows, a: &mut Rows) {
    for (i, factors) in l.iter().enumerate() {
        let (above, below) = a.split_at_mut(i);
        for (row, &factor) in above.iter().zip(factors) {
            for (target, &value) in below[0].iter_mut().zip(row) {
                *target = *target - factor * value;
            }
        }
        for value in &mut below[0] {
            *value = *value / factors[i];
        }
    }
}

/// Returns the lower Cholesky factor; `None` if A is not positive definite.
fn cholesky(a: &Rows) -> Option<Rows> {
    let n = a.len();
    let mut l = vec![vec![DoubleDouble::default(); n]; n];
    for i in 0..n {
        for j in 0..=i {
            let known = l[i][..j].iter().zip(&l[j][..j]);
            let sum = known.fold(a[i][j], |sum, (&x, &y)| sum - x * y);
            if i == j {
                if !(sum.hi > 0.0 && sum.hi.is_finite()) {
                    return None;
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    Some(l)
}

/// Diagonalises A by cyclic Jacobi rotations, which are also applied to the rows of `turned`. Returns `None` if they do
/// not converge to positive numbers.
fn jacobi(a: &mut Rows, turned: &mut Rows) -> Option<()> {
    let n = a.len();
    for _ in 0..MAX_JACOBI_SWEEPS {
        let mut rotated = false;
        for i in 0..n {
            for j in 0..i {
                let size = (a[i][i].hi * a[j][j].hi).sqrt();
                if !(size > 0.0 && size.is_finite() && a[i][j].hi.is_finite()) {
                    return None;
                }
                if a[i][j].hi.abs() > NEGLIGIBLE_OFF_DIAGONAL * size {
                    let (c, s) = rotate(a, i, j);
                    let (above, below) = turned.split_at_mut(i);
                    for (x, y) in below[0].iter_mut().zip(&mut above[j]) {
                        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                    }
                    rotated = true;
                }
            }
        }
        if !rotated {
            return Some(());
        }
    }
    None
}

/// Rotates rows and columns i and j so that entry (i, j) becomes zero. Returns cosine and sine.
fn rotate(a: &mut Rows, i: usize, j: usize) -> (DoubleDouble, DoubleDouble) {
    let one = DoubleDouble::from(1.0);
    let off = a[i][j];
    // t = tan(angle) is the smaller root of t^2 + 2 z t - 1 = 0.
    let z = (a[j][j] - a[i][i]) / (off * 2.0);
    let size = if z.hi < 0.0 { -z } else { z };
    // Beyond 1e30, z^2 + 1 equals z^2 to all digits and could overflow.
    let t = if size.hi > 1e30 { one / (size * 2.0) } else { one / (size + (z * z + one).sqrt()) };
    let t = if z.hi < 0.0 { -t } else { t };
    let c = one / (t * t + one).sqrt();
    let s = t * c;
    a[i][i] = a[i][i] - t * off;
    a[j][j] = a[j][j] + t * off;
    a[i][j] = DoubleDouble::default();
    a[j][i] = DoubleDouble::default();
    for k in (0..a.len()).filter(|&k| k != i && k != j) {
        let (x, y) = (a[k][i], a[k][j]);
        let (x, y) = (c * x - s * y, s * x + c * y);
        (a[k][i], a[i][k]) = (x, x);
        (a[k][j], a[j][k]) = (y, y);
    }
    (c, s)
}

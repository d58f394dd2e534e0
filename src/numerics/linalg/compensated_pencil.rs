//! Eigenvalues of small symmetric pencils in double-double arithmetic.

use super::compensated::DoubleDouble;

/// Sweeps of the Jacobi method: convergence is quadratic, and what comes in is nearly diagonal.
const SWEEPS: usize = 30;

/// Off-diagonal entries below this part of the diagonal are zero.
const ZERO: f64 = 1e-33;

/// Eigenvalues kappa of P x = kappa Q x, ascending, for P and Q symmetric positive definite and scaled so
/// that their diagonals dominate. Rows of full matrices. `None` when they are not positive definite or not
/// finite.
///
/// Cholesky of Q, then Jacobi on L^-1 P L^-T. For such matrices both are accurate relative to every single
/// eigenvalue (J. Demmel, K. Veselic, *Jacobi's method is more accurate than QR*, SIAM J. Matrix Anal. Appl.
/// 13, 1992): the relative error is a small multiple of the order of the pencil times 2^-106.
pub fn small_pencil_eigenvalues(
    mut p: Vec<Vec<DoubleDouble>>,
    q: &[Vec<DoubleDouble>],
) -> Option<Vec<DoubleDouble>> {
    let n = q.len();
    let l = cholesky(q)?;
    // Rows, then columns, of P are solved with L.
    for _ in 0..2 {
        for (i, factors) in l.iter().enumerate() {
            let (above, below) = p.split_at_mut(i);
            for (row, &factor) in above.iter().zip(factors) {
                for (target, &value) in below[0].iter_mut().zip(row) {
                    *target = *target - factor * value;
                }
            }
            for value in &mut below[0] {
                *value = *value / factors[i];
            }
        }
        p = (0..n).map(|i| p.iter().map(|row| row[i]).collect()).collect();
    }
    let mut values = jacobi(p)?;
    values.sort_by(|a, b| a.hi.total_cmp(&b.hi).then(a.lo.total_cmp(&b.lo)));
    Some(values)
}

/// Lower Cholesky factor.
fn cholesky(a: &[Vec<DoubleDouble>]) -> Option<Vec<Vec<DoubleDouble>>> {
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

/// Diagonal after cyclic Jacobi rotations; `None` when they do not converge to positive numbers.
fn jacobi(mut a: Vec<Vec<DoubleDouble>>) -> Option<Vec<DoubleDouble>> {
    let n = a.len();
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for i in 0..n {
            for j in 0..i {
                let size = (a[i][i].hi * a[j][j].hi).sqrt();
                if !(size > 0.0 && size.is_finite() && a[i][j].hi.is_finite()) {
                    return None;
                }
                if a[i][j].hi.abs() > ZERO * size {
                    rotate(&mut a, i, j);
                    rotated = true;
                }
            }
        }
        if !rotated {
            return Some((0..n).map(|i| a[i][i]).collect());
        }
    }
    None
}

/// One rotation of rows and columns i and j, which leaves a zero at (i, j).
fn rotate(a: &mut [Vec<DoubleDouble>], i: usize, j: usize) {
    let one = DoubleDouble::from(1.0);
    let off = a[i][j];
    // t = tan(angle) solves t^2 + 2 z t - 1 = 0, the smaller root.
    let z = (a[j][j] - a[i][i]) / (off * 2.0);
    let size = if z.hi < 0.0 { -z } else { z };
    // Beyond 1e30, z^2 + 1 is z^2 to all digits and could overflow.
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
}

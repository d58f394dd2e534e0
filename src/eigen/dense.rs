//! All finite modes of a small pencil by one dense symmetric eigenproblem.

use super::lanczos::RitzPairs;
use super::problem::{EigenFailure, EigenProblem};
use crate::linalg::{Pencil, SymmetricMatrix, symmetric_eigen};
use faer::linalg::solvers::Llt;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, Par, Side};

/// Scaled eigenvalues of Ms below this are zero: files with 10 digits leave less.
const NULL: f64 = 1e-10;

/// Number of finite eigenvalues of the pencil, rigid ones included: block * rank(Ms). `None`: Ms is indefinite.
pub(super) fn finite_eigenvalues(pencil: &Pencil<'_>) -> Option<usize> {
    let ms = dense(pencil.mass());
    let n = ms.nrows();
    let scale: Vec<f64> =
        (0..n).map(|i| if ms[(i, i)] > 0.0 { ms[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = Mat::from_fn(n, n, |i, j| ms[(i, j)] * scale[i] * scale[j]);
    let eigen = symmetric_eigen(scaled.as_ref())?;
    let indefinite = eigen.values.first().is_some_and(|&v| v < -NULL);
    let rank = eigen.values.iter().filter(|&&v| v > NULL).count();
    (!indefinite).then_some(rank * pencil.block())
}

/// The lowest `wanted` flexible modes (and the values of the next ones) from
/// S = L^-1 M L^-T with K + tau M = L L', whose eigenvalues are 1 / (lambda + tau).
///
/// `highest` is an estimate of the largest eigenvalue wanted: tau is the geometric mean of it and the first one, so
/// that both ends keep digits.
pub(super) fn lowest_modes(
    problem: &EigenProblem<'_>,
    wanted: usize,
    flexible: usize,
    highest: f64,
) -> Result<RitzPairs, EigenFailure> {
    let pencil = &problem.pencil;
    let n = pencil.n();
    let tau = (0.3 * problem.first_estimate * highest.max(problem.first_estimate)).sqrt();
    let m = dense_mass(pencil);
    let k = dense(pencil.stiffness());
    let a = Mat::from_fn(n, n, |i, j| k[(i, j)] + tau * m[(i, j)]);
    let factor =
        Llt::new(a.as_ref(), Side::Lower).map_err(|_| EigenFailure::NotPositiveDefinite { shift: tau })?;
    let l = factor.L();
    let mut s = m;
    solve_lower_triangular_in_place(l, s.as_mut(), Par::Seq);
    let mut s = s.transpose().to_owned();
    solve_lower_triangular_in_place(l, s.as_mut(), Par::Seq);
    // Deflation: a rigid mode r has S y = y / tau with the unit vector y = L' r / sqrt(tau).
    let y = l.transpose() * problem.rigid;
    let s = Mat::from_fn(n, n, |i, j| {
        let rigid: f64 = (0..y.ncols()).map(|c| y[(i, c)] * y[(j, c)]).sum();
        0.5 * (s[(i, j)] + s[(j, i)]) - rigid / (tau * tau)
    });
    let eigen = symmetric_eigen(s.as_ref()).ok_or(EigenFailure::Inaccurate { residual: f64::NAN })?;
    let count = wanted.min(flexible);
    let lambda = |i: usize| 1.0 / eigen.values[n - 1 - i] - tau;
    let mut vectors = Mat::from_fn(n, count, |i, j| eigen.vectors[(i, n - 1 - j)]);
    solve_upper_triangular_in_place(l.transpose(), vectors.as_mut(), Par::Seq);
    for j in 0..count {
        let root = eigen.values[n - 1 - j].sqrt().recip();
        for i in 0..n {
            vectors[(i, j)] *= root;
        }
    }
    Ok(RitzPairs {
        eigenvalues: (0..count).map(lambda).collect(),
        vectors,
        next: (count..flexible).map(lambda).collect(),
        tau,
    })
}

/// The largest ratio K_ii / M_ii: a Rayleigh quotient, hence a lower bound of the largest eigenvalue and close to it.
pub(super) fn highest_estimate(pencil: &Pencil<'_>) -> f64 {
    let k = pencil.stiffness().diagonal();
    let m = pencil.mass().diagonal();
    k.iter()
        .enumerate()
        .map(|(i, &kii)| (kii, m[i / pencil.block()]))
        .filter(|&(_, mii)| mii > 0.0)
        .fold(0.0, |largest: f64, (kii, mii)| largest.max(kii / mii))
}

fn dense(a: &SymmetricMatrix) -> Mat<f64> {
    let mut d = Mat::zeros(a.n(), a.n());
    for i in 0..a.n() {
        let (columns, values) = a.row(i);
        for (&j, &v) in columns.iter().zip(values) {
            d[(i, j as usize)] = v;
        }
    }
    d
}

fn dense_mass(pencil: &Pencil<'_>) -> Mat<f64> {
    let block = pencil.block();
    let mut d = Mat::zeros(pencil.n(), pencil.n());
    for i in 0..pencil.mass().n() {
        let (columns, values) = pencil.mass().row(i);
        for (&j, &v) in columns.iter().zip(values) {
            for b in 0..block {
                d[(i * block + b, j as usize * block + b)] = v;
            }
        }
    }
    d
}

//! All finite modes of a small pencil by one dense symmetric eigenproblem.

use super::failure::EigenFailure;
use super::problem::EigenProblem;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, Par};
use flexbody_linalg::{
    Pencil, Solve, SymmetricEigen, SymmetricMatrix, dense_cholesky, gram, symmetric_eigen,
};

/// Scaled eigenvalues of Ms below this are zero: files with 10 digits leave less.
const NULL: f64 = 1e-10;

/// Number of finite eigenvalues of the pencil, rigid ones included: block * rank(Ms). `None`: Ms is
/// indefinite.
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

/// Shift for modes between `first` and `highest`: the geometric mean, so that both ends keep digits.
pub(super) fn shift(first: f64, highest: f64) -> f64 {
    (0.3 * first * highest.max(first)).sqrt()
}

/// Dense Cholesky factor K + tau M = L L'.
pub(super) struct DenseFactor {
    l: Mat<f64>,
    tau: f64,
}

impl Solve for DenseFactor {
    fn shift(&self) -> f64 {
        self.tau
    }

    fn solve_in_place(&self, mut x: MatMut<'_, f64>) {
        solve_lower_triangular_in_place(self.l.as_ref(), x.rb_mut(), Par::Seq);
        solve_upper_triangular_in_place(self.l.as_ref().transpose(), x, Par::Seq);
    }
}

/// The whole spectrum of S = L^-1 M L^-T, whose eigenvalues are 1 / (lambda + tau), rigid modes deflated.
pub(super) struct Spectrum {
    /// The factor, for refinement.
    pub factor: DenseFactor,
    eigen: SymmetricEigen,
}

impl Spectrum {
    /// Factors and diagonalises.
    pub(super) fn new(problem: &EigenProblem<'_>, tau: f64) -> Result<Self, EigenFailure> {
        let pencil = &problem.pencil;
        let n = pencil.n();
        let m = dense_mass(pencil);
        let k = dense(pencil.stiffness());
        let a = Mat::from_fn(n, n, |i, j| k[(i, j)] + tau * m[(i, j)]);
        let l = dense_cholesky(a).ok_or(EigenFailure::NotPositiveDefinite { shift: tau })?;
        let mut s = m;
        solve_lower_triangular_in_place(l.as_ref(), s.as_mut(), Par::Seq);
        let mut s = s.transpose().to_owned();
        solve_lower_triangular_in_place(l.as_ref(), s.as_mut(), Par::Seq);
        // Deflation: a rigid mode r has S y = y / tau with the unit vector y = L' r / sqrt(tau).
        let y = gram(l.as_ref(), problem.rigid);
        let s = Mat::from_fn(n, n, |i, j| {
            let rigid: f64 = (0..y.ncols()).map(|c| y[(i, c)] * y[(j, c)]).sum();
            0.5 * (s[(i, j)] + s[(j, i)]) - rigid / (tau * tau)
        });
        let eigen = symmetric_eigen(s.as_ref()).ok_or(EigenFailure::Inaccurate { residual: f64::NAN })?;
        Ok(Self { factor: DenseFactor { l, tau }, eigen })
    }

    /// The i-th flexible eigenvalue lambda, ascending.
    pub(super) fn eigenvalue(&self, i: usize) -> f64 {
        let n = self.eigen.values.len();
        1.0 / self.eigen.values[n - 1 - i] - self.factor.tau
    }

    /// The lowest `count` modes.
    pub(super) fn vectors(&self, count: usize) -> Mat<f64> {
        let n = self.eigen.values.len();
        let mut vectors = Mat::from_fn(n, count, |i, j| {
            self.eigen.vectors[(i, n - 1 - j)] / self.eigen.values[n - 1 - j].abs().sqrt()
        });
        solve_upper_triangular_in_place(self.factor.l.as_ref().transpose(), vectors.as_mut(), Par::Seq);
        vectors
    }
}

/// The largest ratio K_ii / M_ii: a Rayleigh quotient, hence a lower bound of the largest eigenvalue and
/// close to it.
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

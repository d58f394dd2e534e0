//! The attempt for small pencils: all finite modes by one dense symmetric eigenproblem.

use super::canonical::{CLUSTER_GAP, cluster_end};
use super::failure::EigenFailure;
use super::needs::{Needs, Unusable, dense_seconds, made_of_modes, resident, with_bounds};
use super::problem::{EigenProblem, Task};
use super::refine::{FoundModes, Refined, refine};
use super::search::{Attempt, Goal};
use super::settings::Method;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, Par};
use flexbody_linalg::{
    Pencil, Solve, SymmetricEigen, SymmetricMatrix, dense_cholesky, gram, symmetric_eigen,
};

/// Scaled eigenvalues of Ms below this value count as zero: files with 10 digits leave smaller ones.
const ZERO_SCALED_MASS: f64 = 1e-10;

/// Largest model that is always solved densely: all modes take less than a second.
const MAX_ALWAYS_DENSE_ROWS: usize = 600;

/// Largest model that is solved densely because most of its modes are wanted (three arrays of n^2 numbers).
const MAX_DENSE_ROWS: usize = 9000;

/// Part of all modes above which the dense path does less work than a Krylov basis of twice that size.
const DENSE_FRACTION: f64 = 0.2;

/// Ratio of a shift among the wanted modes to the first shift below which the eigenproblem is solved again with the
/// lower shift: the first one costs more than a digit.
const LOWER_SHIFT_RATIO: f64 = 0.1;

/// All modes by dense eigenproblems.
pub(super) struct Dense;

/// Returns true when the dense path finds `wanted` modes with less work than an iterative search, or was requested. The
/// iterative attempts are then unsuited, whether or not the dense path fits the memory.
pub(super) fn is_chosen(task: &Task<'_>, wanted: usize) -> bool {
    let n = task.problem.pencil.n();
    match task.settings.method {
        Method::Dense => true,
        Method::Lanczos => false,
        Method::Auto => {
            let most = wanted as f64 > DENSE_FRACTION * task.flexible_rows() as f64;
            n <= MAX_ALWAYS_DENSE_ROWS || (n <= MAX_DENSE_ROWS && most)
        }
    }
}

impl Attempt for Dense {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        let n = task.problem.pencil.n();
        // Both matrices, their transformed product, its eigenvectors and copies in use.
        let found = 8 * (6 * (n as u64).pow(2) + 3 * (n * wanted) as u64);
        let needs = Needs {
            bytes: resident(with_bounds(task, wanted, found.max(made_of_modes(n, wanted)))),
            factor_bytes: 0,
            seconds: dense_seconds(n, wanted),
        };
        needs.within_limits(task)
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        let Task { problem, context, .. } = task;
        context.phase("dense eigenproblem");
        let pencil = &problem.pencil;
        let finite = finite_eigenvalues(pencil).ok_or(EigenFailure::MassIndefinite)?;
        let flexible = finite.saturating_sub(problem.rigid.ncols());
        let mean = shift(problem.first_estimate, highest_estimate(pencil));
        let mut spectrum = Spectrum::new(problem, mean)?;
        let end =
            |spectrum: &Spectrum| cluster_end(goal.wanted, flexible, CLUSTER_GAP, |i| spectrum.eigenvalue(i));
        let mut last = end(&spectrum);
        // A shift far above the wanted modes crowds them together, which costs the digits by which they differ. Once
        // their eigenvalues are known, another shift is placed among them, if that matrix can be factored.
        let highest = if last > 0 { spectrum.eigenvalue(last - 1) } else { mean };
        let among = shift(problem.first_estimate.min(highest), highest);
        if among < LOWER_SHIFT_RATIO * mean
            && let Ok(closer) = Spectrum::new(problem, among)
        {
            spectrum = closer;
            last = end(&spectrum);
        }
        let tau = spectrum.factor.tau;
        let found = Refined::new(problem, spectrum.vectors(last), context)?;
        let refined = refine(problem, &spectrum.factor, found, goal.tolerance, context)?;
        let next = (last..flexible).map(|i| spectrum.eigenvalue(i)).collect();
        Ok(FoundModes { refined, next, tau, finite: Some(flexible) })
    }

    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        true
    }
}

/// Returns the number of finite eigenvalues of the pencil, rigid ones included: block * rank(Ms). `None` means that Ms
/// is indefinite.
fn finite_eigenvalues(pencil: &Pencil<'_>) -> Option<usize> {
    let ms = dense(pencil.mass());
    let n = ms.nrows();
    let scale: Vec<f64> =
        (0..n).map(|i| if ms[(i, i)] > 0.0 { ms[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = Mat::from_fn(n, n, |i, j| ms[(i, j)] * scale[i] * scale[j]);
    let eigen = symmetric_eigen(scaled.as_ref())?;
    let indefinite = eigen.values.first().is_some_and(|&v| v < -ZERO_SCALED_MASS);
    let rank = eigen.values.iter().filter(|&&v| v > ZERO_SCALED_MASS).count();
    (!indefinite).then_some(rank * pencil.block())
}

/// Returns the shift for modes between `first` and `highest`: the geometric mean, so that both ends keep digits.
fn shift(first: f64, highest: f64) -> f64 {
    (0.3 * first * highest.max(first)).sqrt()
}

/// Dense Cholesky factor K + tau M = L L'.
struct DenseFactor {
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

/// Complete spectrum of S = L^-1 M L^-T, whose eigenvalues are 1 / (lambda + tau), with deflated rigid modes.
struct Spectrum {
    /// Factor of K + tau M, for the refinement.
    factor: DenseFactor,
    eigen: SymmetricEigen,
}

impl Spectrum {
    /// Factors K + tau M and diagonalises S.
    fn new(problem: &EigenProblem<'_>, tau: f64) -> Result<Self, EigenFailure> {
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

    /// Returns the i-th flexible eigenvalue lambda, ascending.
    fn eigenvalue(&self, i: usize) -> f64 {
        let n = self.eigen.values.len();
        1.0 / self.eigen.values[n - 1 - i] - self.factor.tau
    }

    /// Returns the lowest `count` modes, M-orthonormal.
    fn vectors(&self, count: usize) -> Mat<f64> {
        let n = self.eigen.values.len();
        let mut vectors = Mat::from_fn(n, count, |i, j| {
            self.eigen.vectors[(i, n - 1 - j)] / self.eigen.values[n - 1 - j].abs().sqrt()
        });
        solve_upper_triangular_in_place(self.factor.l.as_ref().transpose(), vectors.as_mut(), Par::Seq);
        vectors
    }
}

/// Returns the largest ratio K_ii / M_ii: a Rayleigh quotient, hence a lower bound of the largest eigenvalue, and close
/// to it.
fn highest_estimate(pencil: &Pencil<'_>) -> f64 {
    let k = pencil.stiffness().diagonal();
    let m = pencil.mass().diagonal();
    k.iter()
        .enumerate()
        .map(|(i, &kii)| (kii, m[i / pencil.block()]))
        .filter(|&(_, mii)| mii > 0.0)
        .fold(0.0, |largest: f64, (kii, mii)| largest.max(kii / mii))
}

/// Returns the matrix as a dense one.
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

/// Returns the mass matrix as a dense one (N x N): every entry of the scalar matrix Ms on the diagonal of a block.
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

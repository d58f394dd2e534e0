//! The eigenproblem to solve: its matrices, its rigid modes, and the structure of its factors.

use super::failure::EigenFailure;
use super::settings::EigenSettings;
use faer::{Mat, MatRef};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Cholesky, EliminationOrder, Peaks, Pencil, Solve, gram, subtract_combination, uniform,
};
use std::sync::Arc;

/// Part of tr K / tr M by which a pencil without further information is shifted: far above the rounding of a factor in
/// double precision, and far below the first eigenvalue of most pencils.
const DEFAULT_RELATIVE_SHIFT: f64 = 1e-8;

/// Seed of the fixed numbers from which the first eigenvalue is estimated.
const SEED: u64 = 7;

/// K psi = lambda M psi on the M-orthogonal complement of the known rigid modes.
#[derive(Debug, Clone, Copy)]
pub struct EigenProblem<'a> {
    /// K and M.
    pub pencil: Pencil<'a>,
    /// Rigid modes (N x r), M-orthonormal: exact null vectors of K, which are projected out at every step.
    pub rigid: MatRef<'a, f64>,
    /// Upper bound of the first flexible eigenvalue: the Rayleigh quotient of some flexible field.
    pub first_estimate: f64,
    /// Relative error of the entries of K: half a unit of the last digit in the input.
    pub input_error: f64,
    /// Elimination order shared by all problems of this pencil; `None` if each solver computes its own.
    pub order: Option<&'a EliminationOrder>,
}

impl<'a> EigenProblem<'a> {
    /// Creates the problem of a pencil of which only the null space of K is known. The columns of `rigid` (N x r) span
    /// the null space and are M-orthonormal; there are none if K is definite.
    ///
    /// The first eigenvalue is estimated with one factor of K + tau M, tau = 1e-8 tr K / tr M: fixed numbers are
    /// multiplied twice by (K + tau M)^-1 M and freed of `rigid`; their Rayleigh quotient is an upper bound of it. K
    /// and M count as exact. This factor also fills `order`, where the search finds its elimination order.
    ///
    /// # Errors
    /// [`TooLarge`](EigenFailure::TooLarge) if the pencil has no ordering;
    /// [`NotPositiveDefinite`](EigenFailure::NotPositiveDefinite) if K + tau M has no Cholesky factor.
    ///
    /// # Panics
    /// If the number of rows of `rigid` differs from that of the pencil.
    pub fn new(
        pencil: Pencil<'a>,
        rigid: MatRef<'a, f64>,
        order: &'a EliminationOrder,
    ) -> Result<Self, EigenFailure> {
        assert_eq!(rigid.nrows(), pencil.n(), "rows of the rigid modes");
        let first_estimate = rayleigh_estimate(&pencil, rigid, order)?;
        Ok(Self { pencil, rigid, first_estimate, input_error: 0.0, order: Some(order) })
    }
}

/// Returns an upper bound of the first eigenvalue beside those of `rigid`, by inverse iteration from fixed numbers.
fn rayleigh_estimate(
    pencil: &Pencil<'_>,
    rigid: MatRef<'_, f64>,
    order: &EliminationOrder,
) -> Result<f64, EigenFailure> {
    // Factor of K + tau M with a small shift.
    let trace = |diagonal: Vec<f64>| diagonal.into_iter().sum::<f64>();
    let shift = DEFAULT_RELATIVE_SHIFT * trace(pencil.stiffness().diagonal()) / trace(pencil.mass_diagonal());
    let analysis = order.of(pencil).ok_or(EigenFailure::TooLarge)?;
    let factor = Cholesky::<f64>::new(&analysis, pencil, shift);
    let factor = factor.ok_or(EigenFailure::NotPositiveDefinite { shift })?;
    // Two inverse iterations from fixed numbers.
    let mut field = Mat::from_fn(pencil.n(), 1, |row, _| uniform(SEED, row as u64, 0));
    for _ in 0..2 {
        let mut solved = pencil.apply_mass(field.as_ref());
        factor.solve_in_place(solved.as_mut());
        // The factor amplifies the null space most: it is projected out after each step.
        let in_null_space = gram(rigid, pencil.apply_mass(solved.as_ref()).as_ref());
        subtract_combination(solved.as_mut(), rigid, in_null_space.as_ref());
        field = solved;
    }
    // The Rayleigh quotient is an upper bound.
    let energy = gram(field.as_ref(), pencil.apply_stiffness(field.as_ref()).as_ref())[(0, 0)];
    let mass = gram(field.as_ref(), pencil.apply_mass(field.as_ref()).as_ref())[(0, 0)];
    Ok(energy / mass)
}

impl EigenProblem<'_> {
    /// Returns the elimination order and the structure of the factor; `None` if memory runs out.
    pub(super) fn analysis(&self) -> Option<Arc<Analysis>> {
        match self.order {
            Some(order) => order.of(&self.pencil),
            None => Analysis::new(&self.pencil).map(Arc::new),
        }
    }
}

/// An eigenproblem, the structure of its factors, the settings, and the context of the work.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub problem: &'a EigenProblem<'a>,
    pub settings: &'a EigenSettings,
    pub analysis: &'a Analysis,
    /// Largest numbers of entries that factorisations hold with the current number of threads.
    pub peaks: Peaks,
    pub context: &'a Context<'a>,
}

impl<'a> Task<'a> {
    pub(super) fn new(
        problem: &'a EigenProblem<'a>,
        settings: &'a EigenSettings,
        analysis: &'a Analysis,
        context: &'a Context<'a>,
    ) -> Self {
        let peaks = analysis.peaks(rayon::current_num_threads());
        Self { problem, settings, analysis, peaks, context }
    }

    /// Returns an upper bound of the number of flexible modes: the number of rows without the rigid modes.
    pub(super) fn flexible_rows(&self) -> usize {
        self.problem.pencil.n() - self.problem.rigid.ncols()
    }
}

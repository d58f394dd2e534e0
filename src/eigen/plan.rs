//! Memory and precision, decided before the work: the symbolic analysis knows what a factor needs.

use super::problem::{Accuracy, EigenFailure, EigenProblem, EigenSettings};
use crate::linalg::{Analysis, Peaks};

/// Numbers of the factor that the search solves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// f64.
    Double,
    /// f32, with all residuals and projections in f64: half the memory, and half the time where factorisation dominates.
    Single,
}

/// What the user says about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FactorChoice {
    /// Single where double does not fit the memory, or where it is faster; back to double where conditioning defeats it.
    Auto,
    /// This one.
    Always(Precision),
}

/// What was decided, and what it needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Numbers of the factor.
    pub precision: Precision,
    /// Bytes that the solver will hold at the most.
    pub bytes: u64,
    /// Bytes of the factor that the search solves with.
    pub factor_bytes: u64,
    /// Multiplications and additions of one factorisation.
    pub flops: f64,
    /// Whether single precision was tried first, in vain.
    pub single_failed: bool,
    /// Why completeness cannot be proved: bytes of the count, bytes there are.
    pub proof_too_large: Option<(u64, u64)>,
}

/// Work of a factorisation above which single precision is faster: below, the columns that its corrections solve cost
/// what the factorisation saves.
const SINGLE_PAYS: f64 = 4e11;

/// What the search needs beside the factor: Krylov basis, blocks in work, modes with their products, corrections.
fn vectors(problem: &EigenProblem<'_>, wanted: usize, precision: Precision) -> u64 {
    // Measured: five columns for each wanted mode.
    let basis = (5 * wanted + 16).min(2 * wanted + 128) + 4 * wanted + 24;
    let corrected = if precision == Precision::Single { 9 * wanted + 50 } else { 0 };
    8 * (problem.pencil.n() * basis.max(corrected)) as u64
}

/// What an inertia count of `inertia` numbers needs, with the modes and their products.
fn count_bytes(problem: &EigenProblem<'_>, inertia: u64, modes: usize) -> u64 {
    8 * (inertia + (3 * modes * problem.pencil.n()) as u64)
}

impl Plan {
    /// Decides for `wanted` modes.
    ///
    /// # Errors
    /// [`EigenFailure::Memory`] when nothing fits.
    pub(super) fn new(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        wanted: usize,
    ) -> Result<Self, EigenFailure> {
        let Peaks { factor, cholesky, inertia } = analysis.peaks(rayon::current_num_threads());
        let available = settings.memory.unwrap_or(u64::MAX);
        let search = |precision| {
            let size = if precision == Precision::Double { 8 } else { 4 };
            (size * cholesky).max(size * factor + vectors(problem, wanted, precision))
        };
        // The factor is given back before the count.
        let count = count_bytes(problem, inertia, wanted);
        let certified = settings.accuracy == Accuracy::Certified;
        let precision = match settings.factor {
            _ if certified => Precision::Double,
            FactorChoice::Always(precision) => precision,
            FactorChoice::Auto if with_slack(search(Precision::Double)) > available => Precision::Single,
            FactorChoice::Auto if analysis.flops() > SINGLE_PAYS => Precision::Single,
            FactorChoice::Auto => Precision::Double,
        };
        let needed = if certified {
            // The bounds factor a matrix of their own, beside the modes.
            let copy = 12 * problem.pencil.stiffness().as_csc().nnz() as u64;
            search(precision).max(count) + copy
        } else {
            search(precision)
        };
        if with_slack(needed) > available {
            return Err(EigenFailure::Memory { bytes: with_slack(needed), available });
        }
        let proof_too_large = (settings.accuracy != Accuracy::Fast && with_slack(count) > available)
            .then_some((count, available));
        let counted = settings.accuracy != Accuracy::Fast && proof_too_large.is_none();
        let size = if precision == Precision::Double { 8 } else { 4 };
        Ok(Self {
            precision,
            bytes: with_slack(if counted { needed.max(count) } else { needed }),
            factor_bytes: size * factor,
            flops: analysis.flops(),
            single_failed: false,
            proof_too_large,
        })
    }

    /// Bytes that an inertia count beside `found` modes needs.
    pub(super) fn count_bytes(problem: &EigenProblem<'_>, analysis: &Analysis, found: usize) -> u64 {
        with_slack(count_bytes(problem, analysis.peaks(rayon::current_num_threads()).inertia, found))
    }

    /// The same in double precision, where that fits.
    pub(super) fn in_double(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        wanted: usize,
    ) -> Result<Self, EigenFailure> {
        let settings = EigenSettings { factor: FactorChoice::Always(Precision::Double), ..*settings };
        Self::new(problem, &settings, analysis, wanted)
    }
}

impl std::fmt::Display for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let precision = if self.precision == Precision::Double { "double" } else { "single" };
        let (factor, all) = (gigabytes(self.factor_bytes), gigabytes(self.bytes));
        write!(f, "factor of {factor} in {precision} precision, {:.2e} operations, {all} in all", self.flops)
    }
}

/// What the allocator holds beyond what is in use (measured: 8 to 16 % of it), in blocks given back and not yet taken again.
fn with_slack(bytes: u64) -> u64 {
    bytes + bytes / 8
}

/// Bytes in GB, or MB where that is less.
pub(super) fn gigabytes(bytes: u64) -> String {
    if bytes < 1_000_000_000 {
        format!("{:.0} MB", bytes as f64 * 1e-6)
    } else {
        format!("{:.3} GB", bytes as f64 * 1e-9)
    }
}

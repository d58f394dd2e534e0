//! Counts of the eigenvalues below a shift, their plan, and the proof of completeness that rests on them.
//!
//! By Sylvester's law of inertia, the number of negative pivots of K - sigma M is the number of eigenvalues below sigma
//! (M positive semidefinite).

use super::failure::EigenFailure;
use super::needs::{count_bytes, resident};
use super::problem::{EigenProblem, Task};
use super::refine::Refined;
use super::settings::{Accuracy, FactorChoice, Precision};
use faer::ColRef;
use flexbody_linalg::context::Context;
use flexbody_linalg::{Analysis, Indefinite, Inertia};

/// State of the proof that no mode is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// The inertia count equals the number of modes found.
    InertiaCount,
    /// No count was made.
    NotProved,
}

/// Proof that no mode is missing, or the reason why there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Completeness {
    /// State of the proof.
    pub proof: Proof,
    /// The shift sigma of the count, between the last mode and the next eigenvalue.
    pub shift: f64,
    /// Negative pivots of K - sigma M: rigid and flexible modes below sigma.
    pub negative_pivots: Option<usize>,
    /// Flexible modes below sigma that were computed; those after the wanted ones complete a repeated
    /// eigenvalue.
    pub modes_below: usize,
    /// Reason why there is no proof, or its limits; empty if the proof has none.
    pub remark: String,
}

impl Completeness {
    /// Returns the number of flexible modes below the shift: the counted number if there is a count, else the found
    /// number.
    pub(super) fn counted(&self, rigid: usize) -> usize {
        self.negative_pivots.map_or(self.modes_below, |negative| negative.saturating_sub(rigid))
    }
}

/// Number of vectors in use while the rounding of a count in single precision is measured.
const PROBE_VECTORS: usize = 40;

/// Part of [`EigenSettings::single_pays`](super::EigenSettings::single_pays) above which a count in single precision is
/// faster, including the solutions that measure its rounding.
const SINGLE_COUNT_FRACTION: f64 = 0.15;

/// Way to count eigenvalues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Counting {
    /// Count with a factor in double precision, which is discarded after the count.
    Double,
    /// Count with a factor in single precision, whose rounding is then measured. If rounding may change the count, the
    /// count is repeated in double precision, if that fits the memory.
    Single {
        /// True when a count in double precision fits the memory.
        double_fits: bool,
    },
}

/// Plan of the count that proves completeness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CountPlan {
    /// Kind of the count; `None` if there is no count.
    pub counting: Option<Counting>,
    /// Bytes needed by the count.
    pub bytes: u64,
    /// Reason why the count does not fit: bytes needed and bytes available.
    pub too_large: Option<(u64, u64)>,
}

impl CountPlan {
    /// Plans the count beside `modes` modes. Accuracy `fast` has no count. The factor of the search is released before
    /// the count.
    pub(super) fn of(task: &Task<'_>, modes: usize) -> Self {
        if task.settings.accuracy == Accuracy::Fast {
            return Self { counting: None, bytes: 0, too_large: None };
        }
        Self::new(task, modes)
    }

    /// Plans a count beside `modes` modes for any accuracy.
    pub(super) fn new(task: &Task<'_>, modes: usize) -> Self {
        let Task { settings, analysis, .. } = task;
        let available = task.context.available();
        let (single, double) = (single_count_bytes(task, modes), count_bytes(task, modes));
        let fits = |bytes: u64| resident(bytes) <= available;
        let double_fits = fits(double);
        let pays = match settings.factor {
            _ if settings.accuracy == Accuracy::Certified => false,
            FactorChoice::Always(precision) => precision == Precision::Single,
            FactorChoice::Auto => {
                !double_fits || analysis.flops() > SINGLE_COUNT_FRACTION * settings.single_pays
            }
        };
        if pays && fits(single) {
            let bytes = if double_fits { single.max(double) } else { single };
            Self { counting: Some(Counting::Single { double_fits }), bytes, too_large: None }
        } else if double_fits {
            Self { counting: Some(Counting::Double), bytes: double, too_large: None }
        } else {
            let least = if pays { single.min(double) } else { double };
            Self { counting: None, bytes: 0, too_large: Some((resident(least), available)) }
        }
    }
}

/// Returns the bytes of a count in single precision, with the vectors that measure its rounding.
fn single_count_bytes(task: &Task<'_>, modes: usize) -> u64 {
    4 * task.peaks.retained_inertia + 8 * ((3 * modes + PROBE_VECTORS) * task.problem.pencil.n()) as u64
}

/// A count of eigenvalues.
pub(super) struct Count {
    /// Number of eigenvalues below the shift, rigid modes included.
    pub below: usize,
    /// Size of the rounding of a count in single precision; 1 is the size that may change the count. `None` for double
    /// precision.
    pub rounding: Option<f64>,
}

impl Count {
    /// Returns the limits of a proof by this count; an empty text if there are none.
    pub(super) fn remark(&self) -> String {
        self.rounding.map_or_else(String::new, |rounding| {
            format!(
                "counted in single precision, with {rounding:.0e} of the rounding error that could change the count"
            )
        })
    }
}

/// Backward error above which element growth may have spoilt a count in double precision.
const MAX_COUNT_BACKWARD_ERROR: f64 = 1e-4;

/// Distance of a shift from an eigenvalue, relative to [`size_along`] its mode, below which the count is made in double
/// precision, if that fits the memory. With a smaller value rounding may spoil counts in single precision. Measured on
/// cubes and blocks: the norm of G of [`Indefinite::perturbation`](flexbody_linalg::Indefinite::perturbation) is 4.5e-7
/// over this distance.
pub(super) const SINGLE_COUNT_DISTANCE: f64 = 2e-6;

/// Returns the size of K - sigma M along a mode psi: psi' diag(K + sigma M) psi. Rounding moves the eigenvalue of the
/// mode by about one unit roundoff of this size.
pub(super) fn size_along(problem: &EigenProblem<'_>, sigma: f64, mode: ColRef<'_, f64>) -> f64 {
    let pencil = &problem.pencil;
    let diagonal = pencil.stiffness().diagonal().into_iter().zip(pencil.mass_diagonal());
    diagonal.zip(mode.iter()).map(|((k, m), x)| (k.abs() + sigma * m) * x * x).sum()
}

/// Returns true when the shift is so near to the last mode below it, for the size of the matrix along this mode, that
/// the rounding of a factor in single precision may move one across the other.
pub(super) fn is_near(problem: &EigenProblem<'_>, found: &Refined, shift: f64) -> bool {
    let Some(last) = found.eigenvalues.iter().rposition(|&lambda| lambda < shift) else { return false };
    shift - found.eigenvalues[last]
        < SINGLE_COUNT_DISTANCE * size_along(problem, shift, found.vectors.col(last))
}

/// Counts the eigenvalues of the pencil below `sigma`, rigid modes included.
///
/// # Errors
/// [`EigenFailure::Inaccurate`] if rounding may change the count.
pub(super) fn count(task: &Task<'_>, sigma: f64, counting: Counting) -> Result<Count, EigenFailure> {
    let Task { problem, analysis, context, .. } = task;
    if let Counting::Single { double_fits } = counting {
        context.count(|work| work.factorizations += 1);
        let factor = Indefinite::<f32>::new(analysis, &problem.pencil, sigma);
        let inertia = factor.inertia();
        let rounding = if inertia.zero > 0 { None } else { factor.perturbation(&problem.pencil) };
        if rounding.is_some() {
            return Ok(Count { below: inertia.negative, rounding });
        }
        if !double_fits {
            return Err(EigenFailure::Inaccurate { residual: inertia.backward_error });
        }
    }
    let below = count_below(problem, analysis, sigma, context)?;
    Ok(Count { below, rounding: None })
}

/// Counts the eigenvalues of the pencil below `sigma` in double precision, rigid modes included.
pub(super) fn count_below(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    sigma: f64,
    context: &Context<'_>,
) -> Result<usize, EigenFailure> {
    context.count(|work| work.factorizations += 1);
    let inertia = Inertia::new(analysis, &problem.pencil, sigma);
    if inertia.zero > 0
        || inertia.backward_error.is_nan()
        || inertia.backward_error > MAX_COUNT_BACKWARD_ERROR
    {
        return Err(EigenFailure::Inaccurate { residual: inertia.backward_error });
    }
    Ok(inertia.negative)
}

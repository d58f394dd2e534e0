//! The plan of a search: the ways to find modes in the order in which they are tried, each with its memory and time.
//!
//! The first attempt of the list searches for the modes. If it fails for a reason that does not concern the model, the
//! next one does.

use super::attempts::{Cycles, DoublePrecision, SecondShift, SinglePrecision};
use super::count::CountPlan;
use super::dense::{self, Dense};
use super::failure::EigenFailure;
use super::needs::{Needs, gigabytes, resident};
use super::problem::Task;
use super::search::Attempt;
use super::settings::Precision;

/// A way to find modes. Ways are tried in the order of the variants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::VariantArray)]
pub enum Way {
    /// All modes by dense eigenproblems.
    Dense,
    /// Corrections by cycles over levels of groups of nodes, without a factor.
    Cycles,
    /// Lanczos with a factor in single precision, and corrections.
    SinglePrecision,
    /// Lanczos with two factors in double precision, one after the other; the second is at a shift among the modes.
    SecondShift,
    /// Lanczos with a factor in double precision.
    DoublePrecision,
}

impl Way {
    /// Every way, in the order in which they are tried.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Returns the name of the way in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Cycles => "cycles",
            Self::SinglePrecision => "single precision",
            Self::SecondShift => "second shift",
            Self::DoublePrecision => "double precision",
        }
    }

    /// Returns the algorithm of the way.
    pub(super) fn attempt(self) -> &'static dyn Attempt {
        match self {
            Self::Dense => &Dense,
            Self::Cycles => &Cycles,
            Self::SinglePrecision => &SinglePrecision,
            Self::SecondShift => &SecondShift,
            Self::DoublePrecision => &DoublePrecision,
        }
    }
}

/// The attempts that can be made for a problem, in their order, with their needs of memory and time.
///
/// After the search the plan also records which of them failed.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Attempts, in the order in which they are tried. The first one without a failure found the modes.
    pub attempts: Vec<PlannedAttempt>,
    /// Number of multiplications and additions of one factorisation.
    pub flops: f64,
    /// Reason why a further attempt is not made: memory or time.
    pub(super) refused: Option<EigenFailure>,
    /// Plan of the count that proves completeness.
    pub(super) count: CountPlan,
}

/// One attempt of a [`Plan`].
#[derive(Debug, Clone)]
pub struct PlannedAttempt {
    /// Algorithm of the attempt.
    pub way: Way,
    /// Memory and time, including the count after the search.
    pub needs: Needs,
    /// Reason why the attempt failed; `None` if it succeeded or was not made.
    pub failure: Option<String>,
}

impl Plan {
    /// Lists the attempts that can be made for `wanted` modes.
    ///
    /// # Errors
    /// [`EigenFailure::Memory`] if no attempt fits the memory; [`EigenFailure::TooLong`] if an attempt is refused for
    /// its time and none is left.
    pub(super) fn new(task: &Task<'_>, wanted: usize) -> Result<Self, EigenFailure> {
        let count = CountPlan::of(task, wanted);
        let dense = dense::is_chosen(task, wanted);
        let mut attempts = Vec::new();
        let mut refused = None;
        for &way in Way::ALL.iter().filter(|way| (**way == Way::Dense) == dense) {
            match way.attempt().needs(task, wanted) {
                Ok(needs) => {
                    let needs = Needs { bytes: needs.bytes.max(resident(count.bytes)), ..needs };
                    attempts.push(PlannedAttempt { way, needs, failure: None });
                }
                // The first refusal is the one of the fewest bytes.
                Err(unusable) => refused = refused.or(unusable.failure(task, wanted)),
            }
        }
        match refused {
            Some(failure) if attempts.is_empty() => Err(failure),
            refused => Ok(Self { attempts, flops: task.analysis.flops(), refused, count }),
        }
    }

    /// Returns the attempt to make next; after the search, the attempt that found the modes.
    ///
    /// # Panics
    /// Never for a plan that [`solve`](super::solve) returned: at least one of its attempts has not failed.
    pub fn current(&self) -> &PlannedAttempt {
        let next = self.attempts.iter().find(|attempt| attempt.failure.is_none());
        next.or(self.attempts.last()).expect("a plan has an attempt")
    }

    /// Returns the precision of the factor. Cycles, which have no factor, count as single precision.
    pub fn precision(&self) -> Precision {
        match self.current().way {
            Way::Cycles | Way::SinglePrecision => Precision::Single,
            Way::Dense | Way::SecondShift | Way::DoublePrecision => Precision::Double,
        }
    }

    /// Returns the largest number of bytes by which the process grows.
    pub fn bytes(&self) -> u64 {
        self.current().needs.bytes
    }

    /// Returns true when an attempt of this way was made and failed.
    pub fn has_failed(&self, way: Way) -> bool {
        self.attempts.iter().any(|attempt| attempt.way == way && attempt.failure.is_some())
    }

    /// Replaces the bytes of all attempts by `change` of them, for a caller that holds memory beside the search.
    pub fn with_bytes(mut self, change: impl Fn(u64) -> u64) -> Self {
        self.attempts.iter_mut().for_each(|attempt| attempt.needs.bytes = change(attempt.needs.bytes));
        self
    }
}

impl std::fmt::Display for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let PlannedAttempt { way, needs, .. } = self.current();
        let (factor, all) = (gigabytes(needs.factor_bytes), gigabytes(needs.bytes));
        let precision = match way {
            Way::Dense => return write!(f, "dense eigenproblem, {all} of memory"),
            Way::Cycles => return write!(f, "multigrid cycles without a factor, {all} of memory"),
            Way::SinglePrecision => "single",
            Way::SecondShift | Way::DoublePrecision => "double",
        };
        write!(
            f,
            "factor of {factor} in {precision} precision, {:.2e} operations, {all} of memory in total",
            self.flops
        )?;
        match (needs.seconds / 60.0).round() {
            minutes if minutes >= 1.0 => write!(f, "; about {minutes} min for the modes on one processor"),
            _ => Ok(()),
        }
    }
}

//! The plan of a search: the ways to find modes in the order in which they are tried, the interface of an attempt, and
//! the memory and time of each attempt, estimated before the work from the symbolic analysis.
//!
//! The first attempt of the list searches for the modes. If it fails for a reason that does not concern the model, the
//! next one does.

use super::attempts::{Cycles, DoublePrecision, SecondShift, SinglePrecision};
use super::dense::{self, Dense};
use super::problem::{Accuracy, EigenFailure, EigenProblem, FactorChoice, Precision, Task};
use super::refine::{COLUMNS_PER_PRODUCT, FoundModes};
use super::solve::Counting;

/// A way to find modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
    pub const ALL: [Self; 5] =
        [Self::Dense, Self::Cycles, Self::SinglePrecision, Self::SecondShift, Self::DoublePrecision];

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
        for way in Way::ALL.into_iter().filter(|way| (*way == Way::Dense) == dense) {
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

/// Goal of a search for modes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// Number of modes, extended to the end of the cluster of the last one.
    pub wanted: usize,
    /// Largest K-residual allowed for the modes.
    pub tolerance: f64,
    /// Smallest gap above the last mode that the later count needs, relative to the size of the matrix along the modes;
    /// 0 if any gap will do. If the gap is smaller, corrections also search the modes up to the next gap that is wide
    /// enough, provided that it is near.
    pub separation: f64,
    /// Number of this search among the searches for the same modes. A search repeated after a count that found more
    /// modes starts from other random vectors.
    pub round: usize,
}

/// Algorithm behind a [`Way`].
pub(super) trait Attempt: Sync {
    /// Returns the memory and time that a search for `wanted` modes takes.
    ///
    /// # Errors
    /// [`Unusable`] if the attempt cannot be used, or another attempt takes less time.
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable>;

    /// Searches for the modes.
    ///
    /// # Errors
    /// [`EigenFailure`] with the reason why no modes keep the tolerance.
    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure>;

    /// Returns true when the failure reveals a property of the model, so that no other attempt would succeed.
    fn is_conclusive(&self, failure: &EigenFailure) -> bool;

    /// Returns true when the attempt is also made in a repeated search, after a count that found missing modes.
    fn is_repeated(&self) -> bool {
        true
    }
}

/// Memory and time of an attempt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needs {
    /// Largest number of bytes by which the process grows.
    pub bytes: u64,
    /// Bytes of the factor used by the search; 0 without a factor.
    pub factor_bytes: u64,
    /// Estimated time of the search on one processor, in seconds, without the factorisation.
    pub seconds: f64,
}

/// Reason why an attempt is not made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unusable {
    /// Another attempt is better, or was requested.
    Unsuited,
    /// The attempt takes more memory than is available.
    Memory(Needs),
    /// The attempt takes longer than the limit of the context.
    Time(Needs),
}

impl Unusable {
    /// Returns the failure of a search that has no other attempt; `None` if another attempt was preferred.
    pub(super) fn failure(self, task: &Task<'_>, wanted: usize) -> Option<EigenFailure> {
        match self {
            Self::Unsuited => None,
            Self::Memory(Needs { bytes, .. }) => {
                Some(EigenFailure::Memory { bytes, available: task.context.available() })
            }
            Self::Time(Needs { bytes, seconds, .. }) => {
                Some(EigenFailure::TooLong { wanted, seconds, bytes })
            }
        }
    }
}

impl Needs {
    /// Returns these needs if they are within the limits of the context.
    ///
    /// # Errors
    /// The limit that they exceed: [`Unusable::Memory`] or [`Unusable::Time`].
    pub(super) fn within_limits(self, task: &Task<'_>) -> Result<Self, Unusable> {
        if self.bytes > task.context.available() {
            return Err(Unusable::Memory(self));
        }
        if task.context.longest.is_some_and(|longest| self.seconds > longest) {
            return Err(Unusable::Time(self));
        }
        Ok(self)
    }
}

/// Operations per second that time estimates assume, for one processor and the mixed work of a search.
const OPERATIONS_PER_SECOND: f64 = 4e9;

/// Returns the needs of a search with a factor of this precision.
pub(super) fn factor_needs(task: &Task<'_>, wanted: usize, precision: Precision) -> Result<Needs, Unusable> {
    let Task { problem, analysis, peaks, .. } = task;
    let n = problem.pencil.n();
    let size = precision.bytes();
    let found = (size * peaks.cholesky).max(size * peaks.factor + vector_bytes(problem, wanted, precision));
    let needs = Needs {
        bytes: resident(with_bounds(task, wanted, found.max(made_of_modes(n, wanted)))),
        factor_bytes: size * peaks.factor,
        seconds: search_seconds(n, wanted, analysis.factor_len() as u64),
    };
    needs.within_limits(task)
}

/// Returns `bytes` increased by the memory for the bounds of [`Accuracy::Certified`], which factor another matrix
/// beside the modes.
pub(super) fn with_bounds(task: &Task<'_>, wanted: usize, bytes: u64) -> u64 {
    if task.settings.accuracy != Accuracy::Certified {
        return bytes;
    }
    let entries = task.problem.pencil.stiffness().as_csc().nnz() as u64;
    bytes.max(count_bytes(task, wanted)) + 12 * entries
}

/// Returns the number of columns of the Krylov basis. Measured: five for each wanted mode.
pub(super) fn basis_columns(wanted: usize) -> usize {
    (5 * wanted + 16).min(2 * wanted + 128)
}

/// Returns the bytes of a search beside the factor: Krylov basis, blocks in use, modes with products of some of them,
/// and corrections.
pub(super) fn vector_bytes(problem: &EigenProblem<'_>, wanted: usize, precision: Precision) -> u64 {
    let basis = basis_columns(wanted);
    let found = wanted + 3 * wanted.min(COLUMNS_PER_PRODUCT) + 24;
    let columns = match precision {
        Precision::Double => basis + found,
        // A span of three times its first size (1.5 for each wanted mode and 16) with its products with K and M, and
        // forces and vectors in use.
        Precision::Single => (basis + found + 2 * wanted).max(17 * wanted + 180),
    };
    8 * (problem.pencil.n() * columns) as u64
}

/// Returns the bytes that a caller needs beside `wanted` modes: a copy of them, and tables with numbers for each pair
/// of modes.
pub(super) fn made_of_modes(n: usize, wanted: usize) -> u64 {
    let (n, wanted) = (n as u64, wanted as u64);
    8 * (80 * wanted * wanted + 3 * n * wanted)
}

/// Estimates the seconds of an iterative search: solutions with a factor of `factor` numbers, orthogonalisation against
/// the basis, restarts, and the products of all pairs of modes.
pub(super) fn search_seconds(n: usize, wanted: usize, factor: u64) -> f64 {
    let (rows, modes) = (n as f64, wanted as f64);
    let (basis, columns) = (basis_columns(wanted) as f64, 3.0 * modes + 100.0);
    let search = columns * (4.0 * factor as f64 + 8.0 * rows * basis) + 6.0 * rows * basis * modes;
    (search + 20.0 * rows * modes * modes) / OPERATIONS_PER_SECOND
}

/// Estimates the seconds of the dense path: two decompositions, and the products of all pairs of modes.
pub(super) fn dense_seconds(n: usize, wanted: usize) -> f64 {
    let (rows, modes) = (n as f64, wanted as f64);
    (30.0 * rows.powi(3) + 20.0 * rows * modes * modes) / OPERATIONS_PER_SECOND
}

/// Returns the bytes by which a process grows that uses `bytes`. In addition to memory in use the allocator holds
/// released blocks (measured: 8 to 16 %), and partly used pages of every size. Each thread has its own allocator pages,
/// and buffers of the dense products (measured on models of 18 000 degrees of freedom: 14 to 20 MB on one thread, 34 to
/// 48 MB on two).
pub(super) fn resident(bytes: u64) -> u64 {
    bytes + bytes / 8 + 8_000_000 + 20_000_000 * rayon::current_num_threads() as u64
}

/// Returns the bytes of an inertia count in double precision, with the modes and their products.
fn count_bytes(task: &Task<'_>, modes: usize) -> u64 {
    8 * (task.peaks.inertia + (3 * modes * task.problem.pencil.n()) as u64)
}

/// Returns the bytes by which the process grows for an inertia count in double precision beside `found` modes.
pub(super) fn resident_for_count(task: &Task<'_>, found: usize) -> u64 {
    resident(count_bytes(task, found))
}

/// Returns the bytes of a count in single precision, with the vectors that measure its rounding.
fn single_count_bytes(task: &Task<'_>, modes: usize) -> u64 {
    4 * task.peaks.retained_inertia + 8 * ((3 * modes + PROBE_VECTORS) * task.problem.pencil.n()) as u64
}

/// Number of vectors in use while the rounding of a count in single precision is measured.
const PROBE_VECTORS: usize = 40;

/// Part of [`EigenSettings::single_pays`](super::EigenSettings::single_pays) above which a count in single precision is
/// faster, including the solutions that measure its rounding.
const SINGLE_COUNT_FRACTION: f64 = 0.15;

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

/// Returns bytes as a text in GB, or in MB below one GB.
pub(super) fn gigabytes(bytes: u64) -> String {
    if bytes < 1_000_000_000 {
        format!("{:.0} MB", bytes as f64 * 1e-6)
    } else {
        format!("{:.3} GB", bytes as f64 * 1e-9)
    }
}

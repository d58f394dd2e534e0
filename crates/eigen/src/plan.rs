//! Memory and precision, decided before the work: the symbolic analysis knows what a factor needs.

use super::completeness::Counting;
use super::corrector::room_with_levels;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::refine::TOGETHER;
use super::second_shift;
use super::settings::{Accuracy, EigenSettings, FactorChoice, Method, Precision, Wanted};
use super::without_factor::guards;
use flexbody_linalg::multigrid::can_have_levels;
use flexbody_linalg::{Analysis, Peaks};

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
    /// Whether the search goes without a factor.
    pub multigrid: Multigrid,
    /// Whether a second factor, at a shift among the modes, is made beside it.
    pub second_shift: bool,
    /// About how long the search takes on one processor, in seconds, without the factorisation.
    pub seconds: f64,
    /// How completeness is counted; `None`: not at all.
    pub counting: Option<Counting>,
    /// Why completeness cannot be proved: bytes of the count, bytes there are.
    pub proof_too_large: Option<(u64, u64)>,
}

/// Whether a search solves by cycles over levels of groups of nodes instead of with a factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Multigrid {
    /// A factor is cheaper, or was asked for.
    Unsuited,
    /// It does.
    Used,
    /// It was tried first, in vain.
    Failed,
}

/// Modes up to which they are searched for without a factor: with more, the products of all pairs of vectors
/// take longer than the solutions.
const MULTIGRID_MODES: usize = 100;

/// Bytes of all levels, and of what they are made from: for each stored entry of K, and for each row.
const LEVEL_BYTES: (u64, u64) = (12, 400);

/// Entries in a row of K of linear hexahedra, nearly.
const LINEAR_COUPLINGS: f64 = 64.0;

/// Most that the coupling of elements of the second order raises the threshold by, beside itself. Those of
/// hexahedra have not been measured beyond it.
const MOST_RAISED: f64 = 2.1;

/// Modes up to which the threshold is that of the settings. More raise it: corrections take the more time the more
/// modes they are kept off, while a factor is made once. (Measured: equal times with 35 modes of a bar of 100,000
/// rows, with 80 of a cube, whose factor takes three times the operations.)
const FEW: f64 = 28.0;

/// Whether the search is to go without a factor.
fn suits_multigrid(
    problem: &EigenProblem<'_>,
    settings: &EigenSettings,
    analysis: &Analysis,
    wanted: usize,
) -> bool {
    let entries = problem.pencil.stiffness().as_csc().nnz() as f64;
    // Elements of the second order couple more rows, and take more cycles. (Measured: tetrahedra of 100,000 rows,
    // which couple a quarter more, take twice the time of a factor.)
    let coupled = (entries / (problem.pencil.n() as f64 * LINEAR_COUPLINGS)).max(1.0);
    let many = (wanted as f64 / FEW).max(1.0);
    let pays = settings.multigrid_pays * many * coupled * coupled.powi(2).min(MOST_RAISED);
    settings.accuracy != Accuracy::Certified
        && settings.factor == FactorChoice::Auto
        && settings.method == Method::Auto
        && matches!(settings.wanted, Wanted::Lowest(_))
        // Cycles leave nothing to go on from before they are done.
        && problem.resume.start.is_none()
        && problem.resume.save.is_none()
        && can_have_levels(&problem.pencil, problem.rigid.ncols())
        && (1..=MULTIGRID_MODES).contains(&wanted)
        && analysis.flops() > pays * entries
}

/// Operations per second that estimates of time assume: what one processor does of the mixed work of a
/// search.
const PACE: f64 = 4e9;

/// Columns of the Krylov basis. Measured: five for each wanted mode.
fn basis_columns(wanted: usize) -> usize {
    (5 * wanted + 16).min(2 * wanted + 128)
}

/// What the search needs beside the factor: Krylov basis, blocks in work, modes and products of some of them,
/// corrections, and the copy of the basis that a checkpoint is written from.
fn vectors(problem: &EigenProblem<'_>, wanted: usize, precision: Precision) -> u64 {
    let basis = basis_columns(wanted);
    let saved = if problem.resume.save.is_some() { basis } else { 0 };
    let found = wanted + 3 * wanted.min(TOGETHER) + 24;
    let columns = match precision {
        // A search is saved before its modes are made.
        Precision::Double => basis + found.max(saved),
        // A span of three times its first size, 1.5 for each wanted mode and 16, with both products; forces and
        // vectors in work beside it.
        Precision::Single => (basis + found + 2 * wanted).max(17 * wanted + 180) + saved,
    };
    8 * (problem.pencil.n() * columns) as u64
}

/// What a search without a factor needs beside the levels: the span with both products; and for each vector that it
/// begins with a product, a force, a correction, and the copies in single precision that cycles keep it apart from.
/// What cycles hold besides is less than what is in use before and given back.
fn vectors_with_levels(n: usize, wanted: usize) -> u64 {
    let base = wanted + guards(wanted);
    8 * (n * (3 * room_with_levels(base) + 4 * base)) as u64
}

/// What the dense path holds: both matrices, their transformed product, its eigenvectors and copies in work.
fn dense_bytes(n: usize, wanted: usize) -> u64 {
    let (n, wanted) = (n as u64, wanted as u64);
    8 * (6 * n * n + 3 * n * wanted)
}

/// What a caller makes of `wanted` modes: a copy of them, and tables with numbers for each pair of modes.
fn made_of_them(n: usize, wanted: usize) -> u64 {
    let (n, wanted) = (n as u64, wanted as u64);
    8 * (80 * wanted * wanted + 3 * n * wanted)
}

/// About how long a search takes: solutions with the factor, orthogonalisation against the basis, restarts,
/// and the products of all pairs of modes; on the dense path two decompositions.
fn seconds(n: usize, wanted: usize, factor: u64, dense: bool) -> f64 {
    let (rows, modes) = (n as f64, wanted as f64);
    let search = if dense {
        30.0 * rows.powi(3)
    } else {
        let (basis, columns) = (basis_columns(wanted) as f64, 3.0 * modes + 100.0);
        columns * (4.0 * factor as f64 + 8.0 * rows * basis) + 6.0 * rows * basis * modes
    };
    (search + 20.0 * rows * modes * modes) / PACE
}

/// What a search needs, by the dense path or with a factor of this precision, and what is made of its modes.
fn search_bytes(
    problem: &EigenProblem<'_>,
    peaks: &Peaks,
    wanted: usize,
    dense: bool,
    precision: Precision,
) -> u64 {
    let (n, size) = (problem.pencil.n(), precision.bytes());
    let found = if dense {
        dense_bytes(n, wanted)
    } else {
        (size * peaks.cholesky).max(size * peaks.factor + vectors(problem, wanted, precision))
    };
    found.max(made_of_them(n, wanted))
}

/// What an inertia count in double precision needs, with the modes and their products.
fn count_bytes(problem: &EigenProblem<'_>, peaks: &Peaks, modes: usize) -> u64 {
    8 * (peaks.inertia + (3 * modes * problem.pencil.n()) as u64)
}

/// The same in single precision, with the vectors that tell of its rounding.
fn single_count_bytes(problem: &EigenProblem<'_>, peaks: &Peaks, modes: usize) -> u64 {
    4 * peaks.kept_inertia + 8 * ((3 * modes + PROBE_VECTORS) * problem.pencil.n()) as u64
}

/// Vectors that are held while the rounding of a count in single precision is measured.
const PROBE_VECTORS: usize = 40;

/// Part of [`EigenSettings::single_pays`] above which a count in single precision is faster, with the
/// solutions that tell of its rounding.
const COUNT_PART: f64 = 0.15;

/// How a count is made.
pub(super) struct CountPlan {
    /// `None` where there is none.
    pub counting: Option<Counting>,
    /// Bytes that it needs.
    bytes: u64,
    /// Why there is none: bytes of the count, bytes there are.
    too_large: Option<(u64, u64)>,
}

impl CountPlan {
    /// How a count beside so many modes is made. What the search solves with is given back before.
    pub(super) fn new(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        modes: usize,
    ) -> Self {
        let peaks = analysis.peaks(rayon::current_num_threads());
        let available = settings.memory.unwrap_or(u64::MAX);
        let (single, double) =
            (single_count_bytes(problem, &peaks, modes), count_bytes(problem, &peaks, modes));
        let fits = |bytes: u64| resident(bytes) <= available;
        let double_fits = fits(double);
        let pays = match settings.factor {
            _ if settings.accuracy == Accuracy::Certified => false,
            FactorChoice::Always(precision) => precision == Precision::Single,
            FactorChoice::Auto => !double_fits || analysis.flops() > COUNT_PART * settings.single_pays,
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

    /// That of the settings: `fast` has none.
    fn of(problem: &EigenProblem<'_>, settings: &EigenSettings, analysis: &Analysis, modes: usize) -> Self {
        if settings.accuracy == Accuracy::Fast {
            return Self { counting: None, bytes: 0, too_large: None };
        }
        Self::new(problem, settings, analysis, modes)
    }
}

impl Plan {
    /// Decides for `wanted` modes, which the dense path looks for or an iterative search.
    ///
    /// # Errors
    /// [`EigenFailure::Memory`] when nothing fits; [`EigenFailure::TooLong`] when it would take longer than
    /// the settings allow.
    pub(super) fn new(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        wanted: usize,
        dense: bool,
    ) -> Result<Self, EigenFailure> {
        if !dense
            && suits_multigrid(problem, settings, analysis, wanted)
            && let Some(plan) = Self::without_factor(problem, settings, analysis, wanted)
        {
            return Ok(plan);
        }
        Self::with_factor(problem, settings, analysis, wanted, dense)
    }

    /// The plan of a search by cycles over levels; `None` where they do not fit.
    fn without_factor(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        wanted: usize,
    ) -> Option<Self> {
        let n = problem.pencil.n();
        let entries = problem.pencil.stiffness().as_csc().nnz() as u64;
        let levels = LEVEL_BYTES.0 * entries + LEVEL_BYTES.1 * n as u64;
        let found = levels + vectors_with_levels(n, wanted);
        let needed = found.max(made_of_them(n, wanted));
        if settings.memory.is_some_and(|available| resident(needed) > available) {
            return None;
        }
        let count = CountPlan::of(problem, settings, analysis, wanted);
        Some(Self {
            precision: Precision::Single,
            bytes: resident(needed.max(count.bytes)),
            factor_bytes: 0,
            flops: analysis.flops(),
            // As with a factor of the size of K.
            seconds: seconds(n, wanted, entries, false),
            single_failed: false,
            second_shift: false,
            multigrid: Multigrid::Used,
            counting: count.counting,
            proof_too_large: count.too_large,
        })
    }

    /// The plan of a search with a factor.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn with_factor(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        wanted: usize,
        dense: bool,
    ) -> Result<Self, EigenFailure> {
        let n = problem.pencil.n();
        let seconds = seconds(n, wanted, analysis.factor_len() as u64, dense);
        let peaks = analysis.peaks(rayon::current_num_threads());
        let available = settings.memory.unwrap_or(u64::MAX);
        let search = |precision: Precision| search_bytes(problem, &peaks, wanted, dense, precision);
        let count = CountPlan::of(problem, settings, analysis, wanted);
        let certified = settings.accuracy == Accuracy::Certified;
        let precision = match settings.factor {
            _ if certified => Precision::Double,
            FactorChoice::Always(precision) => precision,
            FactorChoice::Auto if resident(search(Precision::Double)) > available => Precision::Single,
            FactorChoice::Auto if analysis.flops() > settings.single_pays => Precision::Single,
            FactorChoice::Auto => Precision::Double,
        };
        let mut needed = search(precision);
        // The first factor is given back before, and made again where its modes are to be refined. A search that is kept
        // has one operator from its beginning to its end.
        let with_second = needed.max(8 * peaks.kept_inertia + vectors(problem, wanted, precision));
        let second_shift = !dense
            && !certified
            && precision == Precision::Double
            && problem.resume.save.is_none()
            && second_shift::pays(analysis, n, wanted, basis_columns(wanted))
            && resident(with_second) <= available;
        if second_shift {
            needed = with_second;
        }
        if certified {
            // The bounds factor a matrix of their own, beside the modes.
            needed = needed.max(count_bytes(problem, &peaks, wanted))
                + 12 * problem.pencil.stiffness().as_csc().nnz() as u64;
        }
        if resident(needed) > available {
            return Err(EigenFailure::Memory { bytes: resident(needed), available });
        }
        if settings.longest.is_some_and(|longest| seconds > longest) {
            return Err(EigenFailure::TooLong { wanted, seconds, bytes: resident(needed) });
        }
        Ok(Self {
            precision,
            bytes: resident(needed.max(count.bytes)),
            factor_bytes: precision.bytes() * peaks.factor,
            flops: analysis.flops(),
            seconds,
            single_failed: false,
            second_shift,
            multigrid: Multigrid::Unsuited,
            counting: count.counting,
            proof_too_large: count.too_large,
        })
    }

    /// Bytes that an inertia count beside `found` modes needs.
    pub(super) fn count_bytes(problem: &EigenProblem<'_>, analysis: &Analysis, found: usize) -> u64 {
        resident(count_bytes(problem, &analysis.peaks(rayon::current_num_threads()), found))
    }

    /// The same in double precision, where that fits.
    pub(super) fn in_double(
        problem: &EigenProblem<'_>,
        settings: &EigenSettings,
        analysis: &Analysis,
        wanted: usize,
    ) -> Result<Self, EigenFailure> {
        let settings = EigenSettings { factor: FactorChoice::Always(Precision::Double), ..*settings };
        Self::new(problem, &settings, analysis, wanted, false)
    }
}

impl std::fmt::Display for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.multigrid == Multigrid::Used {
            return write!(f, "no factor, cycles over groups of nodes, {} in all", gigabytes(self.bytes));
        }
        let precision = if self.precision == Precision::Double { "double" } else { "single" };
        let (factor, all) = (gigabytes(self.factor_bytes), gigabytes(self.bytes));
        write!(
            f,
            "factor of {factor} in {precision} precision, {:.2e} operations, {all} in all",
            self.flops
        )?;
        match (self.seconds / 60.0).round() {
            minutes if minutes >= 1.0 => write!(f, "; about {minutes} min for the modes on one processor"),
            _ => Ok(()),
        }
    }
}

/// What a process grows by that needs so many bytes. Beyond what is in use the allocator holds blocks given
/// back and not yet taken again (measured: 8 to 16 %), and begun pages of every size; each thread has its
/// own, and buffers of the dense products (measured on models of 18 000 degrees of freedom: 14 to 20 MB on one
/// thread, 34 to 48 MB on two).
fn resident(bytes: u64) -> u64 {
    bytes + bytes / 8 + 8_000_000 + 20_000_000 * rayon::current_num_threads() as u64
}

/// Bytes in GB, or MB where that is less.
pub(super) fn gigabytes(bytes: u64) -> String {
    if bytes < 1_000_000_000 {
        format!("{:.0} MB", bytes as f64 * 1e-6)
    } else {
        format!("{:.3} GB", bytes as f64 * 1e-9)
    }
}

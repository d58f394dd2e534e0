//! The eigenproblem to solve: its matrices, the settings of the search, its result, and the reasons why there are no
//! trustworthy modes.

use super::plan::Plan;
use super::refine::is_noisy;
use super::solve::Completeness;
use faer::{Mat, MatRef};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Cholesky, EliminationOrder, Peaks, Pencil, Solve, gram, subtract_combination, uniform,
};
use std::fmt;
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

/// Choice of the wanted modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// This number of lowest flexible modes.
    Lowest(usize),
    /// Every flexible mode with an eigenvalue below this value.
    Below(f64),
}

/// Guaranteed accuracy of the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accuracy {
    /// K-residual 1e-6; completeness is not proved.
    Fast,
    /// K-residual 1e-9 or the rounding floor of the matrices; completeness proved.
    #[default]
    Standard,
    /// K-residual 1e-12 or the rounding floor of the matrices; completeness proved from both sides; guaranteed bounds
    /// of every eigenvalue and, in a conversion, of the invariants.
    Certified,
}

impl Accuracy {
    /// Every accuracy, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Standard, Self::Certified];

    /// Returns the guaranteed K-residual |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|).
    pub fn residual(self) -> f64 {
        match self {
            Self::Fast => 1e-6,
            Self::Standard => 1e-9,
            Self::Certified => 1e-12,
        }
    }

    /// Returns the name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Standard => "standard",
            Self::Certified => "certified",
        }
    }

    /// Returns the accuracy of this name; `None` for an unknown name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }
}

/// Algorithm that computes the modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Dense for small models or when most modes are wanted, Lanczos otherwise.
    Auto,
    /// Dense generalised eigenproblem.
    Dense,
    /// Shift-invert block Lanczos with thick restart.
    Lanczos,
}

/// Settings of the eigen-solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EigenSettings {
    /// Wanted modes.
    pub wanted: Wanted,
    /// Accuracy of the modes.
    pub accuracy: Accuracy,
    /// Algorithm that computes the modes.
    pub method: Method,
    /// Requested precision of the factor.
    pub factor: FactorChoice,
    /// Number of multiplications and additions of a factorisation above which [`FactorChoice::Auto`] tries single
    /// precision for its speed.
    pub single_pays: f64,
    /// Number of multiplications and additions of a factorisation, per stored entry of K, above which modes are
    /// searched for without a factor if the choice is [`FactorChoice::Auto`]. [`Accuracy::Certified`] always uses a
    /// factor.
    pub multigrid_pays: f64,
}

impl EigenSettings {
    /// Default number of modes: the usual size of a modal basis.
    pub const DEFAULT_COUNT: usize = 20;
}

impl Default for EigenSettings {
    /// Returns the settings for 20 modes, proved complete, by the method that suits the size.
    fn default() -> Self {
        Self {
            wanted: Wanted::Lowest(Self::DEFAULT_COUNT),
            accuracy: Accuracy::default(),
            method: Method::Auto,
            factor: FactorChoice::default(),
            // Below this number, solving the columns of the corrections costs more than single precision saves.
            single_pays: 4e11,
            // Measured: a compact solid of 40,000 rows, a bar of 70,000. Thin bodies have cheaper factors, and more
            // deformation that no coarse level represents.
            multigrid_pays: 1.2e4,
        }
    }
}

/// Precision of the factor that the search solves with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// f64.
    Double,
    /// f32, with all residuals and projections in f64. It takes half the memory, and half the time where factorisation
    /// dominates.
    Single,
}

impl Precision {
    /// Returns the bytes of a number.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Double => 8,
            Self::Single => 4,
        }
    }
}

/// Requested precision of the factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FactorChoice {
    /// Single precision where double does not fit the memory, or where single is faster; double again if conditioning
    /// defeats single precision.
    #[default]
    Auto,
    /// Always this precision.
    Always(Precision),
}

impl FactorChoice {
    /// Every choice, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Always(Precision::Double), Self::Always(Precision::Single)];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Always(Precision::Double) => "f64",
            Self::Always(Precision::Single) => "f32",
        }
    }
}

/// Returns true when a K-residual keeps the guarantee: the tolerance, or 30 times the rounding floor (measured:
/// residuals of up to 6 times the estimate of the floor).
pub(super) fn keeps(residual: f64, floor: f64, tolerance: f64) -> bool {
    residual <= tolerance.max(30.0 * floor)
}

/// Guaranteed bounds of the eigenvalues of K and M as they are stored, at [`Accuracy::Certified`].
#[derive(Debug, Clone, PartialEq)]
pub struct EigenvalueBounds {
    /// Lower bounds, ascending: lower\[j\] <= lambda_j.
    pub lower: Vec<f64>,
    /// Upper bounds, ascending: lambda_j <= upper\[j\].
    pub upper: Vec<f64>,
    /// Upper bound of the distance of each mode to the exact eigenspace of its cluster, in the norm of M.
    pub shape_error: Vec<f64>,
    /// Shift between the rigid modes and the first flexible mode.
    pub shift_below: f64,
    /// Number of negative pivots of K - shift_below M: the number of rigid modes.
    pub pivots_below: usize,
}

impl EigenvalueBounds {
    /// Moves eigenvalues that lie outside their bounds onto them: the bounds have more digits than a projection in f64.
    pub(super) fn clamp(&self, eigenvalues: &mut [f64]) {
        for ((lambda, lower), upper) in eigenvalues.iter_mut().zip(&self.lower).zip(&self.upper) {
            *lambda = lambda.clamp(*lower, *upper);
        }
    }
}

/// Flexible modes, ascending, with their accuracy and the proof of completeness.
#[derive(Debug, Clone)]
pub struct EigenSolution {
    /// Eigenvalues lambda, ascending.
    pub eigenvalues: Vec<f64>,
    /// Modes (N x nf): M-orthonormal, M-orthogonal to the rigid modes.
    pub vectors: Mat<f64>,
    /// K-residual of each mode.
    pub residuals: Vec<f64>,
    /// K-residual of each mode that rounding alone explains.
    pub rounding_floors: Vec<f64>,
    /// Proof that no mode is missing, or the reason why there is none.
    pub completeness: Completeness,
    /// Attempts with memory and precision, as planned and as they ended; `None` for the dense path.
    pub plan: Option<Plan>,
    /// Bounds of the eigenvalues, at [`Accuracy::Certified`].
    pub bounds: Option<EigenvalueBounds>,
    /// First eigenvalue beyond the returned modes, if it was computed, at least roughly (for decisions about clusters
    /// and gaps).
    pub next_eigenvalue: Option<f64>,
    /// Number of flexible modes with a finite eigenvalue, if it is known (dense path).
    pub finite_modes: Option<usize>,
    /// Last shift tau of K + tau M.
    pub shift: f64,
}

impl EigenSolution {
    /// Returns the number of modes, of any origin, that are eigenvectors to the K-residual of `accuracy` or to
    /// rounding.
    pub fn eigenvectors(&self, accuracy: Accuracy) -> usize {
        let pairs = self.residuals.iter().zip(&self.rounding_floors);
        pairs.filter(|(residual, floor)| keeps(**residual, **floor, accuracy.residual())).count()
    }

    /// Returns true when rounding keeps a K-residual above the guarantee of [`Accuracy::Standard`]. Products of these
    /// modes with K in double precision then lose digits.
    pub fn is_noisy(&self) -> bool {
        is_noisy(&self.rounding_floors, Accuracy::Standard.residual())
    }
}

/// Reason why there is no trustworthy result.
#[derive(Debug, Clone)]
pub enum EigenFailure {
    /// Only `converged` of `wanted` modes converged within the allowed restarts or rounds.
    NotConverged {
        /// Number of converged modes.
        converged: usize,
        /// Number of requested modes.
        wanted: usize,
    },
    /// Failure of a search with a single-precision factor, where double precision was not allowed or does not fit the
    /// memory or time. The cause is often the precision and not the model.
    SinglePrecision(Box<EigenFailure>),
    /// K + tau M is not positive definite: K or M is indefinite.
    NotPositiveDefinite {
        /// The shift tau.
        shift: f64,
    },
    /// An eigenvalue is negative beyond noise.
    NegativeEigenvalue {
        /// The eigenvalue.
        eigenvalue: f64,
        /// Eigenvector (N x 1).
        vector: Mat<f64>,
    },
    /// M has a negative direction beyond rounding.
    MassIndefinite,
    /// Flexible modes without strain energy: a mechanism or several bodies.
    ZeroEnergy {
        /// Number of zero-energy modes beside the rigid ones.
        count: usize,
        /// Computed eigenvalues of the zero-energy modes.
        eigenvalues: Vec<f64>,
        /// Shapes of the resolved zero-energy modes (N x number of them).
        vectors: Mat<f64>,
    },
    /// The inertia count contradicts the number of modes found, also after a repeated search.
    CountDiffers {
        /// Number of modes found below the shift.
        found: usize,
        /// Number of modes below the shift by the count.
        counted: usize,
        /// The shift.
        shift: f64,
    },
    /// A factorisation is useless (element growth, overflow).
    Inaccurate {
        /// Relative residual or backward error that was found; NaN if there is none.
        residual: f64,
    },
    /// The modes are accurate, but no bounds of the eigenvalues can be guaranteed.
    NotCertified {
        /// The reason.
        why: &'static str,
    },
    /// The search needs more memory than is available.
    Memory {
        /// Bytes needed.
        bytes: u64,
        /// Bytes available.
        available: u64,
    },
    /// The search takes longer than the limit of the context.
    TooLong {
        /// Number of wanted modes, at most the number of flexible modes.
        wanted: usize,
        /// Seconds that the search takes, estimated for one processor.
        seconds: f64,
        /// Bytes needed.
        bytes: u64,
    },
    /// The pencil is too large for the 32-bit indices of the ordering.
    TooLarge,
}

impl fmt::Display for EigenFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConverged { converged, wanted } => write!(f, "{converged} of {wanted} modes converged"),
            Self::SinglePrecision(failure) => write!(f, "with a factor in single precision: {failure}"),
            Self::NotPositiveDefinite { shift } => {
                write!(f, "K + {shift:e} M is not positive definite: K or M is indefinite")
            }
            Self::NegativeEigenvalue { eigenvalue, .. } => {
                write!(f, "{eigenvalue:e} is a negative eigenvalue")
            }
            Self::MassIndefinite => write!(f, "M is indefinite"),
            Self::ZeroEnergy { count, .. } => {
                write!(f, "{count} modes have no strain energy besides the rigid ones")
            }
            Self::CountDiffers { found, counted, shift } => {
                write!(f, "{found} modes were found below {shift:e}, the inertia count is {counted}")
            }
            Self::Inaccurate { residual } => {
                write!(f, "the factor is inaccurate: its solutions have residuals of {residual:e}")
            }
            Self::NotCertified { why } => write!(f, "no bounds of the eigenvalues can be guaranteed: {why}"),
            Self::Memory { bytes, available } => {
                write!(f, "{bytes} bytes are needed, {available} are available")
            }
            Self::TooLong { wanted, seconds, .. } => write!(f, "{wanted} modes take about {seconds:.0} s"),
            Self::TooLarge => write!(f, "the pencil is too large for an ordering with 32-bit numbers"),
        }
    }
}

impl std::error::Error for EigenFailure {}

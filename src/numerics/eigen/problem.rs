//! What is asked of the eigen-solver and what it answers.

use super::plan::{FactorChoice, Plan};
use super::solve::keeps;
use super::{Completeness, Resume};
use crate::numerics::linalg::Pencil;
use faer::{Mat, MatRef};

/// K psi = lambda M psi on the M-orthogonal complement of the known rigid modes.
#[derive(Debug, Clone, Copy)]
pub struct EigenProblem<'a> {
    /// K and M.
    pub pencil: Pencil<'a>,
    /// Rigid modes (N x r), M-orthonormal: exact null vectors of K, projected out at every step.
    pub rigid: MatRef<'a, f64>,
    /// A Rayleigh quotient of some flexible field: an upper bound of the first flexible eigenvalue.
    pub first_estimate: f64,
    /// Relative error of the entries of K: half a unit of the last digit that the input carries.
    pub input_error: f64,
    /// Where an iterative search starts, and who keeps how far it came.
    pub resume: Resume<'a>,
}

/// Which modes are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// The lowest so many flexible modes.
    Lowest(usize),
    /// Every flexible mode with an eigenvalue below this one.
    Below(f64),
}

/// Promises about the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accuracy {
    /// K-residual 1e-6; completeness is not proved.
    Fast,
    /// K-residual 1e-9 or the rounding floor of the matrices; completeness proved.
    Standard,
    /// K-residual 1e-12 or the rounding floor; completeness proved from both sides; guaranteed bounds of every eigenvalue
    /// and, in a conversion, of the invariants.
    Certified,
}

impl Accuracy {
    /// K-residual |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) that is promised.
    pub fn residual(self) -> f64 {
        match self {
            Self::Fast => 1e-6,
            Self::Standard => 1e-9,
            Self::Certified => 1e-12,
        }
    }

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Standard => "standard",
            Self::Certified => "certified",
        }
    }
}

/// Which algorithm computes the modes.
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
    /// Which modes.
    pub wanted: Wanted,
    /// How good.
    pub accuracy: Accuracy,
    /// How.
    pub method: Method,
    /// Precision of the factor.
    pub factor: FactorChoice,
    /// Multiplications and additions of a factorisation above which [`FactorChoice::Auto`] tries single precision for its speed.
    pub single_pays: f64,
    /// Bytes that may be allocated on top of what is in use; `None`: as many as are needed.
    pub memory: Option<u64>,
    /// Seconds that the search may take by its estimate, without the factorisation; `None`: as many as it needs.
    pub longest: Option<f64>,
}

impl EigenSettings {
    /// Number of modes when nothing else is said: the usual size of a modal basis.
    pub const DEFAULT_COUNT: usize = 20;
}

impl Default for EigenSettings {
    /// 20 modes, proved, by the method that suits the size.
    fn default() -> Self {
        Self {
            wanted: Wanted::Lowest(Self::DEFAULT_COUNT),
            accuracy: Accuracy::Standard,
            method: Method::Auto,
            factor: FactorChoice::Auto,
            // Below, the columns that its corrections solve cost what the factorisation saves.
            single_pays: 4e11,
            memory: None,
            longest: None,
        }
    }
}

/// Work done, independent of the machine: snapshotted in tests, so that a slower algorithm fails without timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Numeric factorisations (Cholesky and inertia counts).
    pub factorizations: u64,
    /// Columns solved with the factor.
    pub solved_columns: u64,
    /// Columns multiplied by K.
    pub stiffness_columns: u64,
    /// Columns multiplied by M.
    pub mass_columns: u64,
    /// Thick restarts.
    pub restarts: u64,
    /// Ritz vectors taken from an earlier search.
    pub taken_up: u64,
    /// Numbers in one factor.
    pub factor_len: u64,
    /// Multiplications and additions of one factorisation.
    pub factor_flops: u64,
    /// Bytes of the factor that the modes were found with (0 for the dense path).
    pub factor_bytes: u64,
}

/// Guaranteed bounds of the eigenvalues of K and M as they are stored, at [`Accuracy::Certified`].
#[derive(Debug, Clone, PartialEq)]
pub struct EigenvalueBounds {
    /// lower\[j\] <= lambda_j, ascending.
    pub lower: Vec<f64>,
    /// lambda_j <= upper\[j\], ascending.
    pub upper: Vec<f64>,
    /// Upper bound of the distance of each mode to the exact eigenspace of its cluster, in the norm of M.
    pub shape_error: Vec<f64>,
    /// Shift between the rigid modes and the first flexible one.
    pub shift_below: f64,
    /// Negative pivots of K - shift_below M: the number of rigid modes.
    pub pivots_below: usize,
}

impl EigenvalueBounds {
    /// Moves eigenvalues that lie outside of their bounds onto them: the bounds know more digits than a projection in f64.
    pub(super) fn clamp(&self, eigenvalues: &mut [f64]) {
        for ((lambda, lower), upper) in eigenvalues.iter_mut().zip(&self.lower).zip(&self.upper) {
            *lambda = lambda.clamp(*lower, *upper);
        }
    }
}

/// Flexible modes, ascending.
#[derive(Debug, Clone)]
pub struct EigenSolution {
    /// lambda, ascending.
    pub eigenvalues: Vec<f64>,
    /// Modes (N x nf): M-orthonormal, M-orthogonal to the rigid modes.
    pub vectors: Mat<f64>,
    /// K-residual of each mode.
    pub residuals: Vec<f64>,
    /// K-residual that rounding alone explains, for each mode.
    pub rounding_floors: Vec<f64>,
    /// What is known about missed modes.
    pub completeness: Completeness,
    /// Memory and precision as decided (not on the dense path); the precision is the one used in the end.
    pub plan: Option<Plan>,
    /// Bounds of the eigenvalues, at [`Accuracy::Certified`].
    pub bounds: Option<EigenvalueBounds>,
    /// Eigenvalues that were computed beyond the last mode given, at least loosely (for cluster and gap decisions).
    pub next_eigenvalue: Option<f64>,
    /// Number of flexible modes with a finite eigenvalue, where it is known (dense path).
    pub finite_modes: Option<usize>,
    /// Shift tau of K + tau M that was used last.
    pub shift: f64,
    /// Work.
    pub counters: Counters,
}

impl EigenSolution {
    /// How many of the modes, wherever they come from, are eigenvectors to the K-residual of `accuracy` or to rounding.
    pub fn eigenvectors(&self, accuracy: Accuracy) -> usize {
        let pairs = self.residuals.iter().zip(&self.rounding_floors);
        pairs.filter(|(residual, floor)| keeps(**residual, **floor, accuracy.residual())).count()
    }
}

/// Why there is no trustworthy result.
#[derive(Debug, Clone)]
pub enum EigenFailure {
    /// `converged` of `wanted` modes converged within the allowed restarts.
    NotConverged {
        /// Modes that did converge.
        converged: usize,
        /// Modes asked for.
        wanted: usize,
    },
    /// What a search with a single-precision factor came to, where double precision was not allowed or does not fit: often it
    /// says nothing about the model.
    SinglePrecision(Box<EigenFailure>),
    /// K + tau M is not positive definite: K or M is indefinite.
    NotPositiveDefinite {
        /// The shift tau.
        shift: f64,
    },
    /// A negative eigenvalue beyond noise.
    NegativeEigenvalue {
        /// The eigenvalue.
        eigenvalue: f64,
        /// Its vector (N).
        vector: Mat<f64>,
    },
    /// M has a negative direction beyond rounding.
    MassIndefinite,
    /// Flexible modes without strain energy: a mechanism or several bodies.
    ZeroEnergy {
        /// How many beyond the rigid modes.
        count: usize,
        /// Their eigenvalues as computed.
        eigenvalues: Vec<f64>,
        /// Their shapes (N x as many as were resolved).
        vectors: Mat<f64>,
    },
    /// The inertia count contradicts the modes found, also after another search.
    CountDiffers {
        /// Modes found below the shift.
        found: usize,
        /// Modes that the count says there are.
        counted: usize,
        /// The shift.
        shift: f64,
    },
    /// A factorisation is useless (element growth, overflow).
    Inaccurate {
        /// Probe residual.
        residual: f64,
    },
    /// The modes are sound, but no bounds of the eigenvalues can be guaranteed.
    NotCertified {
        /// The reason.
        why: &'static str,
    },
    /// What is asked for needs more memory than there is.
    Memory {
        /// Bytes needed.
        bytes: u64,
        /// Bytes there are.
        available: u64,
    },
    /// What is asked for takes longer than it may.
    TooLong {
        /// Modes that are wanted, of those that there are.
        wanted: usize,
        /// Seconds that the search takes, estimated for one processor.
        seconds: f64,
        /// Bytes needed.
        bytes: u64,
    },
    /// The pencil is too large for the ordering's 32-bit numbers.
    TooLarge,
}

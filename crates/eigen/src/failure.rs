//! The answer of the eigen-solver where there are no modes to be trusted.

use faer::Mat;
use std::fmt;

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
    /// Failure of a search with a single-precision factor, where double precision was not allowed or does
    /// not fit: often it says nothing about the model.
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
        /// Number of such modes beside the rigid ones.
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
    /// The search needs more memory than there is.
    Memory {
        /// Bytes needed.
        bytes: u64,
        /// Bytes there are.
        available: u64,
    },
    /// The search takes longer than it may.
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
                write!(f, "{count} modes without strain energy beside the rigid ones")
            }
            Self::CountDiffers { found, counted, shift } => {
                write!(f, "{found} modes were found below {shift:e}, and {counted} are there")
            }
            Self::Inaccurate { residual } => {
                write!(f, "the factor is useless: its solutions have residuals of {residual:e}")
            }
            Self::NotCertified { why } => write!(f, "no bounds of the eigenvalues can be guaranteed: {why}"),
            Self::Memory { bytes, available } => {
                write!(f, "{bytes} bytes are needed, {available} are available")
            }
            Self::TooLong { wanted, seconds, .. } => write!(f, "{wanted} modes take some {seconds:.0} s"),
            Self::TooLarge => write!(f, "the pencil is too large for an ordering with 32-bit numbers"),
        }
    }
}

impl std::error::Error for EigenFailure {}

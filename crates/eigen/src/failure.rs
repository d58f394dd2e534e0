//! The reasons why there are no trustworthy modes.

use faer::Mat;
use std::fmt;

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

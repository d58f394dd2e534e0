//! Systems of differential equations, and reasons for an integration to end early.

use super::StageMode;

/// System of ordinary differential equations y' = f(t, y).
pub trait System {
    /// Returns the number of entries of y.
    fn dimension(&self) -> usize;

    /// Computes f(t, y).
    ///
    /// # Errors
    /// [`Failure::Rates`] if the equations have no solution at this state; an integrator with error control
    /// then tries a shorter step.
    fn rates(&mut self, time: f64, state: &[f64], rates: &mut [f64]) -> Result<(), Failure>;

    /// Writes the scale of the error of each entry at this state: all positive, in the units of the entry.
    /// A tolerance is the largest root mean square of error / scale that a step may add.
    fn scales(&self, state: &[f64], scales: &mut [f64]);

    /// Returns the stiff part of the system that implicit steps solve without iteration; the default is
    /// empty.
    fn oscillators(&self) -> &[Oscillator] {
        &[]
    }

    /// Filters the `residuals` of the stages of an implicit step of length h by a stiff linear part J
    /// of the system that is solved as a whole: replaces them by (I - h A kron J)^-1 `residuals`, with the
    /// matrix A of the method given by its eigenvalues. The default does nothing.
    ///
    /// Returns the root mean square of the corrections over the stages, relative to the motion, in a norm
    /// of the system. Such a norm is needed if entry-wise scales would weigh stiff and soft parts equally,
    /// although the stiff part is known less accurately. Returns `None` if the entry-wise scales are valid.
    ///
    /// # Errors
    /// Failures of the solution with the stiff part.
    fn correct_stages(
        &mut self,
        _h: f64,
        _modes: &[StageMode],
        _scales: &[f64],
        _residuals: &mut [Vec<f64>],
    ) -> Result<Option<f64>, Failure> {
        Ok(None)
    }

    /// Restores exact relations, such as the length of Euler parameters; called after every accepted step.
    fn settle(&self, _state: &mut [f64]) {}
}

/// Pair of entries with x' = p + ... and p' = -stiffness x - damping p + ..., where the other terms vary
/// slowly or little.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// Index of x.
    pub coordinate: usize,
    /// Index of p.
    pub momentum: usize,
    /// Square of the circular frequency.
    pub stiffness: f64,
    /// Decay rate of p.
    pub damping: f64,
}

/// Work of an integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Number of accepted steps.
    pub steps: u64,
    /// Number of rejected steps.
    pub rejected: u64,
    /// Number of evaluations of f(t, y).
    pub rates: u64,
}

/// Reason for an integration to fail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// f(t, y) does not exist.
    Rates {
        /// Reason as a lowercase fragment of a sentence.
        reason: &'static str,
    },
    /// The state is no longer finite.
    NotFinite {
        /// End of the last good step.
        time: f64,
    },
    /// No step length that the time can resolve meets the tolerance.
    StepTooSmall {
        /// End of the last good step.
        time: f64,
    },
    /// The equations of an implicit step were not solved.
    NotConverged {
        /// Start of the step.
        time: f64,
        /// Length of the step.
        step: f64,
    },
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rates { reason } => f.write_str(reason),
            Self::NotFinite { time } => write!(f, "the state is no longer finite after t = {time:e}"),
            Self::StepTooSmall { time } => {
                write!(
                    f,
                    "the step that meets the tolerance at t = {time:e} is too small for the resolution of time"
                )
            }
            Self::NotConverged { time, step } => {
                write!(f, "the equations of the implicit step of {step:e} from t = {time:e} did not converge")
            }
        }
    }
}

impl std::error::Error for Failure {}

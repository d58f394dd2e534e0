//! What is integrated, and why an integration ends early.

use super::StageMode;

/// A system of ordinary differential equations y' = f(t, y).
pub trait System {
    /// Number of entries of y.
    fn dimension(&self) -> usize;

    /// f(t, y).
    ///
    /// # Errors
    /// [`Failure::Rates`] where the equations have no solution at this state; an integrator with error
    /// control then tries a shorter step.
    fn rates(&mut self, time: f64, state: &[f64], rates: &mut [f64]) -> Result<(), Failure>;

    /// What an error of each entry is measured against at this state: all positive, in the units of the
    /// entry. A tolerance is the largest root mean square of error / scale that a step may add.
    fn scales(&self, state: &[f64], scales: &mut [f64]);

    /// The stiff part of the system that implicit steps solve without iterating; none unless the system knows
    /// one.
    fn oscillators(&self) -> &[Oscillator] {
        &[]
    }

    /// Sees what the stages of an implicit step of length h lack, `lacks`, through a stiff linear part J of
    /// the system that is solved as a whole: replaces it by (I - h A kron J)^-1 `lacks`, with the matrix A of
    /// the method given by its eigenvalues. Nothing unless the system has such a part.
    ///
    /// Returns the root mean square of the corrections over the stages in a norm of the system's own,
    /// relative to the motion, where its scales, entry by entry, would count as much what is stiff as what is
    /// soft and is known less closely; else `None`.
    ///
    /// # Errors
    /// Where that cannot be solved.
    fn correct_stages(
        &mut self,
        _h: f64,
        _modes: &[StageMode],
        _scales: &[f64],
        _lacks: &mut [Vec<f64>],
    ) -> Result<Option<f64>, Failure> {
        Ok(None)
    }

    /// Restores what holds exactly, as the length of Euler parameters; called after every step that is taken.
    fn settle(&self, _state: &mut [f64]) {}
}

/// A pair of entries with x' = p + ... and p' = -stiffness x - damping p + ..., where the rest varies slowly
/// or little.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// Index of x.
    pub coordinate: usize,
    /// Index of p.
    pub momentum: usize,
    /// Square of the circular frequency.
    pub stiffness: f64,
    /// Rate of decay of p.
    pub damping: f64,
}

/// What an integration has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Steps taken.
    pub steps: u64,
    /// Steps tried and not taken.
    pub rejected: u64,
    /// Evaluations of f(t, y).
    pub rates: u64,
}

/// Why an integration cannot go on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// f(t, y) does not exist: `reason` as a lowercase fragment.
    Rates {
        /// What is wrong with the state.
        reason: &'static str,
    },
    /// The state is no longer finite.
    NotFinite {
        /// End of the last good step.
        time: f64,
    },
    /// No step that time can still resolve meets the tolerance.
    StepTooSmall {
        /// End of the last good step.
        time: f64,
    },
    /// The equations of an implicit step were not solved.
    NotConverged {
        /// Start of the step.
        time: f64,
        /// Its length.
        step: f64,
    },
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rates { reason } => f.write_str(reason),
            Self::NotFinite { time } => write!(f, "the state is no longer finite after t = {time:e}"),
            Self::StepTooSmall { time } => {
                write!(f, "no step that time can resolve meets the tolerance at t = {time:e}")
            }
            Self::NotConverged { time, step } => {
                write!(f, "the equations of the implicit step of {step:e} from t = {time:e} were not solved")
            }
        }
    }
}

impl std::error::Error for Failure {}

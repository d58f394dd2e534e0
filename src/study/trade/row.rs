//! A candidate and what was found of it.

use super::Candidate;
use crate::base::diagnostic::Diagnostic;
use crate::motion::scene::OutputErrors;
use crate::numerics::integration::Work;

/// Times of a candidate. Unit: s.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Times {
    /// To make the body that it is of, where that is known.
    pub preprocessing: Option<f64>,
    /// Of one evaluation of the equations.
    pub evaluation: f64,
    /// Of the simulation.
    pub integration: f64,
}

/// What was found of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Largest errors, with the steps of the reference.
    pub errors: OutputErrors,
    /// Largest ratio of error to tolerance.
    pub worst: f64,
    /// [`ErrorHistory::growth`](crate::motion::scene::ErrorHistory::growth).
    pub growth: Option<f64>,
    /// Multiplications of one evaluation of the equations.
    pub multiplications: usize,
    /// Size of its file. Unit: bytes.
    pub bytes: u64,
    /// Work of its simulation, with the steps that a scene without a given step takes for it.
    pub work: Work,
    /// Times.
    pub times: Times,
}

/// Why there is nothing of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Failed(pub Diagnostic);

/// A candidate and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What it is.
    pub candidate: Candidate,
    /// What it is made of.
    pub source: String,
    /// Frequency of its last mode in hertz.
    pub last_frequency_hz: f64,
    /// What was measured.
    pub outcome: std::result::Result<Measured, Failed>,
}

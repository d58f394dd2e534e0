//! A candidate with its errors, cost and times.

use super::Candidate;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_motion::integration::Work;
use flexbody_motion::scene::OutputErrors;

/// What a candidate takes, one run after the other on one thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timed {
    /// Time of one evaluation of the equations, the longest of any load case. Unit: s.
    pub evaluation: f64,
    /// Time of the simulations of all load cases. Unit: s.
    pub integration: f64,
    /// Work of these, with the steps that a scene without a given step takes for the candidate.
    pub work: Work,
}

/// Errors of a candidate in a load case, or in a scene alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InCase {
    /// Largest errors, with the steps of the reference.
    pub errors: OutputErrors,
    /// Largest ratio of error to tolerance.
    pub worst: f64,
    /// [`ErrorHistory::growth`](flexbody_motion::scene::ErrorHistory::growth).
    pub growth: Option<f64>,
}

/// Errors, cost and times of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Errors in every load case; of a scene alone there is one.
    pub by_case: Vec<InCase>,
    /// The case (from 0) with the largest ratio of error to tolerance.
    pub case: usize,
    /// Cases whose errors are beyond what the reference leaves of their tolerances.
    pub beyond: usize,
    /// Multiplications of one evaluation of the equations, the most of any case.
    pub multiplications: usize,
    /// Size of its file. Unit: bytes.
    pub bytes: u64,
    /// Time to make the body that it is of, where that is known. Unit: s.
    pub preprocessing: Option<f64>,
    /// Of those that somebody may take: the reference, the front and the recommended one.
    pub timed: Option<Timed>,
}

impl Measured {
    /// Whether the errors of every case are within what the reference leaves of its tolerances.
    pub fn holds(&self) -> bool {
        self.beyond == 0
    }

    /// The errors in the case where they are largest beside the tolerances.
    pub fn deciding(&self) -> &InCase {
        &self.by_case[self.case]
    }

    /// Largest ratio of error to tolerance in any case.
    pub fn worst(&self) -> f64 {
        self.deciding().worst
    }
}

/// The diagnostic for a candidate that could not be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Failed(pub Diagnostic);

/// A candidate and its measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeRow {
    /// Modes, groups and precision of the body.
    pub candidate: Candidate,
    /// Name of the source that it is made of.
    pub source: String,
    /// Frequency of its last mode in hertz.
    pub last_frequency_hz: f64,
    /// The measurement, or the reason why there is none.
    pub outcome: std::result::Result<Measured, Failed>,
}

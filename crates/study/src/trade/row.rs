//! Row of a study: a candidate with its errors, cost and times.

use super::Candidate;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::integration::Work;
use flexbody_motion::scene::{ModeStart, OutputErrors, Scheme};

/// Errors of a candidate in a load case, or in a single scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InCase {
    /// Largest errors, with the steps of the reference.
    pub errors: OutputErrors,
    /// Largest ratio of error to tolerance.
    pub worst: f64,
    /// Growth of the errors over the run, see [`ErrorHistory::growth`](flexbody_motion::scene::ErrorHistory::growth).
    pub growth: Option<f64>,
}

/// Simulation of a candidate in a load case: errors and time of the same run.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedRun {
    /// Method with the cheapest accuracy that meets what is left of the tolerances.
    pub scheme: Scheme,
    /// Errors of the run, of the reduction and of its time integration together.
    pub errors: InCase,
    /// Duration of the run. Unit: s.
    pub seconds: f64,
    /// Steps and evaluations of the run.
    pub work: Work,
    /// Initial values of the modes of the candidate's own body, where the scene states those of the reference.
    pub start: Vec<ModeStart>,
}

/// Times of a candidate, measured one after the other on one thread.
#[derive(Debug, Clone, PartialEq)]
pub struct Timed {
    /// Time of one evaluation of the equations, the longest of any load case. Unit: s.
    pub evaluation: f64,
    /// Cheapest run within the tolerances in every load case.
    pub runs: Vec<TimedRun>,
}

impl Timed {
    /// Returns the time of the runs of all load cases. Unit: s.
    pub fn seconds(&self) -> f64 {
        self.runs.iter().map(|run| run.seconds).sum()
    }

    /// Returns the work of the runs of all load cases.
    pub fn work(&self) -> Work {
        self.runs.iter().fold(Work::default(), |all, run| Work {
            steps: all.steps + run.work.steps,
            rejected: all.rejected + run.work.rejected,
            rates: all.rates + run.work.rates,
        })
    }

    /// Returns the largest ratio of error to tolerance of these runs.
    pub fn worst(&self) -> f64 {
        self.decisive().errors.worst
    }

    /// Returns the run with the largest ratio of error to tolerance, the first of equal ones.
    pub fn decisive(&self) -> &TimedRun {
        first_largest(&self.runs, |run| run.errors.worst).expect("a load case")
    }
}

/// Errors of a candidate in the variations of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct InVariations {
    /// Errors in each variation; `None` where its simulation stopped.
    pub by_variation: Vec<Option<InCase>>,
    /// Index of the variation with the largest ratio of error to tolerance.
    pub variation: usize,
    /// Largest ratio of error to tolerance; infinite if a simulation stopped.
    pub worst: f64,
    /// Number of variations whose errors exceed the tolerances that the reference leaves.
    pub beyond: usize,
}

/// Errors, cost and times of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Errors in every load case; one entry for a single scene.
    pub by_case: Vec<InCase>,
    /// Index (from 0) of the load case with the largest ratio of error to tolerance.
    pub case: usize,
    /// Number of load cases whose errors exceed the tolerances that the reference leaves.
    pub beyond: usize,
    /// Multiplications of one evaluation of the equations, the largest of any case.
    pub multiplications: usize,
    /// Size of the file of the body. Unit: bytes.
    pub bytes: u64,
    /// Time to make the source body; `None` if unknown. Unit: s.
    pub preprocessing: Option<f64>,
    /// Errors in variations of the scene; `None` if the candidate was not judged on any.
    pub varied: Option<InVariations>,
    /// Times, for candidates that may be chosen: the reference, the front and the recommended one.
    pub timed: Option<Timed>,
}

impl Measured {
    /// Returns true if the errors of every case are within the tolerances that the reference leaves.
    pub fn holds(&self) -> bool {
        self.beyond == 0
    }

    /// Returns the errors in the case with the largest ratio of error to tolerance.
    pub fn decisive_case(&self) -> &InCase {
        &self.by_case[self.case]
    }

    /// Returns the largest ratio of error to tolerance in any case.
    pub fn worst(&self) -> f64 {
        self.decisive_case().worst
    }

    /// Returns true if the errors of every variation are within the tolerances, or if none was judged.
    pub fn holds_in_variations(&self) -> bool {
        self.varied.as_ref().is_none_or(|varied| varied.beyond == 0)
    }
}

/// Diagnostic of a candidate that could not be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Failed(pub Diagnostic);

/// Candidate and its measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeRow {
    /// Modes, groups and precision of the body.
    pub candidate: Candidate,
    /// Name of the source that the candidate is made of.
    pub source: String,
    /// Frequency of its last mode, in hertz.
    pub last_frequency_hz: f64,
    /// Measurement, or the reason why there is none.
    pub outcome: std::result::Result<Measured, Failed>,
}

//! Candidate with its errors, cost and times; the Pareto front and the best of the candidates.

use super::{Candidate, InVariations, TimedRun};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_linalg::ties::{TIE_MARGIN, first_largest, first_smallest, sort_ascending};
use flexbody_motion::integration::Work;
use flexbody_motion::scene::OutputErrors;

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

/// Recommended candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recommendation {
    /// Index of the cheapest row within every tolerance.
    Cheapest(usize),
    /// Index of the most accurate row within the allowed multiplications.
    MostAccurate(usize),
    /// No candidate is within the tolerances, or none is as cheap as allowed.
    None,
}

impl Recommendation {
    /// Returns the index of the recommended row.
    pub fn row(self) -> Option<usize> {
        match self {
            Self::Cheapest(row) | Self::MostAccurate(row) => Some(row),
            Self::None => None,
        }
    }

    /// Chooses from `rows`: the cheapest within the tolerances or, if the scene states `allowed` multiplications, the
    /// most accurate within these.
    pub(super) fn new(rows: &[TradeRow], allowed: Option<usize>) -> Self {
        let points = points(rows);
        match allowed {
            Some(allowed) => {
                let within = points.iter().filter(|point| point.0 <= allowed);
                let best = first_smallest(within, |point| point.1);
                best.map_or(Self::None, |point| Self::MostAccurate(point.2))
            }
            None => Self::cheapest(rows, |measured| measured.holds()),
        }
    }

    /// Chooses the cheapest of `rows` that `is_enough` accepts.
    pub(super) fn cheapest(rows: &[TradeRow], is_enough: impl Fn(&Measured) -> bool) -> Self {
        let enough = |row: usize| rows[row].outcome.as_ref().is_ok_and(&is_enough);
        let cheapest = points(rows).into_iter().find(|point| enough(point.2));
        cheapest.map_or(Self::None, |point| Self::Cheapest(point.2))
    }
}

/// Returns the rows (from 0) whose errors are within every tolerance of the scene, ascending in cost.
pub(super) fn holding(rows: &[TradeRow]) -> Vec<usize> {
    let holds = |point: &(usize, f64, usize)| rows[point.2].outcome.as_ref().is_ok_and(Measured::holds);
    points(rows).into_iter().filter(holds).map(|point| point.2).collect()
}

/// Returns the rows (from 0) of the Pareto front of multiplications per evaluation and the largest ratio of error to
/// tolerance, ascending in cost. Multiplications represent the time of an evaluation, so that the front does not depend
/// on the machine and its load.
pub fn front(rows: &[TradeRow]) -> Vec<usize> {
    let mut best = f64::INFINITY;
    let better = |point: &(usize, f64, usize)| {
        let better = point.1 < best * (1.0 - TIE_MARGIN);
        if better {
            best = point.1;
        }
        better
    };
    points(rows).into_iter().filter(better).map(|point| point.2).collect()
}

/// Returns (multiplications, worst ratio, row) of all measured candidates, ascending. Lumped masses are left out: they
/// serve for comparison and cost as much as the consistent mass.
fn points(rows: &[TradeRow]) -> Vec<(usize, f64, usize)> {
    let point = |(at, row): (usize, &TradeRow)| {
        let measured = row.outcome.as_ref().ok().filter(|_| row.candidate.lumped.is_none())?;
        Some((measured.multiplications, measured.worst(), at))
    };
    let mut points: Vec<_> = rows.iter().enumerate().filter_map(point).collect();
    points.sort_by_key(|point| (point.0, point.2));
    for of_one_cost in points.chunk_by_mut(|a, b| a.0 == b.0) {
        sort_ascending(of_one_cost, |point| point.1);
    }
    points
}

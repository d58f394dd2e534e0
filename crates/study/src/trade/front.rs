//! The Pareto front and the best of the candidates.

use super::{Measured, TradeRow};
use flexbody_linalg::ties::{TIE_MARGIN, first_smallest, sort_ascending};

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

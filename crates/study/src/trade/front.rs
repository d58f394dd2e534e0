//! The best of the candidates.

use super::{Measured, TradeRow};

/// The candidate to take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recommendation {
    /// This row is the cheapest that holds every tolerance.
    Cheapest(usize),
    /// This row is the most accurate that the allowed multiplications pay for.
    MostAccurate(usize),
    /// No candidate holds the tolerances, or none is as cheap as allowed.
    None,
}

impl Recommendation {
    /// The row.
    pub fn row(self) -> Option<usize> {
        match self {
            Self::Cheapest(row) | Self::MostAccurate(row) => Some(row),
            Self::None => None,
        }
    }

    /// Of `rows`, with the multiplications that the scene allows instead of tolerances.
    pub(super) fn new(rows: &[TradeRow], allowed: Option<usize>) -> Self {
        let points = points(rows);
        match allowed {
            Some(allowed) => {
                let within = points.iter().filter(|point| point.0 <= allowed);
                let best =
                    within.min_by(|a, b| (a.1.total_cmp(&b.1)).then(a.0.cmp(&b.0)).then(a.2.cmp(&b.2)));
                best.map_or(Self::None, |point| Self::MostAccurate(point.2))
            }
            None => Self::cheapest(rows, |measured| measured.holds()),
        }
    }

    /// The cheapest of `rows` that is good enough.
    pub(super) fn cheapest(rows: &[TradeRow], is_enough: impl Fn(&Measured) -> bool) -> Self {
        let enough = |row: usize| rows[row].outcome.as_ref().is_ok_and(&is_enough);
        let cheapest = points(rows).into_iter().find(|point| enough(point.2));
        cheapest.map_or(Self::None, |point| Self::Cheapest(point.2))
    }
}

/// Rows (from 0) that no other is cheaper than and as accurate as, ascending in cost: the Pareto front of
/// multiplications per evaluation and the largest ratio of error to tolerance. Multiplications stand for the
/// time of an evaluation, which is their number but for what clocks add: the front does not depend on the
/// machine and its load.
pub fn front(rows: &[TradeRow]) -> Vec<usize> {
    let mut best = f64::INFINITY;
    let better = |point: &(usize, f64, usize)| {
        let better = point.1 < best;
        if better {
            best = point.1;
        }
        better
    };
    points(rows).into_iter().filter(better).map(|point| point.2).collect()
}

/// (multiplications, worst ratio, row) of what was measured, ascending. A lumped mass is there to be compared
/// with: it costs what the consistent one does.
fn points(rows: &[TradeRow]) -> Vec<(usize, f64, usize)> {
    let point = |(at, row): (usize, &TradeRow)| {
        let measured = row.outcome.as_ref().ok().filter(|_| row.candidate.lumped.is_none())?;
        Some((measured.multiplications, measured.worst(), at))
    };
    let mut points: Vec<_> = rows.iter().enumerate().filter_map(point).collect();
    points.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    points
}

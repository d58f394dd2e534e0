//! Instants at which the truncation error is evaluated along a motion.

use super::compressed::MOST_FORCES;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::largest;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::{Scene, Trace, fastest_history, highest_excited_rate};
use std::f64::consts::TAU;
use std::ops::Range;

/// Smallest number of intervals of a motion.
const MIN_INTERVALS: usize = 120;

/// Largest number of amplitudes of modes and forces at all instants together: about 1.5 GB with their rates,
/// accelerations and derived arrays. A larger value follows longer motions and needs more memory.
const MOST_AMPLITUDES: usize = 15_000_000;

/// Number of forces with amplitudes: the compressed forces, and as many again for inertia and resonances.
const FORCES: usize = 2 * MOST_FORCES;

/// Intervals per period of the fastest motion that counts. The second derivative of a spline through an oscillation is
/// then accurate to 2 %.
const PER_PERIOD: f64 = 12.0;

/// Smallest number of intervals per period: the second derivative of the spline is accurate to 5 %.
const FEWEST_PER_PERIOD: f64 = 8.0;

/// Smallest number of intervals between two breaks.
const MIN_INTERVALS_PER_PIECE: usize = 3;

/// Modes count if the root of their elastic energy is at least this part of the tolerances.
const MIN_MODE_SHARE: f64 = 0.1;

/// Size of a history, relative to the largest one in its unit, up to which it is rounding, whose largest instant is
/// arbitrary: components that are zero by symmetry are 1e-16 to 1e-12.
const ROUNDING_HISTORY: f64 = 1e-9;

/// Stretches between breaks are ignored if they are shorter than this part of the run.
const SHORTEST: f64 = 1e-9;

/// Distance of the last instant of a stretch from the break after it, as a part of the last interval.
const BEFORE: f64 = 1e-3;

/// Instants of a motion in ascending order, in pieces without a break.
pub(super) struct Grid {
    pub times: Vec<f64>,
    /// Indices of the instants of every piece. The first instant is at the break before the piece, the last lies just
    /// before the next break.
    pub pieces: Vec<Range<usize>>,
}

impl Grid {
    /// Builds the grid for the `motion` of a `body`. Returns `None` if too many instants were needed to resolve all
    /// oscillations and all stretches between breaks.
    pub(super) fn new(body: &FlexBody, scene: &Scene, motion: &Trace, duration: f64) -> Option<Self> {
        let frequency = (highest_excited_rate(body, scene, motion, MIN_MODE_SHARE) / TAU)
            .max(fastest_history(scene, duration));
        let wanted = PER_PERIOD * frequency * duration;
        let most = (MOST_AMPLITUDES / (body.n_modes() + FORCES)).max(MIN_INTERVALS);
        let stretches = stretches(&scene.breaks(), duration);
        let for_periods = FEWEST_PER_PERIOD / PER_PERIOD * wanted;
        if for_periods > most as f64 || (MIN_INTERVALS_PER_PIECE + 1) * stretches.len() > most {
            return None;
        }
        // Distribute the intervals over the stretches by length.
        let intervals = wanted.clamp(MIN_INTERVALS as f64, most as f64);
        let (mut times, mut pieces) = (Vec::new(), Vec::new());
        for (start, end) in stretches {
            let length = end - start;
            let count = (intervals * length / duration).ceil().max(MIN_INTERVALS_PER_PIECE as f64) as usize;
            let last = if end < duration { end - BEFORE * length / count as f64 } else { end };
            let first = times.len();
            times.extend((0..count).map(|i| start + length * (i as f64 / count as f64)));
            times.push(last);
            pieces.push(first..times.len());
        }
        Some(Self { times, pieces })
    }

    /// Returns indices of about [`MIN_INTERVALS`] evenly spaced instants, and of the instants where one of the `histories` (one
    /// value per instant, all in one unit) is largest. Short shocks are therefore included.
    pub(super) fn few(&self, histories: Vec<Vec<f64>>) -> Vec<usize> {
        self.significant_instants(MIN_INTERVALS + 1, &[histories])
    }

    /// Returns indices of about `count` evenly spaced instants, and of the instants where a history is largest. Each group
    /// holds histories in one unit; those that stay below [`ROUNDING_HISTORY`] of the largest of their group do not count.
    pub(super) fn significant_instants(&self, count: usize, groups: &[Vec<Vec<f64>>]) -> Vec<usize> {
        let stride = self.times.len().div_ceil(count);
        let mut all: Vec<usize> = (0..self.times.len()).step_by(stride).collect();
        all.extend(self.times.len().checked_sub(1));
        for histories in groups {
            let size = |history: &Vec<f64>| largest(history.iter().map(|value| value.abs()));
            let sizes: Vec<f64> = histories.iter().map(size).collect();
            let least = ROUNDING_HISTORY * largest(sizes.iter().copied());
            let counted = histories.iter().zip(&sizes).filter(|(_, size)| **size > least);
            all.extend(
                counted.filter_map(|(history, _)| first_largest(0..history.len(), |&at| history[at].abs())),
            );
        }
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// Returns the stretches between the breaks of a run, as start and end times.
fn stretches(breaks: &[f64], duration: f64) -> Vec<(f64, f64)> {
    let mut ends = vec![0.0];
    for &time in breaks {
        let shortest = SHORTEST * duration;
        if time > ends[ends.len() - 1] + shortest && time < duration - shortest {
            ends.push(time);
        }
    }
    ends.push(duration);
    ends.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn breaks_part_a_run_unless_they_are_none() {
        assert_eq!(stretches(&[], 2.0), vec![(0.0, 2.0)]);
        assert_eq!(stretches(&[-1.0, 0.0, 0.5, 0.5 + 1e-10, 2.0, 3.0], 2.0), vec![(0.0, 0.5), (0.5, 2.0)]);
        let many: Vec<f64> = (1..100).map(|i| 0.01 * f64::from(i)).collect();
        assert_eq!(stretches(&many, 1.0).len(), 100);
    }
}

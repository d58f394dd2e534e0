//! The instants that a motion is looked at, to see what the body lacks along it.

use super::compressed::MOST_FORCES;
use flexbody_body::flex_body::FlexBody;
use flexbody_motion::scene::{Scene, Trace, fastest_history, liveliest_rate};
use std::f64::consts::TAU;
use std::ops::Range;

/// Intervals at the least.
const LEAST: usize = 120;

/// Amplitudes of modes and forces at all instants at the most: about 1.5 GB with their rates, their accelerations
/// and what is made of them.
const MOST_AMPLITUDES: usize = 15_000_000;

/// Forces that amplitudes are needed of: those that are compressed, and as many again of inertia and resonances.
const FORCES: usize = 2 * MOST_FORCES;

/// Intervals in the period of the fastest motion that counts, and the fewest that show it: a spline through
/// so many values of an oscillation has its second derivative to 2 %, and to 5 %.
const PER_PERIOD: f64 = 12.0;
const FEWEST_PER_PERIOD: f64 = 8.0;

/// Intervals between two breaks at the least.
const PER_PIECE: usize = 3;

/// Modes whose root of the elastic energy is below this part of the tolerances do not count.
const COUNTS: f64 = 0.1;

/// Stretches between breaks that are shorter than this part of the run are none.
const SHORTEST: f64 = 1e-9;

/// How far before a break the motion is looked at, as a part of the stretch that ends there.
const BEFORE: f64 = 1e-3;

/// Instants of a motion, ascending, in pieces without a break.
pub(super) struct Grid {
    pub times: Vec<f64>,
    /// Instants of every piece: the first is that of the break before it, the last lies just before the next.
    pub pieces: Vec<Range<usize>>,
}

impl Grid {
    /// For the `motion` of a `body`; `None` where it would take more instants than can be looked at to see all
    /// oscillations and everything between two breaks.
    pub(super) fn new(body: &FlexBody, scene: &Scene, motion: &Trace, duration: f64) -> Option<Self> {
        let frequency =
            (liveliest_rate(body, scene, motion, COUNTS) / TAU).max(fastest_history(scene, duration));
        let wanted = PER_PERIOD * frequency * duration;
        let most = (MOST_AMPLITUDES / (body.n_modes() + FORCES)).max(LEAST);
        let stretches = stretches(&scene.breaks(), duration);
        let for_periods = FEWEST_PER_PERIOD / PER_PERIOD * wanted;
        if for_periods > most as f64 || (PER_PIECE + 1) * stretches.len() > most {
            return None;
        }
        let intervals = wanted.clamp(LEAST as f64, most as f64);
        let (mut times, mut pieces) = (Vec::new(), Vec::new());
        for (start, end) in stretches {
            let length = end - start;
            let count = (intervals * length / duration).ceil().max(PER_PIECE as f64) as usize;
            let last = if end < duration { end - BEFORE * length / count as f64 } else { end };
            let first = times.len();
            times.extend((0..count).map(|i| start + length * (i as f64 / count as f64)));
            times.push(last);
            pieces.push(first..times.len());
        }
        Some(Self { times, pieces })
    }

    /// About as many of the instants as there are at the least, evenly, and those where any of the `histories`, one
    /// value for every instant, is largest: no blow is missed, however short it is.
    pub(super) fn few(&self, histories: impl Iterator<Item = Vec<f64>>) -> Vec<usize> {
        self.telling(LEAST + 1, histories)
    }

    /// The same with about `count` of the instants.
    pub(super) fn telling(&self, count: usize, histories: impl Iterator<Item = Vec<f64>>) -> Vec<usize> {
        let stride = self.times.len().div_ceil(count);
        let mut all: Vec<usize> = (0..self.times.len()).step_by(stride).collect();
        all.extend(self.times.len().checked_sub(1));
        all.extend(histories.filter_map(|history| {
            (0..history.len()).max_by(|&a, &b| history[a].abs().total_cmp(&history[b].abs()))
        }));
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// The stretches between the breaks of a run.
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

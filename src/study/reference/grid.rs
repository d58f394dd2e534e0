//! The instants that a motion is looked at, to see what the body lacks along it.

use super::compressed::MOST_FORCES;
use crate::body::flex_body::FlexBody;
use crate::motion::scene::{Scene, Trace, fastest_history, liveliest_rate};
use std::f64::consts::TAU;
use std::ops::Range;

/// Intervals at the least.
const LEAST: usize = 120;

/// Amplitudes of modes and compressed forces at all instants at the most: about 1.5 GB with their rates,
/// their accelerations and what is made of them.
const MOST_AMPLITUDES: usize = 15_000_000;

/// Intervals in the period of the fastest motion that counts, and the fewest that show it: a spline through
/// so many values of an oscillation has its second derivative to 2 %, and to 5 %.
const PER_PERIOD: f64 = 12.0;
const FEWEST_PER_PERIOD: f64 = 8.0;

/// Modes whose root of the elastic energy is below this part of the tolerances do not count.
const COUNTS: f64 = 0.1;

/// Stretches between breaks that are shorter than this part of the run are none, and more breaks than these
/// are looked over.
const SHORTEST: f64 = 1e-6;
const MOST_BREAKS: usize = 40;

/// How far before a break the motion is looked at, as a part of the run.
const BEFORE: f64 = 1e-9;

/// Instants of a motion, ascending, in pieces without a break.
pub(super) struct Grid {
    pub times: Vec<f64>,
    /// Instants of every piece: the first is that of the break before it, the last lies just before the next.
    pub pieces: Vec<Range<usize>>,
    /// Whether the motion is smooth between the instants; where it is too fast for that, only its size is
    /// seen.
    pub is_fine: bool,
}

impl Grid {
    /// For the `motion` of a `body`.
    pub fn new(body: &FlexBody, scene: &Scene, motion: &Trace, duration: f64) -> Self {
        let frequency =
            (liveliest_rate(body, scene, motion, COUNTS) / TAU).max(fastest_history(scene, duration));
        let wanted = PER_PERIOD * frequency * duration;
        let most = (MOST_AMPLITUDES / (body.n_modes() + MOST_FORCES)).max(LEAST);
        let is_fine = FEWEST_PER_PERIOD / PER_PERIOD * wanted <= most as f64;
        let intervals = wanted.clamp(LEAST as f64, most as f64);
        let (mut times, mut pieces) = (Vec::new(), Vec::new());
        for (start, end) in stretches(&scene.breaks(), duration) {
            let count = (intervals * (end - start) / duration).ceil().max(3.0) as usize;
            let last = if end < duration { end - BEFORE * duration } else { end };
            let first = times.len();
            times.extend((0..count).map(|i| start + (end - start) * (i as f64 / count as f64)));
            times.push(last);
            pieces.push(first..times.len());
        }
        Self { times, pieces, is_fine }
    }

    /// About as many of the instants as there are at the least, the ends of all pieces among them.
    pub fn few(&self) -> Vec<usize> {
        self.at_most(LEAST + 1)
    }

    /// About so many of the instants, evenly, with the ends of all pieces.
    pub fn at_most(&self, count: usize) -> Vec<usize> {
        let stride = self.times.len().div_ceil(count);
        let is_end = |i: &usize| self.pieces.iter().any(|piece| piece.start == *i || piece.end == *i + 1);
        (0..self.times.len()).filter(|i| i % stride == 0 || is_end(i)).collect()
    }
}

/// What lies between the breaks of a run.
fn stretches(breaks: &[f64], duration: f64) -> Vec<(f64, f64)> {
    let mut ends = vec![0.0];
    for &time in breaks {
        let shortest = SHORTEST * duration;
        if time > ends[ends.len() - 1] + shortest && time < duration - shortest {
            ends.push(time);
        }
    }
    if ends.len() > MOST_BREAKS {
        ends.truncate(1);
    }
    ends.push(duration);
    ends.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn breaks_part_a_run_unless_they_are_no_breaks_or_too_many() {
        assert_eq!(stretches(&[], 2.0), vec![(0.0, 2.0)]);
        assert_eq!(stretches(&[-1.0, 0.0, 0.5, 0.5 + 1e-9, 2.0, 3.0], 2.0), vec![(0.0, 0.5), (0.5, 2.0)]);
        let many: Vec<f64> = (1..100).map(|i| 0.01 * f64::from(i)).collect();
        assert_eq!(stretches(&many, 1.0), vec![(0.0, 1.0)]);
    }
}

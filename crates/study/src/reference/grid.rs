//! Instants at which the truncation error is evaluated along a motion.

use super::compressed::MOST_FORCES;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::largest;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::{ExcitedRates, Scene, Trace, fastest_history};
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

/// Part of the length of a window before and after it whose motion counts as well.
const PADDING: f64 = 0.25;

/// Largest number of halvings of a stretch.
const MOST_HALVINGS: usize = 12;

/// Number of intervals up to which a window is not parted.
const WORTH_PARTING: f64 = 64.0;

/// Part of the intervals of a window that its parts may need.
const SAVES: f64 = 0.67;

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
    /// Number of instants that the run would have with the spacing of its fastest window throughout.
    pub at_finest: usize,
}

/// Stretch of a run without a break, and the frequency that its instants must follow.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Window {
    start: f64,
    end: f64,
    frequency: f64,
}

impl Window {
    /// Returns the number of intervals that follow all oscillations of the window.
    fn intervals(&self) -> f64 {
        PER_PERIOD * self.frequency * (self.end - self.start)
    }
}

impl Grid {
    /// Builds the grid for the `motion` of a `body`. Returns `None` if too many instants were needed to resolve all
    /// oscillations and all stretches between breaks.
    ///
    /// The spacing is that of the fastest motion in the run. If this takes too many instants, the run is parted where
    /// oscillations decay or begin, and each window has the spacing of its own motion.
    pub(super) fn new(body: &FlexBody, scene: &Scene, motion: &Trace, duration: f64) -> Option<Self> {
        let excited = ExcitedRates::new(body, scene, motion, MIN_MODE_SHARE);
        let of_histories = fastest_history(scene, duration);
        let window = |start: f64, end: f64| {
            let around = PADDING * (end - start);
            let frequency = (excited.between(start - around, end + around) / TAU).max(of_histories);
            Window { start, end, frequency }
        };
        let frequency = window(0.0, duration).frequency;
        let most = (MOST_AMPLITUDES / (body.n_modes() + FORCES)).max(MIN_INTERVALS);
        let stretches = stretches(&scene.breaks(), duration);
        let whole = |(start, end)| Window { start, end, frequency };
        let one_spacing = stretches.iter().copied().map(whole).collect();
        Self::of_windows(one_spacing, most, duration).or_else(|| {
            let parted = stretches
                .iter()
                .flat_map(|(start, end)| parted(window(*start, *end), &window, MOST_HALVINGS));
            Self::of_windows(parted.collect(), most, duration)
        })
    }

    /// Returns the instants of windows; `None` if they were more than `most`.
    fn of_windows(windows: Vec<Window>, most: usize, duration: f64) -> Option<Self> {
        let wanted: f64 = windows.iter().map(Window::intervals).sum();
        let for_periods = FEWEST_PER_PERIOD / PER_PERIOD * wanted;
        if for_periods > most as f64 || (MIN_INTERVALS_PER_PIECE + 1) * windows.len() > most {
            return None;
        }
        let part = (most as f64 / wanted).min(1.0);
        let count = |window: &Window| {
            let evenly = MIN_INTERVALS as f64 * ((window.end - window.start) / duration);
            (part * window.intervals()).max(evenly).ceil().max(MIN_INTERVALS_PER_PIECE as f64) as usize
        };
        let (mut times, mut pieces) = (Vec::new(), Vec::new());
        for window in &windows {
            let &Window { start, end, .. } = window;
            let (length, count) = (end - start, count(window));
            let last = if end < duration { end - BEFORE * length / count as f64 } else { end };
            let first = times.len();
            times.extend((0..count).map(|i| start + length * (i as f64 / count as f64)));
            times.push(last);
            pieces.push(first..times.len());
        }
        let fastest = windows.iter().map(|window| window.frequency).fold(0.0, f64::max);
        let at_finest = (part * PER_PERIOD * fastest * duration).min(u32::MAX.into()) as usize;
        let at_finest = at_finest.max(times.len());
        Some(Self { times, pieces, at_finest })
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

/// Parts a window by halving, at most `halvings` times, where this saves a third of the instants. `window` returns the window
/// between two times.
fn parted(whole: Window, window: &impl Fn(f64, f64) -> Window, halvings: usize) -> Vec<Window> {
    if halvings == 0 || whole.intervals() <= WORTH_PARTING {
        return vec![whole];
    }
    let Window { start, end, .. } = whole;
    let middle = 0.5 * (start + end);
    let halves = [window(start, middle), window(middle, end)];
    let parts: Vec<Window> = halves.into_iter().flat_map(|half| parted(half, window, halvings - 1)).collect();
    let intervals = |windows: &[Window]| windows.iter().map(Window::intervals).sum::<f64>();
    if intervals(&parts) < SAVES * whole.intervals() { parts } else { vec![whole] }
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

    /// An oscillation of 1 kHz during 4 ms in the middle of 1 s, beside one of 2 Hz.
    #[test]
    fn a_run_is_parted_where_oscillations_begin_and_end() {
        let window = |start: f64, end: f64| {
            let around = PADDING * (end - start);
            let is_fast = end + around > 0.5 && start - around < 0.504;
            Window { start, end, frequency: if is_fast { 1e3 } else { 2.0 } }
        };
        let whole = window(0.0, 1.0);
        let parts = parted(whole, &window, MOST_HALVINGS);
        assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0.0, 1.0));
        assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
        let fast = parts.iter().filter(|part| part.frequency > 100.0);
        let length: f64 = fast.map(|one| one.end - one.start).sum();
        assert!((0.004..0.02).contains(&length), "{length}");
        let grid = Grid::of_windows(parts, 1000, 1.0).expect("a grid");
        assert!(Grid::of_windows(vec![whole], 1000, 1.0).is_none());
        assert!(grid.times.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(grid.at_finest, 12_000);
    }

    #[test]
    fn breaks_part_a_run_unless_they_are_none() {
        assert_eq!(stretches(&[], 2.0), vec![(0.0, 2.0)]);
        assert_eq!(stretches(&[-1.0, 0.0, 0.5, 0.5 + 1e-10, 2.0, 3.0], 2.0), vec![(0.0, 0.5), (0.5, 2.0)]);
        let many: Vec<f64> = (1..100).map(|i| 0.01 * f64::from(i)).collect();
        assert_eq!(stretches(&many, 1.0).len(), 100);
    }
}

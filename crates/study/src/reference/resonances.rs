//! Frequencies at which forces excite the truncated modes beyond their static responses.

use super::grid::Grid;
use super::principal::{principal, principal_directions};
use faer::Mat;
use flexbody_linalg::gram;
use flexbody_linalg::ties::sort_descending;
use libm::{sin, sincos};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::ops::Range;

/// Largest number of resonances.
const MAX_RESONANCES: usize = 4;

/// Largest number of force combinations whose spectrum is computed.
const MOST_COMBINATIONS: usize = 8;
/// Part of the sum of squares of the combinations that may be dropped.
const LEFT_OUT: f64 = 1e-12;

/// Smallest ratio of a spectral line to the median around it at which the line counts as a resonance. The spectrum of a
/// step is smooth; noise reaches this ratio now and then.
const PEAK: f64 = 3.0;

/// Neighbourhood of a frequency, as a ratio: from this part of the frequency to the frequency over this part.
const AROUND: f64 = 0.7;

/// Number of spectral lines on each side of a resonance that belong to it.
const WIDTH: usize = 6;

/// Largest number of instants of the uniform series.
const MOST_INSTANTS: usize = 1 << 20;

/// Criteria of a search for resonances.
pub(super) struct ResonanceCriteria {
    /// True if the motion starts in equilibrium.
    pub settled: bool,
    /// Root of the elastic energy below which a resonance is negligible.
    pub negligible: f64,
    /// Circular frequency below which no mode of the model is truncated.
    pub complete_below: f64,
}

/// Frequency at which the forces have much energy.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Resonance {
    /// Circular frequency.
    pub rate: f64,
    /// Amplitudes of the forces in phase and a quarter period later (k x 2).
    pub amplitudes: Mat<f64>,
}

/// Returns the frequencies, strongest first, at which forces with the amplitudes c(t) excite an oscillator of unit
/// static response to an elastic energy that is not negligible.
///
/// An undamped oscillator x'' + w^2 x = w^2 c oscillates about its static response by the integral of c' cos w (t - s)
/// ds. This is at most |C'(w)|, the Fourier transform of c' over the run, including a step at the beginning.
///
/// * `amplitudes`: c (k x m) at the instants of `grid`.
/// * `energy`: E'K E of their static responses (k x k).
pub(super) fn resonances(
    grid: &Grid,
    amplitudes: &Mat<f64>,
    energy: &Mat<f64>,
    criteria: &ResonanceCriteria,
) -> Vec<Resonance> {
    let &ResonanceCriteria { settled, negligible, complete_below } = criteria;
    if grid.times.last().is_none_or(|last| *last <= 0.0) {
        return Vec::new();
    }
    let combinations = combinations(amplitudes, energy);
    // Peaks of the spectrum of each part of the run with one spacing, by their level over the whole run.
    let level = |rate: f64| {
        let parts = transform(grid, &combinations, rate, settled);
        (0.5 * parts.row_iter().map(|row| row[0].powi(2) + row[1].powi(2)).sum::<f64>()).sqrt()
    };
    let ranges = evenly_spaced(grid);
    let parts = ranges.len();
    let mut peaks: Vec<Peak> = Vec::new();
    for range in ranges {
        let part = Part { grid, range, settled, complete_below, negligible: negligible / parts as f64 };
        for (rate, width) in part.peaks(&combinations) {
            peaks.push(Peak { rate, width, level: if parts == 1 { f64::INFINITY } else { level(rate) } });
        }
    }
    peaks.retain(|peak| peak.level > negligible);
    // Those of one part are sorted already.
    if parts > 1 {
        sort_descending(&mut peaks, |peak| peak.level);
    }
    let mut chosen: Vec<Peak> = Vec::new();
    for peak in peaks {
        let is_apart = |other: &Peak| (other.rate - peak.rate).abs() > other.width.max(peak.width);
        if chosen.len() < MAX_RESONANCES && chosen.iter().all(is_apart) {
            chosen.push(peak);
        }
    }
    let resonance = |peak: Peak| Resonance {
        rate: peak.rate,
        amplitudes: in_largest(transform(grid, amplitudes, peak.rate, settled)),
    };
    chosen.into_iter().map(resonance).collect()
}

/// Peak of a spectrum.
#[derive(Debug, Clone, Copy)]
struct Peak {
    /// Circular frequency, and the distance up to which another peak is the same.
    rate: f64,
    width: f64,
    /// Root of the elastic energy over the whole run.
    level: f64,
}

/// Ratio of the instants that the spacing of the fastest window would have in the whole run to those that there are, up to
/// which one spectrum serves the whole run.
const ONE_SPECTRUM: usize = 4;

/// Largest ratio of the spacings of neighbouring pieces with one spectrum.
const SIMILAR: f64 = 4.0;

/// Returns the parts of a run whose instants have similar distances: the whole run unless it has windows of their own spacing,
/// where a spectrum of the finest spacing throughout would be mostly empty.
fn evenly_spaced(grid: &Grid) -> Vec<Range<usize>> {
    if grid.at_finest <= ONE_SPECTRUM * grid.times.len() {
        let whole = 0..grid.times.len();
        return Vec::from([whole]);
    }
    let spacing = |piece: &Range<usize>| {
        (grid.times[piece.end - 1] - grid.times[piece.start]) / (piece.len() - 1).max(1) as f64
    };
    let mut parts: Vec<(Range<usize>, f64)> = Vec::new();
    for piece in &grid.pieces {
        let own = spacing(piece);
        match parts.last_mut() {
            Some((range, finest)) if own < SIMILAR * *finest && *finest < SIMILAR * own => {
                (range.end, *finest) = (piece.end, finest.min(own));
            }
            _ => parts.push((piece.clone(), own)),
        }
    }
    parts.into_iter().map(|(range, _)| range).collect()
}

/// Part of a run with instants of similar distance.
struct Part<'g> {
    grid: &'g Grid,
    range: Range<usize>,
    settled: bool,
    complete_below: f64,
    negligible: f64,
}

impl Part<'_> {
    /// Returns the strongest peaks of the spectrum of the increments of `combinations` that stand out, and the width of each;
    /// strongest first.
    fn peaks(&self, combinations: &Mat<f64>) -> Vec<(f64, f64)> {
        let times = &self.grid.times[self.range.clone()];
        let duration = times[times.len() - 1] - times[0];
        let is_whole = times.len() == self.grid.times.len();
        let instants = if is_whole { self.grid.at_finest } else { times.len() };
        let count = (2 * instants).next_power_of_two().min(MOST_INSTANTS);
        let step = duration / count as f64;
        // Spectrum of the force increments: the root of the elastic energy at each line.
        let fourier = FftPlanner::new().plan_fft_forward(2 * count);
        let starts_in_equilibrium = self.settled || self.range.start > 0;
        let mut level = vec![0.0f64; count + 1];
        for j in 0..combinations.nrows() {
            let values: Vec<f64> = self.range.clone().map(|i| combinations[(j, i)]).collect();
            let lines = spectrum(&increments(times, &values, step, count, starts_in_equilibrium), &*fourier);
            level.iter_mut().zip(&lines).for_each(|(level, line)| *level += line.norm_sqr());
        }
        level.iter_mut().for_each(|level| *level = (0.5 * *level).sqrt());
        // Local maxima above the negligible level and above the complete range, strongest first.
        let spacing = TAU / (2.0 * duration);
        let first = (self.complete_below / spacing).ceil().max(1.0) as usize;
        let is_peak = |&line: &usize| {
            level[line] > self.negligible && level[line] >= level[line - 1].max(level[line + 1])
        };
        let mut lines: Vec<usize> = (first..count / 2).filter(is_peak).collect();
        sort_descending(&mut lines, |&line| level[line]);
        // Keep maxima that are apart from each other and well above their neighbourhood.
        let mut chosen: Vec<usize> = Vec::new();
        for line in lines {
            let is_apart = chosen.iter().all(|other| other.abs_diff(line) > WIDTH);
            if is_apart && level[line] > PEAK * around(&level, line) {
                chosen.push(line);
            }
            if chosen.len() == MAX_RESONANCES {
                break;
            }
        }
        let width = WIDTH as f64 * spacing;
        chosen.into_iter().map(|line| (spacing * line as f64, width)).collect()
    }
}

/// Returns the dominant combinations of the amplitudes, scaled to the root of the elastic energy of their static
/// responses.
fn combinations(amplitudes: &Mat<f64>, energy: &Mat<f64>) -> Mat<f64> {
    let none = || Mat::zeros(0, amplitudes.ncols());
    let Some((turned, roots)) = principal(energy.clone(), 0.0, usize::MAX) else { return none() };
    let along = gram(turned.as_ref(), amplitudes.as_ref());
    let along = Mat::from_fn(roots.len(), along.ncols(), |k, i| roots[k] * along[(k, i)]);
    match principal_directions(&along, LEFT_OUT, MOST_COMBINATIONS) {
        Some(directions) => gram(directions.as_ref(), along.as_ref()),
        None => none(),
    }
}

/// Returns the increments of `values`, linear between the instants, over `count` equal steps. Unless the motion starts
/// in equilibrium, the initial value is part of the first increment.
fn increments(times: &[f64], values: &[f64], step: f64, count: usize, settled: bool) -> Vec<f64> {
    let mut at = 0;
    let mut value = |time: f64| {
        while at + 2 < times.len() && times[at + 1] < time {
            at += 1;
        }
        let (from, to) = (times[at], times[at + 1]);
        values[at] + (values[at + 1] - values[at]) * ((time - from) / (to - from)).clamp(0.0, 1.0)
    };
    let mut before = if settled { values[0] } else { 0.0 };
    let mut increments = Vec::with_capacity(count);
    for i in 0..count {
        let now = value(times[0] + step * (i + 1) as f64);
        increments.push(now - before);
        before = now;
    }
    increments
}

/// Returns the Fourier transform of a series padded with as many zeros: the line spacing is half of one period over the
/// series.
///
/// * `fourier`: of twice the length of the series.
fn spectrum(series: &[f64], fourier: &dyn Fft<f64>) -> Vec<Complex<f64>> {
    let mut lines: Vec<Complex<f64>> = series.iter().map(|value| Complex::new(*value, 0.0)).collect();
    lines.resize(2 * series.len(), Complex::default());
    fourier.process(&mut lines);
    lines.truncate(series.len() + 1);
    lines
}

/// Returns the median of the spectrum around a line, without the lines that belong to it.
fn around(level: &[f64], line: usize) -> f64 {
    let from = (AROUND * line as f64) as usize;
    let to = ((line as f64 / AROUND) as usize).max(line + 2 * WIDTH).min(level.len() - 1);
    let beside = |other: &usize| other.abs_diff(line) > WIDTH;
    let mut values: Vec<f64> = (from..=to).filter(beside).map(|other| level[other]).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// Returns the Fourier transform of the rates of every amplitude, linear between the instants, at the circular frequency
/// `rate`: real and imaginary part.
fn transform(grid: &Grid, amplitudes: &Mat<f64>, rate: f64, settled: bool) -> Mat<f64> {
    let mut parts = Mat::<f64>::zeros(amplitudes.nrows(), 2);
    let mut add = |row: usize, increment: f64, time: f64| {
        let (sin, cos) = sincos(rate * time);
        parts[(row, 0)] += increment * cos;
        parts[(row, 1)] -= increment * sin;
    };
    for row in 0..amplitudes.nrows() {
        if !settled {
            add(row, amplitudes[(row, 0)], 0.0);
        }
        for i in 1..grid.times.len() {
            let increment = amplitudes[(row, i)] - amplitudes[(row, i - 1)];
            // A straight line over many periods has nothing of this frequency; intervals of a third of a period follow it.
            let half = 0.5 * rate * (grid.times[i] - grid.times[i - 1]);
            let of_line = if half > 1.0 { sin(half) / half } else { 1.0 };
            add(row, increment * of_line, 0.5 * (grid.times[i] + grid.times[i - 1]));
        }
    }
    parts
}

/// Returns a matrix scaled so that its largest entry is one.
fn in_largest(matrix: Mat<f64>) -> Mat<f64> {
    let largest = matrix.norm_max().max(f64::MIN_POSITIVE);
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(count: usize, duration: f64) -> Grid {
        let times: Vec<f64> = (0..=count).map(|i| duration * i as f64 / count as f64).collect();
        let whole = 0..times.len();
        Grid { at_finest: times.len(), times, pieces: Vec::from([whole]) }
    }

    fn found(force: impl Fn(f64) -> f64, negligible: f64) -> Vec<f64> {
        let grid = grid(4000, 10.0);
        let amplitudes = Mat::from_fn(1, grid.times.len(), |_, i| force(grid.times[i]));
        let energy = Mat::full(1, 1, 2.0);
        let criteria = ResonanceCriteria { settled: false, negligible, complete_below: 0.0 };
        let all = resonances(&grid, &amplitudes, &energy, &criteria);
        all.into_iter().map(|resonance| resonance.rate / TAU).collect()
    }

    /// Windows of their own spacing follow a sine that begins late and lasts a tenth of the run: a resonance as well.
    #[test]
    fn a_sine_in_a_window_of_its_own_is_a_resonance() {
        let mut times: Vec<f64> = (0..100).map(|i| 4.0 * f64::from(i) / 100.0).collect();
        times.extend((0..1000).map(|i| 4.0 + f64::from(i) / 1000.0));
        times.extend((0..=100).map(|i| 5.0 + 5.0 * f64::from(i) / 100.0));
        let pieces = vec![0..100, 100..1100, 1100..times.len()];
        let grid = Grid { at_finest: 10_000, times, pieces };
        assert_eq!(evenly_spaced(&grid), grid.pieces);
        let force = |t: f64| if (4.0..5.0).contains(&t) { 1e-3 * (TAU * 50.0 * t).sin() } else { 0.0 };
        let amplitudes = Mat::from_fn(1, grid.times.len(), |_, i| 0.1 * grid.times[i] + force(grid.times[i]));
        let search = |negligible: f64| {
            let criteria = ResonanceCriteria { settled: false, negligible, complete_below: 30.0 };
            resonances(&grid, &amplitudes, &Mat::full(1, 1, 2.0), &criteria)
        };
        // pi times fifty periods of 1e-3.
        let all = search(0.1);
        assert_eq!(all.len(), 1, "{all:?}");
        assert!((all[0].rate / TAU - 50.0).abs() < 0.6, "{all:?}");
        assert!(search(0.2).is_empty());
    }

    /// A sine of amplitude 1e-3 beside a ramp excites an oscillator of its frequency to 1e-3 times pi times the number
    /// of periods. A step and a ramp have no resonance, and neither has a sine below the negligible level.
    #[test]
    fn a_small_sine_beside_a_ramp_is_a_resonance() {
        let both = |t: f64| 0.1 * t + 1e-3 * (TAU * 20.0 * t).sin();
        let all = found(both, 0.3);
        assert_eq!(all.len(), 1, "{all:?}");
        assert!((all[0] - 20.0).abs() < 0.06, "{all:?}");
        assert!(found(both, 0.7).is_empty());
        assert!(found(|_| 1.0, 1e-3).is_empty());
        assert!(found(|t| (0.3 * t).min(1.0), 1e-3).is_empty());
    }
}

//! Frequencies at which forces excite the truncated modes beyond their static responses.

use super::compressed::principal;
use super::grid::Grid;
use faer::Mat;
use flexbody_linalg::{combine, gram, larger};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

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
    let Some(duration) = grid.times.last().copied().filter(|last| *last > 0.0) else { return Vec::new() };
    let count = (2 * grid.times.len()).next_power_of_two().min(MOST_INSTANTS);
    let step = duration / count as f64;
    // Spectrum of the force increments: the root of the elastic energy at each line.
    let combinations = combinations(amplitudes, energy);
    let mut level = vec![0.0f64; count + 1];
    for j in 0..combinations.nrows() {
        let values: Vec<f64> = (0..combinations.ncols()).map(|i| combinations[(j, i)]).collect();
        let lines = spectrum(&increments(grid, &values, step, count, settled));
        level.iter_mut().zip(&lines).for_each(|(level, line)| *level += line.norm_sqr());
    }
    level.iter_mut().for_each(|level| *level = (0.5 * *level).sqrt());
    // Local maxima above the negligible level and above the complete range, strongest first.
    let rate = |line: usize| TAU * line as f64 / (2.0 * duration);
    let first = (complete_below / rate(1)).ceil().max(1.0) as usize;
    let mut peaks: Vec<usize> = (first.max(1)..count / 2)
        .filter(|&line| level[line] > negligible && level[line] >= level[line - 1].max(level[line + 1]))
        .collect();
    peaks.sort_by(|&a, &b| level[b].total_cmp(&level[a]));
    // Keep maxima that are apart from each other and well above their neighbourhood.
    let mut chosen: Vec<usize> = Vec::new();
    for line in peaks {
        let is_apart = chosen.iter().all(|other| other.abs_diff(line) > WIDTH);
        if is_apart && level[line] > PEAK * around(&level, line) {
            chosen.push(line);
        }
        if chosen.len() == MAX_RESONANCES {
            break;
        }
    }
    let resonance = |line: usize| {
        let rate = rate(line);
        Resonance { rate, amplitudes: transform(grid, amplitudes, rate, settled) }
    };
    chosen.into_iter().map(resonance).collect()
}

/// Returns the dominant combinations of the amplitudes, scaled to the root of the elastic energy of their static
/// responses.
fn combinations(amplitudes: &Mat<f64>, energy: &Mat<f64>) -> Mat<f64> {
    let none = || Mat::zeros(0, amplitudes.ncols());
    let Some((turned, roots)) = principal(energy.clone(), 0.0, usize::MAX) else { return none() };
    let along = gram(turned.as_ref(), amplitudes.as_ref());
    let along = Mat::from_fn(roots.len(), along.ncols(), |k, i| roots[k] * along[(k, i)]);
    let covariance = combine(along.as_ref(), along.transpose().to_owned().as_ref());
    match principal(covariance, LEFT_OUT, MOST_COMBINATIONS) {
        Some((directions, _)) => gram(directions.as_ref(), along.as_ref()),
        None => none(),
    }
}

/// Returns the increments of `values`, linear between the instants, over `count` equal steps. Unless the motion starts
/// in equilibrium, the initial value is part of the first increment.
fn increments(grid: &Grid, values: &[f64], step: f64, count: usize, settled: bool) -> Vec<f64> {
    let mut at = 0;
    let mut value = |time: f64| {
        while at + 2 < grid.times.len() && grid.times[at + 1] < time {
            at += 1;
        }
        let (from, to) = (grid.times[at], grid.times[at + 1]);
        values[at] + (values[at + 1] - values[at]) * ((time - from) / (to - from)).clamp(0.0, 1.0)
    };
    let mut before = if settled { values[0] } else { 0.0 };
    let mut increments = Vec::with_capacity(count);
    for i in 0..count {
        let now = value(step * (i + 1) as f64);
        increments.push(now - before);
        before = now;
    }
    increments
}

/// Returns the Fourier transform of a series padded with as many zeros: the line spacing is half of one period over the
/// series.
fn spectrum(series: &[f64]) -> Vec<Complex<f64>> {
    let mut lines: Vec<Complex<f64>> = series.iter().map(|value| Complex::new(*value, 0.0)).collect();
    lines.resize(2 * series.len(), Complex::default());
    FftPlanner::new().plan_fft_forward(lines.len()).process(&mut lines);
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

/// Returns the Fourier transform of the increments of every amplitude at the circular frequency `rate`: real and
/// imaginary part, scaled so that the largest entry is one.
fn transform(grid: &Grid, amplitudes: &Mat<f64>, rate: f64, settled: bool) -> Mat<f64> {
    let mut parts = Mat::<f64>::zeros(amplitudes.nrows(), 2);
    let mut add = |row: usize, increment: f64, time: f64| {
        let (sin, cos) = (rate * time).sin_cos();
        parts[(row, 0)] += increment * cos;
        parts[(row, 1)] -= increment * sin;
    };
    for row in 0..amplitudes.nrows() {
        if !settled {
            add(row, amplitudes[(row, 0)], 0.0);
        }
        for i in 1..grid.times.len() {
            let increment = amplitudes[(row, i)] - amplitudes[(row, i - 1)];
            add(row, increment, 0.5 * (grid.times[i] + grid.times[i - 1]));
        }
    }
    let largest = (0..parts.nrows()).flat_map(|row| [parts[(row, 0)].abs(), parts[(row, 1)].abs()]);
    let largest = largest.fold(f64::MIN_POSITIVE, larger);
    Mat::from_fn(parts.nrows(), 2, |i, j| parts[(i, j)] / largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(count: usize, duration: f64) -> Grid {
        let times: Vec<f64> = (0..=count).map(|i| duration * i as f64 / count as f64).collect();
        let whole = 0..times.len();
        Grid { times, pieces: Vec::from([whole]) }
    }

    fn found(force: impl Fn(f64) -> f64, negligible: f64) -> Vec<f64> {
        let grid = grid(4000, 10.0);
        let amplitudes = Mat::from_fn(1, grid.times.len(), |_, i| force(grid.times[i]));
        let energy = Mat::full(1, 1, 2.0);
        let criteria = ResonanceCriteria { settled: false, negligible, complete_below: 0.0 };
        let all = resonances(&grid, &amplitudes, &energy, &criteria);
        all.into_iter().map(|resonance| resonance.rate / TAU).collect()
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

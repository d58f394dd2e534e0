//! Bounds of a function of time, as the bounds of responses need them.

use flexbody_motion::scene::{History, Sizes, VectorHistory};
use std::f64::consts::TAU;

/// Bounds of a continuous function h of time over the duration of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variation {
    /// |h(0)|.
    pub start: f64,
    /// Largest |h|.
    pub largest: f64,
    /// Total variation of h.
    pub total: f64,
    /// Largest |h'|.
    pub rate: f64,
    /// Total variation of h', jumps included; infinite if unknown.
    pub rate_total: f64,
}

impl Variation {
    /// Returns the bounds of a constant.
    pub fn constant(value: f64) -> Self {
        Self { start: value.abs(), largest: value.abs(), total: 0.0, rate: 0.0, rate_total: 0.0 }
    }

    /// Returns the bounds of a history from time 0 to `duration`.
    pub fn of(history: &History, duration: f64) -> Self {
        let start = history.at(0.0).0.abs();
        match history {
            History::Constant(value) => Self::constant(*value),
            History::Table { times, .. } => {
                let inner = times.iter().copied().filter(|&time| time > 0.0 && time < duration);
                let instants: Vec<f64> = [0.0].into_iter().chain(inner).chain([duration]).collect();
                let values: Vec<f64> = instants.iter().map(|&time| history.at(time).0).collect();
                let slopes: Vec<f64> = instants
                    .windows(2)
                    .zip(values.windows(2))
                    .map(|(time, value)| (value[1] - value[0]) / (time[1] - time[0]))
                    .collect();
                Self {
                    start,
                    largest: values.iter().map(|v| v.abs()).fold(0.0, f64::max),
                    total: values.windows(2).map(|v| (v[1] - v[0]).abs()).sum(),
                    rate: slopes.iter().map(|v| v.abs()).fold(0.0, f64::max),
                    rate_total: slopes.windows(2).map(|v| (v[1] - v[0]).abs()).sum(),
                }
            }
            History::Sine { amplitude, frequency, .. } => {
                let (size, rate) = (amplitude.abs(), TAU * frequency);
                // |h'| and |h''| are at most the amplitudes of the derivatives.
                Self {
                    start,
                    largest: size,
                    total: size * rate * duration,
                    rate: size * rate,
                    rate_total: size * rate * rate * duration,
                }
            }
            History::Ramp { from, to, duration: length, .. } => {
                let step = (to - from).abs();
                // h' = step (1 - cos(2 pi x)) / length rises to twice the mean and falls again.
                Self {
                    start,
                    largest: from.abs().max(to.abs()),
                    total: step,
                    rate: 2.0 * step / length,
                    rate_total: 4.0 * step / length,
                }
            }
            History::Samples(samples) => samples.sizes_until(duration).into(),
        }
    }

    /// Returns the bounds of the length of a vector from time 0 to `duration`.
    pub fn of_vector(history: &VectorHistory, duration: f64) -> Self {
        match history {
            VectorHistory::Along { direction, factor } => {
                Self::of(factor, duration).times(&Self::constant(direction.norm()))
            }
            VectorHistory::Columns(columns) => columns.sizes_until(duration).into(),
        }
    }

    /// Returns the bounds of a unit vector that is fixed in space, seen from a frame that turns with `rotation`.
    pub fn direction(rotation: &Rotation) -> Self {
        Self {
            start: 1.0,
            largest: 1.0,
            total: rotation.largest * rotation.duration,
            rate: rotation.largest,
            rate_total: rotation.largest.powi(2) * rotation.duration + rotation.variation,
        }
    }

    /// Returns the bounds of the product with another function.
    pub fn times(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        let sum = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x * y };
        Self {
            start: a.start * b.start,
            largest: a.largest * b.largest,
            total: sum(a.largest, b.total) + sum(b.largest, a.total),
            rate: sum(a.largest, b.rate) + sum(b.largest, a.rate),
            rate_total: sum(a.rate, b.total)
                + sum(b.rate, a.total)
                + sum(a.largest, b.rate_total)
                + sum(b.largest, a.rate_total),
        }
    }
}

impl From<Sizes> for Variation {
    fn from(Sizes { start, largest, total, rate, rate_total }: Sizes) -> Self {
        Self { start, largest, total, rate, rate_total }
    }
}

/// Bounds of the angular velocity of a frame with given rotation, over the duration of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Axis of rotation, body axes; `None` if it changes or is unknown.
    pub axis: Option<nalgebra::Vector3<f64>>,
    /// True if the rotation is that of the run; false if it may be any within these bounds.
    pub of_run: bool,
    /// Largest |omega|.
    pub largest: f64,
    /// |omega| at the start.
    pub start: f64,
    /// Integral of |alpha|.
    pub variation: f64,
    /// Largest |alpha|.
    pub acceleration: f64,
    /// Total variation of alpha; infinite if unknown.
    pub jerk: f64,
    /// Duration.
    pub duration: f64,
}

impl Rotation {
    /// Returns the bounds of |omega| as a function of time.
    pub fn rate(&self) -> Variation {
        Variation {
            start: self.start,
            largest: self.largest,
            total: self.variation,
            rate: self.acceleration,
            rate_total: self.jerk,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_motion::scene::Interpolation;

    /// Sampled functions never exceed their bounds, and the bounds of a single history are at most twice as large.
    #[test]
    fn sampled_variation_stays_below_the_bounds() {
        let histories = [
            History::Constant(-2.0),
            History::Table { times: vec![-1.0, 0.5, 1.0, 9.0], values: vec![1.0, 3.0, -2.0, 5.0] },
            History::Sine { amplitude: -3.0, frequency: 0.7, phase: 0.3 },
            History::Ramp { from: 1.0, to: -2.0, start: 0.5, duration: 2.0 },
            History::samples(
                vec![-1.0, 0.5, 1.0, 3.0, 9.0],
                &[1.0, 3.0, -2.0, 5.0, 0.0],
                Interpolation::Cubic,
                false,
            ),
            History::samples(vec![0.5, 1.0, 3.0], &[3.0, -2.0, 5.0], Interpolation::Linear, true),
        ];
        let duration = 4.0;
        let count = 40_000;
        let sampled = |value: &dyn Fn(f64) -> (f64, f64)| {
            let samples: Vec<(f64, f64)> =
                (0..=count).map(|i| value(duration * f64::from(i) / f64::from(count))).collect();
            let largest = |size: &dyn Fn(&(f64, f64)) -> f64| samples.iter().map(size).fold(0.0, f64::max);
            let total = |size: &dyn Fn(&(f64, f64)) -> f64| {
                samples.windows(2).map(|pair| (size(&pair[1]) - size(&pair[0])).abs()).sum::<f64>()
            };
            Variation {
                start: samples[0].0.abs(),
                largest: largest(&|s| s.0.abs()),
                total: total(&|s| s.0),
                rate: largest(&|s| s.1.abs()),
                rate_total: total(&|s| s.1),
            }
        };
        let fields = |v: &Variation| [v.start, v.largest, v.total, v.rate, v.rate_total];
        for a in &histories {
            for b in &histories {
                let bound = Variation::of(a, duration).times(&Variation::of(b, duration));
                let product = |time: f64| {
                    let ((x, dx), (y, dy)) = (a.at(time), b.at(time));
                    (x * y, dx * y + x * dy)
                };
                for (real, bound) in fields(&sampled(&product)).into_iter().zip(fields(&bound)) {
                    assert!(real <= bound * (1.0 + 1e-9) + 1e-12, "{a:?} {b:?}: {real} above {bound}");
                }
            }
            let (real, bound) = (sampled(&|time| a.at(time)), Variation::of(a, duration));
            for (real, bound) in fields(&real).into_iter().zip(fields(&bound)) {
                assert!(real <= bound * (1.0 + 1e-9) && bound <= 2.0 * real + 1e-12, "{a:?}");
            }
        }
    }
}

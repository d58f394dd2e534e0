//! Scalar and vector functions of time, and the axes of vectors.

use super::samples::{Samples, Sizes};
use libm::{cos, sin, sincos};
use nalgebra::{Matrix3, Vector1, Vector3};
use std::f64::consts::TAU;

/// Scalar value as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub enum History {
    /// Constant value.
    Constant(f64),
    /// Straight lines between points with ascending times; constant before the first and after the last
    /// point.
    Table {
        /// Times.
        times: Vec<f64>,
        /// Values at these times.
        values: Vec<f64>,
    },
    /// amplitude sin(2 pi frequency t + phase).
    Sine {
        /// Amplitude.
        amplitude: f64,
        /// Frequency in oscillations per time.
        frequency: f64,
        /// Phase in radians.
        phase: f64,
    },
    /// Smooth transition from one value to another with two continuous derivatives: from + (to - from) (x -
    /// sin(2 pi x) / (2 pi)), with x from 0 to 1 within the duration.
    Ramp {
        /// Value before.
        from: f64,
        /// Value after.
        to: f64,
        /// Start time of the ramp.
        start: f64,
        /// Duration of the ramp.
        duration: f64,
    },
    /// Values given at many times.
    Samples(Samples<1>),
}

impl History {
    /// Returns the value and its rate at a time. At a kink the rate is that after it.
    pub fn at(&self, time: f64) -> (f64, f64) {
        match self {
            Self::Constant(value) => (*value, 0.0),
            Self::Table { times, values } => {
                let after = times.partition_point(|&t| t <= time);
                match (after.checked_sub(1), times.get(after)) {
                    (None, _) => (values[0], 0.0),
                    (Some(before), None) => (values[before], 0.0),
                    (Some(before), Some(end)) => {
                        let slope = (values[after] - values[before]) / (end - times[before]);
                        (values[before] + slope * (time - times[before]), slope)
                    }
                }
            }
            Self::Sine { amplitude, frequency, phase } => {
                let (sin, cos) = sincos(TAU * frequency * time + phase);
                (amplitude * sin, amplitude * TAU * frequency * cos)
            }
            Self::Ramp { from, to, start, duration } => {
                let x = ((time - start) / duration).clamp(0.0, 1.0);
                let (sin, cos) = sincos(TAU * x);
                (from + (to - from) * (x - sin / TAU), (to - from) * (1.0 - cos) / duration)
            }
            Self::Samples(samples) => {
                let sample = samples.at(time);
                (sample.value[0], sample.rate[0])
            }
        }
    }

    /// Returns the integral from time zero to a time.
    pub fn integral(&self, time: f64) -> f64 {
        match self {
            Self::Constant(value) => value * time,
            Self::Table { times, .. } => {
                let (from, to) = (time.min(0.0), time.max(0.0));
                let inner = times.iter().copied().filter(|&t| from < t && t < to);
                let ends: Vec<f64> = [from].into_iter().chain(inner).chain([to]).collect();
                // Lines between the ends: trapezoids are exact.
                let piece =
                    |ends: &[f64]| 0.5 * (self.at(ends[0]).0 + self.at(ends[1]).0) * (ends[1] - ends[0]);
                let sum: f64 = ends.windows(2).map(piece).sum();
                if time < 0.0 { -sum } else { sum }
            }
            Self::Sine { amplitude, frequency, phase } => {
                let half = 0.5 * TAU * frequency * time;
                // cos(phase) - cos(2 half + phase), without cancellation.
                amplitude / (TAU * frequency) * 2.0 * sin(half + phase) * sin(half)
            }
            Self::Ramp { from, to, start, duration } => {
                let risen = |time: f64| {
                    let x = ((time - start) / duration).clamp(0.0, 1.0);
                    let after = (time - start - duration).max(0.0);
                    duration * (0.5 * x * x + (cos(TAU * x) - 1.0) / (TAU * TAU)) + after
                };
                from * time + (to - from) * (risen(time) - risen(0.0))
            }
            Self::Samples(samples) => samples.integral(time)[0],
        }
    }

    /// Returns the second derivative at a time, for a smooth history; zero for a table.
    pub fn curvature(&self, time: f64) -> f64 {
        match self {
            Self::Constant(_) | Self::Table { .. } => 0.0,
            Self::Sine { frequency, .. } => -(TAU * frequency).powi(2) * self.at(time).0,
            Self::Ramp { from, to, start, duration } => {
                let x = ((time - start) / duration).clamp(0.0, 1.0);
                (to - from) * TAU * sin(TAU * x) / (duration * duration)
            }
            Self::Samples(samples) => samples.at(time).second[0],
        }
    }

    /// Returns the largest magnitude of the value and of the rate from time zero to a time; for a sine
    /// those over all times.
    pub fn largest_until(&self, end: f64) -> (f64, f64) {
        if let Self::Samples(samples) = self {
            let Sizes { largest, rate, .. } = samples.sizes_until(end);
            return (largest, rate);
        }
        let inner = self.breaks().into_iter().filter(|&time| 0.0 < time && time < end);
        let ends = [0.0].into_iter().chain(inner).chain(end.is_finite().then_some(end));
        let (mut value, mut rate) = (0.0f64, 0.0f64);
        for time in ends {
            let (at, slope) = self.at(time);
            (value, rate) = (value.max(at.abs()), rate.max(slope.abs()));
        }
        match self {
            Self::Sine { amplitude, frequency, .. } => (amplitude.abs(), amplitude.abs() * TAU * frequency),
            // The middle of the ramp has twice the mean rate.
            Self::Ramp { start, duration, .. } if 0.0 < start + duration && *start < end => {
                let middle = (start + 0.5 * duration).clamp(0.0, end);
                (value, rate.max(self.at(middle).1.abs()))
            }
            _ => (value, rate),
        }
    }

    /// Returns true if the history is zero from time zero to a time.
    pub fn is_zero_until(&self, end: f64) -> bool {
        match self {
            Self::Sine { amplitude, .. } => *amplitude == 0.0,
            Self::Ramp { from, to, start, .. } => *from == 0.0 && (*to == 0.0 || *start >= end),
            Self::Samples(samples) => samples.is_zero_until(end),
            _ => {
                let inner = self.breaks().into_iter().filter(|&time| 0.0 < time && time < end);
                [0.0, end].into_iter().chain(inner).all(|time| self.at(time).0 == 0.0)
            }
        }
    }

    /// Returns the history multiplied by a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Constant(value) => Self::Constant(factor * value),
            Self::Table { times, values } => Self::Table {
                times: times.clone(),
                values: values.iter().map(|value| factor * value).collect(),
            },
            Self::Sine { amplitude, frequency, phase } => {
                Self::Sine { amplitude: factor * amplitude, frequency: *frequency, phase: *phase }
            }
            Self::Ramp { from, to, start, duration } => {
                Self::Ramp { from: factor * from, to: factor * to, start: *start, duration: *duration }
            }
            Self::Samples(samples) => Self::Samples(samples.scaled(factor)),
        }
    }

    /// Returns the times at which the history is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Constant(_) | Self::Sine { .. } => Vec::new(),
            Self::Table { times, .. } => times.clone(),
            Self::Ramp { start, duration, .. } => vec![*start, start + duration],
            Self::Samples(samples) => samples.breaks(),
        }
    }

    /// Returns true if the history has two derivatives everywhere, except at ends beyond which it is
    /// constant.
    pub fn is_smooth(&self) -> bool {
        match self {
            Self::Table { .. } => false,
            Self::Samples(samples) => samples.is_smooth(),
            Self::Constant(_) | Self::Sine { .. } | Self::Ramp { .. } => true,
        }
    }

    /// Returns the frequency from time zero to a time, in oscillations per time; zero without oscillation.
    pub fn frequency_until(&self, end: f64) -> f64 {
        match self {
            Self::Sine { amplitude, frequency, .. } if *amplitude != 0.0 => frequency.abs(),
            Self::Samples(samples) => samples.frequency_until(end),
            _ => 0.0,
        }
    }

    /// Creates a history from values at ascending times with an interpolation (see [`Samples::new`]).
    pub fn samples(times: Vec<f64>, values: &[f64], interpolation: super::Interpolation, held: bool) -> Self {
        let values: Vec<Vector1<f64>> = values.iter().map(|&value| Vector1::new(value)).collect();
        Self::Samples(Samples::new(times, &values, interpolation, held))
    }
}

/// A vector as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub enum VectorHistory {
    /// Constant direction times a history of its value.
    Along {
        /// Direction, of any length.
        direction: Vector3<f64>,
        /// Value over time.
        factor: History,
    },
    /// Three components, each with a history of its own.
    Columns(Samples<3>),
}

/// Value, rate and second derivative at a time.
type Derivatives = [Vector3<f64>; 3];

impl VectorHistory {
    /// Returns the zero vector at all times.
    pub fn nothing() -> Self {
        Self::constant(Vector3::zeros())
    }

    /// Returns a constant vector.
    pub fn constant(direction: Vector3<f64>) -> Self {
        Self::Along { direction, factor: History::Constant(1.0) }
    }

    /// Returns true if the vector is zero at all times.
    pub fn is_nothing(&self) -> bool {
        match self {
            Self::Along { direction, .. } => *direction == Vector3::zeros(),
            Self::Columns(columns) => columns.rows().all(|(_, row)| row == Vector3::zeros()),
        }
    }

    /// Returns the vector and its rate at a time. At a kink the rate is that after it.
    pub fn at(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Along { direction, .. } if *direction == Vector3::zeros() => (*direction, *direction),
            Self::Along { direction, factor } => {
                let (value, rate) = factor.at(time);
                (direction * value, direction * rate)
            }
            Self::Columns(columns) => {
                let sample = columns.at(time);
                (sample.value, sample.rate)
            }
        }
    }

    /// Returns the vector, its rate and its second derivative at a time, for a smooth history.
    pub fn derivatives(&self, time: f64) -> Derivatives {
        match self {
            Self::Along { direction, factor } => {
                let (value, rate) = factor.at(time);
                [direction * value, direction * rate, direction * factor.curvature(time)]
            }
            Self::Columns(columns) => {
                let sample = columns.at(time);
                [sample.value, sample.rate, sample.second]
            }
        }
    }

    /// Returns the integral from time zero to a time.
    pub fn integral(&self, time: f64) -> Vector3<f64> {
        match self {
            Self::Along { direction, factor } => direction * factor.integral(time),
            Self::Columns(columns) => columns.integral(time),
        }
    }

    /// Returns the times at which the history is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Along { factor, .. } => factor.breaks(),
            Self::Columns(columns) => columns.breaks(),
        }
    }

    /// Returns the constant direction; `None` if the direction may change.
    pub fn direction(&self) -> Option<&Vector3<f64>> {
        match self {
            Self::Along { direction, .. } => Some(direction),
            Self::Columns(_) => None,
        }
    }

    /// Returns a direction of the vector: the constant one, or that of the longest row. Returns `None` for
    /// a zero vector.
    pub fn main_direction(&self) -> Option<Vector3<f64>> {
        let longest = match self {
            Self::Along { direction, .. } => *direction,
            Self::Columns(columns) => {
                let rows = columns.rows().map(|(_, row)| row);
                rows.reduce(|a, b| if b.norm_squared() > a.norm_squared() { b } else { a })?
            }
        };
        longest.try_normalize(0.0)
    }

    /// Returns directions that span all values: the constant direction, or the axes of the components that
    /// are not always zero.
    pub fn directions(&self) -> Vec<Vector3<f64>> {
        match self {
            Self::Along { direction, .. } => vec![*direction],
            Self::Columns(_) => {
                (0..3).filter(|&k| self.has_component(k)).map(|k| Vector3::ith(k, 1.0)).collect()
            }
        }
    }

    /// Returns true if a component is not always zero.
    pub fn has_component(&self, component: usize) -> bool {
        match self {
            Self::Along { direction, .. } => direction[component] != 0.0,
            Self::Columns(columns) => columns.rows().any(|(_, row)| row[component] != 0.0),
        }
    }

    /// Returns the largest length of the vector and of its rate from time zero to a time.
    pub fn largest_until(&self, end: f64) -> (f64, f64) {
        match self {
            Self::Along { direction, factor } => {
                let ((value, rate), length) = (factor.largest_until(end), direction.norm());
                (length * value, length * rate)
            }
            Self::Columns(columns) => {
                let Sizes { largest, rate, .. } = columns.sizes_until(end);
                (largest, rate)
            }
        }
    }

    /// Returns the largest magnitudes of the components, and of their rates, from time zero to a time.
    pub fn components_until(&self, end: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Along { direction, factor } => {
                let (value, rate) = factor.largest_until(end);
                (direction.abs() * value, direction.abs() * rate)
            }
            Self::Columns(columns) => {
                let sizes = [0, 1, 2].map(|k| columns.component(k).sizes_until(end));
                (Vector3::from(sizes.map(|s| s.largest)), Vector3::from(sizes.map(|s| s.rate)))
            }
        }
    }

    /// Returns true if the vector is zero from time zero to a time.
    pub fn is_zero_until(&self, end: f64) -> bool {
        match self {
            Self::Along { direction, factor } => *direction == Vector3::zeros() || factor.is_zero_until(end),
            Self::Columns(columns) => columns.is_zero_until(end),
        }
    }

    /// Returns the frequency of the fastest part, in oscillations per time; zero without oscillation.
    pub fn frequency_until(&self, end: f64) -> f64 {
        match self {
            Self::Along { factor, .. } => factor.frequency_until(end),
            Self::Columns(columns) => columns.frequency_until(end),
        }
    }

    /// Returns the shortest spacing of rows between which the history is smooth; `None` if the breaks
    /// already give the shortest time of change.
    pub fn spacing(&self) -> Option<f64> {
        match self {
            Self::Along { factor: History::Samples(samples), .. } => samples.smooth_spacing(),
            Self::Along { .. } => None,
            Self::Columns(columns) => columns.smooth_spacing(),
        }
    }

    /// Returns true if the history has two derivatives everywhere except at its ends.
    pub fn is_smooth(&self) -> bool {
        match self {
            Self::Along { factor, .. } => factor.is_smooth(),
            Self::Columns(columns) => columns.is_smooth(),
        }
    }

    /// Returns the vector multiplied by a matrix.
    pub fn turned(&self, matrix: &Matrix3<f64>) -> Self {
        match self {
            Self::Along { direction, factor } => {
                Self::Along { direction: matrix * direction, factor: factor.clone() }
            }
            Self::Columns(columns) => Self::Columns(columns.turned(matrix)),
        }
    }

    /// Returns the vector multiplied by a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Along { direction, factor: own } => {
                Self::Along { direction: *direction, factor: own.scaled(factor) }
            }
            Self::Columns(columns) => Self::Columns(columns.scaled(factor)),
        }
    }
}

/// Axes that a vector is given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum Axes {
    /// Axes fixed in space.
    World,
    /// Axes of the model, turning with the body. For a body without a model they are the axes of its file.
    #[default]
    Model,
    /// Axes of the body frame of the flex-body file, turning with the body.
    Body,
}

impl Axes {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Interpolation;
    use super::*;

    #[test]
    fn rates_are_slopes() {
        let histories = [
            History::Constant(2.0),
            History::Table { times: vec![0.0, 1.0, 3.0], values: vec![1.0, 2.0, -2.0] },
            History::Sine { amplitude: 3.0, frequency: 0.7, phase: 0.2 },
            History::Ramp { from: 1.0, to: -2.0, start: 0.5, duration: 2.0 },
            History::samples(
                vec![-1.0, 0.3, 1.1, 2.0, 5.0],
                &[1.0, 2.0, -2.0, 0.5, 1.0],
                Interpolation::Cubic,
                false,
            ),
            History::samples(vec![-1.0, 0.3, 3.0], &[1.0, 2.0, -2.0], Interpolation::Linear, true),
        ];
        for history in histories {
            for i in 0..60 {
                let (time, step) = (-0.513 + 0.07 * f64::from(i), 1e-5);
                let slope_of =
                    |value: &dyn Fn(f64) -> f64| (value(time + step) - value(time - step)) / (2.0 * step);
                let near = |slope: f64, rate: f64| {
                    assert!((slope - rate).abs() < 1e-6, "{history:?} at {time}: {slope}, {rate}");
                };
                near(slope_of(&|t| history.at(t).0), history.at(time).1);
                near(slope_of(&|t| history.integral(t)), history.at(time).0);
                if history.is_smooth() {
                    near(slope_of(&|t| history.at(t).1), history.curvature(time));
                }
                let (value, rate) = history.largest_until(4.0);
                assert!(time < 0.0 || history.at(time).0.abs() <= value && history.at(time).1.abs() <= rate);
            }
        }
    }

    #[test]
    fn tables_and_ramps_stay_at_their_ends() {
        let table = History::Table { times: vec![0.0, 1.0], values: vec![1.0, 2.0] };
        assert_eq!((table.at(-1.0), table.at(1.0), table.at(5.0)), ((1.0, 0.0), (2.0, 0.0), (2.0, 0.0)));
        let ramp = History::Ramp { from: 1.0, to: 3.0, start: 0.0, duration: 2.0 };
        assert_eq!((ramp.at(-1.0).0, ramp.at(1.0).0, ramp.at(9.0).0), (1.0, 2.0, 3.0));
    }
}

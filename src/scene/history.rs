//! Values that change with time.

use std::f64::consts::TAU;

/// A value as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub enum History {
    /// The same at all times.
    Constant(f64),
    /// Straight lines between points with ascending times; constant before the first and after the last.
    Table {
        /// Times.
        times: Vec<f64>,
        /// As many values.
        values: Vec<f64>,
    },
    /// amplitude sin(2 pi frequency t + phase).
    Sine {
        /// Amplitude.
        amplitude: f64,
        /// Oscillations per time.
        frequency: f64,
        /// Phase in radians.
        phase: f64,
    },
    /// Smoothly from one value to another: with x from 0 to 1 within the duration, from + (to - from) (x - sin(2 pi x) / (2 pi)); two
    /// continuous derivatives.
    Ramp {
        /// Value before.
        from: f64,
        /// Value after.
        to: f64,
        /// When it begins.
        start: f64,
        /// How long it takes.
        duration: f64,
    },
}

impl History {
    /// The value and its rate at a time. The rate at a kink is that after it.
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
                let (sin, cos) = (TAU * frequency * time + phase).sin_cos();
                (amplitude * sin, amplitude * TAU * frequency * cos)
            }
            Self::Ramp { from, to, start, duration } => {
                let x = ((time - start) / duration).clamp(0.0, 1.0);
                let (sin, cos) = (TAU * x).sin_cos();
                (from + (to - from) * (x - sin / TAU), (to - from) * (1.0 - cos) / duration)
            }
        }
    }

    /// The history times a factor.
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
        }
    }

    /// Times at which it is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Constant(_) | Self::Sine { .. } => Vec::new(),
            Self::Table { times, .. } => times.clone(),
            Self::Ramp { start, duration, .. } => vec![*start, start + duration],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_slopes() {
        let histories = [
            History::Constant(2.0),
            History::Table { times: vec![0.0, 1.0, 3.0], values: vec![1.0, 2.0, -2.0] },
            History::Sine { amplitude: 3.0, frequency: 0.7, phase: 0.2 },
            History::Ramp { from: 1.0, to: -2.0, start: 0.5, duration: 2.0 },
        ];
        for history in histories {
            for i in 0..60 {
                let (time, step) = (-0.51 + 0.07 * f64::from(i), 1e-5);
                let slope = (history.at(time + step).0 - history.at(time - step).0) / (2.0 * step);
                assert!((slope - history.at(time).1).abs() < 1e-6, "{history:?} at {time}");
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

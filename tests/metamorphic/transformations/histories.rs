//! Transformed times and values of histories.

use flexbody_motion::scene::{Drive, History, Interpolation, Samples, Scene, VectorHistory};
use std::f64::consts::TAU;

/// A change of the time t to `factor` (t + `delay`).
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// Factor of the time.
    pub factor: f64,
    /// Delay before scaling.
    pub delay: f64,
}

impl Clock {
    fn time(&self, time: f64) -> f64 {
        self.factor * (time + self.delay)
    }

    /// Returns the history with transformed time.
    pub fn history(&self, history: &History) -> History {
        match history {
            History::Constant(value) => History::Constant(*value),
            History::Table { times, values } => History::Table {
                times: times.iter().map(|t| self.time(*t)).collect(),
                values: values.clone(),
            },
            History::Sine { amplitude, frequency, phase } => History::Sine {
                amplitude: *amplitude,
                frequency: frequency / self.factor,
                phase: phase - TAU * frequency * self.delay,
            },
            History::Ramp { from, to, start, duration } => History::Ramp {
                from: *from,
                to: *to,
                start: self.time(*start),
                duration: self.factor * duration,
            },
            History::Samples(samples) => History::Samples(self.samples(samples)),
        }
    }

    fn samples<const N: usize>(&self, samples: &Samples<N>) -> Samples<N> {
        let (times, values): (Vec<f64>, Vec<_>) = samples.rows().unzip();
        let kind = if samples.is_smooth() { Interpolation::Cubic } else { Interpolation::Linear };
        Samples::new(times.into_iter().map(|t| self.time(t)).collect(), &values, kind, true)
    }

    /// Returns the vector with transformed time.
    pub fn vector(&self, history: &VectorHistory) -> VectorHistory {
        match history {
            VectorHistory::Along { direction, factor } => {
                VectorHistory::Along { direction: *direction, factor: self.history(factor) }
            }
            VectorHistory::Columns(columns) => VectorHistory::Columns(self.samples(columns)),
        }
    }

    /// Transforms the time of all histories of a scene.
    pub fn scene(&self, scene: &mut Scene) {
        for load in &mut scene.loads {
            (load.force, load.torque) = (self.vector(&load.force), self.vector(&load.torque));
        }
        for_driving(scene, |history, _| *history = self.vector(history));
    }
}

/// Kind of a prescribed motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driven {
    /// Angular velocity.
    Turned,
    /// A displacement, a velocity or an acceleration, by the number of its derivative.
    Moved(u8),
}

/// Calls `change` with every prescribed motion of a scene.
pub fn for_driving(scene: &mut Scene, mut change: impl FnMut(&mut VectorHistory, Driven)) {
    if let Some(spin) = &mut scene.spin {
        change(&mut spin.velocity, Driven::Turned);
    }
    let Some(carried) = &mut scene.carried else { return };
    if let Some(spin) = &mut carried.spin {
        change(&mut spin.velocity, Driven::Turned);
    }
    match &mut carried.translation {
        Some(Drive::Displacement(way)) => change(way, Driven::Moved(0)),
        Some(Drive::Velocity(velocity)) => change(velocity, Driven::Moved(1)),
        Some(Drive::Acceleration(acceleration)) => change(acceleration, Driven::Moved(2)),
        None => {}
    }
}

//! Progress of a run along the simulated time, and advice where a run takes long.

use super::prepared::{Prepared, STABLE, fastest_history};
use super::{Scene, Scheme};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use libm::{log10, pow};
use std::f64::consts::TAU;
use std::time::{Duration, Instant};

/// Wall-clock time after which the duration of a run is estimated. A smaller value gives less accurate estimates.
const EARLIEST_ESTIMATE: Duration = Duration::from_secs(2);

/// Estimated seconds of a run from which advice is given.
const LONG_RUN: f64 = 30.0;

/// Number of implicit steps per period of the motion in the advice. The method of order 4 then follows the motion to
/// about 1e-7.
const STEPS_PER_MOTION: f64 = 200.0;

/// Number of implicit steps between two breaks of the loads in the advice.
const STEPS_PER_PIECE: f64 = 50.0;

/// Ratio of the explicit steps to the implicit steps from which implicit steps are advised.
const WORTHWHILE: f64 = 4.0;

/// Number of instants at which the largest rate of a prescribed rotation is looked for.
const SAMPLES: usize = 200;

/// Progress of one run of a simulation.
pub(super) struct Pace<'p> {
    run: &'p Prepared<'p>,
    context: Context<'p>,
    start: Instant,
    is_estimated: bool,
}

impl<'p> Pace<'p> {
    /// Reports to `context` that a run begins.
    pub(super) fn new(run: &'p Prepared<'p>, context: &Context<'p>) -> Self {
        context.run();
        Self { run, context: *context, start: Instant::now(), is_estimated: false }
    }

    /// Reports that the run has reached `time`. Once, if the run takes long, also reports its estimated duration with
    /// the reason and what makes it shorter.
    pub(super) fn see(&mut self, time: f64) {
        let done = time / self.run.duration;
        self.context.fraction(done);
        if self.is_estimated || done <= 0.0 {
            return;
        }
        let elapsed = self.start.elapsed();
        if elapsed >= EARLIEST_ESTIMATE {
            self.is_estimated = true;
            let seconds = elapsed.as_secs_f64() / done;
            if seconds >= LONG_RUN {
                let Prepared { body, scene, scheme, duration, .. } = self.run;
                self.context.advice(&advice(body, scene, *scheme, *duration, seconds));
            }
        }
    }
}

/// Returns advice about a run of `body` in `scene` that is expected to take `seconds` of wall-clock time.
///
/// * `scheme`: integration scheme with the actual step length.
fn advice(body: &FlexBody, scene: &Scene, scheme: Scheme, duration: f64, seconds: f64) -> String {
    // The carrier of a body changes its frequencies.
    let in_frame = scene.carried.as_ref().and_then(|_| body.eigenvalues_in_frame());
    let eigenvalues = in_frame.as_ref().unwrap_or(&body.modes().eigenvalue);
    let root = eigenvalues.iter().copied().fold(0.0, f64::max).sqrt();
    let (periods, unit) = (duration * root / TAU, body.units().time.name());
    let takes = match seconds {
        ..90.0 => format!("about {seconds:.0} s"),
        _ => format!("about {:.0} min", seconds / 60.0),
    };
    let step = step_of_motion(scene, duration);
    let by_motion = (duration / step).ceil();
    // Steps that follow the fastest mode, as far as they are known before the run.
    let (followed, by_modes) = match (scheme, scene.run.scheme) {
        (Scheme::Adaptive { .. }, _) => {
            ("the steps of method = \"adaptive\" follow", duration * root / STABLE)
        }
        (Scheme::Conserving { step: Some(step), .. }, Scheme::Conserving { step: None, .. }) => {
            ("the steps without `step` in [run] follow", duration / step)
        }
        _ => ("", 0.0),
    };
    if by_modes < WORTHWHILE * by_motion {
        return format!(
            "each run of this scene takes {takes}; a body with fewer modes or a shorter `duration` in [run] takes less"
        );
    }
    format!(
        "each run of this scene takes {takes}: {followed} the {periods:.0} periods of the highest mode in {duration} {unit}, about {by_modes:.0} steps. If only the slow motion matters, method = \"conserving\" with step = {step} in [run] takes {by_motion:.0} steps, in which fast modes follow the loads statically; a body with fewer modes or a shorter `duration` is faster too"
    )
}

/// Returns a step that follows the prescribed motion and the loads of `scene`, rounded down to one digit.
fn step_of_motion(scene: &Scene, duration: f64) -> f64 {
    let mut ends: Vec<f64> = scene.breaks();
    ends.retain(|&time| 0.0 < time && time < duration);
    ends.insert(0, 0.0);
    ends.push(duration);
    let piece = ends.windows(2).map(|ends| ends[1] - ends[0]).fold(duration, f64::min);
    let at = |i: usize| duration * (i as f64 / SAMPLES as f64);
    let turning =
        scene.rotation().into_iter().flat_map(|rate| (0..=SAMPLES).map(|i| rate.at(at(i)).0.norm()));
    let rate = turning.fold(scene.initial.angular_velocity.norm(), f64::max);
    let frequency = fastest_history(scene, duration).max(rate / TAU);
    let spacing = scene.acting().chain(scene.driving()).filter_map(|history| history.spacing());
    let step = spacing.fold((piece / STEPS_PER_PIECE).min(1.0 / (STEPS_PER_MOTION * frequency)), f64::min);
    let digit = pow(10.0, log10(step).floor());
    // The decimal text gives the nearest number without the error of the power.
    format!("{:.0e}", (step / digit * (1.0 + 1e-9)).floor() * digit).parse().unwrap_or(step)
}

#[cfg(test)]
mod tests {
    use super::super::{History, Run, Spin, VectorHistory};
    use super::*;
    use crate::dynamics::Terms;
    use nalgebra::Vector3;

    fn scene(factor: History, scheme: Scheme) -> Scene {
        let run = Run { duration: Some(5.0), outputs: 10, most_steps: 1000, scheme, terms: Terms::ALL };
        let mut scene = Scene::new("swing", run);
        let velocity = VectorHistory::Along { direction: Vector3::z(), factor };
        scene.spin = Some(Spin { velocity, axes: super::super::Axes::Model, start: None, hold: true });
        scene
    }

    #[test]
    fn the_step_follows_loads_and_rotation() {
        let adaptive = Scheme::Adaptive { tolerance: 1e-9 };
        let of = |factor| step_of_motion(&scene(factor, adaptive), 5.0);
        // 1 Hz: a two-hundredth of a period.
        assert_eq!(of(History::Sine { amplitude: 1.0, frequency: 1.0, phase: 0.0 }), 0.005);
        // 10 turns a second.
        assert_eq!(of(History::Constant(10.0 * TAU)), 5e-4);
        // A ramp of 0.4: a fiftieth of it.
        assert_eq!(of(History::Ramp { from: 0.0, to: 0.1, start: 0.0, duration: 0.4 }), 0.008);
        assert_eq!(of(History::Constant(0.0)), 0.1);
    }
}

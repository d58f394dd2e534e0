//! Length and number of the steps of an integration, estimated before it begins.

use super::{Scene, Scheme};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use std::f64::consts::TAU;

/// Default number of steps of the conserving method per shortest period.
const STEPS_PER_PERIOD: f64 = 20.0;

/// Smallest number of steps per oscillation of a load or a spin, for explicit and for given step lengths;
/// with fewer steps an oscillation could be missed.
const STEPS_PER_OSCILLATION: f64 = 2.0;

/// Longest stable explicit step, as the phase angle of the fastest mode per step.
const STABLE: f64 = 6.0;

/// Returns the frequency of the fastest history of a scene that lasts `duration`, in oscillations per time;
/// zero without oscillation.
pub fn fastest_history(scene: &Scene, duration: f64) -> f64 {
    scene.acting().chain(scene.driving()).map(|history| history.frequency_until(duration)).fold(0.0, f64::max)
}

/// Returns the longest explicit step for the histories of a scene that lasts `duration`.
pub(super) fn longest_step(scene: &Scene, duration: f64) -> f64 {
    duration.min(1.0 / (STEPS_PER_OSCILLATION * fastest_history(scene, duration)))
}

/// Lower bound of the number of steps of an integration.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Effort {
    steps: f64,
    /// Reason for the number of steps, for messages.
    because: String,
}

impl Effort {
    /// Returns the scheme of `scene` with the actual step length, and the lower bound of its steps.
    ///
    /// # Errors
    /// FB551 if the step is given and longer than half a period of a load.
    pub(super) fn plan(body: &FlexBody, scene: &Scene, duration: f64) -> Result<(Scheme, Self)> {
        let fastest_mode = body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt() / TAU;
        let fastest_load = fastest_history(scene, duration);
        let load_in_words = format!("a load or spin oscillates {fastest_load:.3e} times per unit of time");
        let mode_in_words = format!("the fastest mode oscillates {fastest_mode:.3e} times per unit of time");
        match scene.run.scheme {
            Scheme::Adaptive { .. } => {
                let for_modes = duration * fastest_mode * TAU / STABLE;
                let for_histories = duration * fastest_load * STEPS_PER_OSCILLATION;
                let (steps, because) = if for_histories > for_modes {
                    (for_histories, load_in_words)
                } else {
                    (for_modes, mode_in_words)
                };
                Ok((scene.run.scheme, Self { steps, because }))
            }
            Scheme::Conserving { order, step: Some(step) } => {
                let step = step.min(duration);
                if step * fastest_load * STEPS_PER_OSCILLATION > 1.0 {
                    let message = format!("{load_in_words}: steps of {step:e} cannot resolve it");
                    let longest = 1.0 / (STEPS_PER_PERIOD * fastest_load);
                    let help = format!("give a `step` of {longest:.3e} or less, or omit `step`");
                    return Err(Diagnostic::new(Code::StepPassesOver, message).with_help(help).into());
                }
                let because = format!("steps of {step:e}");
                Ok((Scheme::Conserving { order, step: Some(step) }, Self { steps: duration / step, because }))
            }
            Scheme::Conserving { order, step: None } => {
                let (fastest, because) = if fastest_load > fastest_mode {
                    (fastest_load, load_in_words)
                } else {
                    (fastest_mode, mode_in_words)
                };
                let step = (1.0 / (STEPS_PER_PERIOD * fastest)).min(duration);
                Ok((Scheme::Conserving { order, step: Some(step) }, Self { steps: duration / step, because }))
            }
        }
    }

    /// Returns an error if more steps are needed than the scene allows.
    ///
    /// # Errors
    /// FB550 if the lower bound exceeds the limit of the scene.
    pub(super) fn refuse_too_much(&self, scene: &Scene) -> Result<()> {
        if self.steps <= scene.run.most_steps as f64 {
            return Ok(());
        }
        let message = format!(
            "the run of `{}` needs at least {:.1e} steps, {} are allowed: {}",
            scene.name, self.steps, scene.run.most_steps, self.because
        );
        Err(Diagnostic::new(Code::RunTooLong, message).into())
    }
}

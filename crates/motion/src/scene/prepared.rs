//! Preparation of a scene for its integration.

use super::extremes::Survey;
use super::surroundings::{SceneForces, settle};
use super::{Point, Scene, Scheme};
use crate::dynamics::{
    BodyPoint, Configuration, EquationsOfMotion, Motion, NodalPoint, Orientation, RotationVector,
    Surroundings,
};
use crate::integration::{
    Adaptive, Explicit, Failure, Gauss, Method, ObserverEvent, System, Work, integrate_closely,
};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::significant;
use flexbody_body::flex_body::FlexBody;
use flexbody_model::FeModel;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Number of parts of an explicit step at which the motion is sampled. Stability keeps these steps from being much longer than the
/// period of any mode, and exponential steps have more parts where modes ring, so that every oscillation is resolved.
pub(super) const PARTS: usize = 6;

/// Body with the damping of its scene, and this scene, in one frame and ready for integration.
pub(super) struct Prepared<'a> {
    pub body: &'a FlexBody,
    pub scene: &'a Scene,
    pub forces: SceneForces<'a>,
    pub watched: Vec<BodyPoint>,
    pub equations: EquationsOfMotion,
    pub start: Configuration,
    pub duration: f64,
    /// Integration scheme, with the actual step length.
    pub scheme: Scheme,
}

/// Results of an integration besides the observed states.
pub(super) struct Finished {
    pub work: Work,
    /// Mass and radius of gyration of the body.
    pub size: (f64, f64),
    /// Energy below which energies count as rounding.
    pub least_energy: f64,
}

/// Force and torque of a prescribed motion about the origin of the frame, axes of the body.
pub(super) type Reaction = (Vector3<f64>, Vector3<f64>);

/// Reasons for an integration to end early.
pub(super) enum Stop {
    Failed(Failure),
    /// The memory was full at `time`.
    Memory {
        time: f64,
    },
    /// The limit of the number of steps was reached at `time`.
    Steps {
        time: f64,
    },
}

impl From<Failure> for Stop {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl<'a> Prepared<'a> {
    /// Creates the equations of motion, loads, start and integration scheme of `body` in `scene`.
    ///
    /// # Errors
    /// FB212 if the scene does not fit the body; FB550 and FB551 before any work.
    pub(super) fn new(body: &'a FlexBody, scene: &'a Scene) -> Result<Self> {
        let Some(duration) = scene.run.duration else {
            let diagnostic = Diagnostic::new(Code::SceneBody, "the scene has no `duration`");
            return Err(diagnostic.with_help("give `duration` in [run]").into());
        };
        // Equations and loads, and the state at time zero, in static equilibrium if the scene asks for it.
        let (forces, watched) = SceneForces::new(body, scene)?;
        let equations = EquationsOfMotion::new(body, scene.run.terms);
        let mut start = start(body, scene, &forces);
        if scene.initial.settled {
            settle(body, scene, &equations, &forces, &mut start)?;
        }
        // Integration scheme, refused if the run needs more steps than allowed.
        let (scheme, effort) = Effort::plan(body, scene, duration)?;
        effort.refuse_too_much(scene)?;
        Ok(Self { scene, forces, watched, equations, start, duration, scheme, body })
    }

    /// Passes a sampled state of the motion to `survey`. Returns the reaction there if motion is
    /// prescribed.
    ///
    /// # Errors
    /// Failures of the equations of motion at this state.
    pub(super) fn survey(
        &self,
        survey: &mut Survey<'_>,
        event: ObserverEvent,
        time: f64,
        state: &[f64],
        motion: &mut Motion<'_>,
    ) -> std::result::Result<Option<Reaction>, Failure> {
        // The shape is cheap; the equations of motion are evaluated within a step only for reactions.
        let (_, q) = motion.shape(state);
        survey.see_shape(time, q, self.equations.elastic_energy(q));
        if event == ObserverEvent::Within && !self.scene.prescribes() {
            return Ok(None);
        }
        let now = motion.evaluate(time, state)?;
        let reaction = now.reaction();
        survey.see_reaction(time, &reaction);
        if event != ObserverEvent::Within {
            survey.see_balance(time, &now.balance(), &now.configuration().omega, event);
        }
        Ok(self.scene.prescribes().then_some(reaction))
    }

    /// Integrates over `instants` and passes the motion to `show`, also at `parts` points of every explicit
    /// step.
    ///
    /// # Errors
    /// FB540 if the integration cannot go on, FB550 if it needs more steps than allowed, FB601 if `show`
    /// has no memory left.
    pub(super) fn integrate<E: From<Failure> + Into<Stop>>(
        &self,
        instants: &[f64],
        parts: usize,
        mut show: impl FnMut(ObserverEvent, f64, &[f64], &mut Motion<'_>) -> std::result::Result<(), E>,
    ) -> Result<Finished> {
        let (mut motion, mut state) = Motion::new(&self.equations, &self.forces, &self.start);
        let mut observer = Motion::new(&self.equations, &self.forces, &self.start).0;
        // The observer has an evaluation of its own, so that observation does not change the steps.
        let mut method = match self.scheme {
            Scheme::Adaptive { tolerance } => {
                let longest = longest_step(self.body, self.scene, self.duration);
                let at_rest = longest_passing(self.scene, self.duration);
                let explicit = Explicit::new(motion.dimension(), tolerance, longest);
                Method::Adaptive(Box::new(Adaptive::new(explicit.longest_at_rest(at_rest), &motion)))
            }
            Scheme::Conserving { order, step } => Method::Gauss {
                method: Gauss::new(motion.dimension(), order),
                step: step.unwrap_or(self.duration),
            },
        };
        // Every observed state passes the limit of the number of steps.
        let mut steps = 0;
        let observe = |event: ObserverEvent, time: f64, state: &[f64]| {
            steps += u64::from(event == ObserverEvent::End);
            if steps > self.scene.run.most_steps {
                Err(Stop::Steps { time })
            } else {
                show(event, time, state, &mut observer).map_err(Into::into)
            }
        };
        let breaks = self.scene.breaks();
        integrate_closely(&mut method, &mut motion, &mut state, instants, &breaks, parts, observe)
            .map_err(|stop| stopped(self.scene, &method, stop))?;
        Ok(Finished { work: method.work(), size: motion.size(), least_energy: motion.least_energy() })
    }
}

/// Returns the body, in the frame of the scene, with the damping of the scene if the scene states one.
///
/// # Errors
/// [`SceneDamping`](Code::SceneDamping) if both state damping and the scene does not replace that of the
/// body; the errors of [`FlexBody::new`].
pub fn damped<'b>(body: &'b FlexBody, scene: &Scene) -> Result<Cow<'b, FlexBody>> {
    scene.requirements.damped(body, &format!("scene `{}`", scene.name))
}

/// Returns the body with the damping of the scene, and the scene without damping, so that further
/// processing does not add it twice.
///
/// # Errors
/// The errors of [`damped`].
pub fn damped_once<'b, 's>(
    body: Cow<'b, FlexBody>,
    scene: Cow<'s, Scene>,
) -> Result<(Cow<'b, FlexBody>, Cow<'s, Scene>)> {
    if scene.requirements.damping.is_none() {
        return Ok((body, scene));
    }
    let body = Cow::Owned(damped(&body, &scene)?.into_owned());
    let mut scene = scene.into_owned();
    scene.requirements.damping = None;
    Ok((body, Cow::Owned(scene)))
}

/// Returns the state at time zero. Prescribed motion overrides the initial state of the scene.
fn start(body: &FlexBody, scene: &Scene, forces: &SceneForces<'_>) -> Configuration {
    let initial = &scene.initial;
    let (mut q, mut qd) = (vec![0.0; body.n_modes()], vec![0.0; body.n_modes()]);
    // Modal coordinates from the initial values of modes by number.
    for start in &initial.modes {
        (q[start.mode], qd[start.mode]) = (start.amplitude, start.rate);
    }
    let attitude = RotationVector(initial.rotation);
    let axes = attitude.axes();
    // A prescribed motion replaces the initial velocities.
    let prescribed = forces.prescribed(0.0, &axes).0;
    Configuration {
        origin: initial.origin,
        attitude: attitude.into(),
        velocity: prescribed.linear.map_or(initial.velocity, |linear| linear.in_world(&axes)),
        omega: prescribed.angular.map_or(initial.angular_velocity, |angular| angular.0),
        q,
        qd,
    }
}

fn stopped(scene: &Scene, method: &Method, stop: Stop) -> Error {
    let steps = method.work().steps;
    match stop {
        Stop::Memory { time } => {
            let message = format!(
                "the recorded motion of `{}` exceeds the memory after {steps} steps, at t = {}",
                scene.name,
                significant(time, 6)
            );
            Diagnostic::new(Code::MemoryShort, message)
                .with_help("simulate a shorter `duration` or fewer modes")
                .into()
        }
        Stop::Steps { time } => {
            let message = format!(
                "the run of `{}` reached only t = {} within the {steps} steps that are allowed",
                scene.name,
                significant(time, 6)
            );
            Diagnostic::new(Code::RunTooLong, message).into()
        }
        Stop::Failed(failure) => {
            let message = format!("simulation of `{}` stopped after {steps} steps: {failure}", scene.name);
            let help = match failure {
                Failure::NotConverged { .. } => "give a shorter `step`, or use method = \"adaptive\"",
                _ => "check spin, loads and dropped terms: the motion may leave the range of the model",
            };
            Diagnostic::new(Code::SimulationStopped, message).with_help(help).into()
        }
    }
}

/// Returns true if `code` ends a single run: runs with other models of the scene may go on.
pub fn ends_a_run(code: Code) -> bool {
    matches!(code, Code::SimulationStopped | Code::RunTooLong)
}

// Length and number of the steps of an integration, estimated before it begins.

/// Default number of steps of the conserving method per shortest period.
const STEPS_PER_PERIOD: f64 = 20.0;

/// Smallest number of steps per oscillation of a load or a spin, for explicit and for given step lengths;
/// with fewer steps an oscillation could be missed.
const STEPS_PER_OSCILLATION: f64 = 2.0;

/// Longest stable explicit step, as the phase angle of the fastest mode per step.
pub(super) const STABLE: f64 = 6.0;

/// Phase angle of the fastest mode in the longest explicit step that is taken: |R(5.8 i)| = 0.78 for the stability
/// function R of the method, and 1.08 at 6.1. Longer steps let rounding grow until the step control sees it; when it does
/// depends on the last bits, and with it the motion by as much as the tolerance. A smaller value takes more steps.
const SAFELY_STABLE: f64 = 5.8;

/// Returns the frequency of the fastest history of a scene that lasts `duration`, in oscillations per time;
/// zero without oscillation.
pub fn fastest_history(scene: &Scene, duration: f64) -> f64 {
    scene.acting().chain(scene.driving()).map(|history| history.frequency_until(duration)).fold(0.0, f64::max)
}

/// Returns the longest explicit step for the modes of a body and the histories of a scene that lasts `duration`.
fn longest_step(body: &FlexBody, scene: &Scene, duration: f64) -> f64 {
    // The carrier of a body changes its frequencies.
    let in_frame = scene.carried.as_ref().and_then(|_| body.eigenvalues_in_frame());
    let eigenvalues = in_frame.as_ref().unwrap_or(&body.modes().eigenvalue);
    let fastest = eigenvalues.iter().copied().fold(0.0, f64::max).sqrt();
    longest_passing(scene, duration).min(SAFELY_STABLE / fastest)
}

/// Returns the longest step that passes over no oscillation of a history of a scene that lasts `duration`.
fn longest_passing(scene: &Scene, duration: f64) -> f64 {
    duration.min(1.0 / (STEPS_PER_OSCILLATION * fastest_history(scene, duration)))
}

/// Lower bound of the number of steps of an integration.
#[derive(Debug, Clone, PartialEq)]
struct Effort {
    steps: f64,
    /// Reason for the number of steps, for messages.
    because: String,
}

impl Effort {
    /// Returns the scheme of `scene` with the actual step length, and the lower bound of its steps.
    ///
    /// # Errors
    /// FB551 if the step is given and longer than half a period of a load.
    fn plan(body: &FlexBody, scene: &Scene, duration: f64) -> Result<(Scheme, Self)> {
        let fastest_mode = body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt() / TAU;
        let fastest_load = fastest_history(scene, duration);
        let load_in_words =
            format!("a load or spin oscillates {} times per unit of time", significant(fastest_load, 4));
        let mode_in_words =
            format!("the fastest mode oscillates {} times per unit of time", significant(fastest_mode, 4));
        match scene.run.scheme {
            // Modes limit the steps only while they ring.
            Scheme::Adaptive { .. } => {
                let steps = duration * fastest_load * STEPS_PER_OSCILLATION;
                Ok((scene.run.scheme, Self { steps, because: load_in_words }))
            }
            Scheme::Conserving { order, step: Some(step) } => {
                let step = step.min(duration);
                if step * fastest_load * STEPS_PER_OSCILLATION > 1.0 {
                    let message =
                        format!("{load_in_words}: steps of {} cannot resolve it", significant(step, 6));
                    let longest = 1.0 / (STEPS_PER_PERIOD * fastest_load);
                    let help =
                        format!("give a `step` of {} or less, or omit `step`", significant(longest, 3));
                    return Err(Diagnostic::new(Code::StepPassesOver, message).with_help(help).into());
                }
                let because = format!("steps of {}", significant(step, 6));
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

// Points of a scene among the nodes of a model.

/// Finds `point` among the nodes of `model`. Returns `None` if the model has no such node, or no such
/// interface with a reference point, or no such named load.
///
/// # Errors
/// [`InterfaceNode`](Code::InterfaceNode) if the model has no interfaces.
pub fn find_nodal_point(model: &FeModel, point: &Point) -> Result<Option<NodalPoint>> {
    match point {
        Point::Interface(name) => NodalPoint::interface(model, name),
        Point::NamedLoad(name) => {
            let load = model.named_loads().iter().find(|load| load.name == *name);
            Ok(load.map(NodalPoint::named_load))
        }
        Point::Node(number) => {
            let node = model.nodes().ids.iter().position(|id| id == number);
            Ok(node.map(|node| NodalPoint::node(model, node)))
        }
    }
}

/// Finds `point` among the nodes of `model`, which must exist.
///
/// # Errors
/// FB212 when the model has no such node, or no such interface with a reference point.
pub fn nodal_point(model: &FeModel, point: &Point) -> Result<NodalPoint> {
    find_nodal_point(model, point)?
        .ok_or_else(|| Diagnostic::new(Code::SceneBody, format!("the model has no {point}")).into())
}

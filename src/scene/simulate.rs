//! The simulation of a scene.

use super::surroundings::SceneForces;
use super::{Path, Recording, Resolution, Scene, Scheme, Setting, Stage};
use crate::diagnostic::{Code, Diagnostic};
use crate::dynamics::{Configuration, EquationsOfMotion, Evaluation, Motion, RotationVector, Surroundings};
use crate::error::{Error, Result};
use crate::flex_body::FlexBody;
use crate::integration::{Explicit, Failure, Gauss, Method, System, integrate};
use crate::model::LoadKind;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Steps of the conserving method per shortest period, unless said.
const STEPS_PER_PERIOD: f64 = 20.0;

/// Deflections up to this part of the extent of the body are those of linear elasticity.
const LINEAR_RANGE: f64 = 0.1;

/// Bytes that a recorded number takes: itself, and as text of a table.
const BYTES: f64 = 8.0 + 25.0;

/// Numbers of an instant besides modes and watched points.
const NUMBERS: usize = 44;

/// The motion of `body` in `scene`, and what has to be said about it.
///
/// * `memory`: bytes that there are for the recording and tables of it; `None` where it is not known.
/// * `watch`: hears which part of the duration is done.
///
/// # Errors
/// FB212 where the scene does not fit the body, FB540 when the integration cannot go on; FB601, before any work, when the recording does
/// not fit the memory.
pub fn simulate(
    body: &FlexBody,
    scene: &Scene,
    memory: Option<u64>,
    mut watch: impl FnMut(f64),
) -> Result<(Recording, Vec<Diagnostic>)> {
    let stage = Stage::new(body, scene)?;
    let (body, scene) = (&*damped(&stage.body, &stage.scene)?, &*stage.scene);
    let Some(duration) = scene.run.duration else {
        let diagnostic = Diagnostic::new(Code::SceneBody, "the scene does not say how long it lasts");
        return Err(diagnostic.with_help("give `duration` in [run]").into());
    };
    let (forces, points) = SceneForces::new(body, scene)?;
    refuse_too_much(body, scene, memory)?;
    let equations = EquationsOfMotion::new(body, scene.run.terms);
    let start = start(body, scene, &forces);
    let (mut motion, mut state) = Motion::new(&equations, &forces, &start);
    let mut observer = Motion::new(&equations, &forces, &start).0;

    let outputs = scene.run.outputs;
    let time: Vec<f64> = (0..=outputs).map(|i| duration * (i as f64 / outputs as f64)).collect();
    let (scheme, mut method) = method(body, scene, duration, motion.dimension());
    let mut recording = Recording {
        scene: scene.name.clone(),
        body: body.source().name.clone(),
        scheme,
        time: Vec::with_capacity(time.len()),
        states: Vec::with_capacity(time.len()),
        balances: Vec::with_capacity(time.len()),
        reactions: scene.prescribes().then(Vec::new),
        setting: Setting::new(body, scene),
        paths: scene
            .watched
            .iter()
            .map(|point| Path { name: point.to_string(), place: Vec::new(), deflection: Vec::new() })
            .collect(),
        work: method.work(),
        size: motion.size(),
        deflection: 0.0,
        resolution: Resolution::new(body, scene.requirements.tolerance.least_deflection),
    };
    let undeformed = Evaluation::new(&equations);
    let rest: Vec<Vector3<f64>> = points.iter().map(|point| point.place(&undeformed)).collect();
    let observe = |time: f64, state: &[f64]| {
        recording.time.push(time);
        let now = observer.evaluate(time, state)?;
        recording.states.push(now.configuration());
        recording.balances.push(now.balance());
        if let Some(reactions) = &mut recording.reactions {
            reactions.push(now.reaction());
        }
        for ((path, point), rest) in recording.paths.iter_mut().zip(&points).zip(&rest) {
            let at = point.place(now.evaluation());
            path.place.push(now.place().origin + now.place().axes * at);
            path.deflection.push(at - rest);
        }
        watch(time / duration);
        Ok::<(), Failure>(())
    };
    integrate(&mut method, &mut motion, &mut state, &time, &scene.breaks(), observe)
        .map_err(|failure| stopped(scene, &method, failure))?;
    recording.work = method.work();
    let (deflection, at) = largest_deflection(body, &recording);
    recording.deflection = deflection;
    let found = [stage.found, remarks(body, scene, &recording, at)].concat();
    Ok((recording, found))
}

/// The body, in the frame of the scene, with the damping of the scene where it has none of its own.
pub(crate) fn damped<'b>(body: &'b FlexBody, scene: &Scene) -> Result<Cow<'b, FlexBody>> {
    let modes = body.modes();
    match scene.requirements.damping {
        Some(ratio) if modes.modal_damping.is_none() && modes.damping_ratio.iter().all(|&r| r == 0.0) => {
            Ok(Cow::Owned(body.with_damping_ratio(ratio)?))
        }
        _ => Ok(Cow::Borrowed(body)),
    }
}

fn refuse_too_much(body: &FlexBody, scene: &Scene, memory: Option<u64>) -> Result<()> {
    let numbers = NUMBERS + 2 * body.n_modes() + 6 * scene.watched.len();
    let needed = (scene.run.outputs + 1) as f64 * numbers as f64 * BYTES;
    match memory {
        Some(left) if needed > left as f64 => {
            let message = format!(
                "recording {} instants takes {:.3} GB, {:.3} GB are left",
                scene.run.outputs + 1,
                needed / 1e9,
                left as f64 / 1e9
            );
            Err(Diagnostic::new(Code::MemoryShort, message).with_help("record fewer `outputs`").into())
        }
        _ => Ok(()),
    }
}

/// The state at time zero. What is prescribed replaces what the scene says of it.
fn start(body: &FlexBody, scene: &Scene, forces: &SceneForces<'_>) -> Configuration {
    let initial = &scene.initial;
    let (mut q, mut qd) = (vec![0.0; body.n_modes()], vec![0.0; body.n_modes()]);
    for start in &initial.modes {
        (q[start.mode], qd[start.mode]) = (start.amplitude, start.rate);
    }
    let prescribed = forces.prescribed(0.0).0;
    Configuration {
        origin: initial.origin,
        attitude: RotationVector(initial.rotation).into(),
        velocity: prescribed.linear.unwrap_or(initial.velocity),
        omega: prescribed.angular.unwrap_or(initial.angular_velocity),
        q,
        qd,
    }
}

fn method(body: &FlexBody, scene: &Scene, duration: f64, dimension: usize) -> (Scheme, Method) {
    match scene.run.scheme {
        Scheme::Adaptive { tolerance } => {
            let explicit = Explicit::new(dimension, tolerance, duration);
            (scene.run.scheme, Method::Explicit(explicit))
        }
        Scheme::Conserving { order, step } => {
            let fastest = body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt();
            let step = step.unwrap_or(TAU / fastest / STEPS_PER_PERIOD).min(duration);
            let method = Method::Gauss { method: Gauss::new(dimension, order), step };
            (Scheme::Conserving { order, step: Some(step) }, method)
        }
    }
}

fn stopped(scene: &Scene, method: &Method, failure: Failure) -> Error {
    let work = method.work();
    let message = format!("simulation of `{}` stopped after {} steps: {failure}", scene.name, work.steps);
    let help = match failure {
        Failure::NotConverged { .. } => "take a shorter step, or the adaptive method",
        _ => "the motion may leave the range of the model: look at spin, loads and dropped terms",
    };
    Diagnostic::new(Code::SimulationStopped, message).with_help(help).into()
}

/// The largest deflection of a node when the elastic energy is largest, relative to the extent of the body; and that time.
fn largest_deflection(body: &FlexBody, recording: &Recording) -> (f64, f64) {
    let energies = recording.balances.iter().map(|balance| balance.elastic).enumerate();
    let at = energies.fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most }).0;
    let (shape, q) = (&body.modes().shape, &recording.states[at].q);
    let component = |row: usize| -> f64 { q.iter().enumerate().map(|(j, q)| shape[(row, j)] * q).sum() };
    let deflections =
        (0..body.nodes().positions.len()).map(|i| Vector3::from_fn(|k, _| component(3 * i + k)).norm());
    (deflections.fold(0.0, f64::max) / body.extent(), recording.time[at])
}

fn remarks(body: &FlexBody, scene: &Scene, recording: &Recording, at: f64) -> Vec<Diagnostic> {
    let (mut found, unit) = (Vec::new(), body.units().time.name());
    if recording.deflection > LINEAR_RANGE {
        let message = format!(
            "a node is deflected by {:.0} % of the largest extent of the body at t = {} {unit}: modes are those of small deformation",
            100.0 * recording.deflection,
            rounded(at)
        );
        found.push(Diagnostic::new(Code::LinearRangeLeft, message));
    }
    let stiffened = scene.run.terms.geometric_stiffness
        && body.geometric_stiffness().iter().any(|one| one.load.kind == LoadKind::Spin);
    if scene.run.terms.w2 && !stiffened {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let Some(limit) = body.invariants().softening_rate(axis) else { continue };
            let largest = recording.states.iter().map(|state| state.omega[axis].abs()).fold(0.0, f64::max);
            if largest > limit {
                let lost = (0.1 * largest / limit).powi(2) * 100.0;
                let message = format!(
                    "spin about {name} reaches {} rad/{unit}: without geometric stiffness it takes {lost:.2} % of the stiffness of some motion",
                    rounded(largest)
                );
                found.push(Diagnostic::new(Code::SpinSoftens, message));
            }
        }
    }
    found
}

/// Four digits are enough to find a place.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

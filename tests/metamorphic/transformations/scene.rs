//! Transformations of the scene.

use super::Pair;
use super::histories::{Clock, for_driving};
use crate::correspondence::Correspondence;
use crate::draws::{between, pick};
use crate::scenes::scaled;
use crate::subject::Subject;
use flexbody_base::error::Result;
use flexbody_body::invariants::FrameChoice;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{Orientation, RotationVector};
use flexbody_motion::scene::{
    Axes, Drive, FramedScene, History, Initial, ModeStart, Point, Scene, VectorHistory, simulate,
};
use nalgebra::{Matrix3, Vector3};
use oracle::random::Random;

/// States every vector along other axes.
pub fn axes(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let frame = subject.body()?.frame().axes;
    let mut changed = subject.clone();
    let scene = &mut changed.scene;
    let start = start_axes(scene);
    // Transformation to model axes: at time zero for axes that rotate with the body.
    let in_model = |axes: Axes| match axes {
        Axes::World => start.transpose(),
        Axes::Model => Matrix3::identity(),
        Axes::Body => frame,
    };
    let to = [Axes::World, Axes::Body, Axes::Model][pick(random, 3)];
    let turn = |from: Axes| in_model(to).transpose() * in_model(from);
    let initial = &mut scene.initial;
    initial.angular_velocity = turn(initial.axes) * initial.angular_velocity;
    if initial.angular_velocity != Vector3::zeros() {
        initial.axes = to;
    }
    for load in scene.loads.iter_mut().filter(|load| !load.is_named()) {
        if load.axes != Axes::World && to != Axes::World {
            (load.force, load.torque) =
                (load.force.turned(&turn(load.axes)), load.torque.turned(&turn(load.axes)));
            load.axes = to;
        }
    }
    let of_spin = |velocity: &mut VectorHistory, axes: &mut Axes, start: Option<RotationVector>| {
        // An initial attitude refers to the frame named by `axes`.
        let keeps_axes = start.is_none()
            && (velocity.direction().is_some() || (*axes != Axes::World && to != Axes::World));
        if keeps_axes {
            (*velocity, *axes) = (velocity.turned(&turn(*axes)), to);
        }
    };
    if let Some(spin) = &mut scene.spin {
        of_spin(&mut spin.velocity, &mut spin.axes, spin.start);
    }
    if let Some(spin) = scene.carried.as_mut().and_then(|carried| carried.spin.as_mut()) {
        of_spin(&mut spin.velocity, &mut spin.axes, spin.start);
    }
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Returns the initial attitude of the model.
pub fn start_axes(scene: &Scene) -> Matrix3<f64> {
    let carried = scene.carried.as_ref().and_then(|carried| carried.spin.as_ref());
    let own = scene.spin.as_ref().and_then(|spin| spin.start).or(carried.and_then(|spin| spin.start));
    own.unwrap_or(RotationVector(scene.initial.rotation)).axes()
}

/// Splits every load into two of different size.
pub fn split(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let part = between(random, 0.1, 0.9);
    let mut changed = subject.clone();
    changed.scene.loads =
        subject.scene.loads.iter().flat_map(|load| [scaled(load, part), scaled(load, 1.0 - part)]).collect();
    let applies = !subject.scene.loads.is_empty();
    Ok(applies.then(|| Pair::new(subject, changed, Correspondence::default())))
}

/// Adds points to piecewise linear tables, which replace smooth factors of loads.
pub fn refine(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    const ROWS: usize = 5;
    let part = between(random, 0.2, 0.8);
    let Some(duration) = subject.scene.run.duration else { return Ok(None) };
    let mut original = subject.clone();
    for load in &mut original.scene.loads {
        for history in [&mut load.force, &mut load.torque] {
            if let VectorHistory::Along { factor, .. } = history {
                let times: Vec<f64> = (0..ROWS).map(|i| duration * i as f64 / (ROWS - 1) as f64).collect();
                let values = times.iter().map(|time| factor.at(*time).0).collect();
                *factor = History::Table { times, values };
            }
        }
    }
    let (mut changed, mut count) = (original.clone(), 0);
    let mut finer = |history: &mut VectorHistory| {
        if let VectorHistory::Along { factor: History::Table { times, values }, .. } = history {
            let middle = |ends: &[f64]| [ends[0], ends[0] + part * (ends[1] - ends[0])];
            let refined = |all: &[f64]| -> Vec<f64> {
                all.windows(2).flat_map(middle).chain(all.last().copied()).collect()
            };
            (*times, *values) = (refined(times), refined(values));
            count += 1;
        }
    };
    for load in &mut changed.scene.loads {
        finer(&mut load.force);
        finer(&mut load.torque);
    }
    Ok((count > 0).then(|| Pair::new(&original, changed, Correspondence::default())))
}

/// Returns the scene starting from rest: no velocity and no gravity, and all loads and drives rise from zero.
fn from_rest(scene: &Scene, duration: f64) -> Scene {
    let mut scene = scene.clone();
    scene.gravity = None;
    let initial = &mut scene.initial;
    (initial.velocity, initial.angular_velocity) = (Vector3::zeros(), Vector3::zeros());
    initial.modes.clear();
    let rising = |history: &VectorHistory| {
        let (size, _) = history.largest_until(duration);
        let direction = history.main_direction().unwrap_or_else(Vector3::zeros) * size;
        let factor = History::Ramp { from: 0.0, to: 1.0, start: 0.0, duration: 0.7 * duration };
        VectorHistory::Along { direction, factor }
    };
    for load in &mut scene.loads {
        (load.force, load.torque) = (rising(&load.force), rising(&load.torque));
    }
    for_driving(&mut scene, |history, _| *history = rising(history));
    scene
}

/// Starts all loads and drives later, from rest.
pub fn later(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let Some(duration) = subject.scene.run.duration else { return Ok(None) };
    let original = Subject { scene: from_rest(&subject.scene, duration), ..subject.clone() };
    let outputs = original.scene.run.outputs;
    let delayed = 1 + pick(random, outputs);
    let delay = duration * delayed as f64 / outputs as f64;
    let mut changed = original.clone();
    Clock { factor: 1.0, delay }.scene(&mut changed.scene);
    changed.scene.run.duration = Some(duration + delay);
    changed.scene.run.outputs += delayed;
    Ok(Some(Pair::new(&original, changed, Correspondence { delayed, ..Correspondence::default() })))
}

/// Starts from an intermediate state of the motion.
pub fn restart(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let scene = &subject.scene;
    let by_acceleration = scene
        .carried
        .as_ref()
        .is_some_and(|carried| matches!(carried.translation, Some(Drive::Acceleration(_))));
    // Without a carrier a body whose frame is on an interface is simulated in mean axes, in which it has other modes.
    let has_other_modes = scene.carried.is_none() && matches!(subject.frame, FrameChoice::Interface(_));
    let (Some(duration), false) = (scene.run.duration, by_acceleration || has_other_modes) else {
        return Ok(None);
    };
    let skipped = 1 + pick(random, scene.run.outputs / 2);
    let body = subject.body()?;
    let (recording, _) = simulate(&body, scene, &Context::QUIET)?;
    let (time, state) = (recording.time[skipped], &recording.states[skipped]);
    let mut changed = subject.clone();
    let next = &mut changed.scene;
    fix_axes(next);
    Clock { factor: 1.0, delay: -time }.scene(next);
    next.run.duration = Some(duration - time);
    next.run.outputs -= skipped;
    let axes = state.attitude.axes();
    let prescribed = FramedScene::new(&body, scene)?.scene.prescribes();
    let held = scene.carried.is_some() || scene.spin.as_ref().is_some_and(|spin| spin.hold);
    next.initial = Initial {
        origin: state.origin - axes * recording.setting.origin,
        velocity: if held { Vector3::zeros() } else { state.velocity },
        rotation: RotationVector::of_axes(&axes).0,
        angular_velocity: if prescribed { Vector3::zeros() } else { state.omega },
        axes: Axes::Model,
        modes: (0..body.n_modes())
            .map(|mode| ModeStart { mode, amplitude: state.q[mode], rate: state.qd[mode] })
            .collect(),
        settled: false,
    };
    Ok(Some(Pair::new(
        subject,
        changed,
        Correspondence { skipped, whole: false, ..Correspondence::default() },
    )))
}

/// States axes of rotation that turn with the body along those of the model.
fn fix_axes(scene: &mut Scene) {
    let start = start_axes(scene);
    let fix = |velocity: &mut VectorHistory, axes: &mut Axes| {
        if *axes == Axes::World && velocity.direction().is_some() {
            (*velocity, *axes) = (velocity.turned(&start.transpose()), Axes::Model);
        }
    };
    if let Some(spin) = &mut scene.spin {
        fix(&mut spin.velocity, &mut spin.axes);
        spin.start = None;
    }
    if let Some(spin) = scene.carried.as_mut().and_then(|carried| carried.spin.as_mut()) {
        fix(&mut spin.velocity, &mut spin.axes);
        spin.start = None;
    }
}

/// Repeats the load case, so that the body serves it several times.
pub fn repeat(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let changed = Subject { cases: 2 + pick(random, 2), ..subject.clone() };
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

/// Records more times.
pub fn outputs(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let finer = 2 + pick(random, 4);
    let mut changed = subject.clone();
    changed.scene.run.outputs *= finer;
    Ok(Some(Pair::new(subject, changed, Correspondence { finer, ..Correspondence::default() })))
}

/// Watches one more point, which a verdict would count among its deflections.
pub fn watch(subject: &Subject, _: &mut Random) -> Result<Option<Pair>> {
    let root = Point::Interface("root".to_owned());
    if subject.scene.watched.contains(&root) {
        return Ok(None);
    }
    let mut changed = subject.clone();
    changed.scene.watched.push(root);
    Ok(Some(Pair::new(subject, changed, Correspondence::default())))
}

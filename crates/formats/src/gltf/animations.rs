//! Animations: every mode by itself, or a simulation.

use super::binary::Binary;
use crate::picture::Played;
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Duration of a period of a mode, and of the motion of a simulation. Unit: s.
const PERIOD: f64 = 2.0;
pub(super) const MOTION: f64 = 8.0;

/// Number of key frames of a period; viewers interpolate weights linearly between them. A larger value is
/// smoother and makes the file larger.
const STEPS: usize = 32;

/// Returns one animation for each mode: one period with sinusoidal weights from -1 to 1 on the mesh of
/// `node`.
pub(super) fn of_modes(binary: &mut Binary, names: &[String], node: usize) -> Vec<Value> {
    if names.is_empty() {
        return Vec::new();
    }
    let part = |step: usize| step as f64 / STEPS as f64;
    let times: Vec<f32> = (0..=STEPS).map(|step| (PERIOD * part(step)) as f32).collect();
    let input = binary.times(&times);
    let mut all = Vec::new();
    for (j, name) in names.iter().enumerate() {
        let weight = |step: usize, k: usize| if k == j { (TAU * part(step)).sin() as f32 } else { 0.0 };
        let weights: Vec<[f32; 1]> =
            (0..=STEPS).flat_map(|step| (0..names.len()).map(move |k| [weight(step, k)])).collect();
        let output = binary.keys("SCALAR", &weights);
        all.push(json!({
            "name": name,
            "samplers": [sampler(input, output)],
            "channels": [channel(0, node, "weights")],
        }));
    }
    all
}

/// Returns the animation of a simulation: position and attitude of `node`, and the weights of its mesh, which
/// are the modal coordinates divided by their `largest` values. One unit of length has `metres` metres.
pub(super) fn of_motion(
    binary: &mut Binary,
    played: &Played<'_>,
    largest: &[f64],
    metres: f64,
    node: usize,
) -> Value {
    let frames = KeyFrames::new(played);
    let input = binary.times(&frames.times);
    let places: Vec<[f32; 3]> = frames.instants.iter().map(|&at| place(played, at, metres)).collect();
    let weight = |at: usize, j: usize| if largest[j] > 0.0 { played.q(at)[j] / largest[j] } else { 0.0 };
    let weights: Vec<[f32; 1]> = frames
        .instants
        .iter()
        .flat_map(|&at| (0..largest.len()).map(move |j| [weight(at, j) as f32]))
        .collect();
    let mut outputs = vec![
        (binary.keys("VEC3", &places), "translation"),
        (binary.keys("VEC4", &frames.attitudes), "rotation"),
    ];
    if !largest.is_empty() {
        outputs.push((binary.keys("SCALAR", &weights), "weights"));
    }
    let samplers: Vec<Value> = outputs.iter().map(|(output, _)| sampler(input, *output)).collect();
    let channels: Vec<Value> =
        outputs.iter().enumerate().map(|(at, (_, path))| channel(at, node, path)).collect();
    json!({ "name": played.scene(), "samplers": samplers, "channels": channels })
}

/// Returns the position of the frame at an output time, in metres.
pub(super) fn place(played: &Played<'_>, instant: usize, metres: f64) -> [f32; 3] {
    let origin: Vector3<f64> = played.origin(instant) * metres;
    <[f64; 3]>::from(origin).map(|x| x as f32)
}

/// Key frames with strictly ascending times, which rounding to single precision may violate, and attitudes
/// (quaternions) with signs for the shorter rotation between them.
struct KeyFrames {
    instants: Vec<usize>,
    times: Vec<f32>,
    attitudes: Vec<[f32; 4]>,
}

impl KeyFrames {
    fn new(played: &Played<'_>) -> Self {
        let mut own = Self { instants: Vec::new(), times: Vec::new(), attitudes: Vec::new() };
        let Some(last) = played.len().checked_sub(1) else { return own };
        let (begin, duration) = (played.time(0), played.duration());
        let mut before = UnitQuaternion::identity();
        for instant in 0..=last {
            let part = if duration > 0.0 { (played.time(instant) - begin) / duration } else { 0.0 };
            let time = (MOTION * part) as f32;
            if own.times.last().is_some_and(|last| *last >= time) {
                continue;
            }
            let attitude = played.attitude(instant);
            let near =
                if before.coords.dot(&attitude.coords) < 0.0 { -attitude.coords } else { attitude.coords };
            before = UnitQuaternion::new_unchecked(near.into());
            own.instants.push(instant);
            own.times.push(time);
            own.attitudes.push(<[f64; 4]>::from(near).map(|x| x as f32));
        }
        own
    }
}

fn sampler(input: usize, output: usize) -> Value {
    json!({ "input": input, "output": output, "interpolation": "LINEAR" })
}

fn channel(sampler: usize, node: usize, path: &str) -> Value {
    json!({ "sampler": sampler, "target": { "node": node, "path": path } })
}

//! Binary glTF 2.0: a body in motion, for viewers and the web.
//!
//! A file holds the surface with a morph target for each mode, and animations of the targets.
//! <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>
//!
//! Lengths are in metres and y points upwards, as glTF requires: a root node rotates the axes of the model,
//! whose z axis is taken as vertical. Its child, the node of the body, has the mesh and one child for each
//! interface with a reference point.

mod binary;

use crate::export::Holding::{Held, NotApplicable};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use crate::picture::{Drawn, Played, mode_names, named, rounded};
use binary::{Binary, Vertices};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use libm::sin;
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Export format of glTF.
pub(crate) struct Gltf;

/// Default number of modes: as many morph targets as every viewer should play. More targets may be ignored by
/// a viewer.
const MODES: usize = 8;

/// Largest displacement of a mode, relative to the largest extent of the body.
const DEFLECTION: f64 = 0.1;

/// Largest count of numbers in all key frames of a motion; a longer motion is thinned.
const MOST_NUMBERS: usize = 2_000_000;

/// Indices of the nodes of the file: axes, body, first interface.
const AXES: usize = 0;
const BODY: usize = 1;
const INTERFACES: usize = 2;

impl ExportFormat for Gltf {
    fn name(&self) -> &'static str {
        "gltf"
    }

    fn reader(&self) -> &'static str {
        "viewers and the web, Blender: modes or a motion as animations of one .glb"
    }

    fn is_picture(&self) -> bool {
        true
    }

    /// Returns mechanical properties as not applicable to a picture; [`leaves_out`](Self::leaves_out) names
    /// them.
    fn checklist(&self, _: &FlexBody, _: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            rigid_coupling: NotApplicable,
            plane: NotApplicable,
            deformed_inertia: NotApplicable,
            general_w0: NotApplicable,
            coriolis_force: NotApplicable,
            general_w3: NotApplicable,
            separate_w2: NotApplicable,
            geometric_stiffness: NotApplicable,
            inertia_stiffness: NotApplicable,
            damping: NotApplicable,
            shapes: Held,
            rotations: NotApplicable,
            internal_rows: NotApplicable,
            gravity: NotApplicable,
            interfaces: Held,
            surface: Held,
            origins_of_modes: Held,
            units: Held,
            storage: NotApplicable,
            named_loads: NotApplicable,
            recoveries: NotApplicable,
        }
    }

    fn needs(&self, _: &FlexBody, options: &ExportOptions) -> Vec<String> {
        named(options, "glb").into_iter().collect()
    }

    fn leaves_out(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        let mut left = vec![
            "gltf holds the surface, its motion and the positions of the interfaces for pictures in single precision, but no mass, stiffness, damping or inertia, and no node numbers"
                .to_owned(),
        ];
        let (modes, all) = (modes(body, options), body.n_modes());
        if modes < all {
            left.push(format!("the first {modes} of {all} modes are written: raise --modes for more"));
        } else if modes > MODES {
            left.push(format!("{modes} modes are written: some viewers play {MODES} morph targets only"));
        }
        if let Some(motion) = &options.motion {
            let played = played(motion);
            let seconds = played.duration() * body.units().time.to_si();
            left.push(format!(
                "the motion of {} s is played in {MOTION} s with {}",
                rounded(seconds),
                played.in_words()
            ));
        }
        left
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let played = options.motion.as_ref().map(played);
        let scene = DrawnScene::new(body, modes(body, options), played.as_ref());
        let file = scene.file(played.as_ref())?;
        Ok(Exported::single(file))
    }
}

/// Returns the number of modes in the picture; by default all modes for a motion.
fn modes(body: &FlexBody, options: &ExportOptions) -> usize {
    let usual = if options.motion.is_some() { body.n_modes() } else { body.n_modes().min(MODES) };
    options.modes.unwrap_or(usual)
}

fn played(motion: &RecordedMotion) -> Played<'_> {
    Played::new(motion, MOST_NUMBERS / (8 + motion.modes))
}

/// Contents of the picture.
struct DrawnScene<'b> {
    body: &'b FlexBody,
    drawn: Drawn<'b>,
    names: Vec<String>,
    /// Origin of the frame in model coordinates; positions of the mesh are relative to it.
    origin: Vector3<f64>,
    /// Metres per unit of length.
    metres: f64,
    /// Largest value of each modal coordinate in the motion; empty without a motion.
    largest: Vec<f64>,
}

impl<'b> DrawnScene<'b> {
    fn new(body: &'b FlexBody, modes: usize, played: Option<&Played<'_>>) -> Self {
        let largest = |played: &Played<'_>| -> Vec<f64> {
            let one = |j: usize| (0..played.len()).map(|at| played.q(at)[j].abs()).fold(0.0, f64::max);
            (0..modes).map(one).collect()
        };
        Self {
            body,
            drawn: Drawn::surface(body),
            names: mode_names(body, modes),
            origin: played.map_or(body.frame().origin, Played::origin_in_model),
            metres: body.units().length.to_si(),
            largest: played.map(largest).unwrap_or_default(),
        }
    }

    /// Returns the bytes of the file.
    ///
    /// # Errors
    /// [`ExportLoses`](Code::ExportLoses) if a length is beyond single precision, or the file is too long.
    fn file(&self, played: Option<&Played<'_>>) -> Result<Vec<u8>> {
        let mut binary = Binary::default();
        let mesh = self.mesh(&mut binary, played.is_some())?;
        let nodes = self.nodes(played)?;
        let animations = match played {
            Some(played) => vec![of_motion(&mut binary, played, &self.largest, self.metres, BODY)],
            None => of_modes(&mut binary, &self.names, BODY),
        };
        let mut document = json!({
            "asset": { "version": "2.0", "generator": generator() },
            "scene": 0,
            "scenes": [{ "name": self.body.description().name, "nodes": [AXES] }],
            "nodes": nodes,
            "meshes": [mesh],
            "materials": [
                material("surface", [0.52, 0.60, 0.68, 1.0], true),
                material("lines", [0.05, 0.07, 0.09, 1.0], false),
            ],
        });
        if !animations.is_empty() {
            document["animations"] = Value::Array(animations);
        }
        binary
            .file(document)
            .ok_or_else(|| refused("a file of more than 4 GB: choose fewer modes with --modes"))
    }

    fn mesh(&self, binary: &mut Binary, moves: bool) -> Result<Value> {
        let positions = self.drawn.positions();
        let vertices = Vertices::new(&self.drawn, &positions);
        let at_vertices = |of_points: &[[f64; 3]]| {
            let one = |point: &u32| single(Vector3::from(of_points[*point as usize]));
            vertices.points.iter().map(one).collect::<Result<Vec<_>>>()
        };
        // Undeformed positions relative to the frame origin, in metres.
        let places: Vec<[f64; 3]> =
            positions.iter().map(|x| ((Vector3::from(*x) - self.origin) * self.metres).into()).collect();
        let position = binary.vertices(&at_vertices(&places)?);
        // One morph target per mode: displacements at weight one.
        let mut targets = Vec::new();
        for j in 0..self.names.len() {
            let target = if moves { self.largest_motion(j) } else { self.scaled_shape(j) };
            targets.push(json!({ "POSITION": binary.vertices(&at_vertices(&target)?) }));
        }
        // Triangles (mode 4), lines (mode 1) or, without both, points (mode 0).
        let mut primitives = Vec::new();
        if !vertices.triangles.is_empty() {
            let normal = binary.directions(&vertices.normals);
            let indices = binary.indices(vertices.triangles.as_flattened());
            let attributes = json!({ "POSITION": position, "NORMAL": normal });
            primitives
                .push(json!({ "mode": 4, "attributes": attributes, "indices": indices, "material": 0 }));
        }
        let attributes = json!({ "POSITION": position });
        if !vertices.edges.is_empty() {
            let indices = binary.indices(vertices.edges.as_flattened());
            primitives
                .push(json!({ "mode": 1, "attributes": attributes, "indices": indices, "material": 1 }));
        }
        if primitives.is_empty() {
            primitives.push(json!({ "mode": 0, "attributes": attributes, "material": 1 }));
        }
        let mut mesh = json!({ "name": self.body.description().name });
        if !targets.is_empty() {
            primitives.iter_mut().for_each(|primitive| primitive["targets"] = json!(targets));
            mesh["weights"] = json!(vec![0.0; targets.len()]);
            mesh["extras"] = json!({ "targetNames": self.names });
        }
        mesh["primitives"] = Value::Array(primitives);
        Ok(mesh)
    }

    /// Returns a mode in metres, scaled to the displacement that pictures of modes have.
    fn scaled_shape(&self, j: usize) -> Vec<[f64; 3]> {
        let shape = self.drawn.shape(j);
        let component = shape.as_flattened().iter().fold(0.0f64, |own, x| own.max(x.abs()));
        if component == 0.0 {
            return shape;
        }
        // Normalises by the largest component first, so that squares neither overflow nor underflow.
        let parts: Vec<Vector3<f64>> = shape.iter().map(|u| Vector3::from(*u) / component).collect();
        let longest = parts.iter().map(Vector3::norm).fold(0.0, f64::max);
        let extent = self.body.extent();
        let wanted = DEFLECTION * self.metres * if extent > 0.0 { extent } else { 1.0 };
        parts.iter().map(|part| (part / longest * wanted).into()).collect()
    }

    /// Returns a mode in metres at its largest amplitude in the motion.
    fn largest_motion(&self, j: usize) -> Vec<[f64; 3]> {
        let one = |u: &[f64; 3]| u.map(|x| x * self.largest[j] * self.metres);
        self.drawn.shape(j).iter().map(one).collect()
    }

    fn nodes(&self, played: Option<&Played<'_>>) -> Result<Vec<Value>> {
        let start = match played {
            Some(played) => {
                // Checks that all positions of the motion fit single precision.
                (0..played.len()).try_for_each(|at| finite(place(played, at, self.metres)).map(drop))?;
                place(played, 0, self.metres)
            }
            None => single(self.origin * self.metres)?,
        };
        let mut body = json!({ "name": self.body.description().name, "mesh": 0, "translation": start });
        if let Some(played) = played {
            let attitude = <[f64; 4]>::from(played.attitude(0).coords);
            body["rotation"] = json!(attitude.map(|x| x as f32));
        }
        let mut interfaces = Vec::new();
        for interface in self.body.interfaces() {
            if let Some(reference) = interface.reference {
                let place = Vector3::from(self.body.frame().to_model(reference)) - self.origin;
                let translation = single(place * self.metres)?;
                interfaces.push(json!({ "name": interface.name, "translation": translation }));
            }
        }
        if !interfaces.is_empty() {
            body["children"] = (INTERFACES..INTERFACES + interfaces.len()).collect();
        }
        let turned = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
        let axes = json!({ "name": "axes of the model, z up", "rotation": turned, "children": [BODY] });
        Ok([vec![axes, body], interfaces].concat())
    }
}

fn material(name: &str, colour: [f64; 4], both_sides: bool) -> Value {
    json!({
        "name": name,
        "doubleSided": both_sides,
        "pbrMetallicRoughness": { "baseColorFactor": colour, "metallicFactor": 0.1, "roughnessFactor": 0.6 },
    })
}

/// Returns a vector in single precision.
fn single(x: Vector3<f64>) -> Result<[f32; 3]> {
    finite(<[f64; 3]>::from(x).map(|x| x as f32))
}

fn finite(x: [f32; 3]) -> Result<[f32; 3]> {
    if x.iter().all(|x| x.is_finite()) {
        return Ok(x);
    }
    Err(refused("lengths beyond 3e38 m, which overflow single precision"))
}

fn refused(what: &str) -> Error {
    Diagnostic::new(Code::ExportLoses, format!("gltf cannot hold {what}")).into()
}

// Animations: every mode by itself, or a simulation.

/// Duration of a period of a mode, and of the motion of a simulation. Unit: s.
const PERIOD: f64 = 2.0;
const MOTION: f64 = 8.0;

/// Number of key frames of a period; viewers interpolate weights linearly between them. A larger value is
/// smoother and makes the file larger.
const STEPS: usize = 32;

/// Returns one animation for each mode: one period with sinusoidal weights from -1 to 1 on the mesh of
/// `node`.
fn of_modes(binary: &mut Binary, names: &[String], node: usize) -> Vec<Value> {
    if names.is_empty() {
        return Vec::new();
    }
    let part = |step: usize| step as f64 / STEPS as f64;
    let times: Vec<f32> = (0..=STEPS).map(|step| (PERIOD * part(step)) as f32).collect();
    let input = binary.times(&times);
    let mut all = Vec::new();
    for (j, name) in names.iter().enumerate() {
        let weight = |step: usize, k: usize| if k == j { sin(TAU * part(step)) as f32 } else { 0.0 };
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
fn of_motion(binary: &mut Binary, played: &Played<'_>, largest: &[f64], metres: f64, node: usize) -> Value {
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
fn place(played: &Played<'_>, instant: usize, metres: f64) -> [f32; 3] {
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

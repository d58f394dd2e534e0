//! The meaning of a scene does not depend on the frame of the conversion: one golden scene in three frames
//! gives one motion, one selection, one study.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{Orientation, RotationVector};
use flexbody_motion::scene::{LoadCases, Recording, Scene, simulate};
use flexbody_study::recipe::Recipe;
use flexbody_study::selection::select;
use flexbody_study::trade::{Source, TradeSettings, trade};
use nalgebra::Vector3;
use oracle::brackets::footed_block;
use oracle::flexible::body_of;
use std::fs;

fn bodies() -> Vec<FlexBody> {
    BodyFrame::ALL.iter().map(|&frame| body_of(footed_block(), 8, frame)).collect()
}

fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("written");
    LoadCases::read_single(&path, None).expect("a scene")
}

const POINTS: &str = "[[watch]]\nnode = 3\n[[watch]]\ninterface = \"foot\"\n[[watch]]\nnode = 40\n";
const LOADS: &str = "[[load]]\nnode = 3\nforce = [2e-3, 1e-3, -3e-3]\nhistory = { amplitude = 1, frequency = 0.3 }\n\
                     [[load]]\ninterface = \"foot\"\nforce = [1e-3, 0, 2e-3]\ntorque = [0, 1e-3, 0]\naxes = \"model\"\n";

/// Returns scenes of a free, a spun and a carried body.
fn golden() -> [(&'static str, Scene); 4] {
    let head = "gravity = [0.02, -0.01, -0.05]\n[run]\nduration = 8\noutputs = 40\ntolerance = 1e-12\n";
    let free = "[initial]\norigin = [1, 2, 3]\nvelocity = [0.1, -0.2, 0.3]\nrotation = [0.4, -0.3, 0.8]\nangular_velocity = [0.05, 0.3, -0.1]\n";
    let seen = free.replace("angular_velocity", "axes = \"world\"\nangular_velocity");
    let spun = "[initial]\nrotation = [0.4, -0.3, 0.8]\n[spin]\naxis = [1, 2, -1]\nrate = { to = 0.4, duration = 4 }\nhold = true\n";
    let carried = "[initial]\nrotation = [0.4, -0.3, 0.8]\n[carried]\ninterface = \"foot\"\n[carried.spin]\naxis = [1, 2, -1]\nthrough = [2, -3, 1]\n\
                   rate = { to = 0.3, duration = 4 }\n[carried.translation]\ndirection = [1, 0, 1]\nvelocity = { amplitude = 0.05, frequency = 0.2 }\n";
    [
        ("free", free.to_owned()),
        ("free, in world axes", seen),
        ("spun", spun.to_owned()),
        ("carried", carried.to_owned()),
    ]
    .map(|(name, middle)| (name, scene(&format!("{head}{middle}{LOADS}{POINTS}"))))
}

/// Returns the largest differences of positions, deflections, attitudes, spins and reactions, relative to
/// their largest values.
fn apart(a: &Recording, b: &Recording) -> f64 {
    let relative = |pairs: &mut dyn Iterator<Item = (Vector3<f64>, Vector3<f64>)>, least: f64| {
        let (mut size, mut difference) = (least, 0.0f64);
        for (a, b) in pairs {
            (size, difference) = (size.max(a.norm()), difference.max((a - b).norm()));
        }
        difference / size
    };
    let states = || a.states.iter().zip(&b.states);
    let mut all = vec![
        relative(&mut states().map(|(a, b)| (a.omega, b.omega)), 1e-3),
        relative(&mut states().map(|(a, b)| (a.origin, b.origin)), 1.0),
        states().map(|(a, b)| (a.attitude.axes() - b.attitude.axes()).amax()).fold(0.0, f64::max),
    ];
    for (a, b) in a.paths.iter().zip(&b.paths) {
        all.push(relative(&mut a.place.iter().copied().zip(b.place.iter().copied()), 1.0));
        all.push(relative(&mut a.deflection.iter().copied().zip(b.deflection.iter().copied()), 1e-3));
    }
    if let (Some(a), Some(b)) = (&a.reactions, &b.reactions) {
        all.push(relative(&mut a.iter().zip(b).map(|(a, b)| (a.0, b.0)), 1e-4));
        all.push(relative(&mut a.iter().zip(b).map(|(a, b)| (a.1, b.1)), 1e-4));
    }
    all.into_iter().fold(0.0, f64::max)
}

#[test]
fn one_scene_is_one_motion_in_three_frames() {
    let bodies = bodies();
    for (name, scene) in golden() {
        let motions = bodies.iter().map(|body| simulate(body, &scene, &Context::QUIET).expect("a motion").0);
        let motions: Vec<Recording> = motions.collect();
        for other in &motions[1..] {
            let apart = apart(&motions[0], other);
            assert!(apart < 1e-8, "{name}: {apart:e}");
        }
    }
}

/// Vectors stated along axes of the body, of the model and of the world are equivalent.
#[test]
fn vectors_along_other_axes_say_the_same() {
    let bodies = bodies();
    let start = Vector3::new(0.4, -0.3, 0.8);
    let vectors = [Vector3::new(0.05, 0.3, -0.1), Vector3::new(1e-3, 0.0, 2e-3)];
    let text = |axes: &str, of_load: &str, [omega, force]: [Vector3<f64>; 2]| {
        let list = |v: Vector3<f64>| format!("[{:e}, {:e}, {:e}]", v.x, v.y, v.z);
        scene(&format!(
            "[run]\nduration = 4\noutputs = 10\ntolerance = 1e-12\n[initial]\nrotation = {}\nangular_velocity = {}\naxes = \"{axes}\"\n\
             [[load]]\nnode = 3\nforce = {}\naxes = \"{of_load}\"\n{POINTS}",
            list(start),
            list(omega),
            list(force)
        ))
    };
    let turn = RotationVector(start).axes();
    for body in &bodies {
        let run = |scene: &Scene| simulate(body, scene, &Context::QUIET).expect("a motion").0;
        let model = run(&text("model", "model", vectors));
        let axes = body.frame().axes;
        let own = run(&text("body", "body", vectors.map(|v| axes.tr_mul(&v))));
        let world = run(&text("world", "model", [turn * vectors[0], vectors[1]]));
        assert!(apart(&model, &own) < 1e-9 && apart(&model, &world) < 1e-9);
        // Initially every node is at its position of the model, rotated about the origin of the model.
        let at = model.paths[0].place[0];
        let raw = footed_block();
        let expected = turn * Vector3::from(raw.nodes.positions[2]);
        assert!((at - expected).norm() < 1e-12 * expected.norm(), "{at}, {expected}");
    }
}

#[test]
#[ignore = "slow"]
fn selections_and_studies_do_not_know_the_frame() {
    let bodies = bodies();
    for (name, mut scene) in golden() {
        scene.run.outputs = 20;
        let selections = bodies
            .iter()
            .map(|body| select(body, &[], &scene.clone().into(), &Context::QUIET).expect("a selection"));
        let selections: Vec<_> = selections.collect();
        for other in &selections[1..] {
            assert_eq!((other.groups, &other.modes), (selections[0].groups, &selections[0].modes), "{name}");
            let worst =
                |one: &flexbody_study::selection::Selection| one.chosen.as_ref().expect("measured").worst;
            assert!((worst(other) - worst(&selections[0])).abs() < 1e-5, "{name}");
        }
    }
    let [_, _, (name, scene), _] = golden();
    let settings = TradeSettings { repeat: 1, reserved: &[], varied: None };
    let studies = bodies.iter().map(|body| {
        let source = Source::new("body", body.clone(), Recipe::File, None).expect("a body");
        trade(&[source], &scene.clone().into(), None, &settings, &Context::QUIET).expect("a study")
    });
    let studies: Vec<_> = studies.collect();
    for other in &studies[1..] {
        assert_eq!(other.rows.len(), studies[0].rows.len(), "{name}");
        for (a, b) in other.rows.iter().zip(&studies[0].rows) {
            let (a, b) = (a.outcome.as_ref().expect("a motion"), b.outcome.as_ref().expect("a motion"));
            let (a, b) = (a.worst(), b.worst());
            assert!((a - b).abs() < 1e-4 * b.max(1e-2), "{name}: {a}, {b}");
        }
    }
}

//! Binary glTF: vertices, morph targets and animations of modes against the body.

use super::motion::block;
use super::readers::Glb;
use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use nalgebra::Vector3;
use oracle::exported::{bodies, exported, file};
use oracle::file_bodies::{body, wild_body};
use proptest::prelude::*;
use serde_json::Value;

/// Relative rounding of single precision, with a margin for two roundings.
const SINGLE: f64 = 2.0e-7;

/// Returns the drawn nodes, and their positions relative to the origin of the frame in metres.
fn drawn(body: &FlexBody) -> Vec<(usize, [f64; 3])> {
    let nodes: Vec<usize> = match body.mesh() {
        Some(mesh) => mesh.drawn_nodes().into_iter().map(|node| node as usize).collect(),
        None => (0..body.n_nodes()).collect(),
    };
    let metres = body.units().length.to_si();
    let place = |node: usize| {
        let x = Vector3::from(body.frame().to_model(body.nodes().positions[node])) - body.frame().origin;
        (x * metres).into()
    };
    nodes.into_iter().map(|node| (node, place(node))).collect()
}

fn apart(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// Asserts that every drawn node has a vertex at its position, with targets proportional to the shapes.
fn check(body: &FlexBody, glb: &Glb) {
    let (positions, targets) = glb.vertices();
    let nodes = drawn(body);
    assert!(positions.len() >= nodes.len());
    let size = nodes.iter().flat_map(|(_, x)| x).fold(0.0f64, |own, x| own.max(x.abs()));
    let axes = body.frame().axes;
    let at =
        |own: &[f64; 3]| positions.iter().position(|x| apart(x, own) <= SINGLE * size).expect("a vertex");
    let vertices: Vec<usize> = nodes.iter().map(|(_, place)| at(place)).collect();
    // Nodes at one position cannot be distinguished.
    let alone = |vertex: usize| vertices.iter().filter(|own| **own == vertex).count() == 1;
    assert_eq!(targets.len(), body.n_modes().min(8));
    for (j, target) in targets.iter().enumerate() {
        let shape = |node: usize| -> [f64; 3] {
            (axes * Vector3::from_fn(|k, _| body.modes().shape[(3 * node + k, j)])).into()
        };
        let length = |u: [f64; 3]| u[0].hypot(u[1]).hypot(u[2]);
        let largest = nodes.iter().map(|(node, _)| length(shape(*node))).fold(0.0, f64::max);
        let told = target.iter().map(|u| length(*u)).fold(0.0, f64::max);
        if largest == 0.0 {
            assert_eq!(told, 0.0);
            continue;
        }
        let extent = if body.extent() > 0.0 { body.extent() } else { 1.0 };
        let wanted = 0.1 * extent * body.units().length.to_si();
        assert!((told / wanted - 1.0).abs() < 1e-6, "{told} {wanted}");
        for ((node, _), vertex) in nodes.iter().zip(&vertices).filter(|(_, vertex)| alone(**vertex)) {
            let expected = shape(*node).map(|x| x / largest * wanted);
            assert!(apart(&target[*vertex], &expected) < 1e-6 * wanted, "mode {j} at node {node}");
        }
    }
    check_primitives(glb, positions.len(), targets.len());
    check_animations(glb, targets.len());
}

fn check_primitives(glb: &Glb, vertices: usize, targets: usize) {
    for primitive in glb.primitives() {
        let corners = match primitive["mode"].as_u64().expect("a mode") {
            0 => 1,
            1 => 2,
            4 => 3,
            other => panic!("mode {other}"),
        };
        assert_eq!(primitive["targets"].as_array().map_or(0, Vec::len), targets);
        if corners > 1 {
            let indices = glb.indices(&primitive["indices"]);
            assert!(indices.len().is_multiple_of(corners) && indices.iter().all(|index| *index < vertices));
        }
        if corners == 3 {
            let normals = glb.vectors(&primitive["attributes"]["NORMAL"]);
            assert_eq!(normals.len(), vertices);
            assert!(normals.iter().all(|n| (n.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-5));
        }
    }
}

/// Asserts that each mode has an animation: its weight is a sine of one period, the other weights are zero.
fn check_animations(glb: &Glb, targets: usize) {
    let names = glb.json["meshes"][0]["extras"]["targetNames"].as_array().expect("names");
    let animations = glb.json["animations"].as_array().expect("animations");
    assert_eq!((names.len(), animations.len()), (targets, targets));
    for (j, animation) in animations.iter().enumerate() {
        assert_eq!(animation["name"], names[j]);
        let (times, weights) = glb.channel(j, "weights");
        assert_eq!(weights.len(), times.len() * targets);
        assert_eq!((times[0], times[times.len() - 1]), (0.0, 2.0));
        for (time, weights) in times.iter().zip(weights.chunks(targets)) {
            for (k, weight) in weights.iter().enumerate() {
                let wanted = if k == j { (std::f64::consts::PI * time).sin() } else { 0.0 };
                assert!((weight - wanted).abs() < SINGLE);
            }
        }
    }
}

#[test]
fn bodies_of_every_kind_come_back() {
    for (name, body) in bodies() {
        let glb = Glb::read(&file(body, "gltf", None));
        check(body, &glb);
        let nodes = glb.json["nodes"].as_array().expect("nodes");
        // The vertical axis z of the model is y in the file.
        let turned: Vec<f64> =
            nodes[0]["rotation"].as_array().expect("a rotation").iter().map(number).collect();
        let up = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            turned[3], turned[0], turned[1], turned[2],
        )) * Vector3::z();
        assert!((up - Vector3::y()).norm() < 1e-12, "{name}");
        let held = body.interfaces().iter().filter(|interface| interface.reference.is_some());
        let names: Vec<&str> = held.map(|interface| interface.name.as_str()).collect();
        let told: Vec<&str> = nodes[2..].iter().map(|node| node["name"].as_str().expect("a name")).collect();
        assert_eq!(told, names, "{name}");
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// Flat sides of a block meet at sharp edges: every normal is along an axis, and vertices are split there.
#[test]
fn feature_edges_stay_sharp() {
    let folder = block();
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let glb = Glb::read(&file(&body, "gltf", None));
    let primitive = &glb.primitives()[0];
    assert_eq!(primitive["mode"], 4);
    for normal in glb.vectors(&primitive["attributes"]["NORMAL"]) {
        assert_eq!(normal.iter().filter(|x| x.abs() < 1e-6).count(), 2, "{normal:?}");
    }
    let mesh = body.mesh().expect("a surface");
    assert!(glb.vertices().0.len() > mesh.drawn_nodes().len());
    assert_eq!(glb.indices(&primitive["indices"]).len(), 3 * mesh.triangles().len());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bodies_come_back(seed in any::<u64>(), n in 1..9usize, nf in 1..4usize, interfaces in 0..4usize) {
        let body = body(seed, n, nf.min(3 * n), 0, interfaces);
        check(&body, &Glb::read(&file(&body, "gltf", None)));
    }

    /// Numbers beyond single precision are refused; other bodies give valid files.
    #[test]
    fn wild_bodies_are_written_or_refused(seed in any::<u64>(), n in 1..9usize, nf in 1..4usize) {
        let body = wild_body(seed, n, nf.min(3 * n), 0, 2);
        match exported(&body, "gltf", None) {
            Ok(exported) => drop(Glb::read(&exported.file)),
            Err(error) => prop_assert!(error.has(Code::ExportLoses), "{}", error),
        }
    }
}

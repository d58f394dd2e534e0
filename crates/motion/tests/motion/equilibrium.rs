//! Option `deformation = "static"`: equilibria remain, exist under the expected conditions, and do not depend
//! on the attitude.

use flexbody_base::error::Error;
use flexbody_body::flex_body::{FlexBody, GeometricStiffness, LoadKind, UnitLoad};
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, NodeSet, RawModel};
use flexbody_motion::scene::{LoadCases, Recording, Scene, simulate};
use nalgebra::{DMatrix, DVector};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, fixture};
use oracle::mesh::Mesh;
use oracle::random::Random;
use oracle::turning::block;
use std::f64::consts::TAU;
use std::fs;

/// Returns a solid bar along x with the interface `root`.
fn bar() -> RawModel {
    let mesh = Mesh::block(ElementKind::Hex8, [4, 1, 1], [1.0, 0.2, 0.16]);
    let root = (1..=mesh.nodes.len() as i64).filter(|i| mesh.nodes[*i as usize - 1][0] < 1e-9).collect();
    let mut raw = mesh
        .assemble(&Material { youngs: 1e7, poisson: 0.3, density: 1000.0 }, MassRule::Consistent)
        .raw_model();
    raw.data.interfaces = vec![NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("root", root) }];
    raw
}

/// Returns a block whose rigid end is one node with rotations, the interface `root`.
fn rigid_ended() -> RawModel {
    let mut raw = block(ElementKind::Hex8).raw;
    let reference = *raw.nodes.ids.last().expect("a node");
    raw.data.interfaces = vec![NodeSet::new("root", vec![reference])];
    raw
}

fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("written");
    LoadCases::read_single(&path, None).expect("a scene")
}

fn run(body: &FlexBody, text: &str) -> Result<Recording, Error> {
    simulate(body, &scene(text), &Context::QUIET).map(|(recording, _)| recording)
}

fn first_rate(body: &FlexBody) -> f64 {
    body.modes().eigenvalue[0].sqrt()
}

/// Returns the initial deformation, and its largest change in the norm of the elastic energy.
fn rest_and_change(body: &FlexBody, recording: &Recording) -> (DVector<f64>, f64) {
    let stiffness = body.invariants().modal_stiffness();
    let stiffness = DMatrix::from_fn(stiffness.nrows(), stiffness.ncols(), |i, j| stiffness[(i, j)]);
    let size = |q: &DVector<f64>| q.dot(&(&stiffness * q)).sqrt();
    let states: Vec<DVector<f64>> =
        recording.states.iter().map(|state| DVector::from_column_slice(&state.q)).collect();
    let largest = states.iter().map(|q| size(&(q - &states[0]))).fold(0.0, f64::max);
    (states[0].clone(), largest / size(&states[0]))
}

/// A carried body with constant rotation keeps its initial deformation for any attitude in the world.
#[test]
fn carried_equilibria_turn_with_the_world() {
    for (name, body) in [
        ("solid", body_of(bar(), 12, BodyFrame::Principal)),
        ("rigid end", body_of(rigid_ended(), 12, BodyFrame::Com)),
        ("beams", fixture("car_frame", 8, BodyFrame::Principal)),
    ] {
        let interface = body.interfaces()[0].name.clone();
        let rate = 0.1 * first_rate(&body);
        let place = body.interfaces()[0].reference.unwrap_or([0.5, 0.3, -0.4]);
        let way = [place[0] + 0.3, place[1] - 0.8, place[2] + 0.1].map(|x: f64| x.to_string()).join(", ");
        let text = |rotation: &str| {
            format!(
                "[run]\nduration = {}\noutputs = 12\ntolerance = 1e-12\n[initial]\ndeformation = \"static\"\n\
                 rotation = {rotation}\norigin = [0.3, 1, -2]\n[carried]\ninterface = \"{interface}\"\n\
                 [carried.spin]\naxis = [0.3, 1, 0.2]\nrate = {rate}\nthrough = [{way}]\n",
                TAU / first_rate(&body)
            )
        };
        let (reference, change) =
            rest_and_change(&body, &run(&body, &text("[0, 0, 0]")).expect("an equilibrium"));
        assert!(change < 2e-6, "{name}: {change:e}");
        for rotation in ["[0, 0, 1.5707963267948966]", "[0.7, -0.4, 2.1]"] {
            let (q, change) = rest_and_change(&body, &run(&body, &text(rotation)).expect("an equilibrium"));
            assert!(change < 2e-6, "{name}, {rotation}: {change:e}");
            assert!((&q - &reference).norm() < 1e-10 * reference.norm(), "{name}, {rotation}");
        }
    }
}

/// Slow spins cause deformation rates far below the inertia of the whole body.
#[test]
fn slow_spins_settle() {
    let mut random = Random(11);
    for name in ["frame_beams", "car_frame", "shell_folded"] {
        let body = fixture(name, 12, BodyFrame::Principal);
        for _ in 0..20 {
            let axis = random.vector::<3>().map(|x| x.to_string()).join(", ");
            let rate = 0.05 * 200f64.powf(0.5 * (random.signed() + 1.0));
            let text = format!(
                "[run]\nduration = {}\noutputs = 4\ntolerance = 1e-11\n[initial]\ndeformation = \"static\"\n\
                 [spin]\naxis = [{axis}]\nrate = {rate}\n",
                1.0 / first_rate(&body)
            );
            let (_, change) = rest_and_change(
                &body,
                &run(&body, &text).unwrap_or_else(|failure| panic!("{name}, {rate}: {failure}")),
            );
            assert!(change < 1e-6, "{name} at {rate} about {axis}: {change:e}");
        }
    }
}

/// A body in free fall or at constant velocity does not deform.
#[test]
fn nothing_deforms_what_falls_freely() {
    for body in [body_of(bar(), 10, BodyFrame::Model), fixture("shell_folded", 10, BodyFrame::Principal)] {
        for what in ["", "gravity = [3, -9.81, 1]\n", "gravity = [0, 0, -9810]\n"] {
            let text = format!(
                "{what}[run]\nduration = {}\noutputs = 2\n[initial]\ndeformation = \"static\"\nvelocity = [3, 1, 200]\n\
                 rotation = [0.4, 1, -0.3]\n",
                1.0 / first_rate(&body)
            );
            let recording = run(&body, &text).expect("an equilibrium");
            let energy = recording.balances[0].elastic;
            let weight = 9810.0 * body.invariants().mass();
            let rounding = (1e-12 * weight / first_rate(&body)).powi(2);
            assert!(energy <= rounding, "{what}: {energy:e}");
        }
    }
}

/// Geometric stiffness of three times the elastic one gives a quarter of the deflection, and a reduction by
/// half doubles it.
#[test]
fn geometric_stiffness_as_large_as_the_elastic_one_settles() {
    let body = body_of(bar(), 12, BodyFrame::Principal);
    let stiffness = body.invariants().modal_stiffness().clone();
    let rate = 1e-4 * first_rate(&body);
    let text = format!(
        "[run]\nduration = {}\noutputs = 6\ntolerance = 1e-12\n[initial]\ndeformation = \"static\"\n\
         [spin]\naxis = [0, 0, 1]\naxes = \"body\"\nrate = {rate}\n",
        1.0 / first_rate(&body)
    );
    let (plain, _) = rest_and_change(&body, &run(&body, &text).expect("an equilibrium"));
    for (share, left) in [(3.0, 0.25), (-0.5, 2.0)] {
        let mut parts = body.clone().into_parts();
        let matrix = faer::Scale(share / (rate * rate)) * &stiffness;
        parts.geometric_stiffness =
            vec![GeometricStiffness { load: UnitLoad { kind: LoadKind::Spin, component: 2 }, matrix }];
        let stressed = FlexBody::new(parts).expect("a body");
        let (q, change) = rest_and_change(&stressed, &run(&stressed, &text).expect("an equilibrium"));
        assert!(change < 1e-8, "{share}: {change:e}");
        assert!((&q - &plain * left).norm() < 1e-6 * plain.norm(), "{share}: {q} {plain}");
    }
    // For a spin that cancels all stiffness the equilibrium is unstable.
    let mut parts = body.clone().into_parts();
    let matrix = faer::Scale(-3.0 / (rate * rate)) * &stiffness;
    parts.geometric_stiffness =
        vec![GeometricStiffness { load: UnitLoad { kind: LoadKind::Spin, component: 2 }, matrix }];
    let Err(refused) = run(&FlexBody::new(parts).expect("a body"), &text) else {
        panic!("a body that its spin softens below zero settles");
    };
    let refused = refused.to_string();
    assert!(refused.contains("makes the stiffness of some motion zero or negative"), "{refused}");
}

//! Bodies carried at an interface, compared with dense solutions of the clamped model, closed forms and the
//! prescribed motion of the interface.

use crate::program::flexbody;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::{Carrier, FlexBody, TermGroups};
use flexbody_body::invariants::{BodyFrame, condense};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::SymmetricMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet, RawModel};
use flexbody_motion::dynamics::{Orientation, RotationVector};
use flexbody_motion::scene::{LoadCases, Recording, simulate};
use flexbody_study::selection::select;
use nalgebra::{DVector, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::fixtures;
use oracle::flexible::{body_of, fixture};
use oracle::held::{HeldModel, dense_matrix};
use oracle::mesh::Mesh;
use oracle::random::Random;
use std::fs;
use std::path::Path;

const LENGTH: f64 = 1.0;
const SOFT: Material = Material { youngs: 1e7, poisson: 0.0, density: 1000.0 };
const ALL: usize = 54;

/// Returns a bar along x with the interface `root` at x = 0 and the interface `tip` at the other end.
fn bar() -> (Mesh, RawModel) {
    let mesh = Mesh::block(ElementKind::Hex8, [4, 1, 1], [LENGTH, 0.2, 0.16]);
    let raw = with_ends(&mesh, mesh.assemble(&SOFT, MassRule::Consistent).raw_model());
    (mesh, raw)
}

/// Adds the interfaces of a bar, located by the positions of its nodes in the straight mesh.
fn with_ends(straight: &Mesh, mut raw: RawModel) -> RawModel {
    let end = |x: f64| -> Vec<i64> {
        let kept = straight.nodes.iter().enumerate().filter(|(_, node)| (node[0] - x).abs() < 1e-9);
        kept.map(|(i, _)| i as i64 + 1).collect()
    };
    raw.data.interfaces = [("root", 0.0), ("tip", LENGTH)]
        .map(|(name, x)| NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, end(x)) })
        .to_vec();
    raw
}

/// Returns the bar rotated and shifted, so that no axes coincide with those of the model.
fn turned_bar() -> RawModel {
    let (straight, _) = bar();
    let turned = straight.moved(&Random(7).rotation(), [3.0, -1.0, 0.5]);
    with_ends(&straight, turned.assemble(&SOFT, MassRule::Consistent).raw_model())
}

fn root() -> Carrier {
    Carrier::Interface("root".to_owned())
}

/// Returns the displacements under the weight of all nodes.
fn hanging_model(held: &HeldModel, raw: &RawModel, gravity: Vector3<f64>) -> DVector<f64> {
    let mass = dense_matrix(&raw.mass.matrix);
    let field = DVector::from_fn(mass.nrows(), |row, _| gravity[row % 3]);
    let load = held.motions.tr_mul(&(mass * field));
    &held.motions * held.stiffness.clone().cholesky().expect("held").solve(&load)
}

/// Returns the static displacements of a carried body under gravity, in model axes.
fn hanging(carried: &FlexBody, gravity: Vector3<f64>) -> DVector<f64> {
    let (invariants, shape) = (carried.invariants(), &carried.modes().shape);
    let q = |j: usize| {
        let load: f64 = (0..3).map(|k| invariants.c1()[(k, j)] * gravity[k]).sum();
        load / invariants.modal_stiffness()[(j, j)]
    };
    let q: Vec<f64> = (0..carried.n_modes()).map(q).collect();
    DVector::from_fn(shape.nrows(), |row, _| q.iter().enumerate().map(|(j, q)| shape[(row, j)] * q).sum())
}

#[test]
fn with_all_modes_the_carried_body_is_the_clamped_model() {
    let raw = turned_bar();
    let clamped = HeldModel::new(&raw, &raw.data.interfaces[0].nodes);
    let body = body_of(raw.clone(), ALL, BodyFrame::Principal);
    assert_eq!(body.n_modes(), ALL);
    let carried = body.carried(&root()).expect("an interface");
    let own = carried.eigenvalues_in_frame().expect("definite");
    for (own, expected) in own.iter().zip(clamped.eigenvalues()) {
        assert!((own / expected - 1.0).abs() < 1e-8, "{own:e}, {expected:e}");
    }
    let gravity = Vector3::new(2.0, -9.81, 4.0);
    let (own, expected) = (hanging(&carried, gravity), hanging_model(&clamped, &raw, gravity));
    assert!((&own - &expected).amax() < 1e-9 * expected.amax(), "{:e}", (&own - &expected).amax());
    // Carrying a body twice by one interface changes nothing; by another interface and back, only rounding.
    assert_eq!(carried.carried(&root()).expect("an interface"), carried);
    let there = carried.carried(&Carrier::Interface("tip".to_owned())).expect("an interface");
    let back = hanging(&there.carried(&root()).expect("an interface"), gravity);
    assert!((&back - &expected).amax() < 1e-9 * expected.amax());
}

/// The invariants of the transformed modes agree with the mass matrix.
#[test]
fn carried_invariants_are_those_of_the_mass_matrix() {
    let (straight, _) = bar();
    let turned = straight.moved(&Random(7).rotation(), [3.0, -1.0, 0.5]);
    let assembly = turned.assemble(&SOFT, MassRule::Consistent);
    let mass = SymmetricMatrix::new(assembly.scalar_mass.clone()).expect("symmetric");
    for &frame in BodyFrame::ALL {
        let body = body_of(with_ends(&straight, assembly.raw_model()), 20, frame);
        let carried = body.carried(&root()).expect("an interface");
        let shape = carried.modes().shape.as_ref();
        let stiffness = carried.invariants().modal_stiffness().clone();
        let expected = condense(&mass, &carried.nodes().positions, shape, stiffness);
        let own = carried.invariants();
        let far = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() / b.norm_max();
        assert!((own.first_moment() - expected.first_moment()).amax() < 1e-12 * own.first_moment().amax());
        assert!((own.second_moment() - expected.second_moment()).amax() < 1e-12 * own.second_moment().amax());
        let pairs = [
            (own.c1().clone(), expected.c1().clone()),
            (own.c2(), expected.c2()),
            (own.modal_mass(), expected.modal_mass()),
            (own.w1().expect("held"), expected.w1().expect("held")),
            (own.w2().expect("held"), expected.w2().expect("held")),
            (own.w3().expect("held"), expected.w3().expect("held")),
        ];
        for (at, (own, expected)) in pairs.iter().enumerate() {
            assert!(far(own, expected) < 1e-10, "{frame:?}, {at}: {:e}", far(own, expected));
        }
    }
}

/// Terms linear in the modes are exact for nodal rotations too: M acts on the rows of the model.
#[test]
fn carried_frames_of_beams_keep_what_is_linear_in_the_modes() {
    let folder = fixtures().join("models/car_frame");
    let raw = read_model(&read_manifest(folder.join("model.toml")).expect("a manifest")).expect("a model");
    let name = raw.data.interfaces[0].name.clone();
    let model = FeModel::from_raw(raw).expect("a body").model;
    let body = fixture("car_frame", 8, BodyFrame::Principal);
    assert!(body.invariants().general().is_some());
    let carried = body.carried(&Carrier::Interface(name)).expect("an interface");
    let modes = carried.vectors_of(&model).expect("a body of the model");
    let product = model.pencil().apply_mass(modes.as_ref());
    let (own, expected) = (carried.invariants().modal_mass(), modes.transpose() * &product);
    assert!((&own - &expected).norm_max() < 1e-10 * expected.norm_max());
    let along =
        |k: usize, j: usize| -> f64 { (0..model.nodes().len()).map(|i| product[(3 * i + k, j)]).sum() };
    let expected = Mat::from_fn(3, modes.ncols(), along);
    assert!((carried.invariants().c1() - &expected).norm_max() < 1e-10 * expected.norm_max());
}

fn run(body: &FlexBody, text: &str) -> (Recording, Vec<Diagnostic>) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("written");
    simulate(body, &LoadCases::read_single(&path, None).expect("a scene"), &Context::QUIET).expect("a motion")
}

#[test]
#[ignore = "slow"]
fn a_cantilever_bends_under_gravity_and_its_root_carries_the_weight() {
    let raw = turned_bar();
    let clamped = HeldModel::new(&raw, &raw.data.interfaces[0].nodes);
    let body = body_of(raw.clone(), ALL, BodyFrame::Principal);
    let (recording, said) = run(
        &body,
        "gravity = [0, 0, -9.81]\n[run]\nduration = 2\noutputs = 2\ntolerance = 1e-10\n[damping]\nratio = 0.5\n\
         [carried]\ninterface = \"root\"\n[[watch]]\nnode = 20\n",
    );
    assert!(said.iter().all(|d| d.code() != Code::CarrierUnresolved), "{said:?}");
    let expected = hanging_model(&clamped, &raw, Vector3::new(0.0, 0.0, -9.81));
    let expected = Vector3::new(expected[57], expected[58], expected[59]);
    let own = recording.paths[0].deflection[2];
    assert!((own - expected).norm() < 1e-7 * expected.norm(), "{own}, {expected}");
    let weight = 9.81 * body.invariants().mass();
    let (force, torque) = recording.reactions.as_ref().expect("a reaction")[2];
    assert!((force - Vector3::new(0.0, 0.0, weight)).norm() < 1e-7 * weight, "{force}");
    // About the reference point the weight acts at the deflected centre of mass.
    let centre = body.frame().origin - recording.setting.origin;
    let lever = centre.cross(&Vector3::new(0.0, 0.0, weight));
    assert!((torque - lever).norm() < 2e-2 * lever.norm(), "{torque}, {lever}");
}

/// The extension is u(L) = rho w^2 / E (R L^2 / 2 + L^3 / 3), with the radius R of the root.
#[test]
#[ignore = "slow"]
fn a_spun_bar_stretches_by_the_closed_form_and_pulls_at_its_root() {
    let (_, raw) = bar();
    let body = body_of(raw, ALL, BodyFrame::Principal);
    let (rate, radius) = (0.05, 0.4);
    let (recording, _) = run(
        &body,
        &format!(
            "[run]\nduration = 2\noutputs = 2\ntolerance = 1e-10\n[damping]\nratio = 0.5\n[[watch]]\ninterface = \"tip\"\n\
             [carried]\ninterface = \"root\"\n[carried.spin]\naxis = [0, 0, 1]\nthrough = [-{radius}, 0.1, 0.08]\nrate = {rate}\n"
        ),
    );
    let load = SOFT.density * rate * rate / SOFT.youngs;
    let expected = load * (radius * LENGTH.powi(2) / 2.0 + LENGTH.powi(3) / 3.0);
    let own = recording.paths[0].deflection[2];
    // The extension increases the load, and the bar does not bend.
    assert!((own.x / expected - 1.0).abs() < 1e-5, "{own}, {expected:e}");
    assert!(own.y.abs() + own.z.abs() < 1e-6 * expected);
    let pull = body.invariants().mass() * rate * rate * (radius + 0.5 * LENGTH);
    let (force, _) = recording.reactions.as_ref().expect("a reaction")[2];
    assert!((force.x / -pull - 1.0).abs() < 1e-5, "{force}, {pull:e}");
}

#[test]
fn accelerations_of_the_interface_act_like_gravity() {
    let body = body_of(turned_bar(), 12, BodyFrame::Com);
    let head = "[run]\nduration = 0.4\noutputs = 8\ntolerance = 1e-11\n[[watch]]\nnode = 20\n[carried]\ninterface = \"root\"\n";
    let (held, said) = run(&body, &format!("gravity = [1, -2, -3]\n{head}"));
    assert!(said.iter().any(|d| d.code() == Code::CarrierUnresolved), "free modes alone: {said:?}");
    let size = 14f64.sqrt();
    let pushed = format!("{head}[carried.translation]\ndirection = [-1, 2, 3]\nacceleration = {size}\n");
    let (pushed, _) = run(&body, &pushed);
    let largest = held.paths[0].deflection.iter().map(|d| d.norm()).fold(0.0, f64::max);
    for (a, b) in held.paths[0].deflection.iter().zip(&pushed.paths[0].deflection) {
        assert!((a - b).norm() < 1e-7 * largest, "{a}, {b}");
    }
    let ((a, s), (b, t)) = (held.reactions.as_ref().unwrap()[8], pushed.reactions.as_ref().unwrap()[8]);
    assert!((a - b).norm() < 1e-6 * a.norm() && (s - t).norm() < 1e-6 * s.norm());
    // A ramp of the displacement ends at its value, and a sine of the velocity returns to zero.
    for (drive, end) in [
        ("displacement = { to = 0.3, duration = 0.4 }", 0.3),
        ("velocity = { amplitude = 2, frequency = 2.5 }", 0.0),
        ("velocity = { times = [0.1, 0.2], values = [0, 3] }", 0.15 + 0.6),
    ] {
        let text = format!("{head}[carried.translation]\ndirection = [0, 0, 2]\n{drive}\n");
        let (moved, _) = run(&body, &text);
        let way = moved.states[8].origin - moved.states[0].origin;
        assert!((way - Vector3::new(0.0, 0.0, end)).norm() < 1e-8, "{drive}: {way}");
    }
}

/// The carried interface follows its prescribed motion, whatever the body.
#[test]
fn the_interface_goes_its_prescribed_way() {
    let body = body_of(turned_bar(), 10, BodyFrame::Principal);
    let (recording, _) = run(
        &body,
        "gravity = [0, 0, -9.81]\n[run]\nduration = 0.5\noutputs = 10\ntolerance = 1e-11\n\
         [initial]\norigin = [0.1, 0.2, 0.3]\nrotation = [0.3, -0.5, 0.2]\n\
         [[load]]\ninterface = \"tip\"\nforce = [5, 3, 1]\n[[watch]]\ninterface = \"root\"\n\
         [carried]\ninterface = \"root\"\n[carried.spin]\naxis = [1, 2, 2]\nthrough = [1, 1, 1]\n\
         rate = { amplitude = 4, frequency = 1.5, phase = 0.4 }\n\
         [carried.translation]\ndirection = [0, 3, 4]\nvelocity = { times = [0.1, 0.3], values = [0, 2] }\n",
    );
    let (axis, through) = (Vector3::new(1.0, 2.0, 2.0) / 3.0, Vector3::repeat(1.0));
    let start = RotationVector(Vector3::new(0.3, -0.5, 0.2)).axes();
    let root = recording.setting.origin;
    for (i, time) in recording.time.iter().enumerate() {
        let frequency = std::f64::consts::TAU * 1.5;
        let angle = 4.0 / frequency * (0.4f64.cos() - (frequency * time + 0.4).cos());
        let way = match time {
            t if *t < 0.1 => 0.0,
            t if *t < 0.3 => 5.0 * (t - 0.1) * (t - 0.1),
            t => 0.2 + 2.0 * (t - 0.3),
        };
        let turned = start * RotationVector(axis * angle).axes();
        let centre = Vector3::new(0.1, 0.2, 0.3) + start * through + Vector3::new(0.0, 0.6, 0.8) * way;
        let expected = centre + turned * (root - through);
        let path = &recording.paths[0];
        assert!((path.place[i] - expected).norm() < 1e-8, "at {time}: {}, {expected}", path.place[i]);
        assert!(path.deflection[i].norm() < 1e-12);
        assert!((recording.states[i].attitude.axes() - turned).amax() < 1e-8);
    }
    assert!(recording.drift().energy < 1e-7, "{:e}", recording.drift().energy);
}

#[test]
fn selections_for_a_carried_body_keep_what_moves_it_and_hold() {
    let body = body_of(turned_bar(), 20, BodyFrame::Principal);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let text = "gravity = [0, 0, -9.81]\n[run]\nduration = 0.5\noutputs = 50\n[damping]\nratio = 0.02\n[carried]\ninterface = \"root\"\n\
                [carried.spin]\nrate = { to = 0.3, duration = 0.4 }\n[[watch]]\ninterface = \"tip\"\n";
    fs::write(&path, text).expect("written");
    let scene = LoadCases::read_single(&path, None).expect("a scene");
    let selection = select(&body, &[], &scene.clone().into(), &Context::QUIET).expect("a selection");
    // The carrier turns slowly: its acceleration and gravity bend the bar, the terms of deformed inertia do not.
    assert!(selection.holds() && selection.groups == TermGroups::NONE, "{:?}", selection.terms);
    assert!(selection.modes.len() < body.n_modes(), "{:?}", selection.modes);
    let small = body.reduced(&selection.modes, selection.groups, selection.terms.clone()).expect("a body");
    let ends = [&body, &small].map(|body| {
        let recording = simulate(body, &scene, &Context::QUIET).expect("a motion").0;
        recording.paths[0].deflection.clone()
    });
    let largest = ends[0].iter().map(|d| d.norm()).fold(0.0, f64::max);
    let apart = ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart < 0.011 * largest, "{apart:e} of {largest:e}");
}

/// Creates a folder with the bracket, whose base is rigid like a bolted one.
fn bolted_bracket() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let from = fixtures().join("models/bracket_hex20");
    for file in ["K.mtx.gz", "M.mtx.gz", "nodes.csv", "dofs.csv", "matrices.inp.gz"] {
        fs::copy(from.join(file), folder.path().join(file)).expect("copied");
    }
    let text = fs::read_to_string(from.join("model.toml")).expect("a manifest");
    let bolted = text.replace("name = \"bolt_base\"\n", "name = \"bolt_base\"\ncoupling = \"rigid\"\n");
    assert_ne!(text, bolted);
    fs::write(folder.path().join("model.toml"), bolted).expect("written");
    folder
}

fn done(folder: &Path, words: &[&str]) -> String {
    let run = flexbody(folder, words);
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.status.success(), "{words:?}: {said}");
    said
}

/// Returns the displacements under the weight of all nodes, clamped at the nodes `held`, by conjugate
/// gradients on K.
fn clamped_static(folder: &Path, gravity: Vector3<f64>, held: &[i64]) -> (Vec<i64>, Vec<f64>) {
    let raw = read_model(&read_manifest(folder.join("model.toml")).expect("a manifest")).expect("a model");
    let model = FeModel::from_raw(raw).expect("a body").model;
    let (ids, n) = (model.nodes().ids.clone(), 3 * model.nodes().len());
    let free: Vec<bool> = ids.iter().flat_map(|id| [!held.contains(id); 3]).collect();
    let field = Mat::from_fn(n, 1, |row, _| gravity[row % 3]);
    let load = model.pencil().apply_mass(field.as_ref());
    let k = model.stiffness();
    let times = |x: &[f64]| -> Vec<f64> {
        let row = |i: usize| {
            let (columns, values) = k.row(i);
            columns.iter().zip(values).map(|(&j, v)| v * x[j as usize]).sum::<f64>()
        };
        (0..n).map(|i| if free[i] { row(i) } else { 0.0 }).collect()
    };
    let diagonal = k.diagonal();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut r: Vec<f64> = (0..n).map(|i| if free[i] { load[(i, 0)] } else { 0.0 }).collect();
    let precondition = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
    let mut z = precondition(&r);
    let (mut x, mut p, mut energy) = (vec![0.0; n], z.clone(), dot(&r, &z));
    let first = energy;
    for _ in 0..20_000 {
        if energy < 1e-20 * first {
            return (ids, x);
        }
        let q = times(&p);
        let step = energy / dot(&p, &q);
        (0..n).for_each(|i| {
            x[i] += step * p[i];
            r[i] -= step * q[i];
        });
        z = precondition(&r);
        let new = dot(&r, &z);
        (0..n).for_each(|i| p[i] = z[i] + new / energy * p[i]);
        energy = new;
    }
    panic!("conjugate gradients do not converge");
}

/// Compares a bracket bolted to a shaft under gravity with the clamped finite element model.
#[test]
#[ignore = "slow"]
fn the_bracket_that_is_bolted_to_a_shaft_hangs_by_what_the_model_says() {
    let folder = bolted_bracket();
    let place = folder.path();
    let words =
        ["convert", "model.toml", "--basis", "craig-bampton", "--modes", "12", "-o", "b.flex.h5", "--quiet"];
    done(place, &words);
    let scene = "gravity = [0, 0, -9810]\n[run]\nduration = 0.05\noutputs = 5\n[damping]\nratio = 0.5\n\
                 [carried]\ninterface = \"bolt_base\"\n[[watch]]\nnode = 20000\n";
    fs::write(place.join("scene.toml"), scene).expect("written");
    let said = done(place, &["simulate", "b.flex.h5", "--scene", "scene.toml", "--report", "motion.txt"]);
    assert!(!said.contains("FB54"), "{said}");
    let text = fs::read_to_string(place.join("motion.txt")).expect("a report");
    assert!(text.contains("interface bolt_base; natural frequencies"), "{text}");
    assert!(text.contains("0, 0, -9810 mm/s^2 along the axes of the model"), "{text}");

    let manifest = read_manifest(place.join("model.toml")).expect("a manifest");
    let raw = read_model(&manifest).expect("a model");
    let base = raw.data.interfaces.iter().find(|set| set.name == "bolt_base").expect("an interface");
    let (ids, u) = clamped_static(place, Vector3::new(0.0, 0.0, -9810.0), &base.nodes);
    let at = ids.iter().position(|id| *id == 20000).expect("a node");
    let expected = Vector3::new(u[3 * at], u[3 * at + 1], u[3 * at + 2]);
    let body = flexbody_file::read(place.join("b.flex.h5")).expect("a body");
    let described = LoadCases::read_single(place.join("scene.toml"), None).expect("a scene");
    let (recording, _) = simulate(&body, &described, &Context::QUIET).expect("a motion");
    let own = recording.paths[0].deflection[5];
    assert!((own - expected).norm() < 2e-3 * expected.norm(), "{own}, {expected}");
    let weight = 9810.0 * body.invariants().mass();
    let force = recording.reactions.as_ref().expect("a reaction")[5].0;
    assert!((force.z / weight - 1.0).abs() < 1e-6 && force.x.abs() + force.y.abs() < 1e-6 * weight);

    // In mean axes gravity bends nothing, and the program warns of that.
    let held = scene.replace("[carried]\ninterface = \"bolt_base\"\n", "[spin]\nrate = 0\nhold = true\n");
    fs::write(place.join("scene.toml"), held).expect("written");
    let said = done(place, &["simulate", "b.flex.h5", "--scene", "scene.toml"]);
    assert!(said.contains("FB545") && said.contains("[carried]"), "{said}");
}

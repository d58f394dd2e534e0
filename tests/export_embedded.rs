//! The embedded format: the C header, compiled as a real-time program does it, computes what the library computes. Needs a C compiler, as
//! the project itself does.

mod support;

use flexbody::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody::convert::{ConvertSettings, convert};
use flexbody::diagnostic::Code;
use flexbody::dynamics::{BodyPoint, EquationsOfMotion, Evaluation, Terms};
use flexbody::eigen::Wanted;
use flexbody::export::{ExportFrame, ExportOptions, Exported, Points, export, find_format, frames};
use flexbody::flex_body::FlexBody;
use flexbody::input::{read_manifest, read_model};
use flexbody::invariants::BodyFrame;
use flexbody::model::{FeModel, LoadKind};
use flexbody::progress::SILENT;
use nalgebra::Vector3;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use support::flexible::{fixture, lively_state, stressed};
use support::partial::{combinations, with_groups};
use support::random::Random;
use tempfile::TempDir;

const STATES: usize = 4;

/// Flags that the evaluation must compile with.
const STRICT: &[&str] =
    &["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-pedantic", "-ffreestanding"];

/// A body as a C program has it.
struct Compiled {
    folder: TempDir,
    exported: Exported,
}

fn exported(body: &FlexBody, dialect: &str, points: &Points) -> Exported {
    let options = ExportOptions { dialect: Some(dialect.to_owned()), points: points.clone() };
    let format = find_format("embedded").expect("registered");
    let (exported, losses) = export(body, format, &options, false).expect("exports");
    assert!(losses.is_empty());
    exported
}

fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}; the C compiler is `cc`"));
    output
}

#[track_caller]
fn succeed(command: &mut Command) {
    let output = run(command);
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
}

impl Compiled {
    fn new(exported: Exported, flags: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let [("h", header)] = &exported.beside[..] else { panic!("a header beside the file") };
        std::fs::write(path("body.h"), header).expect("writable");
        std::fs::write(path("body.bin"), &exported.file).expect("writable");
        // The name of a type that the header defines has the prefix of all names.
        let text = std::str::from_utf8(header).expect("ASCII");
        let small = text.split_once("_evaluation;").expect("a type").0.rsplit(' ').next().expect("a name");
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/embedded");
        let object = |name: &str| path(name).with_extension("o");
        succeed(
            Command::new("cc")
                .args(STRICT)
                .args(flags)
                .arg(format!("-DBODY_HEADER=\"{}\"", path("body.h").display()))
                .arg(format!("-DSMALL={small}_"))
                .arg(format!("-DCAPITAL={}_", small.to_uppercase()))
                .arg("-c")
                .arg(sources.join("evaluation.c"))
                .arg("-o")
                .arg(object("evaluation")),
        );
        succeed(
            Command::new("cc")
                .args(["-std=c11", "-Wall", "-Wextra", "-Werror"])
                .args(flags)
                .arg(sources.join("driver.c"))
                .arg(object("evaluation"))
                .arg("-o")
                .arg(path("driver")),
        );
        Self { folder, exported }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// What opening `data`, `start` bytes behind a multiple of 64, returns.
    fn opened(&self, data: &[u8], start: usize) -> i32 {
        std::fs::write(self.path("changed.bin"), data).expect("writable");
        let start = start.to_string();
        let output = run(Command::new(self.path("driver")).arg(self.path("changed.bin")).arg(start));
        output.status.code().unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(&output.stderr)))
    }

    /// The results at the states, `bytes` per number.
    fn results(&self, states: &[Vec<f64>], bytes: usize) -> Vec<f64> {
        let number = |v: &f64| if bytes == 8 { v.to_le_bytes().to_vec() } else { (*v as f32).to_le_bytes().to_vec() };
        std::fs::write(self.path("states"), states.concat().iter().flat_map(number).collect::<Vec<u8>>())
            .expect("writable");
        let output =
            run(Command::new(self.path("driver")).arg(self.path("body.bin")).arg("0").arg(self.path("states")));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |raw: &[u8]| match bytes {
            8 => f64::from_le_bytes(raw.try_into().expect("eight")),
            _ => f64::from(f32::from_le_bytes(raw.try_into().expect("four"))),
        };
        output.stdout.chunks_exact(bytes).map(read).collect()
    }
}

/// q, nu, applied forces, gravity, a force and a torque that suit the body.
fn state(random: &mut Random, body: &FlexBody) -> Vec<f64> {
    let own = lively_state(random, body);
    let (mass, size) = (body.invariants().mass, body.invariants().inertia().norm().sqrt());
    let rate = body.modes().eigenvalue[0].sqrt();
    let of_nu = |linear: Vector3<f64>, angular: Vector3<f64>| match body.dimension() {
        2 => vec![linear.x, linear.y, angular.z],
        _ => [linear.as_slice(), angular.as_slice()].concat(),
    };
    let mut vector = |size: f64| Vector3::from(random.vector::<3>()) * size;
    let acceleration = rate * rate * size / mass.sqrt();
    let gravity = vector(acceleration);
    let force = vector(mass * acceleration);
    let torque = vector(size * size * rate * rate);
    let applied = of_nu(vector(mass * acceleration), vector(size * size * rate * rate));
    let plane = |v: Vector3<f64>, turns: bool| match body.dimension() {
        2 if turns => [0.0, 0.0, v.z],
        2 => [v.x, v.y, 0.0],
        _ => v.into(),
    };
    let modal: Vec<f64> = (0..body.n_modes()).map(|_| size * rate * rate * random.signed()).collect();
    [
        own.q.as_slice(),
        &of_nu(own.velocity, own.omega),
        own.qd.as_slice(),
        &applied,
        &modal,
        &plane(gravity, false),
        &plane(force, false),
        &plane(torque, true),
    ]
    .concat()
}

/// The frame as the library has it.
fn point(body: &FlexBody, all: &[ExportFrame], frame: &ExportFrame) -> BodyPoint {
    let alone = all.iter().filter(|other| other.name == frame.name).count() == 1;
    let interface = body.interfaces().iter().find(|interface| Some(&interface.name) == frame.name.as_ref());
    let reference = interface
        .filter(|_| alone)
        .and_then(|interface| BodyPoint::interface(body, interface, Terms::ALL));
    reference.unwrap_or_else(|| {
        let node = body.nodes().ids.iter().position(|id| *id == frame.id).expect("a node");
        BodyPoint::node(body, node)
    })
}

/// What the C program must find: the numbers, each with its scale.
fn expected(body: &FlexBody, points: &Points, state: &[f64]) -> Vec<(f64, f64)> {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let (nf, n, r) = (equations.n_modes(), equations.n_velocities(), equations.n_rigid());
    let mut evaluation = Evaluation::new(&equations);
    let (q, rest) = state.split_at(nf);
    let (nu, rest) = rest.split_at(n);
    let (applied, rest) = rest.split_at(n);
    let [gravity, force, torque] = [0, 3, 6].map(|at| Vector3::from_column_slice(&rest[at..at + 3]));
    evaluation.set(q, nu);
    let mut found = Vec::new();
    let mut add = |values: &[f64]| {
        let scale = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        found.extend(values.iter().map(|v| (*v, scale)));
    };
    let of_nu = |add: &mut dyn FnMut(&[f64]), values: &[f64]| {
        add(&values[..r - r / 2]);
        add(&values[r - r / 2..r]);
        add(&values[r..]);
    };
    let zeros = || vec![0.0; n];

    let mut numbers = zeros();
    evaluation.accelerations(applied, &mut numbers).expect("a body with mass");
    add(&[0.0]);
    of_nu(&mut add, &numbers);
    evaluation.balance(applied, &mut numbers);
    of_nu(&mut add, &numbers);
    let (p, h) = (evaluation.linear_momentum(), evaluation.angular_momentum());
    let rigid = if r == 3 { vec![p.x, p.y, h.z] } else { [p.as_slice(), h.as_slice()].concat() };
    numbers[..r].copy_from_slice(&rigid);
    evaluation.modal_momentum(&mut numbers[r..]);
    of_nu(&mut add, &numbers);
    numbers = zeros();
    evaluation.add_gravity(&gravity, &mut numbers);
    of_nu(&mut add, &numbers);
    add(&[evaluation.kinetic_energy()]);
    add(&[evaluation.elastic_energy()]);
    let all = frames(body, points);
    for frame in &all {
        let point = point(body, &all, frame);
        add(point.place(&evaluation).as_slice());
        add(point.velocity(&evaluation).as_slice());
        let turn = point.axes(&evaluation).zip(point.angular_velocity(&evaluation));
        // FLEXBODY_NO_ORIENTATION.
        add(&[if turn.is_some() { 0.0 } else { 10.0 }]);
        let (axes, rate) = turn.map_or(([0.0; 9], [0.0; 3]), |(axes, rate)| {
            (std::array::from_fn(|at| axes[(at / 3, at % 3)]), rate.into())
        });
        add(&axes);
        add(&rate);
        numbers = zeros();
        point.add_force(&evaluation, &force, &mut numbers);
        if turn.is_some() {
            point.add_torque(&evaluation, &torque, &mut numbers);
        }
        of_nu(&mut add, &numbers);
    }
    found
}

/// Largest error of the C program relative to the largest number beside each.
fn error(compiled: &Compiled, body: &FlexBody, points: &Points, bytes: usize) -> f64 {
    let mut random = Random(body.n_nodes() as u64);
    let mut states: Vec<Vec<f64>> = (0..STATES).map(|_| state(&mut random, body)).collect();
    if bytes == 4 {
        states.iter_mut().flatten().for_each(|v| *v = f64::from(*v as f32));
    }
    let expected: Vec<(f64, f64)> = states.iter().flat_map(|state| expected(body, points, state)).collect();
    let found = compiled.results(&states, bytes);
    assert_eq!(found.len(), expected.len());
    let worst = found.iter().zip(&expected).map(|(found, (value, scale))| {
        let off = (found - value).abs();
        if off == 0.0 { 0.0 } else { off / scale }
    });
    worst.fold(0.0, f64::max)
}

/// Frames where the body has interfaces, else some nodes.
fn some_points(body: &FlexBody) -> Points {
    match body.interfaces() {
        [] => Points::Some(body.nodes().ids.iter().copied().step_by(1 + body.n_nodes() / 3).collect()),
        _ => Points::Usual,
    }
}

#[track_caller]
fn assert_same(name: &str, body: &FlexBody, flags: &[&str]) {
    let points = some_points(body);
    let compiled = Compiled::new(exported(body, "double", &points), flags);
    let error = error(&compiled, body, &points, 8);
    println!("{name}: {error:.1e}");
    assert!(error < DOUBLE, "{name}: {error:.1e}");
}

/// What two orders of summation may differ by.
const DOUBLE: f64 = 1e-12;

fn all_fixtures() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/models");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("models")
        .map(|entry| entry.expect("a folder").file_name().into_string().expect("a name"))
        .collect();
    names.sort();
    names
}

#[test]
fn every_fixture_body_moves_in_c_as_in_the_library() {
    for (at, name) in all_fixtures().iter().enumerate() {
        // The frame of the model has c, C1 and C2.
        let frame = if at % 2 == 0 { BodyFrame::Model } else { BodyFrame::Principal };
        assert_same(name, &fixture(name, 5 + at % 4, frame), &["-O2"]);
    }
}

//! Embedded format: the C header, compiled like in a real-time program, computes the same values as the
//! library. The test needs a C compiler, like the project itself.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_formats::export::{ExportFrame, ExportOptions, Exported, Points, frames};
use flexbody_formats::{export, find_format};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, LoadKind};
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Evaluation, Terms};
use nalgebra::Vector3;
use oracle::flexible::{body_of, fixture, moving_state, soft_block, stressed};
use oracle::partial::{combinations, with_groups};
use oracle::plane::rectangle;
use oracle::random::Random;
use std::path::PathBuf;
use std::process::{Command, Output};
use tempfile::TempDir;

const STATES: usize = 4;

/// Compiler flags with which the evaluation must compile.
const STRICT: &[&str] = &["-Wall", "-Wextra", "-Wconversion", "-Werror", "-pedantic", "-ffreestanding"];

/// Compiler and language.
const C: &[&str] = &["cc", "-std=c99"];

/// A body compiled in a C program.
struct Compiled {
    folder: TempDir,
    exported: Exported,
}

fn exported(body: &FlexBody, dialect: &str, points: &Points) -> Exported {
    let options = ExportOptions {
        dialect: Some(dialect.to_owned()),
        points: points.clone(),
        ..ExportOptions::default()
    };
    let format = find_format("embedded").expect("registered");
    let (exported, losses) = export(body, format, &options, false).expect("exports");
    assert!(losses.is_empty());
    exported
}

fn run(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|error| panic!("{command:?}: {error}; the compilers are `cc` and `c++`"))
}

#[track_caller]
fn succeed(command: &mut Command) {
    let output = run(command);
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
}

impl Compiled {
    fn new(exported: Exported, flags: &[&str]) -> Self {
        Self::in_language(exported, C, flags)
    }

    fn in_language(exported: Exported, language: &[&str], flags: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let [(ending, header)] = &exported.beside[..] else { panic!("a header beside the file") };
        assert_eq!(ending, "h");
        std::fs::write(path("body.h"), header).expect("writable");
        std::fs::write(path("body.bin"), &exported.file).expect("writable");
        // Type names defined by the header have the prefix of all names.
        let text = std::str::from_utf8(header).expect("ASCII");
        let small = text.split_once("_evaluation;").expect("a type").0.rsplit(' ').next().expect("a name");
        let sources = oracle::root().join("tests/embedded");
        let object = |name: &str| path(name).with_extension("o");
        succeed(
            Command::new(language[0])
                .args(&language[1..])
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

    /// Returns the result of opening `data` at `start` bytes after a multiple of 64.
    fn opened(&self, data: &[u8], start: usize) -> i32 {
        std::fs::write(self.path("changed.bin"), data).expect("writable");
        let start = start.to_string();
        let output = run(Command::new(self.path("driver")).arg(self.path("changed.bin")).arg(start));
        output.status.code().unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(&output.stderr)))
    }

    /// Returns the results at the states, with `bytes` bytes per number.
    fn results(&self, states: &[Vec<f64>], bytes: usize) -> Vec<f64> {
        let number =
            |v: &f64| if bytes == 8 { v.to_le_bytes().to_vec() } else { (*v as f32).to_le_bytes().to_vec() };
        std::fs::write(self.path("states"), states.concat().iter().flat_map(number).collect::<Vec<u8>>())
            .expect("writable");
        let output = run(Command::new(self.path("driver"))
            .arg(self.path("body.bin"))
            .arg("0")
            .arg(self.path("states")));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |raw: &[u8]| match bytes {
            8 => f64::from_le_bytes(raw.try_into().expect("eight")),
            _ => f64::from(f32::from_le_bytes(raw.try_into().expect("four"))),
        };
        output.stdout.chunks_exact(bytes).map(read).collect()
    }
}

/// Returns q, nu, applied forces, gravity, a force and a torque of suitable size for the body.
fn state(random: &mut Random, body: &FlexBody) -> Vec<f64> {
    let own = moving_state(random, body);
    // Geometric stiffness corrects the inertia to first order only, so that its amplitude is reduced here.
    let amount = if body.geometric_stiffness().is_empty() { 1.0 } else { 0.1 };
    let (mass, size) = (body.invariants().mass(), body.invariants().inertia().norm().sqrt());
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
        (own.q * amount).as_slice(),
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

/// Returns the frame as a point of the library.
fn point(body: &FlexBody, all: &[ExportFrame], frame: &ExportFrame) -> BodyPoint {
    let alone = all.iter().filter(|other| other.name == frame.name).count() == 1;
    let interface = body.interfaces().iter().find(|interface| Some(&interface.name) == frame.name.as_ref());
    let reference =
        interface.filter(|_| alone).and_then(|interface| BodyPoint::interface(body, interface, Terms::ALL));
    reference.unwrap_or_else(|| {
        let node = body.nodes().ids.iter().position(|id| *id == frame.id).expect("a node");
        BodyPoint::node(body, node)
    })
}

/// Returns the expected results of the C program, each with its scale.
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
        // The code is FLEXBODY_NO_ORIENTATION for frames without orientation.
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

/// Returns the largest error of the C program, relative to the scale of each number.
fn error(compiled: &Compiled, body: &FlexBody, points: &Points, bytes: usize) -> f64 {
    let mut random = Random(body.n_nodes() as u64);
    let mut states: Vec<Vec<f64>> = (0..STATES).map(|_| state(&mut random, body)).collect();
    if bytes == 4 {
        states.iter_mut().flatten().for_each(|v| *v = f64::from(*v as f32));
    }
    let expected: Vec<(f64, f64)> = states.iter().flat_map(|state| expected(body, points, state)).collect();
    worst(&compiled.results(&states, bytes), &expected)
}

fn worst(found: &[f64], expected: &[(f64, f64)]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let error = |(found, (value, scale)): (&f64, &(f64, f64))| {
        let off = (found - value).abs();
        let relative = if off == 0.0 { 0.0 } else { off / scale };
        // A NaN counts as an infinite error.
        if relative.is_nan() { f64::INFINITY } else { relative }
    };
    found.iter().zip(expected).map(error).fold(0.0, f64::max)
}

/// Returns the interfaces as frames or, without interfaces, some nodes.
fn some_points(body: &FlexBody) -> Points {
    match body.interfaces() {
        [] => Points::Some(body.nodes().ids.iter().copied().step_by(1 + body.n_nodes() / 3).collect()),
        _ => Points::Usual,
    }
}

/// Largest difference in roundings of the largest number of a result, for two orders of its sums and
/// cancellation in the elimination.
const ROUNDINGS: f64 = 500.0;

#[track_caller]
fn assert_same(name: &str, body: &FlexBody, dialect: &str, flags: &[&str]) {
    let points = some_points(body);
    let (bytes, rounding) =
        if dialect == "float" { (4, 0.5 * f64::from(f32::EPSILON)) } else { (8, 0.5 * f64::EPSILON) };
    let compiled = Compiled::new(exported(body, dialect, &points), flags);
    let error = error(&compiled, body, &points, bytes);
    assert!(error < ROUNDINGS * rounding, "{name}, {dialect}: {error:.1e}");
}

fn all_fixtures() -> Vec<String> {
    let folder = oracle::fixtures().join("models");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("models")
        .map(|entry| entry.expect("a folder").file_name().into_string().expect("a name"))
        .collect();
    names.sort();
    names
}

#[test]
#[ignore = "slow"]
fn every_fixture_body_moves_in_c_as_in_the_library() {
    for (at, name) in all_fixtures().iter().enumerate() {
        // The frame of the model gives nonzero c, C1 and C2; the numbers of modes cover all remainders of
        // four and eight.
        let frame = if at % 2 == 0 { BodyFrame::Model } else { BodyFrame::Principal };
        let body = fixture(name, 3 + at % 9, frame);
        assert_same(name, &body, "double", &["-O2"]);
        assert_same(name, &body, "float", &["-O3"]);
    }
}

/// Returns solids and general masses, in space and in the plane.
fn kinds() -> [FlexBody; 4] {
    [
        soft_block(8),
        fixture("frame_beams", 6, BodyFrame::Model),
        body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 6, BodyFrame::Model),
        fixture("plane_frame", 6, BodyFrame::Principal),
    ]
}

#[test]
#[ignore = "slow"]
fn a_body_without_some_terms_has_neither_their_numbers_nor_their_forces() {
    for body in kinds() {
        let full = exported(&body, "double", &Points::Some(Vec::new())).file.len();
        for groups in combinations() {
            let partial = with_groups(&body, groups);
            assert_same(&format!("{groups:?}"), &partial, "double", &["-O0"]);
            let (nf, axes) = (body.n_modes(), if body.dimension() == 2 { 1 } else { 3 });
            let pairs = if axes == 3 { 6 } else { 1 };
            let mut dropped = 0;
            // The stiffness of inertia, which is never dropped, is added to the arrays of geometric
            // stiffness.
            let drops = body.inertia_stiffness().is_none();
            dropped += if groups.w2 { 0 } else { 8 * pairs * nf * nf };
            dropped += if groups.w3 { 0 } else { 8 * axes * nf * nf };
            let size = exported(&partial, "double", &Points::Some(Vec::new())).file.len();
            assert!(size <= full, "{groups:?}: {size} > {full}");
            assert!(!drops || full - size >= dropped, "{groups:?}: {full} - {size} < {dropped}");
        }
    }
}

/// Adds properties that no fixture has: geometric stiffness of all kinds, full stiffness and damping
/// matrices, and modes that are not mass-normalised.
fn laden(body: FlexBody, random: &mut Random) -> FlexBody {
    let names: Vec<String> = body.interfaces().iter().map(|interface| interface.name.clone()).collect();
    let at = |make: fn(String) -> LoadKind| names.iter().cloned().map(make);
    let mut kinds = vec![LoadKind::Spin, LoadKind::Acceleration, LoadKind::AngularAcceleration];
    kinds.extend(at(LoadKind::Force).chain(at(LoadKind::Moment)));
    let (nf, lambda) = (body.n_modes(), body.modes().eigenvalue.clone());
    let mut parts = stressed(body, &kinds, 0.1, random).into_parts();
    let symmetric = |random: &mut Random, size: f64, unit: &dyn Fn(usize) -> f64| {
        let a = Mat::from_fn(nf, nf, |_, _| size * random.signed());
        Mat::from_fn(nf, nf, |i, j| if i == j { unit(i) } else { a[(i.min(j), i.max(j))] })
    };
    let rate = lambda[0].sqrt();
    parts.modes.modal_damping = Some(symmetric(random, 0.01 * rate, &|j| 0.1 * lambda[j].sqrt()));
    parts.invariants.primary_mut().modal_stiffness = symmetric(random, 0.1 * lambda[0], &|j| lambda[j]);
    if let Some(general) = &mut parts.invariants.primary_mut().general {
        general.modal_mass = symmetric(random, 0.05, &|j| 1.0 + 0.1 * j as f64);
    }
    FlexBody::new(parts).expect("valid parts")
}

#[test]
#[ignore = "slow"]
fn geometric_stiffness_damping_and_modes_of_any_mass_are_held() {
    let interfaces: Vec<FlexBody> =
        ["robot_link", "car_frame"].map(|name| fixture(name, 6, BodyFrame::Model)).into();
    for (at, body) in kinds().into_iter().chain(interfaces).enumerate() {
        let mut random = Random(7 + at as u64);
        let body = laden(body, &mut random);
        assert_same(&format!("kind {at}"), &body, "double", &["-O3"]);
        assert_same(&format!("kind {at}"), &body, "float", &["-O2"]);
        // Geometric stiffness for spin is present without W2, and the other kinds without W3.
        let bare = with_groups(&body, TermGroups::NONE);
        assert_same(&format!("kind {at}, bare"), &bare, "double", &["-O2"]);
    }
}

/// The power series of the rotation of a frame is used up to an angle of 1; larger angles are doubled.
#[test]
fn frames_turn_by_any_angle() {
    let body = fixture("frame_beams", 6, BodyFrame::Principal);
    let points = Points::Some(vec![body.nodes().ids[3]]);
    for angle in [0.999, 1.001, 3.0, 6.0] {
        let mut parts = body.clone().into_parts();
        let rotation = parts.modes.rotation.as_mut().expect("beams");
        // Every mode has the same rotation, and the modal coordinates below add up to 1.
        for j in 0..6 {
            for (k, part) in [2.0, -1.0, 2.0].into_iter().enumerate() {
                rotation[(9 + k, j)] = angle * part / 3.0;
            }
        }
        let body = FlexBody::new(parts).expect("valid parts");
        let mut random = Random(9);
        let mut state = state(&mut random, &body);
        (0..6).for_each(|j| state[j] = [0.9, -0.2, 0.3, 0.1, -0.3, 0.2][j]);
        let compiled = Compiled::new(exported(&body, "double", &points), &["-O2"]);
        let found = compiled.results(&[state.clone()], 8);
        // The results after those without frames: position, velocity and code.
        let trace = 1 + 4 * 12 + 2 + 7;
        let cosine = 0.5 * (found[trace] + found[trace + 4] + found[trace + 8] - 1.0);
        assert!((cosine - angle.cos()).abs() < 1e-14, "{angle}");
        let error = worst(&found, &expected(&body, &points, &state));
        assert!(error < ROUNDINGS * 0.5 * f64::EPSILON, "{angle}: {error:e}");
    }
}

#[test]
fn craig_bampton_bodies_have_frames_at_their_interfaces() {
    let manifest = oracle::fixtures().join("models/robot_link/model.toml");
    let raw = read_model(&read_manifest(&manifest).expect("manifest")).expect("readable");
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(6), ..ModeSettings::default() };
    let basis = BasisChoice::CraigBampton(CraigBampton);
    let settings = ConvertSettings { modes, basis, ..ConvertSettings::default() };
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    assert_same("craig-bampton", &body, "double", &["-O3"]);
    let header = exported(&body, "double", &Points::Usual).beside.remove(0).1;
    let header = String::from_utf8(header).expect("ASCII");
    for interface in body.interfaces() {
        let name = format!("_FRAME_{} = ", interface.name.to_uppercase());
        assert!(header.contains(&name), "{name}");
    }
}

/// The header compiles as C++ too and gives the numbers of the library.
#[test]
fn the_header_is_cpp_too() {
    for (body, standard) in kinds().into_iter().zip(["c++11", "c++17", "c++14", "c++20"]) {
        let body = laden(body, &mut Random(6));
        let (points, standard) = (some_points(&body), format!("-std={standard}"));
        let language = ["c++", standard.as_str(), "-x", "c++"];
        let compiled = Compiled::in_language(exported(&body, "double", &points), &language, &["-O1"]);
        assert!(error(&compiled, &body, &points, 8) < ROUNDINGS * 0.5 * f64::EPSILON, "{standard}");
    }
}

#[test]
fn sanitizers_find_nothing() {
    let flags = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    for (body, dialect) in kinds().into_iter().zip(["float", "double", "double", "float"]) {
        assert_same("sanitized", &laden(body, &mut Random(3)), dialect, &flags);
    }
}

/// Return values of `flexbody_open`.
const OK: i32 = 0;
const TOO_SHORT: i32 = 1;
const NOT_ALIGNED: i32 = 2;
const NO_BODY: i32 = 3;
const BYTE_ORDER: i32 = 4;
const OTHER_VERSION: i32 = 5;
const OTHER_BODY: i32 = 6;
const DAMAGED: i32 = 7;

#[test]
#[ignore = "slow"]
fn other_and_damaged_files_are_refused() {
    let body = fixture("frame_beams", 6, BodyFrame::Model);
    let points = some_points(&body);
    let flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let compiled = Compiled::new(exported(&body, "double", &points), &flags);
    let file = &compiled.exported.file;
    assert_eq!(compiled.opened(file, 0), OK);
    assert_eq!(compiled.opened(file, 8), OK);
    assert_eq!(compiled.opened(&[&file[..], &[1, 2, 3]].concat(), 0), OK, "more bytes behind the file");
    assert_eq!(compiled.opened(file, 4), NOT_ALIGNED);
    for end in [0, 7, 64, file.len() - 1] {
        assert_eq!(compiled.opened(&file[..end], 0), TOO_SHORT);
    }
    let with = |at: usize, bytes: &[u8]| {
        let mut changed = file.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        changed
    };
    assert_eq!(compiled.opened(&with(0, b"\x89HDF"), 0), NO_BODY);
    // The byte order mark of a machine with the other byte order.
    assert_eq!(compiled.opened(&with(8, &[1, 2, 3, 4]), 0), BYTE_ORDER);
    assert_eq!(compiled.opened(&with(12, &2u32.to_le_bytes()), 0), OTHER_VERSION);
    // Covers every entry of header and table except the units, which only the checksum protects.
    for at in (16..328).step_by(4) {
        let code = compiled.opened(&with(at, &[file[at] ^ 1]), 0);
        let wanted = if at == 20 || (48..72).contains(&at) { DAMAGED } else { OTHER_BODY };
        assert_eq!(code, wanted, "byte {at}");
    }
    let mut random = Random(1);
    for _ in 0..40 {
        let at = 328 + random.next_u64() as usize % (file.len() - 328);
        assert_eq!(compiled.opened(&with(at, &[file[at] ^ (1 << (at % 8))]), 0), DAMAGED, "byte {at}");
    }
    // Files of other bodies and precisions are refused.
    for (other, dialect) in [("frame_beams", "float"), ("satellite", "double"), ("plane_frame", "double")] {
        let other = fixture(other, 6, BodyFrame::Model);
        let foreign = exported(&other, dialect, &some_points(&other)).file;
        let longer = [&foreign[..], &vec![0; file.len()]].concat();
        assert_eq!(compiled.opened(&longer, 0), OTHER_BODY);
    }
}

/// Refuses manipulated indices even with a valid checksum.
#[test]
fn indices_that_lead_nowhere_are_refused() {
    let body = laden(fixture("robot_link", 6, BodyFrame::Model), &mut Random(5));
    let flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    let compiled = Compiled::new(exported(&body, "double", &Points::Usual), &flags);
    let file = &compiled.exported.file;
    let u32_at = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four"));
    let parts = (72..328)
        .step_by(16)
        .find(|&at| u32_at(at + 4) == 3 && u32_at(at + 8) == u32_at(40))
        .map(|at| u32_at(at) as usize)
        .expect("frame_parts");
    for (at, value) in [(0, -2i32), (0, 1000), (4, -1), (4, 1000), (8, 0x3f), (4, i32::MAX), (4, i32::MIN)] {
        let mut changed = file.clone();
        changed[parts + at..][..4].copy_from_slice(&value.to_le_bytes());
        let mut checksum = flate2::Crc::new();
        checksum.update(&changed[24..]);
        changed[20..24].copy_from_slice(&checksum.sum().to_le_bytes());
        let sound = at == 8 && value == i32::from_le_bytes(file[parts + 8..][..4].try_into().expect("four"));
        assert_eq!(compiled.opened(&changed, 0), if sound { OK } else { DAMAGED }, "{at}: {value}");
    }
}

/// Names that would end a comment or are no identifiers; all nodes as frames.
#[test]
fn any_name_makes_a_header_that_compiles() {
    for name in ["*/ int x; /*", "??/\n#error", "", "Ärger 2", "9"] {
        let mut parts = fixture("hex8_edges", 4, BodyFrame::Model).into_parts();
        parts.description.name = name.to_owned();
        let body = FlexBody::new(parts).expect("valid parts");
        let compiled = Compiled::new(exported(&body, "double", &Points::Nodes), &["-O0"]);
        assert!(error(&compiled, &body, &Points::Nodes, 8) < ROUNDINGS * 0.5 * f64::EPSILON);
    }
}

#[test]
fn the_page_has_the_layout_that_is_written() {
    let path = oracle::root().join("docs/reference/formats/embedded.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let (before, rest) = page.split_once("<!-- layout -->\n").expect("a place for the tables");
    let (own, after) = rest.split_once("<!-- end of layout -->").expect("their end");
    let written = flexbody_formats::embedded_markdown();
    if std::env::var_os("FLEXBODY_BLESS").is_some_and(|v| v == "1") {
        let text = format!("{before}<!-- layout -->\n{written}<!-- end of layout -->{after}");
        std::fs::write(&path, text).expect("writable");
    } else {
        assert!(
            own == written,
            "FLEXBODY_BLESS=1 cargo test -p flexbody-formats export_embedded the_page writes it"
        );
    }
}

#[test]
fn what_cannot_be_held_is_told_or_refused() {
    let format = find_format("embedded").expect("registered");
    let body = fixture("robot_link", 4, BodyFrame::Model);
    let mut random = Random(2);
    let named = stressed(body.clone(), &[LoadKind::Named("preload".to_owned())], 1.0, &mut random);
    let (_, told) = export(&named, format, &ExportOptions::default(), false).expect("a warning");
    let [diagnostic] = &told[..] else { panic!("one loss: {told:?}") };
    assert_eq!(diagnostic.code(), Code::ExportLost);
    assert!(diagnostic.message().contains("times load `preload`"), "{}", diagnostic.message());

    // 1e60 does not fit into a file of 32-bit floats.
    let mut parts = body.into_parts();
    parts.invariants.primary_mut().modal_stiffness[(1, 1)] = 1e60;
    let stiff = FlexBody::new(parts).expect("valid parts");
    let options = ExportOptions { dialect: Some("float".to_owned()), ..ExportOptions::default() };
    let refused = export(&stiff, format, &options, true).expect_err("too large");
    assert!(refused.diagnostics()[0].message().contains("`stiffness`"));
    assert!(export(&stiff, format, &ExportOptions::default(), false).is_ok());
}

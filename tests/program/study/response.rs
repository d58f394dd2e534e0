//! Frequency responses: closed forms, identities of the receptance, the dense modal sum of all modes, and
//! estimates compared with direct solutions.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, CraigBampton, FreeSurface, Loads, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, Damping, FeModel, NodeSet, RawMatrix, RawModel};
use flexbody_motion::scene::Point;
use flexbody_study::response::{
    Band, Complex, Direction, Excitation, Pair, Place, Response, ResponseEnds, ResponseSettings, respond,
};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::fixtures;
use oracle::mesh::Mesh;
use oracle::turning::dense;
use serde_json::Value;
use std::fs;

/// Returns a steel block with a node set at each end, and a damping ratio.
fn block(ratio: Option<f64>) -> FeModel {
    damped_block(ratio.map(Damping::Ratio))
}

fn damped_block(damping: Option<Damping<RawMatrix>>) -> FeModel {
    let mesh = Mesh::block(ElementKind::Hex8, [4, 2, 1], [0.4, 0.15, 0.1]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let end = |raw: &RawModel, x: f64| -> Vec<i64> {
        let nodes = raw.nodes.positions.iter().zip(&raw.nodes.ids);
        nodes.filter(|(position, _)| (position[0] - x).abs() < 1e-9).map(|(_, &id)| id).collect()
    };
    for (name, x) in [("left", 0.0), ("right", 0.4)] {
        let nodes = end(&raw, x);
        raw.data.interfaces.push(NodeSet::new(name, nodes));
    }
    raw.data.damping = damping;
    FeModel::from_raw(raw).expect("a model").model
}

fn body_of(model: &FeModel, modes: usize, basis: BasisChoice) -> FlexBody {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, basis, lumped: Vec::new(), ..ConvertSettings::default() };
    convert(model, &settings, &Context::QUIET).expect("a body").body
}

fn free(model: &FeModel, modes: usize) -> FlexBody {
    body_of(model, modes, BasisChoice::default())
}

fn over(low: f64, high: f64, solves: usize) -> ResponseSettings {
    ResponseSettings {
        band: Band::new(low, high).expect("a band"),
        points: 60,
        solves,
        damping: None,
        replaces_damping: false,
        tolerance: 0.05,
    }
}

fn ends(text: &str) -> Vec<Place> {
    vec![Place::parse(text)]
}

/// Returns the response between places.
fn between(
    model: Option<&FeModel>,
    body: &FlexBody,
    from: &str,
    to: &str,
    settings: &ResponseSettings,
) -> Result<Response> {
    let (from, to) = (Excitation::Forces(ends(from)), ends(to));
    let ends = ResponseEnds { from: &from, to: &to, rows: &[], densities: None };
    respond(model, body, &ends, settings, &Context::QUIET)
}

fn study(model: &FeModel, body: &FlexBody, from: &str, to: &str, settings: &ResponseSettings) -> Response {
    between(Some(model), body, from, to, settings).expect("a response")
}

/// Returns the measured errors of the only pair.
fn measured(response: &Response) -> Vec<f64> {
    let errors = response.pairs[0].errors.as_ref().expect("errors");
    errors.measured.iter().filter_map(|error| *error).collect()
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

#[test]
#[ignore = "slow"]
fn with_all_modes_the_reduced_body_answers_as_all_nodes_do() {
    // The block has 90 rows; the places include rotations of its ends.
    for damping in [None, Some(Damping::Ratio(0.02)), Some(Damping::Rayleigh { alpha: 300.0, beta: 2e-7 })] {
        let model = damped_block(damping.clone());
        let body = free(&model, 84);
        let last = *body.frequencies_hz().last().expect("modes");
        for (from, to) in [("left:x,y,z,rx,ry,rz", "right:x,y,z,rx,ry,rz"), ("1", "17:y")] {
            let response = study(&model, &body, from, to, &over(last / 200.0, 1.1 * last, 60));
            let solved = response.solved.expect("solved");
            assert_eq!((solved.rows, solved.modes_in_band, response.body_modes_in_band), (90, 84, 84));
            for pair in &response.pairs {
                let errors = pair.errors.as_ref().expect("errors");
                let worst = largest(errors.measured.iter().filter_map(|error| *error));
                assert!(worst < 1e-6, "{damping:?} {from} {worst:e}");
            }
        }
    }
}

#[test]
fn receptances_are_reciprocal() {
    let model = block(Some(0.01));
    let body = free(&model, 9);
    let settings = over(0.0, 1.3 * body.frequencies_hz()[8], 24);
    let [there, back] = [("left:x,y,rz", "17"), ("17", "left:x,y,rz")]
        .map(|(from, to)| study(&model, &body, from, to, &settings));
    let functions = |response: &Response| -> Vec<_> {
        response.pairs.iter().flat_map(|pair| pair.functions.clone()).collect()
    };
    // Frequencies that were added at the largest estimate differ by the rounding of the estimate.
    let at_both = there
        .frequencies
        .iter()
        .enumerate()
        .filter_map(|(i, f)| Some((i, back.frequencies.iter().position(|other| other == f)?)));
    let at_both: Vec<(usize, usize)> = at_both.collect();
    let (there, back) = (functions(&there), functions(&back));
    assert_eq!(there.len(), 9);
    let (mut reduced, mut full) = (0, 0);
    for one in &there {
        let other = back
            .iter()
            .find(|other| (other.from.name(), other.to.name()) == (one.to.name(), one.from.name()))
            .expect("the other");
        for &(i, j) in &at_both {
            // The scale is the largest function of the same kind, because some functions are zero up to
            // rounding.
            let alike = there.iter().filter(|f| f.kind(false) == one.kind(false));
            let scale = largest(alike.map(|f| f.reduced[i].norm()));
            let same = |a: Complex<f64>, b: Complex<f64>| (a - b).norm() < 1e-8 * scale;
            assert!(same(one.reduced[i], other.reduced[j]));
            reduced += 1;
            if let (Some(a), Some(b)) = (one.full[i], other.full[j]) {
                assert!(same(a, b), "{a} {b}");
                full += 1;
            }
        }
    }
    assert!(reduced > 9 * 50 && full > 9 * 8, "{reduced} {full}");
}

/// A bar of bricks with zero Poisson's ratio is equivalent to a chain of rod elements under forces uniform
/// over its ends.
#[test]
fn a_chain_of_rods_has_its_closed_form() {
    let cells = 12;
    let (length, area) = (0.6, 0.02 * 0.02);
    let material = Material { youngs: 2e11, poisson: 0.0, density: 7800.0 };
    let mesh = Mesh::block(ElementKind::Hex8, [cells, 1, 1], [length, 0.02, 0.02]);
    let mut raw = mesh.assemble(&material, MassRule::Consistent).raw_model();
    let positions = raw.nodes.positions.clone();
    for (name, x) in [("left", 0.0), ("right", length)] {
        let at = |(_, position): &(&i64, &[f64; 3])| (position[0] - x).abs() < 1e-9;
        let nodes = raw.nodes.ids.iter().zip(&positions).filter(at).map(|(&id, _)| id).collect();
        raw.data.interfaces.push(NodeSet::new(name, nodes));
    }
    let model = FeModel::from_raw(raw).expect("a model").model;
    let body = free(&model, 30);
    // Linear rod elements with consistent mass satisfy (k/h) (2 - 2 cos t) = w^2 (rho A h / 6) (4 + 2 cos t)
    // on the inner nodes, with u_j = cos(j t) + ...
    let h = length / f64::from(cells);
    let (k, m) = (material.youngs * area / h, material.density * area * h / 6.0);
    let first = (material.youngs / material.density).sqrt() / (2.0 * length);
    let response = study(&model, &body, "left:x", "right:x", &over(50.0, 2.6 * first, 40));
    let function = &response.pairs[0].functions[0];
    for (hertz, full) in response.frequencies.iter().zip(&function.full) {
        let Some(full) = full else { continue };
        let square = (std::f64::consts::TAU * hertz).powi(2);
        let cosine = (k - 2.0 * square * m) / (k + square * m);
        // u_j = cos((n - j) t) a satisfies the inner equations and the free end; the loaded end gives a.
        let t = cosine.acos();
        let n = f64::from(cells);
        let stiffness = (k - 2.0 * square * m) * (n * t).cos() - (k + square * m) * ((n - 1.0) * t).cos();
        let exact = 1.0 / stiffness;
        assert!((full.re - exact).abs() < 1e-7 * exact.abs() && full.im == 0.0, "{hertz}: {full} {exact:e}");
    }
}

#[test]
fn damping_is_that_of_the_modes_in_both() {
    let model = block(Some(0.03));
    let body = free(&model, 10);
    // At these frequencies the tenth mode still responds dynamically and the truncated modes respond
    // statically, so that the truncation error does not depend on damping.
    let settings = over(0.02 * body.frequencies_hz()[0], 1.02 * body.frequencies_hz()[3], 40);
    let response = study(&model, &body, "left", "left", &settings);
    // At the first resonance the response is that of one mode, 1 / (2 i zeta lambda) psi^2.
    let at = response.frequencies.iter().position(|f| (f / body.frequencies_hz()[0] - 1.0).abs() < 1e-3);
    let at = at.expect("the peak is looked at");
    for function in &response.pairs[0].functions {
        let (Some(full), reduced) = (function.full[at], function.reduced[at]) else { panic!("not solved") };
        if reduced.norm() > 1e-12 {
            assert!((full.im - reduced.im).abs() < 1e-6 * reduced.norm(), "{full} {reduced}");
        }
    }
}

#[test]
fn more_modes_and_residual_vectors_come_closer() {
    let model = block(Some(0.02));
    let band = over(100.0, 1.05 * free(&model, 4).frequencies_hz()[3], 30);
    let error = |body: &FlexBody| largest(measured(&study(&model, body, "left", "right", &band)));
    let plain: Vec<f64> = [8, 20, 50].map(|modes| error(&free(&model, modes))).to_vec();
    assert!(plain[0] > plain[1] && plain[1] > plain[2], "{plain:?}");
    let basis = |loads| BasisChoice::Free(FreeSurface { residual_vectors: vec![loads] });
    let with_vectors = error(&body_of(&model, 8, basis(Loads::Interfaces)));
    assert!(with_vectors < 0.05 * plain[0], "{with_vectors:e} {plain:?}");
    // A Craig-Bampton body has natural frequencies of its own until there are enough fixed-interface modes.
    let fixed =
        [6, 20, 34].map(|modes| error(&body_of(&model, modes, BasisChoice::CraigBampton(CraigBampton))));
    assert!(fixed[0] > fixed[1] && fixed[1] > fixed[2] && fixed[2] < 0.05 * fixed[0], "{fixed:?}");
}

#[test]
fn residual_vectors_make_the_static_limit_exact() {
    // At low frequencies the response is rigid motion plus the static deformation: (H - H_rigid) tends to
    // K^+.
    let model = block(None);
    let basis = BasisChoice::Free(FreeSurface { residual_vectors: vec![Loads::Interfaces] });
    let (vectors, plain) = (body_of(&model, 4, basis), free(&model, 4));
    let low = 1e-3 * plain.frequencies_hz()[0];
    let elastic_error = |body: &FlexBody| {
        let response = study(&model, body, "left", "right", &over(low, 1.5 * low, 4));
        let pair = &response.pairs[0];
        let i = pair.functions[0].full.iter().position(Option::is_some).expect("solved");
        let apart =
            |f: &flexbody_study::response::Function| (f.full[i].expect("solved") - f.reduced[i]).norm();
        largest(pair.functions.iter().map(apart))
    };
    let (with, without) = (elastic_error(&vectors), elastic_error(&plain));
    assert!(with < 1e-4 * without && without > 0.0, "{with:e} {without:e}");
}

/// Accuracy of the estimate over bases and bands, at the solved frequencies, including resonances and
/// antiresonances. The estimate equals the error up to half the first truncated frequency, and on average; it
/// is too small if a mode is missing next to the band.
#[test]
fn the_estimate_is_near_the_error() {
    let model = block(Some(0.01));
    let basis = |loads| BasisChoice::Free(FreeSurface { residual_vectors: loads });
    let bodies = [
        ("free", free(&model, 8)),
        ("free, many", free(&model, 30)),
        ("residual vectors", body_of(&model, 8, basis(vec![Loads::Interfaces]))),
        ("craig-bampton", body_of(&model, 8, BasisChoice::CraigBampton(CraigBampton))),
    ];
    let missing = free(&model, 9).frequencies_hz()[8];
    for (name, body) in &bodies {
        for (from, to) in [("left", "right"), ("left:y", "17:y"), ("1:z", "right:z")] {
            let band = over(50.0, free(&model, 8).frequencies_hz()[5], 60);
            let response = study(&model, body, from, to, &band);
            let errors = response.pairs[0].errors.as_ref().expect("errors");
            let Some(effectivity) = errors.effectivity else { continue };
            assert!((0.9..1.1).contains(&effectivity.median), "{name} {from} {to}: {effectivity:?}");
            assert!(effectivity.least > 0.1 && effectivity.most < 3.0, "{name} {from} {to}: {effectivity:?}");
            for (i, f) in response.frequencies.iter().enumerate().filter(|(_, f)| **f < 0.5 * missing) {
                let Some(measured) = errors.measured[i].filter(|error| *error > 1e-6) else { continue };
                let ratio = errors.estimated[i] / measured;
                assert!((0.8..1.25).contains(&ratio), "{name} {from} {to}, {f} Hz: {ratio}");
            }
        }
    }
}

#[test]
fn a_mode_that_the_body_lacks_in_the_band_is_seen() {
    let model = block(Some(0.01));
    let all = free(&model, 8);
    let third = all.frequencies_hz()[2];
    let body = all.reduced(&[0, 1, 3, 4, 5, 6, 7], all.groups(), Vec::new()).expect("a body");
    let response = study(&model, &body, "left", "right", &over(100.0, 1.2 * third, 40));
    let solved = response.solved.expect("solved");
    assert_eq!(solved.modes_in_band, response.body_modes_in_band + 1);
    let worst = response.pairs[0].errors.as_ref().and_then(|errors| errors.worst).expect("an error");
    assert!(worst.value > 0.5 && (worst.hertz / third - 1.0).abs() < 0.15, "{worst:?} {third}");
    assert!(!response.holds(0.05));
}

#[test]
fn models_with_rotations_and_in_the_plane_answer() {
    for (name, directions) in [("frame_beams", "y,rx"), ("plane_frame", "y,rz")] {
        let files = read_manifest(fixtures().join(format!("models/{name}/model.toml"))).expect("a manifest");
        let model = FeModel::from_raw(read_model(&files).expect("files")).expect("a model").model;
        let last = model.nodes().ids[model.nodes().len() - 1];
        let at = |text: &str| format!("{last}:{text}");
        let bodies = [6, 12, 24].map(|modes| free(&model, modes));
        let first_mode = bodies[0].frequencies_hz()[0];
        let settings = over(0.05 * first_mode, 0.3 * first_mode, 8);
        let errors = bodies.each_ref().map(|body| {
            let response = study(&model, body, &at(directions), &at(directions), &settings);
            assert_eq!(response.pairs.len(), 4, "{name}");
            let worst =
                |pair: &Pair| pair.errors.as_ref().and_then(|errors| errors.largest).expect("one").value;
            response.pairs.iter().map(worst).collect::<Vec<_>>()
        });
        // At the loaded point every mode adds flexibility of one sign below its resonance.
        for kind in [0, 3] {
            let [few, some, many] = errors.each_ref().map(|errors| errors[kind]);
            assert!(few > some && some > many, "{name}, kind {kind}: {few} {some} {many}");
        }
    }
}

#[test]
fn places_that_are_not_there_are_refused() {
    let model = block(None);
    let body = free(&model, 4);
    let settings = over(0.0, 100.0, 4);
    for text in ["nowhere", "9999", "1:rx"] {
        for (from, to) in [(text, "left"), ("left", text)] {
            for model in [Some(&model), None] {
                let error = between(model, &body, from, to, &settings).expect_err("no place");
                assert!(error.has(Code::PlaceUnknown), "{text}: {error:?}");
            }
        }
    }
    let other = block(Some(0.5));
    assert!(between(Some(&other), &body, "left", "left", &settings).is_ok());
    let mesh = Mesh::block(ElementKind::Hex8, [4, 2, 1], [0.5, 0.15, 0.1]);
    let raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let longer = FeModel::from_raw(raw).expect("a model").model;
    let error = between(Some(&longer), &body, "1", "2", &settings).expect_err("another model");
    assert!(error.has(Code::BodyIncomparable), "{error:?}");
    assert_eq!(Place::parse("3:z"), Place { point: Point::Node(3), directions: vec![Direction::Z] });
}

#[test]
#[ignore = "slow"]
fn the_command_writes_what_its_schema_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let manifest = fixtures().join("models/bracket_hex20/model.toml");
    let manifest = manifest.to_str().expect("a path");
    let line =
        "--band 100..3000 --from bolt_wall --to bolt_base:x,y,rz --damping 0.02 --solves 12 --points 60";
    let words: Vec<&str> = line.split(' ').collect();
    let outputs = ["--json", "--csv", "r.csv", "--report", "r.html", "--report", "r.txt"];
    let with = |first: &[&str], threads: &str| {
        let all: Vec<&str> = [first, &words, &outputs, &["--threads", threads]].concat();
        let run = flexbody(place, &all);
        assert!(matches!(run.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&run.stderr));
        let told: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        (told, fs::read(place.join("r.csv")).expect("a table"))
    };
    let (told, table) =
        with(&["response", manifest, "--modes", "10", "--residual-vectors", "interfaces"], "1");
    let schema: Value =
        serde_json::from_slice(include_bytes!("../../../schemas/response-report.schema.json")).expect("JSON");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let wrong: Vec<String> = schema.iter_errors(&told["results"]).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    assert_eq!(told["results"]["pairs"].as_array().map(Vec::len), Some(2));
    assert_eq!(told["results"]["passed"], told["passed"]);
    let page = fs::read_to_string(place.join("r.html")).expect("a page");
    assert!(page.contains("Transfer functions") && page.contains("<circle") && !page.contains("NaN"));
    let text = fs::read_to_string(place.join("r.txt")).expect("a text");
    assert!(text.starts_with("Response") && text.contains("bolt_base"), "{text}");
    // Two threads give the same bits.
    let (_, again) = with(&["response", manifest, "--modes", "10", "--residual-vectors", "interfaces"], "2");
    assert_eq!(table, again);

    // The body read from its file gives the same response, with the model and alone.
    let made = [
        "convert",
        manifest,
        "--modes",
        "10",
        "--residual-vectors",
        "interfaces",
        "-o",
        "b.flex.h5",
        "--quiet",
    ];
    assert!(flexbody(place, &made).status.success());
    let (beside, same) = with(&["response", manifest, "b.flex.h5"], "2");
    assert_eq!(beside["results"]["verdict"], told["results"]["verdict"]);
    assert_eq!(table.len() / 100, same.len() / 100);
    let (alone, _) = with(&["response", "b.flex.h5"], "2");
    assert_eq!((&alone["results"]["passed"], &alone["exit_code"]), (&Value::Null, &0.into()));
    assert!(alone["results"]["verdict"].as_str().is_some_and(|verdict| verdict.contains("not known")));
}

/// Returns the block with the stated coupling of both ends.
fn coupled_block(coupling: Coupling) -> RawModel {
    let mesh = Mesh::block(ElementKind::Hex8, [4, 2, 1], [0.4, 0.15, 0.1]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    for (name, x) in [("left", 0.0), ("right", 0.4)] {
        let nodes = raw.nodes.positions.iter().zip(&raw.nodes.ids);
        let nodes = nodes.filter(|(position, _)| (position[0] - x).abs() < 1e-9).map(|(_, &id)| id).collect();
        raw.data.interfaces.push(NodeSet { coupling: Some(coupling), ..NodeSet::new(name, nodes) });
    }
    raw
}

/// Returns G (N x m) of u = G y, with y the displacements of all nodes outside interfaces and the six motions
/// of each rigid interface about its mean. G is written down from the positions alone.
fn motions_under_coupling(raw: &RawModel) -> DMatrix<f64> {
    let n = 3 * raw.nodes.ids.len();
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let index = |id: &i64| raw.nodes.ids.iter().position(|own| own == id).expect("a node");
    let held: Vec<usize> = raw.data.interfaces.iter().flat_map(|set| set.nodes.iter().map(index)).collect();
    for node in (0..raw.nodes.ids.len()).filter(|node| !held.contains(node)) {
        columns
            .extend((0..3).map(|k| DVector::from_fn(n, |row, _| f64::from(u8::from(row == 3 * node + k)))));
    }
    for set in &raw.data.interfaces {
        let places: Vec<usize> = set.nodes.iter().map(index).collect();
        let position = |node: usize| Vector3::from(raw.nodes.positions[node]);
        let mean = places.iter().map(|&node| position(node)).sum::<Vector3<f64>>() / places.len() as f64;
        for motion in 0..6 {
            let mut column = DVector::zeros(n);
            for &node in &places {
                let axis = Vector3::ith(motion % 3, 1.0);
                let u = if motion < 3 { axis } else { axis.cross(&(position(node) - mean)) };
                column.fixed_rows_mut::<3>(3 * node).copy_from(&u);
            }
            columns.push(column);
        }
    }
    DMatrix::from_columns(&columns)
}

#[test]
fn a_body_with_rigid_interfaces_is_compared_with_the_model_under_the_same_coupling() {
    let raw = coupled_block(Coupling::Rigid);
    let g = motions_under_coupling(&raw);
    let [k, m] = [&raw.stiffness, &raw.mass].map(|raw| g.transpose() * dense(&raw.matrix) * &g);
    let model = FeModel::from_raw(raw).expect("a model").model;
    let body = body_of(&model, 6, BasisChoice::CraigBampton(CraigBampton));
    let response = study(&model, &body, "left", "right", &over(100.0, 9000.0, 30));
    // The last twelve columns of G are the motions of `left` and `right`, the translations first.
    let [from, to] = [g.ncols() - 12, g.ncols() - 6];
    let mut compared = 0;
    for (i, hertz) in response.frequencies.iter().enumerate() {
        let square = (std::f64::consts::TAU * hertz).powi(2);
        let inverse = (&k - &m * square).try_inverse().expect("no natural frequency");
        for function in &response.pairs[0].functions {
            let axis =
                |name: &str| Direction::ALL.iter().position(|own| own.name() == name).expect("one of six");
            let Some(full) = function.full[i] else { continue };
            let exact = inverse[(to + axis(function.to.name()), from + axis(function.from.name()))];
            let scale = inverse.column(from + axis(function.from.name())).rows(to, 6).amax();
            assert!((full.re - exact).abs() < 1e-7 * scale, "{hertz} Hz: {} {exact}", full.re);
            compared += 1;
        }
    }
    assert!(compared > 200, "{compared}");
    // With enough modes the body agrees with the coupled model; it agrees nowhere with a model whose ends
    // deform.
    let errors = measured(&response);
    assert!(errors[0] < 1e-3, "{errors:?}");
    let coupling = response.coupling.expect("rigid ends");
    assert_eq!(coupling.interfaces, ["left", "right"]);
    assert!(coupling.largest.is_some_and(|at| at.value > 0.1), "{:?}", coupling.largest);
    let averaging = FeModel::from_raw(coupled_block(Coupling::Averaging)).expect("a model").model;
    let body = body_of(&averaging, 6, BasisChoice::CraigBampton(CraigBampton));
    let plain = study(&averaging, &body, "left", "right", &over(100.0, 9000.0, 4));
    assert!(plain.coupling.is_none());
}

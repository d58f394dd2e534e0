//! Bodies meshed and assembled by other programs, through the readers and the whole pipeline, compared with
//! reference numbers of another solver and with the unreduced nodal equations.

use flexbody_body::basis::{ModeSettings, free_surface};
use flexbody_body::invariants::{BodyFrame, Frame, LumpedMasses, condense_lumped};
use flexbody_eigen::{Accuracy, Method, Wanted};
use flexbody_input::{ModelFiles, read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{RawModel, check};
use nalgebra::{Matrix3, Vector3};
use oracle::equations::Coriolis;
use oracle::mesh::entries;
use oracle::nodal::{deviation, inertia_forces, random_state, reduced};
use oracle::pipeline::{Body, proved};
use oracle::random::Random;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A body with its reference numbers.
struct Case {
    name: String,
    raw: RawModel,
    mass: f64,
    com: Vector3<f64>,
    inertia: Matrix3<f64>,
    eigenvalues: Vec<f64>,
    /// Relative residuals of the eigenvectors of the reference.
    residuals: Vec<f64>,
    /// A shift between eigenvalues and the number of eigenvalues below it, including rigid ones.
    count: Option<(f64, usize)>,
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
}

fn rows(value: &Value) -> Matrix3<f64> {
    Matrix3::from_row_iterator(value.as_array().expect("a matrix").iter().flat_map(numbers))
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("reference")).expect("JSON")
}

/// Solid bodies of `fixtures/models`.
const SOLIDS: [&str; 10] = [
    "bar_c3d8r",
    "bracket_hex20",
    "connecting_rod",
    "conveyor_plate",
    "cube_hex8",
    "gear_disc",
    "mems_gyroscope",
    "robot_link",
    "satellite",
    "turbine_blade",
];

/// Returns the bodies that are part of the project.
fn own() -> Vec<Case> {
    let folder = oracle::fixtures().join("models");
    let case = |name: &str| {
        let reference = json(&folder.join(name).join("expected.json"));
        let rigid = &reference["rigid_body"];
        let files = read_manifest(folder.join(name).join("model.toml")).expect("manifest");
        Case {
            name: name.to_owned(),
            raw: read_model(&files).expect("a readable model"),
            mass: rigid["mass"].as_f64().expect("mass"),
            com: Vector3::from_iterator(numbers(&rigid["com"])),
            inertia: rows(&rigid["inertia_com"]),
            residuals: vec![
                reference["eigenvalue_facts"]["residual_max"].as_f64().expect("residual");
                numbers(&reference["flexible_eigenvalues"]).len()
            ],
            eigenvalues: numbers(&reference["flexible_eigenvalues"]),
            count: None,
        }
    };
    SOLIDS.map(case).into()
}

/// Returns the folder of larger bodies, which exists on some machines beside the project.
fn shared_folder() -> PathBuf {
    oracle::shared().join("models")
}

/// Returns larger solid bodies that are stored beside the project on some machines; empty elsewhere.
fn shared() -> Vec<Case> {
    let case = |folder: PathBuf| {
        let reference = json(&folder.join("ref.json"));
        let (rigid, modes) = (&reference["consistent"], &reference["modes"]);
        let path = |name: &str| folder.join(name);
        let (k, m, nodes) = (path("K.mtx.gz"), path("M.mtx.gz"), path("nodes.csv"));
        let mut files =
            ModelFiles::from_arguments(k, m, nodes, Some(path("dofs.csv")), None).expect("no units");
        // Some models are in mm, t, s without stating it; the numbers are not affected.
        files.allow_implausible = true.into();
        let sylvester = &modes["sylvester"];
        Case {
            name: folder.file_name().expect("a folder").to_string_lossy().into_owned(),
            raw: read_model(&files).expect("a readable model"),
            mass: rigid["mass"].as_f64().expect("mass"),
            com: Vector3::from_iterator(numbers(&rigid["com"])),
            inertia: rows(&rigid["inertia_com"]),
            eigenvalues: numbers(&modes["lambda_"]),
            residuals: numbers(&modes["rel_residual"]),
            count: Some((
                sylvester["lam"].as_f64().expect("shift"),
                sylvester["count"].as_u64().expect("count") as usize,
            )),
        }
    };
    ["a_beam_c3d20", "b_conrod_30k", "e_bracket_near", "f_cube_c3d8", "g_two_1e6", "k_c3d8r_singularM"]
        .iter()
        .map(|name| shared_folder().join(name))
        .filter(|folder| folder.is_dir())
        .map(case)
        .collect()
}

/// Returns the sizes of the groups of eigenvalues that agree to 1e-9.
fn groups(eigenvalues: &[f64]) -> Vec<usize> {
    eigenvalues.chunk_by(|a, b| b / a - 1.0 < 1e-9).map(<[f64]>::len).collect()
}

/// Asserts that mass properties and frequencies agree with the reference to the digits of the files, and that
/// the count of modes is proved. Both sides read the same matrices; eigenvalues of thin bodies keep fewer
/// digits than the matrices, and the accuracy of the reference is that of its residuals.
fn agrees_with_its_reference(case: &Case) {
    let (name, count) = (&case.name, case.eigenvalues.len());
    let body = proved(case.raw.clone(), count, Method::Auto);
    let condensed = body.condensed(BodyFrame::Com);
    let (mass, inertia) = (condensed.invariants.mass(), condensed.invariants.inertia());
    let size = (case.inertia.trace() / case.mass).sqrt();
    assert!((mass / case.mass - 1.0).abs() < 1e-13, "{name}: mass {mass}, expected {}", case.mass);
    assert!((condensed.frame.origin - case.com).norm() < 1e-13 * size, "{name}: {}", condensed.frame.origin);
    assert!((inertia - case.inertia).norm() < 1e-13 * case.inertia.norm(), "{name}: {inertia}");
    for (j, (found, expected)) in body.eigenvalues().iter().zip(&case.eigenvalues).enumerate() {
        let tolerance = 1e-12 + 10.0 * body.modes.input_noise[j] + case.residuals[j];
        let difference = (found / expected - 1.0).abs();
        assert!(
            difference < tolerance,
            "{name} mode {j}: {found}, expected {expected}: {difference:e} > {tolerance:e}"
        );
    }
    if let Some((shift, below)) = case.count {
        let settings = ModeSettings {
            wanted: Wanted::Below(shift),
            accuracy: Accuracy::Standard,
            method: Method::Auto,
            ..ModeSettings::default()
        };
        let found = free_surface(&body.model, &settings, &Context::QUIET).expect("a sound body").solution;
        assert_eq!(found.eigenvalues.len() + 6, below, "{name}");
        assert_eq!(found.completeness.negative_pivots, Some(below), "{name}");
    }
}

/// Asserts the last line of theory section 10: generalised inertia forces from the invariants of the modes
/// equal the sums of the forces M of the file times the accelerations of all nodes.
fn obeys_the_nodal_equations(case: &Case) {
    let body = proved(case.raw.clone(), case.eigenvalues.len(), Method::Auto);
    let mass = labelled(&case.raw, &body);
    let mut random = Random(42);
    for &choice in BodyFrame::ALL {
        let condensed = body.condensed(choice);
        let reduced = reduced(&condensed.invariants);
        // Modes are mass-normalised: displacements of a fifth of the size of the body, without linearisation.
        let size = 0.2 * (0.5 * case.inertia.trace()).sqrt();
        let (state, accelerations) = random_state(&mut random, condensed.shapes.ncols(), size);
        let nodal = inertia_forces(&mass, &condensed.positions, &condensed.shapes, &state, &accelerations);
        let exact = deviation(&nodal, &reduced.inertia_forces(&state, &accelerations));
        let printed =
            reduced.mass_matrix(&state) * &accelerations + reduced.velocity_terms(&state, Coriolis::Printed);
        let printed = deviation(&nodal, &printed);
        let what = format!("{} {}", case.name, choice.name());
        assert!(exact < 1e-11, "{what}: {exact:e}");
        assert!(printed > 1e-5, "{what}: the misprinted terms should differ, {printed:e}");
    }
}

/// Returns the entries of M of the file, with rows and columns in the node order of the model.
fn labelled(raw: &RawModel, body: &Body) -> Vec<(usize, usize, f64)> {
    let place: std::collections::HashMap<i64, usize> =
        body.model.nodes().ids.iter().enumerate().map(|(i, id)| (*id, i)).collect();
    let labels = raw.dofs.as_ref().expect("labelled rows");
    let row: Vec<usize> =
        labels.iter().map(|label| 3 * place[&label.node] + usize::from(label.direction) - 1).collect();
    entries(&raw.mass.matrix).map(|(r, c, v)| (row[r as usize], row[c as usize], v)).collect()
}

#[test]
#[ignore = "slow"]
fn own_bodies_agree_with_their_references() {
    own().iter().for_each(agrees_with_its_reference);
}

#[test]
#[ignore = "slow"]
fn shared_bodies_agree_with_their_references() {
    shared().iter().for_each(agrees_with_its_reference);
}

#[test]
#[ignore = "slow"]
fn own_bodies_obey_the_nodal_equations() {
    own().iter().for_each(obeys_the_nodal_equations);
}

#[test]
#[ignore = "slow"]
fn shared_bodies_obey_the_nodal_equations() {
    shared().iter().for_each(obeys_the_nodal_equations);
}

/// Row sums of the mass matrix, and the number of finite eigenvalues for a mass matrix without full rank.
#[test]
fn shared_bodies_agree_with_the_row_sums_and_the_rank_of_their_references() {
    for case in shared() {
        let reference = json(&shared_folder().join(&case.name).join("ref.json"));
        let lumped = &reference["rowsum_lumped"];
        let model = check(case.raw.clone()).expect("a sound body").model;
        let masses = LumpedMasses::row_sum(model.scalar_mass().expect("a solid"));
        let negative = reference["rowsum_negative_rows"].as_u64().expect("a count") / 3;
        assert_eq!(masses.negative() as u64, negative, "{}", case.name);
        let com = Vector3::from_iterator(numbers(&lumped["com"]));
        let frame = Frame { origin: com, ..Frame::model() };
        let none = faer::Mat::zeros(3 * model.nodes().len(), 0);
        let positions = frame.to_body(&model.nodes().positions);
        let invariants = condense_lumped(&masses, &positions, none.as_ref(), faer::Mat::zeros(0, 0));
        let expected = rows(&lumped["inertia_com"]);
        let found = invariants.inertia();
        assert!((found - expected).norm() < 1e-12 * expected.norm(), "{}: {found}", case.name);
        let size = (expected.trace() / invariants.mass()).sqrt();
        assert!(invariants.first_moment().norm() < 1e-12 * invariants.mass() * size, "{}", case.name);
        if let Some(missing) = reference["M_rank_deficit_1e-12"].as_u64().filter(|missing| *missing > 0) {
            let settings = ModeSettings { wanted: Wanted::Lowest(usize::MAX), ..ModeSettings::default() };
            let found = free_surface(&model, &settings, &Context::QUIET).expect("a sound body").solution;
            let finite = model.stiffness().n() - missing as usize - 6;
            assert_eq!(found.eigenvalues.len(), finite, "{}", case.name);
        }
    }
}

#[test]
#[ignore = "slow"]
fn cubes_keep_their_double_and_triple_eigenvalues() {
    for case in own().into_iter().chain(shared()).filter(|case| case.name.contains("cube")) {
        let body = proved(case.raw.clone(), case.eigenvalues.len(), Method::Auto);
        assert_eq!(groups(body.eigenvalues()), groups(&case.eigenvalues), "{}", case.name);
        assert!(groups(body.eigenvalues()).contains(&3));
        let split = |pair: &[f64]| pair[1] / pair[0] - 1.0;
        let widest = body.eigenvalues().windows(2).map(split).filter(|d| *d < 1e-9).fold(0.0, f64::max);
        assert!(widest < 1e-12, "{}: repeated eigenvalues differ by {widest:e}", case.name);
    }
}

//! Format `simscape`: K, M and damping in the motions of the interface frames; refused bodies, for `chrono`
//! too.

use super::readers::{Variable, mat5};
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::{Coupling, NodeSet};
use hdf5::types::{FixedAscii, TypeDescriptor};
use hdf5_metno as hdf5;
use nalgebra::DMatrix;
use oracle::exported::{exported, file, jointed, jointed_bodies};
use oracle::general::{dense, raw_fixture};
use oracle::plane::rectangle;
use std::collections::BTreeMap;

pub(super) type Matrices = BTreeMap<String, DMatrix<f64>>;

pub(super) fn of_rows(rows: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

/// Returns the matrices and the texts of a file.
fn of_mat5(bytes: &[u8]) -> (Matrices, BTreeMap<String, Vec<String>>) {
    let (mut matrices, mut texts) = (Matrices::new(), BTreeMap::new());
    for (name, variable) in mat5(bytes) {
        match variable {
            Variable::Matrix(rows) => assert_eq!(matrices.insert(name, of_rows(&rows)), None),
            Variable::Text(lines) => assert_eq!(texts.insert(name, lines), None),
        }
    }
    (matrices, texts)
}

fn of_hdf5(bytes: &[u8]) -> (Matrices, BTreeMap<String, Vec<String>>) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.h5");
    std::fs::write(&path, bytes).expect("a file");
    let file = hdf5::File::open(&path).expect("opens");
    let (mut matrices, mut texts) = (Matrices::new(), BTreeMap::new());
    for dataset in file.datasets().expect("datasets") {
        let name = dataset.name()[1..].to_owned();
        match dataset.shape()[..] {
            [rows, columns] => {
                let values = dataset.read_raw::<f64>().expect("numbers");
                matrices.insert(name, DMatrix::from_row_slice(rows, columns, &values));
            }
            _ => {
                // Octave cannot read texts of variable length or in UTF-8.
                let kind = dataset.dtype().and_then(|kind| kind.to_descriptor()).expect("a type");
                assert!(matches!(kind, TypeDescriptor::FixedAscii(_)), "{name}: {kind}");
                let text = dataset.read_scalar::<FixedAscii<1024>>().expect("a text");
                texts.insert(name, serde_json::from_str(text.as_str()).expect("a list of texts"));
            }
        }
    }
    (matrices, texts)
}

/// Returns the rigid motions about the origin of the body frame in the coordinates of frames at `origins`.
pub(super) fn rigid(origins: &DMatrix<f64>, size: usize) -> DMatrix<f64> {
    DMatrix::from_fn(size, 6, |row, column| {
        let (frame, k) = (row / 6, row % 6);
        if frame >= origins.nrows() {
            return 0.0;
        }
        let x = |axis: usize| origins[(frame, axis)];
        match (k, column) {
            (k, column) if k == column => 1.0,
            // e x r: about x (0, -z, y), about y (z, 0, -x), about z (-y, x, 0).
            (1, 3) => -x(2),
            (2, 3) => x(1),
            (0, 4) => x(2),
            (2, 4) => -x(0),
            (0, 5) => -x(1),
            (1, 5) => x(0),
            _ => 0.0,
        }
    })
}

/// Asserts the required properties of K, M and D of a file of any format.
pub(super) fn assert_is_the_body(name: &str, body: &FlexBody, matrices: &Matrices) {
    let (k, m, origins) = (&matrices["K"], &matrices["M"], &matrices["P0"]);
    let size = k.nrows();
    let rigid = rigid(origins, size);
    let (own, found) = (dense(&body.parts().rigid_mass()), rigid.transpose() * m * &rigid);
    for i in 0..6 {
        for j in 0..6 {
            let scale = (own[(i, i)] * own[(j, j)]).sqrt();
            assert!(
                (found[(i, j)] - own[(i, j)]).abs() <= 1e-9 * scale,
                "{name}: mass of rigid motion {i} {j}"
            );
        }
    }
    let lambda = &body.modes().eigenvalue;
    let noise = 1e-9 + 10.0 * body.certificate().rigid_noise;
    let strained = rigid.transpose() * k * &rigid;
    for i in 0..6 {
        assert!(
            strained[(i, i)].abs() <= noise * lambda[0] * own[(i, i)],
            "{name}: rigid motion {i} is strained"
        );
    }
    // The modes of the body in coordinates: B'K B = diag(lambda), B'M B = I, B'D B = D_ff.
    let b = dense(&body.coordinates().expect("jointed").of_modes);
    let (stiffness, mass) = (b.transpose() * k * &b, b.transpose() * m * &b);
    let d = matrices.get("C").map(|c| b.transpose() * c * &b);
    assert_eq!(d.is_some(), body.modes().modal_damping.is_some(), "{name}");
    for i in 0..lambda.len() {
        for j in 0..lambda.len() {
            let same = f64::from(i == j);
            let root = (lambda[i] * lambda[j]).sqrt();
            assert!((stiffness[(i, j)] / root - same).abs() <= noise, "{name}: stiffness of modes {i} {j}");
            assert!((mass[(i, j)] - same).abs() <= 1e-9, "{name}: mass of modes {i} {j}");
            if let (Some(d), Some(own)) = (&d, &body.modes().modal_damping) {
                let scale = (own[(i, i)] * own[(j, j)]).sqrt();
                assert!((d[(i, j)] - own[(i, j)]).abs() <= 1e-9 * scale, "{name}: damping of modes {i} {j}");
            }
        }
    }
    // Rigid motion is orthogonal to the modes: B'D R = D_ff (B'M R) = 0.
    if let (Some(c), Some(d)) = (matrices.get("C"), &d) {
        let force = b.transpose() * c * &rigid;
        for (i, j) in (0..lambda.len()).flat_map(|i| (0..6).map(move |j| (i, j))) {
            let scale = d.row(i).abs().sum() * own[(j, j)].sqrt();
            assert!(
                force[(i, j)].abs() <= 1e-9 * scale,
                "{name}: {:e} damps rigid motion",
                force[(i, j)] / scale
            );
        }
    }
}

#[test]
fn simscape_has_the_matrices_of_the_body_under_the_names_of_its_example_in_both_dialects() {
    for (name, body) in jointed_bodies() {
        let (matrices, texts) = of_mat5(&file(body, "simscape", None));
        let mut names = vec!["K", "M", "P0", "axes", "origin"];
        if body.modes().modal_damping.is_some() {
            names.insert(0, "C");
        }
        assert_eq!(matrices.keys().map(String::as_str).collect::<Vec<_>>(), names, "{name}");
        let coordinates = body.coordinates().expect("jointed");
        assert_eq!(matrices["K"], dense(&coordinates.stiffness), "{name}");
        assert_eq!(matrices["M"], dense(&coordinates.mass), "{name}");
        let origins: Vec<[f64; 3]> =
            body.interfaces().iter().map(|i| i.reference.expect("coupled")).collect();
        assert_eq!(matrices["P0"], DMatrix::from_fn(origins.len(), 3, |i, k| origins[i][k]), "{name}");
        assert_eq!(matrices["origin"].as_slice(), body.frame().origin.as_slice());
        assert_eq!(matrices["axes"], DMatrix::from_fn(3, 3, |i, j| body.frame().axes[(i, j)]));
        let frames: Vec<&str> = body.interfaces().iter().map(|interface| interface.name.as_str()).collect();
        assert_eq!(texts["frames"], frames);
        let units = body.units();
        assert_eq!(texts["units"], [units.length.name(), units.mass.name(), units.time.name()]);
        assert_is_the_body(name, body, &matrices);
        assert_eq!(of_hdf5(&file(body, "simscape", Some("hdf5"))), (matrices, texts), "{name}");
    }
}

/// Covers names of frames outside ASCII and of different lengths.
#[test]
fn names_of_frames_are_kept() {
    let mut raw = raw_fixture("robot_link");
    for (interface, name) in raw.data.interfaces.iter_mut().zip(["Lager außen", "日本 \"x\""]) {
        (interface.name, interface.coupling) = (name.to_owned(), Some(Coupling::Rigid));
    }
    let basis = BasisChoice::CraigBampton(CraigBampton);
    let body = oracle::exported::body_of(raw, basis, BodyFrame::Com);
    for (dialect, read) in [("mat5", of_mat5 as fn(&[u8]) -> _), ("hdf5", of_hdf5)] {
        let (_, texts): (Matrices, BTreeMap<String, Vec<String>>) =
            read(&file(&body, "simscape", Some(dialect)));
        assert_eq!(texts["frames"], ["Lager außen", "日本 \"x\""]);
    }
    let table = String::from_utf8(exported(&body, "chrono", None).expect("writes").file).expect("UTF-8");
    assert!(table.contains("\n\"Lager außen\",") && table.contains("\n\"日本 \"\"x\"\"\","), "{table}");
}

#[test]
fn bodies_without_such_coordinates_are_refused_with_what_to_do() {
    let plane = {
        let mut raw = rectangle(8, 3, 0.4, [0.3, -0.1]);
        raw.data.interfaces =
            vec![NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new("end", vec![1, 10, 19]) }];
        oracle::exported::body_of(raw, BasisChoice::CraigBampton(CraigBampton), BodyFrame::Model)
    };
    let free_modes =
        oracle::exported::body_of(raw_fixture("robot_link"), BasisChoice::default(), BodyFrame::Com);
    let free_interface = jointed("satellite", Coupling::Free, None);
    let renamed = {
        let mut parts = jointed_bodies()[0].1.clone().into_parts();
        parts.interfaces.swap(0, 1);
        FlexBody::new(parts).expect("valid parts")
    };
    for (body, said, helped) in [
        (&free_modes, "the body has free modes only", "--basis craig-bampton"),
        (&plane, "out of the plane", "in space"),
        (&free_interface, "interface `bus` is free", "couple the interface"),
        (&renamed, "do not match its interfaces", "--basis craig-bampton"),
    ] {
        for format in ["simscape", "chrono"] {
            let error = exported(body, format, None).expect_err(said);
            let [diagnostic] = error.diagnostics() else { panic!("{error}") };
            assert_eq!(diagnostic.code(), Code::ExportLoses);
            assert!(
                diagnostic.message().starts_with(&format!("{format} needs K and M")),
                "{}",
                diagnostic.message()
            );
            assert!(diagnostic.message().contains(said), "{}", diagnostic.message());
            let help = diagnostic.help();
            assert!(help.contains(helped), "{help}");
        }
    }
}

//! Folded shells of CalculiX: knots, linear shells, edges of shells as interfaces.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisKind, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::{ModelFiles, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel};
use flexbody_study::tailoring::computed_basis;
use nalgebra::Vector3;
use oracle::fixtures;
use oracle::jobs::{body, job, set};
use std::fs;
use std::path::PathBuf;

/// Size of the two strips, which enclose 100 degrees. Unit: m.
const THICKNESS: f64 = 0.004;
const LENGTH: f64 = 0.3;
const WIDTHS: [f64; 2] = [0.2, 0.15];

/// Decks, with the eigenvalues that CalculiX prints.
const TABLES: [(&str, [f64; 6]); 2] = [
    ("s4", [0.8330742e6, 0.1373472e7, 0.1683193e8, 0.2715093e8, 0.2880350e8, 0.2205588e9]),
    ("s8", [0.8153780e6, 0.1361291e7, 0.3627870e7, 0.6513721e7, 0.1610362e8, 0.2262005e8]),
];

fn deck(name: &str) -> PathBuf {
    fixtures().join("small/calculix_folded").join(name).with_extension("inp")
}

/// Asserts mass, place and polar inertia of the two strips: solids that overlap at the fold.
fn assert_is_the_sheet(body: &FlexBody) {
    let angle = 100f64.to_radians();
    let middles = [
        Vector3::new(0.5 * LENGTH, 0.5 * WIDTHS[0], 0.0),
        Vector3::new(0.5 * LENGTH, 0.5 * WIDTHS[1] * angle.cos(), 0.5 * WIDTHS[1] * angle.sin()),
    ];
    let masses = WIDTHS.map(|width| 7850.0 * THICKNESS * LENGTH * width);
    let mass: f64 = masses.iter().sum();
    let centre: Vector3<f64> = (0..2).map(|k| middles[k] * masses[k]).sum::<Vector3<f64>>() / mass;
    let square = |k: usize| {
        let own = (THICKNESS.powi(2) + LENGTH.powi(2) + WIDTHS[k].powi(2)) / 12.0;
        masses[k] * (own + (middles[k] - centre).norm_squared())
    };
    let invariants = body.invariants();
    // The deck has nine digits.
    assert!((invariants.mass() / mass - 1.0).abs() < 1e-9, "{}", invariants.mass());
    let away = (Vector3::from(body.frame().origin) - centre).norm();
    assert!(away < 1e-9 * LENGTH, "{away}");
    let polar = 0.5 * invariants.inertia().trace();
    assert!((polar / (square(0) + square(1)) - 1.0).abs() < 1e-8, "{polar}");
}

/// Rows of knots are read as nodes with rotations, and the body has the mass of the sheet and the frequencies that
/// CalculiX prints.
#[test]
fn folded_shells_have_the_frequencies_of_calculix() {
    for (name, table) in TABLES {
        let raw = job(&deck(name), Vec::new());
        let labels = raw.dofs.as_ref().expect("labels");
        let turning = labels.iter().filter(|label| label.direction > 3).count();
        assert_eq!(turning, 9, "three knots");
        let body = body(raw, 6);
        assert_is_the_sheet(&body);
        for (own, printed) in body.modes().eigenvalue.iter().zip(table) {
            assert!((own / printed - 1.0).abs() < 1e-6, "{name}: {own} {printed}");
        }
    }
}

/// Edges of shells take part with the nodes on both faces, and folds with the rotations of their knots, so that both
/// hold the body at a reference point; the surface is drawn.
#[test]
fn edges_and_folds_are_interfaces() {
    for (name, [at_edge, at_fold]) in [("s4", [6, 3]), ("s8", [8, 3])] {
        let raw = job(&deck(name), vec![set("edge", "EDGE"), set("fold", "FOLD")]);
        let counts: Vec<usize> = raw.data.interfaces.iter().map(|interface| interface.nodes.len()).collect();
        assert_eq!(counts, [at_edge, at_fold], "{name}");
        assert!(raw.data.mesh.as_ref().is_some_and(|mesh| !mesh.triangles().is_empty()), "{name}");
        let model = FeModel::from_raw(raw).expect("a model").model;
        let middle = model.interfaces()[0].reference.point().expect("a point");
        let exact = [0.5 * LENGTH, WIDTHS[0], 0.0];
        let near = (0..3).all(|k| (middle[k] - exact[k]).abs() < 1e-9);
        assert!(near, "{name}: the edge is between the faces, {middle:?}");
        let settings = ConvertSettings {
            basis: computed_basis(BasisKind::CraigBampton, &[], &model).expect("a basis"),
            modes: ModeSettings { wanted: Wanted::Lowest(4), ..ModeSettings::default() },
            ..ConvertSettings::default()
        };
        let held = convert(&model, &settings, &Context::QUIET).expect("a body").body;
        assert_is_the_sheet(&held);
        for interface in held.interfaces() {
            let (nodes, modes) = (held.nodes(), held.modes());
            let rotation = modes.rotation.as_ref().map(|rotation| rotation.as_ref());
            let rows = interface.rows(nodes, modes.shape.as_ref(), rotation, 3).expect("a point");
            assert!(rows.rotation.is_some(), "{name}: {} turns", interface.name);
        }
    }
}

/// A deck whose knots do not explain the rows is refused with the reason.
#[test]
fn rows_of_other_knots_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    for file in ["s4.inp", "s4.sti", "s4.mas", "s4.dof"] {
        fs::copy(fixtures().join("small/calculix_folded").join(file), place.path().join(file))
            .expect("a copy");
    }
    let read = |from: &str, to: &str| {
        let text = fs::read_to_string(deck("s4")).expect("a deck").replace(from, to);
        fs::write(place.path().join("s4.inp"), text).expect("a deck");
        let files = ModelFiles::from_job(place.path().join("s4.inp"), None, Vec::new(), None).expect("files");
        read_model(&files)
    };
    read("nothing", "nothing").expect("the deck");
    let refused = |from: &str, to: &str| -> String {
        let error = read(from, to).map(|raw: RawModel| raw.data.description.name).expect_err(to);
        assert!(error.has(Code::DeckUnsupported), "{error}");
        error.to_string()
    };
    // Without the elements on one side of a line the node of a knot is not one of shells.
    let text = refused(
        "*ELEMENT, TYPE=S4, ELSET=E\n1, 1, 3, 13, 11\n2, 11, 13, 23, 21\n3, 3, 5, 15, 13\n4, 13, 15, 25, 23",
        "*ELEMENT, TYPE=S4, ELSET=E\n1, 1, 3, 13, 11\n2, 11, 13, 23, 21",
    );
    assert!(
        text.contains("3 nodes outside the deck are stretches of knots of shells, but 2 nodes"),
        "{text}"
    );
}

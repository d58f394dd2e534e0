//! Stresses of nodes in the files of programs that have a place for them.

use crate::checklists::nodal_stresses;
use flexbody_body::flex_body::FlexBody;
use flexbody_formats::export::{ExportOptions, Points};
use flexbody_formats::{FORMATS, export};
use hdf5_metno::File;
use nalgebra::{Matrix3, Rotation3, Vector3};
use oracle::exported::jointed_bodies;

/// Returns a body with stresses of some of its nodes, in a frame that is turned against the model.
fn body() -> FlexBody {
    let (_, body) =
        jointed_bodies().iter().find(|(name, _)| name == "car_frame, jointed").expect("a body of beams");
    let mut parts = body.clone().into_parts();
    let nf = parts.modes.eigenvalue.len();
    parts.recoveries = vec![nodal_stresses(&parts.nodes.ids[1..4], nf)];
    let turned = Rotation3::from_scaled_axis(Vector3::new(0.3, -0.8, 0.5)) * parts.frame.axes;
    parts.frame.axes = turned;
    FlexBody::new(parts).expect("a body")
}

/// Returns the stress of a node in a mode along body axes, from the rows along the axes of the model.
fn expected(body: &FlexBody, node: usize, mode: usize) -> Matrix3<f64> {
    let modes = &body.recoveries()[0].modes;
    let row = |c: usize| if (1..4).contains(&node) { modes[(6 * (node - 1) + c, mode)] } else { 0.0 };
    let stress = Matrix3::new(row(0), row(3), row(5), row(3), row(1), row(4), row(5), row(4), row(2));
    let axes = body.frame().axes;
    axes.transpose() * stress * axes
}

fn written(format: &str, body: &FlexBody, points: Points) -> (tempfile::NamedTempFile, Vec<String>) {
    let format = FORMATS.iter().find(|one| one.name() == format).expect("a format");
    let (exported, said) = export(body, *format, &ExportOptions { points, ..ExportOptions::default() }, true)
        .expect("an export");
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), &exported.file).expect("written");
    (
        file,
        said.iter()
            .map(|diagnostic| format!("{}: {}", diagnostic.code().id(), diagnostic.message()))
            .collect(),
    )
}

#[test]
fn exudyn_has_them_by_modes_in_its_order() {
    let body = body();
    let (file, said) = written("exudyn", &body, Points::Nodes);
    let file = File::open(file.path()).expect("HDF5");
    let matrix =
        file.dataset("postProcessingModes/matrix").expect("stresses").read_2d::<f64>().expect("numbers");
    let (n, nf) = (body.nodes().len(), body.n_modes());
    assert_eq!(matrix.dim(), (n, 6 * nf));
    for node in 0..n {
        for mode in 0..nf {
            let s = expected(&body, node, mode);
            let order = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
            for (c, at) in order.into_iter().enumerate() {
                assert!((matrix[(node, 6 * mode + c)] - s[at]).abs() < 1e-13, "{node} {mode} {c}");
            }
        }
    }
    assert!(said.iter().any(|one| one.contains("FB724") && one.contains("undeformed")), "{said:?}");
}

#[test]
fn mbsim_has_six_rows_of_each_node() {
    let body = body();
    let (file, _) = written("mbsim", &body, Points::Nodes);
    let file = File::open(file.path()).expect("HDF5");
    let matrix = file.dataset("nodal stress matrix").expect("stresses").read_2d::<f64>().expect("numbers");
    let ids = file.dataset("node numbers").expect("numbers").read_raw::<i64>().expect("numbers");
    for (place, id) in ids.iter().enumerate() {
        let node = body.nodes().ids.iter().position(|own| own == id).expect("a node");
        for mode in 0..body.n_modes() {
            let s = expected(&body, node, mode);
            let order = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
            for (c, at) in order.into_iter().enumerate() {
                assert!((matrix[(6 * place + c, mode)] - s[at]).abs() < 1e-13, "{id} {mode} {c}");
            }
        }
    }
}

#[test]
fn sid_has_the_stresses_of_the_undeformed_body_too() {
    let body = body();
    let (file, said) = written("sid", &body, Points::Nodes);
    let text = std::fs::read_to_string(file.path()).expect("text");
    let objects = |name: &str| text.lines().filter(|line| line.trim() == name).count();
    assert!(
        objects("sigma") > 3 && objects("sigma") == objects("AP"),
        "{} {}",
        objects("sigma"),
        objects("AP")
    );
    assert!(!said.iter().any(|one| one.contains("undeformed")), "{said:?}");
}

#[test]
fn formats_without_a_place_say_so() {
    let body = body();
    // The reference points of interfaces have no stresses.
    for format in ["adams-invariants", "mbdyn", "mbsim"] {
        let (_, said) = written(format, &body, Points::Usual);
        assert!(
            said.iter().any(|one| one.contains("FB724") && one.contains("`stresses`")),
            "{format}: {said:?}"
        );
    }
    let (_, said) = written("npz", &body, Points::Usual);
    assert!(!said.iter().any(|one| one.contains("FB724")), "{said:?}");
}

/// Interfaces have numbers in SID and MBSim; a note and a table beside the file say which.
#[test]
fn numbers_of_interfaces_are_told() {
    let body = body();
    let names: Vec<&str> = body.interfaces().iter().map(|interface| interface.name.as_str()).collect();
    assert!(!names.is_empty());
    for format in ["sid", "mbsim"] {
        let (_, said) = written(format, &body, Points::Usual);
        let note = said.iter().find(|one| one.contains("FB725")).expect("a note");
        assert!(names.iter().all(|name| note.contains(&format!("`{name}` is "))), "{note}");
        let found = FORMATS.iter().find(|one| one.name() == format).expect("a format");
        let (exported, _) = export(&body, *found, &ExportOptions::default(), true).expect("an export");
        let (ending, table) = &exported.beside[0];
        let table = String::from_utf8(table.clone()).expect("text");
        assert_eq!(ending, "frames.csv");
        for name in &names {
            let row = table.lines().find(|line| line.contains(&format!("\"{name}\""))).expect("a row");
            let number = row.split(',').next().expect("a number");
            assert!(note.contains(&format!("`{name}` is {number}")), "{note}: {row}");
        }
        let (_, said) = written(format, &body, Points::Nodes);
        assert!(!said.iter().any(|one| one.contains("FB725")), "{said:?}");
    }
}

//! Meshes of VTK: points, cells, shapes and interfaces against the body.

use super::readers::Vtu;
use crate::program::flexbody;
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_formats::export::{ExportOptions, Points};
use flexbody_formats::{export, find_format};
use nalgebra::Vector3;
use oracle::exported::{bodies, file};
use oracle::file_bodies::{body, wild_body};
use oracle::fixtures;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

fn with_points(body: &FlexBody, points: Points) -> Vtu {
    let options = ExportOptions { points, ..ExportOptions::default() };
    let format = find_format("vtk").expect("a format");
    Vtu::read(&export(body, format, &options, false).expect("written").0.file)
}

/// Asserts that the nodal data of a file agree with the body; returns the numbers of the points that are no
/// nodes.
fn check(body: &FlexBody, vtu: &Vtu) -> Vec<i64> {
    let index: BTreeMap<i64, usize> = body.nodes().ids.iter().copied().zip(0..).collect();
    let numbers = vtu.numbers();
    assert_eq!(numbers.len(), vtu.points);
    let nodes: Vec<(usize, usize)> =
        numbers.iter().enumerate().filter_map(|(point, number)| Some((point, *index.get(number)?))).collect();
    let positions = vtu.positions();
    for &(point, node) in &nodes {
        assert_eq!(positions[point], body.frame().to_model(body.nodes().positions[node]));
    }
    let axes = body.frame().axes;
    let turned = |of: &Mat<f64>, node: usize, j: usize| -> [f64; 3] {
        (axes * Vector3::from_fn(|k, _| of[(3 * node + k, j)])).into()
    };
    for (kind, own) in [("mode_", Some(&body.modes().shape)), ("rotation_", body.modes().rotation.as_ref())] {
        let arrays: Vec<_> = vtu.arrays.iter().filter(|array| array.name.starts_with(kind)).collect();
        let Some(own) = own else { continue };
        assert_eq!(arrays.len(), body.n_modes());
        for (j, array) in arrays.iter().enumerate() {
            assert!(array.name.starts_with(&format!("{kind}{:03} (", j + 1)), "{}", array.name);
            let vectors = array.vectors();
            assert_eq!(vectors.len(), vtu.points);
            for &(point, node) in &nodes {
                assert_eq!(vectors[point], turned(own, node, j), "{} of node {node}", array.name);
            }
        }
    }
    assert_eq!(vtu.array("FieldData", "frequency_hz").floats(), body.frequencies_hz());
    check_cells(vtu);
    check_interfaces(body, vtu, &index);
    numbers.into_iter().filter(|number| !index.contains_key(number)).collect()
}

/// Asserts that every point belongs to a cell of a known kind.
fn check_cells(vtu: &Vtu) {
    let mut used = BTreeSet::new();
    for (kind, points) in vtu.cells() {
        let corners = BTreeMap::from([(1u8, 1), (3, 2), (5, 3)]);
        assert_eq!(corners.get(&kind), Some(&points.len()), "kind {kind}");
        assert!(points.iter().all(|point| *point < vtu.points));
        used.extend(points);
    }
    assert_eq!(used.len(), vtu.points);
}

fn check_interfaces(body: &FlexBody, vtu: &Vtu, index: &BTreeMap<i64, usize>) {
    let marks: Vec<_> = vtu.arrays.iter().filter(|array| array.name.starts_with("interface ")).collect();
    assert_eq!(marks.len(), body.interfaces().len());
    for (array, interface) in marks.iter().zip(body.interfaces()) {
        let marked = array.bytes.iter().zip(vtu.numbers()).filter(|(mark, _)| **mark == 1);
        let marked: BTreeSet<usize> = marked.map(|(_, number)| index[&number]).collect();
        assert!(marked.is_subset(&interface.nodes.iter().copied().collect()), "{}", interface.name);
    }
}

#[test]
fn bodies_of_every_kind_come_back() {
    for (name, body) in bodies() {
        let vtu = Vtu::read(&file(body, "vtk", None));
        let references = check(body, &vtu);
        let wanted = body.interfaces().iter().filter(|interface| interface.reference.is_some()).count();
        assert!(references.len() <= wanted, "{name}");
        assert_eq!(references.is_empty(), !vtu.arrays.iter().any(|array| array.name == "reference point"));
        assert!(vtu.head.contains(" Vectors=\"mode_001 ("), "{name}");
        let all = with_points(body, Points::Nodes);
        assert_eq!(check(body, &all).len(), references.len(), "{name}");
        assert_eq!(all.points, body.n_nodes() + references.len());
        let node = body.nodes().ids[body.n_nodes() / 2];
        assert_eq!(with_points(body, Points::Some(vec![node])).numbers(), [node]);
        let Some(mesh) = body.mesh() else { continue };
        let count = |kind: u8| vtu.cells().iter().filter(|cell| cell.0 == kind).count();
        assert_eq!((count(5), count(3)), (mesh.triangles().len(), mesh.edges().len()), "{name}");
    }
}

/// Reference points move like the fit of their nodes.
#[test]
fn reference_points_are_those_of_the_interfaces() {
    let (_, body) = bodies().iter().find(|(name, _)| name == "bracket_hex20, jointed").expect("a body");
    let vtu = Vtu::read(&file(body, "vtk", None));
    let (positions, marks) = (vtu.positions(), &vtu.array("PointData", "reference point").bytes);
    let mode = vtu.arrays.iter().find(|array| array.name.starts_with("mode_003")).expect("a mode").vectors();
    let axes = body.frame().axes;
    let mut found = 0;
    for interface in body.interfaces() {
        let rotation = body.modes().rotation.as_ref().map(|rotation| rotation.as_ref());
        let shape = body.modes().shape.as_ref();
        let rows = interface.rows(body.nodes(), shape, rotation, body.dimension()).expect("a motion");
        let place = body.frame().to_model(interface.reference.expect("a reference point"));
        let own: [f64; 3] = (axes * Vector3::from_fn(|k, _| rows.translation[(k, 2)])).into();
        let there = |point: &usize| marks[*point] == 1 && positions[*point] == place;
        found += usize::from((0..vtu.points).filter(there).any(|point| mode[point] == own));
    }
    assert!(found > 0 && found == marks.iter().filter(|mark| **mark == 1).count());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bodies_come_back(seed in any::<u64>(), n in 1..9usize, nf in 1..4usize, interfaces in 0..4usize) {
        let nf = nf.min(3 * n);
        for body in [body(seed, n, nf, 0, interfaces), wild_body(seed, n, nf, 0, interfaces)] {
            check(&body, &Vtu::read(&file(&body, "vtk", None)));
            check(&body, &with_points(&body, Points::Nodes));
        }
    }
}

/// The reader of meshes finds nodes with their numbers and interfaces as sets: the model converts with the
/// mesh as with its table.
#[test]
fn our_own_reader_takes_the_nodes() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |line: &str| {
        let run = flexbody(folder.path(), &line.split_whitespace().collect::<Vec<_>>());
        assert!(run.status.success(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
    };
    let model = fixtures().join("models/bracket_hex20");
    let model = model.to_str().expect("a path in UTF-8");
    run(&format!("convert {model}/model.toml --modes 5 --frame model -o a.flex.h5"));
    run("export a.flex.h5 --to vtk --points nodes -o a.vtu");
    let nodes = folder.path().join("a.vtu");
    let interface = |name: &str| format!("[[interface]]\nname = \"{name}\"\nset = \"interface {name}\"\n");
    let manifest = format!(
        "[model]\nname = \"bracket_hex20\"\n[model.units]\nlength = \"mm\"\nmass = \"tonne\"\ntime = \"s\"\n[files]\n\
         stiffness = \"{model}/K.mtx.gz\"\nmass = \"{model}/M.mtx.gz\"\nnodes = {nodes:?}\ndofs = \"{model}/dofs.csv\"\n{}{}",
        interface("bolt_base"),
        interface("bolt_wall")
    );
    std::fs::write(folder.path().join("model.toml"), manifest).expect("written");
    run("convert model.toml --modes 5 --frame model -o b.flex.h5");
    run("compare a.flex.h5 b.flex.h5");
    let read = |name: &str| flexbody_file::read(folder.path().join(name)).expect("a body");
    let (a, b) = (read("a.flex.h5"), read("b.flex.h5"));
    assert_eq!(a.nodes(), b.nodes());
    let sorted = |body: &FlexBody| -> Vec<BTreeSet<usize>> {
        body.interfaces().iter().map(|interface| interface.nodes.iter().copied().collect()).collect()
    };
    assert_eq!(sorted(&a), sorted(&b));
}

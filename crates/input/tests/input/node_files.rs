//! Nodes and labels of rows in files of FE programs and meshers.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{InterfaceNodes, InterfaceSource, ModelFiles, ModelSource, read_model};
use flexbody_model::{FeModel, RawModel, Reference};
use oracle::fixtures;
use std::fs;
use std::path::Path;

/// Reads the tetrahedron of `fixtures/small` with nodes and labels from other files.
pub fn tetrahedron(nodes: &Path, dofs: Option<&Path>, sets: &[&str]) -> Result<RawModel, Error> {
    let small = |name: &str| fixtures().join("small/tet4").join(name);
    let dofs = dofs.map_or_else(|| small("dofs.csv"), Path::to_path_buf);
    let mut files =
        ModelFiles::from_arguments(small("K.mtx"), small("M.mtx"), nodes, Some(dofs), None).expect("files");
    let interface = |name: &&str| InterfaceSource {
        name: (*name).to_owned(),
        nodes: InterfaceNodes::Set((*name).to_owned()),
        coupling: None,
        reference: Reference::Centre,
    };
    files.interfaces = sets.iter().map(interface).collect();
    read_model(&files)
}

/// Returns numbers and positions of the tetrahedron.
pub fn nodes() -> Vec<(i64, [f64; 3])> {
    let own = fixtures().join("small/tet4/nodes.csv");
    let raw = tetrahedron(&own, None, &[]).expect("readable");
    raw.nodes.ids.into_iter().zip(raw.nodes.positions).collect()
}

fn written(name: &str, text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, text).expect("written");
    (folder, path)
}

/// The tetrahedron in Ansys formats: archive with a component, tab-separated table with decimal commas,
/// listing.
#[test]
fn nodes_of_ansys_are_those_of_the_table() {
    let own = nodes();
    let mut table = "Knotennummer\tX-Position (m)\tY-Position (m)\tZ-Position (m)\t\n".to_owned();
    for (id, [x, y, z]) in &own {
        table += &format!("{id}\t{x:e}\t{y:e}\t{z:e}\t\n").replace('.', ",");
    }
    let (_folder, table) = written("nodes.txt", &table);
    let mesh = |name: &str| fixtures().join("small/meshes").join(name);
    for path in [&mesh("tet4.cdb"), &table, &mesh("tet4_nlist.lis")] {
        let shown = path.display();
        let raw = tetrahedron(path, None, &[]).unwrap_or_else(|error| panic!("{shown}: {error}"));
        let read: Vec<_> = raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied()).collect();
        assert_eq!(read, own, "{shown}");
        FeModel::from_raw(raw).unwrap_or_else(|error| panic!("{shown}: {error}"));
    }
    let raw = tetrahedron(&mesh("tet4.cdb"), None, &["pin", "RUN"]).expect("readable");
    assert_eq!(raw.data.interfaces[0].nodes, [10, 30]);
    assert_eq!(raw.data.interfaces[1].nodes, [10, 20], "those of the range that there are");
}

#[test]
fn damaged_node_files_are_refused_where_they_are_damaged() {
    let head = "/PREP7\nNBLOCK,6,SOLID\n(3i9,6e21.13e3)\n";
    let mesh = fs::read_to_string(fixtures().join("small/meshes/block41.msh")).expect("a mesh");
    let cases = [
        ("a.cdb", format!("{head}        1        0        0 1.0\n"), Code::NodeFileSyntax, "cut off"),
        (
            "a.cdb",
            format!("{head}      one        0        0 1.0\nN,R5.3,LOC\n"),
            Code::NodeFileSyntax,
            "a node and coordinates",
        ),
        ("a.cdb", "/PREP7\nNBLOCK,6\n(something)\n".to_owned(), Code::NodeFileSyntax, "not a format"),
        ("a.cdb", "/PREP7\nFINISH\n".to_owned(), Code::NodeFileSyntax, "no nodes"),
        (
            "a.cdb",
            "/PREP7\nNBLOCK,6\n(3i99999999999999999,6e21.13)\n".to_owned(),
            Code::NodeFileSyntax,
            "not a format",
        ),
        (
            "a.cdb",
            format!(
                "{head}        1        0        0\nN,R5\nCMBLOCK,A,NODE,99999999999999999\n(8i10)\n         1-999999999\n"
            ),
            Code::NodeFileSyntax,
            "expected 99999999999999999 numbers",
        ),
        (
            "a.inp",
            "*NODE\n1, 0, 0, 0\n*NSET, NSET=A, GENERATE\n1, 9000000000000000000, 1\n".to_owned(),
            Code::DeckSyntax,
            "first, last and increment",
        ),
        (
            "a.inp",
            "*INSTANCE, NAME=A, PART=B\n0, 0, 0\n1, 1, 1, 1, 1, 1, 90\n".to_owned(),
            Code::DeckSyntax,
            "two points of an axis",
        ),
        ("a.msh", mesh[..mesh.len() / 3].to_owned(), Code::NodeFileSyntax, "end of the file"),
        ("a.msh", mesh.replace("4.1 0 8", "4.1 1 8"), Code::NodeFileSyntax, "binary"),
        ("a.msh", mesh.replace("4.1 0 8", "5.2 0 8"), Code::NodeFileSyntax, "not read"),
        ("a.inp", "*NODE\n1, 0, 0, nan\n".to_owned(), Code::DeckSyntax, "a node number and its coordinates"),
        ("a.txt", "Knotennummer\tX\tY\tZ\n1\t0,5\n".to_owned(), Code::NodeFileSyntax, "three coordinates"),
    ];
    for (name, text, code, part) in cases {
        let (_folder, path) = written(name, &text);
        let error = tetrahedron(&path, None, &[]).expect_err(part);
        let found = error.diagnostics().iter().find(|found| found.code() == code);
        assert!(found.is_some_and(|found| found.message().contains(part)), "{part}: {error}");
    }
}

/// Both versions of a Gmsh mesh, and the nodes of a deck with the same positions.
#[test]
fn meshes_of_gmsh_have_nodes_and_groups() {
    let read = ["block41.msh", "block22.msh"].map(|name| {
        let path = fixtures().join("small/meshes").join(name);
        // The matrices belong to another model; the mismatch is detected later.
        let raw = tetrahedron(&path, None, &["left end"]);
        raw.unwrap_or_else(|error| panic!("{name}: {error}"))
    });
    for raw in &read {
        let at = |id: &i64| raw.nodes.ids.iter().position(|own| own == id).expect("a node");
        let left = &raw.data.interfaces[0].nodes;
        assert!(!left.is_empty() && left.iter().all(|id| raw.nodes.positions[at(id)][0] == 0.0));
    }
    let [a, b] = read;
    assert_eq!(a.nodes.len(), b.nodes.len());
    for (id, x) in a.nodes.ids.iter().zip(&a.nodes.positions) {
        let at = b.nodes.ids.iter().position(|own| own == id).expect("a node");
        assert!((0..3).all(|k| (b.nodes.positions[at][k] - x[k]).abs() < 1e-12));
    }
}

/// Node numbers in the order of the rows, and directions by name.
#[test]
fn mappings_of_ansys_label_the_rows() {
    let own = nodes();
    let labels = {
        let raw = tetrahedron(&fixtures().join("small/tet4/nodes.csv"), None, &[]).expect("readable");
        raw.dofs.expect("labels")
    };
    let mut named = "      Matrix Eqn    Node    DOF\n".to_owned();
    for (row, label) in labels.iter().enumerate() {
        let name = ["UX", "UY", "UZ"][usize::from(label.direction) - 1];
        named += &format!("{:>10} {:>10}   {name}\n", row + 1, label.node);
    }
    let table = fixtures().join("small/tet4/nodes.csv");
    let (_folder, path) = written("K.mapping", &named);
    assert_eq!(tetrahedron(&table, Some(&path), &[]).expect("readable").dofs, Some(labels));
    let mut array = "%%MatrixMarket matrix array integer general\n% Creator: ANSYS Inc\n4 1\n".to_owned();
    own.iter().for_each(|(id, _)| array += &format!("{id}\n"));
    let (_folder, path) = written("map.txt", &array);
    let dofs = tetrahedron(&table, Some(&path), &[]).expect("readable").dofs.expect("labels");
    assert_eq!(dofs.len(), 12);
    assert!(
        dofs.iter().enumerate().all(|(row, l)| (l.node, l.direction) == (own[row / 3].0, row as u8 % 3 + 1))
    );
    let (_folder, path) = written("map.txt", &array.replace("4 1\n", "5 1\n7\n"));
    let error = tetrahedron(&table, Some(&path), &[]).expect_err("12 rows of five nodes");
    assert!(error.has(Code::DofCount), "{error}");
}

/// The rotor exported by Ansys with its mapping and its node list with decimal commas: K R = 0 shows that
/// rows and positions belong together.
#[test]
fn the_rotor_of_ansys_is_read_as_it_was_written() {
    let folder = oracle::shared().join("samples/ansys");
    let file = |name: &str| folder.join(format!("rotorAnsys{name}.txt"));
    if !file("StiffnessMatrixSparse").exists() {
        return;
    }
    let mut files = ModelFiles::from_arguments(
        file("StiffnessMatrixSparse"),
        file("MassMatrixSparse"),
        file("NodalCoordinates"),
        Some(file("MatrixDofMappingVector")),
        Some("m,kg,s"),
    )
    .expect("files");
    assert!(matches!(files.source, ModelSource::Tables(_)));
    files.allow_implausible = false.into();
    let checked = FeModel::from_raw(read_model(&files).expect("readable")).expect("a free body");
    assert_eq!(checked.model.nodes().len(), 115);
    assert!(
        checked.diagnostics.iter().any(|found| found.code() == Code::MassDiagonal),
        "lumped mass is told"
    );
}

//! Nodes and sets in meshes of open formats: both forms of VTK, and Exodus.

use crate::node_files::{nodes, tetrahedron};
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_model::{FeModel, RawModel};
use oracle::fixtures;
use proptest::prelude::*;
use std::fs;
use std::path::PathBuf;

fn mesh(name: &str) -> PathBuf {
    fixtures().join("small/meshes").join(name)
}

/// Reads the tetrahedron with nodes in the mesh `content`. Labels with the numbers of the table define its
/// rows.
fn read(name: &str, content: &[u8], sets: &[&str]) -> Result<RawModel, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, content).expect("written");
    tetrahedron(&path, None, sets)
}

/// Files of the tetrahedron written by meshio and VTK, in text and in every packing, give equal positions to
/// the last bit.
#[test]
fn meshes_of_vtk_have_the_places_of_the_table() {
    let places: Vec<[f64; 3]> = nodes().iter().map(|(_, x)| *x).collect();
    for name in [
        "tet4_ascii.vtu",
        "tet4_zlib.vtu",
        "tet4_plain.vtu",
        "tet4.vts",
        "tet4.vtp",
        "tet4_51.vtk",
        "tet4_51_ascii.vtk",
        "tet4_ascii.vtk",
        "tet4_binary.vtk",
    ] {
        let raw = tetrahedron(&mesh(name), None, &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(raw.nodes.positions, places, "{name}");
        assert_eq!(raw.nodes.ids, [0, 1, 2, 3], "{name}: points are numbered as ParaView shows them");
    }
    // The rows have labels with other numbers, so that the set is known but none of its nodes has a row.
    for name in ["tet4_zlib.vtu", "tet4_ascii.vtu", "tet4.exo"] {
        let error = tetrahedron(&mesh(name), None, &["left"]).expect_err("other numbers");
        assert!(error.to_string().contains("no node of the set `left`"), "{name}: {error}");
    }
}

/// Global ids number the points, and an array of zeros and ones at the points is a set.
#[test]
fn global_ids_and_marks_are_read() {
    let own = nodes();
    for name in ["tet4_raw.vtu", "tet4_raw_big_endian_64.vtu", "tet4_base64.vtu", "tet4_inline.vtu"] {
        let raw = tetrahedron(&mesh(name), None, &["left"]).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(raw.data.interfaces[0].nodes, [10, 30, 40], "{name}");
        let read: Vec<_> = raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied()).collect();
        assert_eq!(read, own, "{name}");
        FeModel::from_raw(raw).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// Exodus meshes written by meshio (one array of coordinates, positions as numbers) and as Exodus lays them out, in netCDF-4
/// and in classic netCDF.
#[test]
fn meshes_of_exodus_have_nodes_and_sets() {
    let own = nodes();
    for name in ["tet4_named.exo", "tet4_classic.exo"] {
        let raw = tetrahedron(&mesh(name), None, &["left", "9"]).expect(name);
        let read: Vec<_> = raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied()).collect();
        assert_eq!(read, own, "{name}");
        assert_eq!(raw.data.interfaces[0].nodes, [10, 30, 40], "{name}");
        assert_eq!(
            raw.data.interfaces[1].nodes,
            [20],
            "{name}: a set without a name is called by its number"
        );
    }
    let raw = tetrahedron(&mesh("tet4.exo"), None, &[]).expect("readable");
    assert_eq!(raw.nodes.ids, [1, 2, 3, 4]);
    assert_eq!(raw.nodes.positions, own.iter().map(|(_, x)| *x).collect::<Vec<_>>());
}

#[test]
fn damaged_meshes_are_refused_where_they_are_damaged() {
    let text = |name: &str| fs::read_to_string(mesh(name)).expect("a mesh");
    let (vtu, vtk) = (text("tet4_ascii.vtu"), text("tet4_51_ascii.vtk"));
    let plain = text("tet4_plain.vtu");
    let point = vtu.find("Float64").expect("points");
    for (name, content, part) in [
        ("a.vtu", vtu[..point].to_owned(), "not XML"),
        ("a.vtu", vtu.replace("Points=\"4\"", "Points=\"5\""), "5 points"),
        ("a.vtu", vtu.replace("Points=\"4\"", "Points=\"9999999999999999999\""), " coordinates"),
        ("a.vtu", vtu.replace("NumberOfPoints", "Points"), "its number of points"),
        ("a.vtu", vtu.replace("UnstructuredGrid\" ", "PUnstructuredGrid\" "), "no list of points"),
        ("a.vtu", vtu.replace("format=\"ascii\"", "format=\"spoken\""), "format `spoken`"),
        ("a.vtu", vtu.replace("Float64", "Float80"), "type `Float80`"),
        ("a.vtu", vtu.replace("</Piece>", "</Piece><Piece NumberOfPoints=\"0\"/>"), "2 pieces"),
        ("a.vtu", plain.replace("Float64", "Float32"), "24 coordinates"),
        ("a.vtu", plain.replace("byte_order", "header_type=\"UInt16\" byte_order"), "UInt16"),
        ("a.vtk", vtk.replace("ASCII", "SPOKEN"), "ASCII or BINARY"),
        ("a.vtk", vtk.replace("UNSTRUCTURED_GRID", "STRUCTURED_POINTS"), "no list of points"),
        ("a.vtk", vtk.replace("POINTS 4", "POINTS 99999999999999999999"), "a count and a type"),
        ("a.vtk", vtk.replace("POINTS 4", "POINTS 8"), "a number"),
        ("a.vtk", vtk.replace("POINTS 4", "POIS 4"), "found `POIS`"),
        ("a.vtk", vtk[..100].to_owned(), "file ends"),
    ] {
        let error = read(name, content.as_bytes(), &[]).expect_err(part);
        assert!(error.has(Code::NodeFileSyntax) && error.to_string().contains(part), "{part}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Written points are read back to the last bit: text, and numbers of every width in both byte orders.
    #[test]
    fn points_of_vtk_come_back(
        places in proptest::collection::vec([-1e6..1e6f64, -1e6..1e6, -1e-6..1e-6], 1..30),
        form in 0..4usize,
    ) {
        let flat: Vec<f64> = places.iter().flatten().copied().collect();
        let legacy = |form: &str| {
            format!("# vtk DataFile Version 3.0\nx\n{form}\nDATASET POLYDATA\nPOINTS {} double\n", places.len())
        };
        let xml = |attributes: &str, inner: &str, after: &str| format!(
            "<VTKFile type=\"PolyData\" {attributes}><PolyData><Piece NumberOfPoints=\"{}\"><Points><DataArray type=\"Float64\" \
             NumberOfComponents=\"3\" {inner}</Points></Piece></PolyData>{after}", places.len());
        let words: Vec<String> = flat.iter().map(|x| format!("{x:e}")).collect();
        let (name, content) = match form {
            0 => ("a.vtk", [legacy("ASCII").into_bytes(), words.join(" ").into_bytes()].concat()),
            1 => {
                let bytes: Vec<u8> = flat.iter().flat_map(|x| x.to_be_bytes()).collect();
                ("a.vtk", [legacy("BINARY").into_bytes(), bytes, b"\nPOLYGONS 0 0\n".to_vec()].concat())
            }
            2 => {
                let inner = format!("format=\"ascii\">{}</DataArray>", words.join("\n"));
                ("a.vtp", xml("", &inner, "</VTKFile>").into_bytes())
            }
            _ => {
                let head = xml(
                    "header_type=\"UInt64\" byte_order=\"BigEndian\"",
                    "format=\"appended\" offset=\"3\"/>",
                    "<AppendedData encoding=\"raw\">\n _abc",
                );
                let mut bytes = head.into_bytes();
                bytes.extend((8 * flat.len() as u64).to_be_bytes());
                bytes.extend(flat.iter().flat_map(|x| x.to_be_bytes()));
                bytes.extend(b"\n</AppendedData></VTKFile>");
                ("a.vtp", bytes)
            }
        };
        let raw = read(name, &content, &[]).map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(raw.nodes.positions, places);
    }
}

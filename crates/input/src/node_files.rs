//! Files with node positions: tables, and files of FE programs and meshers. Each format is recognised by its content.

mod ansys_list;
mod cdb;
mod errors;
mod exodus;
mod gmsh;
mod point_data;
mod vtk_legacy;
mod vtk_packing;
mod vtk_xml;

pub(super) use point_data::{PointArray, PointData};
pub(super) use vtk_legacy::point_arrays as legacy_point_arrays;
pub(super) use vtk_xml::{CollectionMember, collection, pieces, point_arrays};

use super::bulk_cards::is_bulk_data;
use super::jobs::{begins_like_deck, nodes_of_bulk, nodes_of_deck};
use super::node_file::NodeFile;
use super::tables::read_nodes;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::compression::refuse_packed;
use std::collections::HashSet;

/// Format of node files besides the table of this program.
struct Format {
    recognises: fn(&str) -> bool,
    read: fn(&InputFile) -> Diagnosed<NodeFile>,
}

/// Formats of node files. The first that recognises the beginning of a file reads it.
const FORMATS: &[Format] = &[
    Format { recognises: gmsh::recognises, read: gmsh::read },
    Format { recognises: vtk_xml::recognises, read: vtk_xml::read },
    Format { recognises: vtk_legacy::recognises, read: vtk_legacy::read },
    Format { recognises: exodus::recognises, read: exodus::read },
    Format { recognises: cdb::recognises, read: cdb::read },
    Format { recognises: begins_like_deck, read: nodes_of_deck },
    Format { recognises: ansys_list::recognises, read: ansys_list::read },
    Format { recognises: |head| is_bulk_data(head.as_bytes()), read: bulk },
];

/// Number of bytes by which formats are recognised.
const HEAD: usize = 4096;

/// Reads the nodes of a file; z is zero in the plane.
///
/// # Errors
/// FB102 for compressed files; FB106, FB203 to FB206 for tables; FB110, FB111, FB115, FB205 for other files.
pub(super) fn read_node_file(file: &InputFile, dimension: u8) -> Diagnosed<NodeFile> {
    refuse_packed(file, "file of nodes or elements").map_err(|found| vec![found])?;
    let bytes = file.bytes();
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]);
    let Some(format) = FORMATS.iter().find(|format| (format.recognises)(&head)) else {
        return read_nodes(file, dimension).map(|nodes| NodeFile { nodes, ..NodeFile::default() });
    };
    let read = (format.read)(file)?;
    let wrong = |code, message: String| Err(vec![Diagnostic::new(code, message).in_file(file.path())]);
    if read.nodes.is_empty() {
        return wrong(Code::NodeFileSyntax, "file has no nodes".to_owned());
    }
    let mut seen = HashSet::new();
    if let Some(twice) = read.nodes.ids.iter().find(|id| !seen.insert(**id)) {
        return wrong(Code::NodeDuplicate, format!("node {twice} is given twice"));
    }
    if let Some(at) = read.nodes.positions.iter().position(|x| x.iter().any(|x| !x.is_finite())) {
        return wrong(
            Code::CoordinateNotFinite,
            format!("node {} has no finite coordinates", read.nodes.ids[at]),
        );
    }
    let mut turned: Vec<_> = read.axes.iter().collect();
    turned.sort_unstable_by_key(|(node, _)| **node);
    if let Some((node, _)) = turned.iter().find(|(_, axes)| axes.iter().flatten().any(|x| !x.is_finite())) {
        return wrong(Code::CoordinateNotFinite, format!("node {node} has no finite angles"));
    }
    if let Some(at) = read.nodes.positions.iter().position(|x| dimension == 2 && x[2] != 0.0) {
        let message =
            format!("node {} has z = {} in a plane model", read.nodes.ids[at], read.nodes.positions[at][2]);
        return wrong(Code::TableRow, message);
    }
    Ok(read)
}

fn bulk(file: &InputFile) -> Diagnosed<NodeFile> {
    nodes_of_bulk(file.path())
}

/// Returns true when a file begins like VTK in XML.
pub(super) fn is_vtk_xml(head: &[u8]) -> bool {
    vtk_xml::recognises(&String::from_utf8_lossy(head))
}

/// Returns true when a file begins like VTK in its legacy form.
pub(super) fn is_vtk_legacy(head: &[u8]) -> bool {
    vtk_legacy::recognises(&String::from_utf8_lossy(head))
}

#[cfg(test)]
mod tests {
    use super::{FORMATS, HEAD};
    use std::path::Path;

    /// The fuzz test of meshes and the tests of jobs read these files.
    #[test]
    fn every_format_has_a_fixture_that_it_alone_reads() {
        let small = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/small");
        let mut found = vec![0; FORMATS.len()];
        for folder in ["meshes", "abaqus", "nastran"] {
            for entry in std::fs::read_dir(small.join(folder)).expect("fixtures") {
                let bytes = std::fs::read(entry.expect("an entry").path()).expect("a file");
                let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]);
                if let Some(at) = FORMATS.iter().position(|format| (format.recognises)(&head)) {
                    found[at] += 1;
                }
            }
        }
        assert!(found.iter().all(|count| *count > 0), "fixtures of each format: {found:?}");
    }
}

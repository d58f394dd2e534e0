//! Meshes of Exodus II (.exo, .e, .g, .exii): nodes, node sets by their names or numbers, elements.
//! <https://sandialabs.github.io/seacas-docs/exodusII-new.pdf>. They are netCDF files: netCDF-4, which is HDF5, or classic.

use crate::classic_netcdf::is_classic;
use crate::exodus::read_mesh;
use crate::node_file::NodeFile;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;

/// Returns true when a file is HDF5 or classic netCDF.
pub(super) fn recognises(head: &str) -> bool {
    // The first byte of HDF5 is no valid text.
    head.starts_with("\u{fffd}HDF\r\n\u{1a}\n") || is_classic(head.as_bytes())
}

/// Reads nodes, node sets and elements.
pub(super) fn read(file: &InputFile) -> Diagnosed<NodeFile> {
    match read_mesh(file) {
        Ok((nodes, sets, elements)) => Ok(NodeFile { nodes, sets, elements, ..NodeFile::default() }),
        Err(found) => Err(found.into_iter().map(|diagnostic| diagnostic.in_file(file.path())).collect()),
    }
}

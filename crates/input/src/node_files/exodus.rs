//! Meshes of Exodus II (.exo, .e, .g, .exii): nodes, node sets by their names or numbers, elements.
//! <https://sandialabs.github.io/seacas-docs/exodusII-new.pdf>. They are netCDF files. Those of netCDF-4, which is
//! HDF5, are read.

use super::{Found, NodeFile, refused};
use crate::hdf5::read_exodus;
use flexbody_base::text::InputFile;

/// Returns true when a file is HDF5 or classic netCDF.
pub(super) fn recognises(head: &str) -> bool {
    // The first byte of HDF5 is no valid text.
    head.starts_with("\u{fffd}HDF\r\n\u{1a}\n") || is_classic(head)
}

fn is_classic(head: &str) -> bool {
    ["CDF\u{1}", "CDF\u{2}", "CDF\u{5}"].iter().any(|magic| head.starts_with(magic))
}

/// Reads nodes, node sets and elements.
pub(super) fn read(file: &InputFile) -> Found<NodeFile> {
    if is_classic(&String::from_utf8_lossy(&file.bytes()[..file.bytes().len().min(4)])) {
        let message = "file is of classic netCDF, which is not read".to_owned();
        return Err(refused(file, message, "convert it to netCDF-4: nccopy -k 4 FILE.exo NEW.exo"));
    }
    match read_exodus(file) {
        Ok((nodes, sets, elements)) => Ok(NodeFile { nodes, sets, elements, ..NodeFile::default() }),
        Err(found) => Err(found.into_iter().map(|diagnostic| diagnostic.in_file(file.path())).collect()),
    }
}

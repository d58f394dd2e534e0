//! Sparse matrices in HDF5 files: opens the file, and finds the group with the matrix.

mod group;

use super::assemble::Entry;
use super::named_matrices::NamedMatrices;
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixRole, MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::array::Array;
use crate::hdf5::{
    MAX_DEPTH, MAX_GROUPS, Members, StoredArray, has_arrays_beside, layout, opened, read_array,
    read_stored_array,
};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::Compression;
use flexbody_base::text::input_file::{InputFile, is_hdf5};
use flexbody_model::RawMatrix;
use group::holds_matrix;
use hdf5_metno::{File, Group};

/// Reader of HDF5 files.
pub(crate) struct Hdf5;

const NAMES: NamedMatrices = NamedMatrices { holder: "group", file: "FILE.h5", matrices: "sparse matrices" };

impl Reader for Hdf5 {
    fn name(&self) -> &'static str {
        "HDF5"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["h5", "hdf5", "hdf", "h5ad"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        is_hdf5(head)
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        let read = || {
            if source.compression != Compression::None {
                let message = "HDF5 file is compressed as a whole";
                let help = "unpack it: HDF5 compresses inside the file";
                return Err(vec![Diagnostic::new(Code::FileFormatUnknown, message).with_help(help)]);
            }
            let file = opened(source.file)?;
            let (name, group) = match source.group {
                Some(name) => (name.to_owned(), named(&file, name)?),
                None => search(&file, source.role)?,
            };
            group::read(&group, &name, source)
        };
        read().map_err(|found| Error::new(found.into_iter().map(|d| d.in_file(path)).collect()))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        source.is_plain().then(|| read_rectangular(source.file, source.name).map(Rectangular::operator))
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        source.is_plain().then(|| read_array(source.file, source.name))
    }
}

/// Reads a matrix that need not be square: the sparse matrix or the dense array `name`, or the only one of the file.
///
/// # Errors
/// FB310 if there is no such matrix or several, FB302 to FB313 for an invalid one.
fn read_rectangular(file: &InputFile, name: Option<&str>) -> Diagnosed<Rectangular> {
    let opened = opened(file)?;
    let found = matrices(&opened);
    let wanted = name.map(|name| format!("/{}", name.trim_matches('/')));
    let sparse = match &wanted {
        Some(wanted) => found.iter().find(|(name, _)| name == wanted),
        None => found.first().filter(|_| found.len() == 1 && !has_arrays_beside(&opened, &found[0].0)),
    };
    match sparse {
        Some((name, group)) => group::read_rectangular(group, name, file),
        None if wanted.is_none() && found.len() > 1 => {
            let message = format!("file holds {} sparse matrices; which is the operator?", found.len());
            Err(vec![layout(message).with_help(listing(&found))])
        }
        None => dense(file, name),
    }
}

/// Reads the dataset `name`, or the only array of the file, as a matrix. MATLAB stores the transposed array.
fn dense(file: &InputFile, name: Option<&str>) -> Diagnosed<Rectangular> {
    let StoredArray { array, is_transposed } = read_stored_array(file, name)?;
    let Array { rows, cols, values, .. } = array;
    let mut entries = Vec::new();
    for (at, &value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
        let (row, col) = ((at / cols.max(1)) as u32, (at % cols.max(1)) as u32);
        entries.push(if is_transposed {
            Entry { row: col, col: row, value }
        } else {
            Entry { row, col, value }
        });
    }
    let (rows, columns) = if is_transposed { (cols, rows) } else { (rows, cols) };
    Rectangular { rows, columns, entries }.checked().map_err(|diagnostic| vec![diagnostic])
}

/// Opens the group that the user named.
fn named(file: &File, name: &str) -> Diagnosed<Group> {
    let mut group = file.group("/").map_err(|e| vec![layout(format!("root group cannot be read: {e}"))])?;
    for part in name.split('/').filter(|part| !part.is_empty()) {
        if Members::of(&group).is_elsewhere(part) {
            let message =
                format!("`{part}` of group `{name}` is a soft or external link, which is not followed");
            return Err(vec![
                layout(message).with_help("name the group that it leads to, in the file that holds it"),
            ]);
        }
        group = group.group(part).map_err(|_| {
            let what =
                if group.dataset(part).is_ok() { "is a dataset, not a group" } else { "is not in the file" };
            vec![layout(format!("group `{name}`: `{part}` {what}")).with_help(listing(&matrices(file)))]
        })?;
    }
    if holds_matrix(&Members::of(&group)) {
        return Ok(group);
    }
    let message = format!("group `{name}` holds no sparse matrix");
    Err(vec![layout(message).with_help(listing(&matrices(file)))])
}

/// Returns the only matrix of the file, or the only one named after its role.
fn search(file: &File, role: MatrixRole) -> Diagnosed<(String, Group)> {
    let mut found = matrices(file);
    if found.is_empty() {
        return Err(vec![layout("file holds no sparse matrix".into())]);
    }
    let chosen = NAMES.choose(&names(&found), role).map_err(|diagnostic| vec![diagnostic])?;
    Ok(found.swap_remove(chosen))
}

/// Returns names and groups of all sparse matrices of the file, breadth first.
fn matrices(file: &File) -> Vec<(String, Group)> {
    let mut found = Vec::new();
    let mut level: Vec<(String, Group)> =
        file.group("/").map(|root| (String::new(), root)).into_iter().collect();
    let mut visited = 0;
    for _ in 0..MAX_DEPTH {
        let mut next = Vec::new();
        for (name, group) in level {
            let members = Members::of(&group);
            if holds_matrix(&members) {
                let name = if name.is_empty() { "/".to_owned() } else { name };
                found.push((name, group));
                continue;
            }
            // MATLAB keeps internal data in groups that begin with `#`.
            for child in members.hard_links().filter(|child| !child.starts_with('#')) {
                visited += 1;
                if visited > MAX_GROUPS {
                    return found;
                }
                if let Ok(inner) = group.group(child) {
                    next.push((format!("{name}/{child}"), inner));
                }
            }
        }
        level = next;
    }
    found
}

fn names(found: &[(String, Group)]) -> Vec<&str> {
    found.iter().map(|(name, _)| name.as_str()).collect()
}

fn listing(found: &[(String, Group)]) -> String {
    if found.is_empty() { Code::Hdf5Layout.help().to_owned() } else { NAMES.listing(&names(found)) }
}

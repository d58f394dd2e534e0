//! Sparse matrices in HDF5 files: opens the file, and finds the group with the matrix.

mod group;

use super::assemble::Entry;
use super::compressed::assemble_array;
use super::named_matrices::NamedMatrices;
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixRole, MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::array::Array;
use crate::hdf5::{
    MAX_DEPTH, MAX_GROUPS, Members, StoredArray, has_arrays_beside, is_array, layout, opened, read_array,
    read_stored_array, square_arrays,
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
const FULL_NAMES: NamedMatrices =
    NamedMatrices { holder: "dataset", file: "FILE.h5", matrices: "square datasets" };
const FULL: &str = "write the matrix again, square and of real numbers";
const BOTH_TRIANGLES: &str = "write both triangles: K + tril(K, -1)'";

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
            match source.group {
                Some(name) => match named(&file, name)? {
                    Place::Group(group) => group::read(&group, name, source),
                    Place::Dataset(dataset) => read_full(source.file, &dataset),
                },
                None => match search(&file, source.role)? {
                    (name, Place::Group(group)) => group::read(&group, &name, source),
                    (_, Place::Dataset(dataset)) => read_full(source.file, &dataset),
                },
            }
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
            Err(vec![layout(message).with_help(NAMES.listing(&names(&found)))])
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

/// Place of a matrix in a file.
enum Place {
    /// Group with a sparse matrix.
    Group(Group),
    /// Path of a dataset with a full matrix.
    Dataset(String),
}

/// Reads a full matrix. Its rows and columns need not be told apart: a symmetric one is its transpose.
fn read_full(file: &InputFile, dataset: &str) -> Diagnosed<RawMatrix> {
    let StoredArray { array, .. } = read_stored_array(file, Some(dataset))?;
    assemble_array(array, FULL, BOTH_TRIANGLES, file.path()).map_err(|diagnostic| vec![diagnostic])
}

/// Returns the place of the matrix that the user named; fields of structs of MATLAB may follow a point instead of a `/`.
fn named(file: &File, name: &str) -> Diagnosed<Place> {
    let fields = name.replace('.', "/");
    let as_written = named_path(file, name);
    if as_written.is_err() && fields != name { named_path(file, &fields).or(as_written) } else { as_written }
}

fn named_path(file: &File, name: &str) -> Diagnosed<Place> {
    if is_array(file, name) {
        return Ok(Place::Dataset(name.to_owned()));
    }
    named_group(file, name).map(Place::Group)
}

/// Opens the group that the user named.
fn named_group(file: &File, name: &str) -> Diagnosed<Group> {
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
            vec![layout(format!("group `{name}`: `{part}` {what}")).with_help(listing(file))]
        })?;
    }
    if holds_matrix(&Members::of(&group)) {
        return Ok(group);
    }
    let message = format!("group `{name}` holds no sparse matrix");
    Err(vec![layout(message).with_help(listing(file))])
}

/// Returns the only sparse matrix of the file, or the only one named after its role; in a file without sparse matrices the
/// only square dataset, or the one named after its role.
fn search(file: &File, role: MatrixRole) -> Diagnosed<(String, Place)> {
    let mut found = matrices(file);
    if found.is_empty() {
        let mut full = square_arrays(file);
        if full.is_empty() {
            return Err(vec![layout("file holds no sparse matrix".into())]);
        }
        let paths: Vec<&str> = full.iter().map(String::as_str).collect();
        let chosen = FULL_NAMES.choose(&paths, role).map_err(|diagnostic| vec![diagnostic])?;
        let path = full.swap_remove(chosen);
        return Ok((path.clone(), Place::Dataset(path)));
    }
    let chosen = NAMES.choose(&names(&found), role).map_err(|diagnostic| vec![diagnostic])?;
    let (name, group) = found.swap_remove(chosen);
    Ok((name, Place::Group(group)))
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

fn listing(file: &File) -> String {
    let (found, full) = (matrices(file), square_arrays(file));
    match (found.is_empty(), full.is_empty()) {
        (false, _) => NAMES.listing(&names(&found)),
        (true, false) => FULL_NAMES.listing(&full.iter().map(String::as_str).collect::<Vec<_>>()),
        (true, true) => Code::Hdf5Layout.help().to_owned(),
    }
}

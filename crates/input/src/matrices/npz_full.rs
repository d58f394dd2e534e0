//! Full arrays in archives of NumPy (`numpy.savez`, `numpy.savez_compressed`): one by its name, or the only one.

use super::assemble::check_size;
use super::compressed::assemble_array;
use super::named_matrices::{NamedMatrices, named_or_only};
use super::npz_archive::Archive;
use super::reader::MatrixSource;
use crate::array::Array;
use crate::npy;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::RawMatrix;

const NAMES: NamedMatrices = NamedMatrices { holder: "array", file: "FILE.npz", matrices: "square arrays" };
const HELP: &str = "write it again: numpy.savez(file, K=K, M=M), or sparse: scipy.sparse.save_npz(file, K)";

const BOTH_TRIANGLES: &str = "save both triangles: K + numpy.tril(K, -1).T";

/// Largest number of arrays whose headers are read to find the matrix.
const MAX_ARRAYS: usize = 1000;

/// Reads the square array that the user named, the only one, or the only one named after its role.
///
/// # Errors
/// FB310 if there is no such array, or several; FB103, FB301 to FB313 for an invalid one.
pub(super) fn read(archive: &mut Archive<'_>, source: &MatrixSource<'_>) -> Result<RawMatrix, Diagnostic> {
    let name = match source.group {
        Some(group) => named(archive, group)?,
        None => {
            let mut square = arrays(archive, |extents| matches!(*extents, [rows, cols] if rows == cols));
            let paths: Vec<String> = square.iter().map(|name| format!("/{name}")).collect();
            let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
            if paths.is_empty() {
                let message = "archive holds no sparse matrix and no square array";
                return Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(HELP));
            }
            square.swap_remove(NAMES.choose(&paths, source.role)?)
        }
    };
    // The sizes are checked before anything is unpacked.
    if let Some(&[rows, cols]) = archive.extents(&name).as_deref() {
        check_size(rows as u64, cols as u64, (rows as u64).saturating_mul(cols as u64))?;
    }
    assemble_array(npy::read(&archive.member(&name)?)?, HELP, BOTH_TRIANGLES, source.file.path())
}

/// Reads the array `name`, or the only one with one or two extents.
///
/// # Errors
/// FB310 if there is no such array, or several; FB103, FB301 to FB304 for an invalid one.
pub(super) fn read_array(archive: &mut Archive<'_>, name: Option<&str>) -> Result<Array, Diagnostic> {
    let name = match name {
        Some(name) => named(archive, name)?,
        None => {
            let mut all = arrays(archive, |_| true);
            all.swap_remove(named_or_only(&all, None)?)
        }
    };
    npy::read(&archive.member(&name)?)
}

/// Returns the names of the arrays with extents for which `is_wanted` returns true.
fn arrays(archive: &mut Archive<'_>, is_wanted: impl Fn(&[usize]) -> bool) -> Vec<String> {
    let mut names = archive.names();
    names.truncate(MAX_ARRAYS);
    names.retain(|name| archive.extents(name).is_some_and(|extents| is_wanted(&extents)));
    names
}

/// Returns the name of the array that the user named, which the archive must have.
fn named(archive: &mut Archive<'_>, group: &str) -> Result<String, Diagnostic> {
    let name = group.trim_matches('/');
    if archive.has(name) {
        return Ok(name.to_owned());
    }
    let paths: Vec<String> = archive.names().iter().map(|name| format!("/{name}")).collect();
    let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
    let message = format!("array `{name}` is not in the archive");
    Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(NAMES.listing(&paths)))
}

//! Archives of NumPy: sparse matrices of SciPy (`scipy.sparse.save_npz`), whose arrays are those of a matrix in CSC, CSR,
//! COO or BSR form, <https://docs.scipy.org/doc/scipy/reference/generated/scipy.sparse.save_npz.html>, and full arrays.

use super::assemble::{
    Entry, StoredEntries, assemble, check_extents, check_size, push, refuse_beyond_memory,
    undeclared_triangle,
};
use super::compressed::{Compressed, EntryCheck};
use super::npz_archive::Archive;
use super::npz_full;
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::array::Array;
use crate::npy;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::RawMatrix;
use std::path::Path;

/// Reader of SciPy's archives.
pub(crate) struct ScipyNpz;

const HELP: &str = "write it again: scipy.sparse.save_npz(file, A.tocsc())";
const BOTH_TRIANGLES: &str = "save both triangles: A + scipy.sparse.tril(A, -1).T";

impl Reader for ScipyNpz {
    fn name(&self) -> &'static str {
        "SciPy npz"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["npz"]
    }

    /// Recognises an archive whose first member is an array.
    fn recognises(&self, head: &[u8]) -> bool {
        let length = head.get(26..28).map_or(0, |b| usize::from(u16::from_le_bytes([b[0], b[1]])));
        head.starts_with(b"PK\x03\x04")
            && head.get(30..30 + length).is_some_and(|name| name.ends_with(b".npy"))
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let read = || {
            let mut archive = Archive::open(source.not_packed("archive of NumPy")?)?;
            if archive.is_sparse() {
                source.has_one_matrix("an archive of SciPy")?;
                read(archive, source.file.path())
            } else {
                npz_full::read(&mut archive, source)
            }
        };
        read().map_err(|diagnostic: Diagnostic| Error::from(diagnostic.in_file(source.file.path())))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        if !source.is_plain_of_one() {
            return None;
        }
        let read = match Archive::open(source.file.bytes()) {
            Ok(archive) if !archive.is_sparse() => return None,
            opened => opened.and_then(read_rectangular),
        };
        Some(read.map(Rectangular::operator).map_err(|diagnostic| vec![diagnostic]))
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        if !source.is_plain() {
            return None;
        }
        let opened = source.file.load().and_then(|()| Archive::open(source.file.bytes()));
        let read = match opened {
            Ok(archive) if archive.is_sparse() => return None,
            opened => opened.and_then(|mut archive| npz_full::read_array(&mut archive, source.name)),
        };
        Some(read.map_err(|diagnostic| vec![diagnostic]))
    }
}

/// Reads a matrix in CSC, CSR or COO form that need not be square.
///
/// # Errors
/// FB103, FB301 to FB306 for an archive that is not valid.
fn read_rectangular(mut archive: Archive<'_>) -> std::result::Result<Rectangular, Diagnostic> {
    let form = archive.member("format").ok().and_then(|bytes| npy::read_word(&bytes)).unwrap_or_default();
    let shape = npy::read_integers(&archive.member("shape")?)?;
    let &[rows, columns] = shape.as_slice() else {
        return Err(Diagnostic::new(Code::MatrixKind, "`shape` is not two whole numbers").with_help(HELP));
    };
    let entries = archive.count("data")?;
    let [rows, columns] = check_extents(rows.max(0) as u64, columns.max(0) as u64, entries)?;
    let mut member = |name: &str| -> std::result::Result<Vec<i64>, Diagnostic> {
        let count = archive.count(name)?;
        if name != "indptr" {
            same_count(entries, count, name)?;
        }
        npy::read_integers(&archive.member(name)?)
    };
    let places: Vec<[i64; 2]> = match form.as_str() {
        "coo" => member("row")?.into_iter().zip(member("col")?).map(|(row, column)| [row, column]).collect(),
        "csc" | "csr" => {
            let by_rows = form == "csr";
            let (indices, pointers) = (member("indices")?, member("indptr")?);
            let majors = if by_rows { rows } else { columns };
            let is_valid = pointers.len() == majors + 1
                && pointers.is_sorted()
                && pointers[0] == 0
                && pointers[majors] as u64 == entries;
            if !is_valid {
                let message = format!("`indptr` does not rise from 0 to {entries} in {} steps", majors);
                return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
            }
            let mut places = Vec::with_capacity(indices.len());
            for (major, pair) in pointers.windows(2).enumerate() {
                let of_major = &indices[pair[0] as usize..pair[1] as usize];
                places.extend(
                    of_major
                        .iter()
                        .map(|&minor| if by_rows { [major as i64, minor] } else { [minor, major as i64] }),
                );
            }
            places
        }
        other => {
            let message = format!("matrix is stored in the form `{}`", other.escape_default());
            return Err(Diagnostic::new(Code::MatrixKind, message).with_help(HELP));
        }
    };
    let data = npy::read(&archive.member("data")?)?;
    if data.values.len() != places.len() {
        let message = format!("{} values have {} places", data.values.len(), places.len());
        return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
    }
    let index = |index: i64| u32::try_from(index).unwrap_or(u32::MAX);
    let entry =
        |([row, col], value): ([i64; 2], &f64)| Entry { row: index(row), col: index(col), value: *value };
    let entries = places.into_iter().zip(&data.values).map(entry).collect();
    Rectangular { rows, columns, entries }.checked()
}

fn read(mut archive: Archive<'_>, path: &Path) -> std::result::Result<RawMatrix, Diagnostic> {
    let form = archive.member("format").ok().and_then(|bytes| npy::read_word(&bytes)).unwrap_or_default();
    let shape = npy::read_integers(&archive.member("shape")?)?;
    let &[rows, columns] = shape.as_slice() else {
        return Err(Diagnostic::new(Code::MatrixKind, "`shape` is not two whole numbers").with_help(HELP));
    };
    // The sizes are checked before anything is unpacked.
    let entries = archive.count("data")?;
    let n = check_size(rows.max(0) as u64, columns.max(0) as u64, entries)?;
    refuse_beyond_memory(entries)?;
    if form == "bsr" {
        return blocks(&mut archive, n, path);
    }
    for name in ["indices", "row", "col"] {
        if archive.has(name) {
            same_count(entries, archive.count(name)?, name)?;
        }
    }
    let data = npy::read(&archive.member("data")?)?;
    let raw = match form.as_str() {
        "coo" => coordinates(&mut archive, n, &data.values, path)?,
        "csc" | "csr" => {
            let indices = npy::read_integers(&archive.member("indices")?)?;
            same_length(&data.values, &indices, "indices")?;
            let pointers = npy::read_integers(&archive.member("indptr")?)?;
            let compressed = Compressed {
                n,
                by_rows: form == "csr",
                pointers: pointers.into_iter().map(|at| u64::try_from(at).unwrap_or(u64::MAX)).collect(),
                pointers_name: "`indptr`",
                entries: data.values.len(),
                entry: &|k| (indices[k], data.values[k]),
                help: HELP,
                both_triangles: BOTH_TRIANGLES,
            };
            compressed.assemble(path)?
        }
        other => {
            let message = format!("matrix is stored in the form `{}`", other.escape_default());
            return Err(Diagnostic::new(Code::MatrixKind, message).with_help(HELP));
        }
    };
    Ok(RawMatrix { digits: raw.digits.min(data.digits), ..raw })
}

/// Reads a matrix in blocks of equal size: `data` (blocks x r x c), the block column of each block in `indices`, and
/// the start of each block row in `indptr`.
fn blocks(archive: &mut Archive<'_>, n: usize, path: &Path) -> std::result::Result<RawMatrix, Diagnostic> {
    let wrong = |code, message: String| Err(Diagnostic::new(code, message).with_help(HELP));
    let npy::Blocks { count, rows, columns, values, digits } = npy::read_blocks(&archive.member("data")?)?;
    if rows == 0 || columns == 0 || !n.is_multiple_of(rows) || !n.is_multiple_of(columns) {
        return wrong(
            Code::MatrixCount,
            format!("blocks of {rows} x {columns} do not make up {n} rows and columns"),
        );
    }
    let indices = npy::read_integers(&archive.member("indices")?)?;
    let pointers = npy::read_integers(&archive.member("indptr")?)?;
    if indices.len() != count {
        return wrong(Code::MatrixCount, format!("{count} blocks have {} indices", indices.len()));
    }
    if pointers.len() != n / rows + 1 {
        let message = format!(
            "`indptr` has {} values, expected {} for {} block rows",
            pointers.len(),
            n / rows + 1,
            n / rows
        );
        return wrong(Code::MatrixCount, message);
    }
    if !pointers.is_sorted() || pointers[0] != 0 || pointers[n / rows] != count as i64 {
        let message = format!("`indptr` does not rise from 0 to {count}, the number of blocks");
        return wrong(Code::MatrixSyntax, message);
    }
    let (mut pieces, mut check) = (Vec::new(), EntryCheck::new(n, HELP));
    for (block_row, pair) in pointers.windows(2).enumerate() {
        for block in pair[0] as usize..pair[1] as usize {
            let block_values = &values[block * rows * columns..(block + 1) * rows * columns];
            for (k, &value) in block_values.iter().enumerate() {
                // Zeros pad the blocks: they are no entries, but their indices must still lie within the matrix.
                let row = (block_row * rows + k / columns) as i64;
                let column =
                    indices[block].saturating_mul(columns as i64).saturating_add((k % columns) as i64);
                push(&mut pieces, check.entry(row, column, value)?);
            }
        }
    }
    let raw = match undeclared_triangle(check.sides, |_| BOTH_TRIANGLES.into()) {
        Some(triangle) => return Err(triangle),
        None => assemble(n, pieces, StoredEntries::Full, 17, path)?,
    };
    Ok(RawMatrix { digits: raw.digits.min(digits), ..raw })
}

fn coordinates(
    archive: &mut Archive<'_>,
    n: usize,
    values: &[f64],
    path: &Path,
) -> std::result::Result<RawMatrix, Diagnostic> {
    let rows = npy::read_integers(&archive.member("row")?)?;
    let columns = npy::read_integers(&archive.member("col")?)?;
    same_length(values, &rows, "rows")?;
    same_length(values, &columns, "columns")?;
    let (mut pieces, mut check) = (Vec::new(), EntryCheck::new(n, HELP));
    for ((&row, &column), &value) in rows.iter().zip(&columns).zip(values) {
        push(&mut pieces, check.entry(row, column, value)?);
    }
    match undeclared_triangle(check.sides, |_| BOTH_TRIANGLES.into()) {
        Some(triangle) => Err(triangle),
        None => assemble(n, pieces, StoredEntries::Full, 17, path),
    }
}

/// Refuses a number of indices that differs from the number of values, before they are unpacked.
fn same_count(entries: u64, indices: u64, name: &str) -> std::result::Result<(), Diagnostic> {
    if entries == indices {
        return Ok(());
    }
    let what = match name {
        "row" => "rows",
        "col" => "columns",
        other => other,
    };
    let message = format!("{entries} values have {indices} {what}");
    Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP))
}

fn same_length(values: &[f64], indices: &[i64], what: &str) -> std::result::Result<(), Diagnostic> {
    if values.len() == indices.len() {
        return Ok(());
    }
    let message = format!("{} values have {} {what}", values.len(), indices.len());
    Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP))
}

//! Sparse matrices of SciPy (`scipy.sparse.save_npz`): an archive of the arrays of a matrix in CSC, CSR or COO
//! form, <https://docs.scipy.org/doc/scipy/reference/generated/scipy.sparse.save_npz.html>.

use super::assemble::{Entry, Sides, Storage, assemble, check_size, push, undeclared_triangle};
use super::npy;
use super::reader::{MatrixSource, Reader};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::RawMatrix;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// The reader of SciPy's archives.
pub(super) struct ScipyNpz;

const HELP: &str = "write it again: scipy.sparse.save_npz(file, A.tocsc())";

impl Reader for ScipyNpz {
    fn name(&self) -> &'static str {
        "SciPy npz"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["npz"]
    }

    /// An archive whose first member is an array.
    fn recognises(&self, head: &[u8]) -> bool {
        let length = head.get(26..28).map_or(0, |b| usize::from(u16::from_le_bytes([b[0], b[1]])));
        head.starts_with(b"PK\x03\x04")
            && head.get(30..30 + length).is_some_and(|name| name.ends_with(b".npy"))
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        let read = match source.group {
            Some(group) => {
                let message = format!("group `{group}` is named, but an archive of SciPy holds one matrix");
                Err(Diagnostic::new(Code::Hdf5Layout, message).with_help("give the file without a group"))
            }
            None => read(source),
        };
        read.map_err(|diagnostic| Error::from(diagnostic.in_file(path)))
    }
}

fn read(source: &MatrixSource<'_>) -> std::result::Result<RawMatrix, Diagnostic> {
    let mut archive = Archive::open(source.file.bytes())?;
    let form = archive.member("format").ok().and_then(|bytes| npy::read_word(&bytes)).unwrap_or_default();
    let shape = npy::read_integers(&archive.member("shape")?)?;
    let &[rows, columns] = shape.as_slice() else {
        return Err(Diagnostic::new(Code::MatrixKind, "`shape` is not two whole numbers").with_help(HELP));
    };
    let data = npy::read(&archive.member("data")?)?;
    let n = check_size(rows.max(0) as u64, columns.max(0) as u64, data.values.len() as u64)?;
    let [row_of, column_of] = match form.as_str() {
        "coo" => [npy::read_integers(&archive.member("row")?)?, npy::read_integers(&archive.member("col")?)?],
        // Compressed columns or rows: for symmetric matrices the same.
        "csc" | "csr" => {
            let minor = npy::read_integers(&archive.member("indices")?)?;
            let major = majors(&npy::read_integers(&archive.member("indptr")?)?, n, data.values.len())?;
            if form == "csc" { [minor, major] } else { [major, minor] }
        }
        other => {
            let message = format!("matrix is stored in the form `{}`", other.escape_default());
            return Err(Diagnostic::new(Code::MatrixKind, message).with_help(HELP));
        }
    };
    let (pieces, sides) = entries(&row_of, &column_of, &data.values, n)?;
    if let Some(triangle) =
        undeclared_triangle(sides, |_| "save both triangles: A + scipy.sparse.tril(A, -1).T".into())
    {
        return Err(triangle);
    }
    let raw = assemble(n, pieces, Storage::Full, 17, source.file.path())?;
    Ok(RawMatrix { digits: raw.digits.min(data.digits), ..raw })
}

/// The column (or row) of every entry, from pointers.
fn majors(pointers: &[i64], n: usize, entries: usize) -> std::result::Result<Vec<i64>, Diagnostic> {
    let fits =
        pointers.len() == n + 1 && pointers[0] == 0 && pointers[n] == entries as i64 && pointers.is_sorted();
    if !fits {
        let message = format!("`indptr` does not rise from 0 to {entries} in {} values", n + 1);
        return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP));
    }
    let column = |(j, pair): (usize, &[i64])| std::iter::repeat_n(j as i64, (pair[1] - pair[0]) as usize);
    Ok(pointers.windows(2).enumerate().flat_map(column).collect())
}

fn entries(
    rows: &[i64],
    columns: &[i64],
    values: &[f64],
    n: usize,
) -> std::result::Result<(Vec<Vec<Entry>>, Sides), Diagnostic> {
    if rows.len() != values.len() || columns.len() != values.len() {
        let message =
            format!("{} values have {} rows and {} columns", values.len(), rows.len(), columns.len());
        return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
    }
    let (mut pieces, mut sides) = (Vec::new(), Sides::default());
    for ((&row, &column), &value) in rows.iter().zip(columns).zip(values) {
        let inside = |index: i64| (0..n as i64).contains(&index);
        if !inside(row) || !inside(column) {
            let message =
                format!("an entry is at ({row}, {column}), the matrix has indices 0 to {}", n as i64 - 1);
            return Err(Diagnostic::new(Code::MatrixIndex, message).with_help(HELP));
        }
        if !value.is_finite() {
            let message = format!("entry ({row}, {column}) is {value}");
            return Err(Diagnostic::new(Code::MatrixNotFinite, message));
        }
        sides.lower |= row > column && value != 0.0;
        sides.upper |= row < column && value != 0.0;
        push(&mut pieces, Entry { row: row as u32, col: column as u32, value });
    }
    Ok((pieces, sides))
}

struct Archive<'a>(ZipArchive<Cursor<&'a [u8]>>);

impl<'a> Archive<'a> {
    fn open(bytes: &'a [u8]) -> std::result::Result<Self, Diagnostic> {
        ZipArchive::new(Cursor::new(bytes)).map(Self).map_err(|error| damaged(&error))
    }

    /// The bytes of the array `name`, checked by its checksum.
    fn member(&mut self, name: &str) -> std::result::Result<Vec<u8>, Diagnostic> {
        let mut member = self.0.by_name(&format!("{name}.npy")).map_err(|error| match error {
            zip::result::ZipError::FileNotFound => {
                let message = format!("archive has no array `{name}`: it is no sparse matrix of SciPy");
                Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
            }
            error => damaged(&error),
        })?;
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).map_err(|error| damaged(&error))?;
        Ok(bytes)
    }
}

fn damaged(error: &dyn std::fmt::Display) -> Diagnostic {
    Diagnostic::new(Code::FileCompressionBroken, format!("archive is damaged: {error}")).with_help(HELP)
}

//! Files of recoveries: operators, which have one row for each value and one column for each matrix row of the model,
//! and values of the undeformed body.

use super::array::Array;
use super::assemble::Entry;
use super::matrix_market;
use super::reader::{HEAD, Reader};
use super::scipy_npz::{self, ScipyNpz};
use super::shapes;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::{Compression, InputFile};
use flexbody_linalg::CscMatrix;

type Found<T> = Result<T, Vec<Diagnostic>>;

/// Matrix that need not be square, with entries from 0.
pub(super) struct Rectangular {
    pub rows: usize,
    pub columns: usize,
    pub entries: Vec<Entry>,
}

impl Rectangular {
    /// Returns the matrix if all entries lie within it and are finite.
    ///
    /// # Errors
    /// FB303 and FB306.
    pub(super) fn checked(self) -> Result<Self, Diagnostic> {
        let Self { rows, columns, entries } = &self;
        let outside = |entry: &&Entry| entry.row as usize >= *rows || entry.col as usize >= *columns;
        if let Some(entry) = entries.iter().find(outside) {
            let message = format!(
                "an entry is at ({}, {}), counted from 0, in a matrix of {rows} x {columns}",
                entry.row, entry.col
            );
            return Err(Diagnostic::new(Code::MatrixIndex, message));
        }
        match entries.iter().find(|entry| !entry.value.is_finite()) {
            Some(Entry { row, col, value }) => {
                let message = format!("entry ({row}, {col}), counted from 0, is {value}");
                Err(Diagnostic::new(Code::MatrixNotFinite, message))
            }
            None => Ok(self),
        }
    }

    /// Returns the transposed matrix.
    fn transposed(&self) -> CscMatrix {
        let entries: Vec<(u32, u32, f64)> = self.entries.iter().map(|e| (e.col, e.row, e.value)).collect();
        CscMatrix::from_triplets(self.columns, self.rows, &entries)
    }
}

/// Reads an operator R (rows x matrix rows of the model) and returns R': sparse in a Matrix Market file or an archive of
/// SciPy, dense in a NumPy, HDF5 or Matrix Market array.
///
/// # Errors
/// FB102 for other formats; FB103, FB301 to FB313 for files that cannot be read.
pub(super) fn read_operator(file: &InputFile, dataset: Option<&str>) -> Found<CscMatrix> {
    let about = |found: Vec<Diagnostic>| -> Vec<Diagnostic> {
        found.into_iter().map(|diagnostic| diagnostic.in_file(file.path())).collect()
    };
    let compression = Compression::of(file.bytes());
    let head = compression.head(file, HEAD);
    if ScipyNpz.recognises(&head) && compression == Compression::None && dataset.is_none() {
        let read = scipy_npz::read_rectangular(file.bytes()).map_err(|diagnostic| about(vec![diagnostic]));
        return Ok(read?.transposed());
    }
    if matrix_market::is_coordinate(&head) && dataset.is_none() {
        return Ok(matrix_market::read_rectangular(file, compression).map_err(about)?.transposed());
    }
    let array = shapes::read(file, dataset).map_err(|found| about(with_formats(found)))?;
    transposed_array(&array).map_err(|diagnostic| about(vec![diagnostic]))
}

/// Reads one value per row.
///
/// # Errors
/// The errors of dense arrays; FB322 for an array with several columns and several rows.
pub(super) fn read_offset(file: &InputFile, dataset: Option<&str>) -> Found<Vec<f64>> {
    let about = |found: Vec<Diagnostic>| -> Vec<Diagnostic> {
        found.into_iter().map(|diagnostic| diagnostic.in_file(file.path())).collect()
    };
    let Array { rows, cols, values, .. } = shapes::read(file, dataset).map_err(about)?;
    if rows != 1 && cols != 1 {
        let message = format!("array of the offset is {rows} x {cols}, expected one value for each row");
        return Err(about(vec![Diagnostic::new(Code::RecoverySize, message)]));
    }
    Ok(values)
}

/// Names the formats of operators in the help about a file of unknown format.
fn with_formats(found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let help = "give the operator as Matrix Market file (.mtx), archive of scipy.sparse.save_npz (.npz), NumPy array (.npy) or HDF5 dataset (FILE.h5:/dataset)";
    let named = |diagnostic: Diagnostic| match diagnostic.code() {
        Code::FileFormatUnknown => diagnostic.with_help(help),
        _ => diagnostic,
    };
    found.into_iter().map(named).collect()
}

/// Returns the transpose of a dense array without its zeros.
fn transposed_array(array: &Array) -> Result<CscMatrix, Diagnostic> {
    let Array { rows, cols, row_major, values, .. } = array;
    let at = |i: usize, j: usize| if *row_major { values[i * cols + j] } else { values[j * rows + i] };
    let mut entries = Vec::new();
    for i in 0..*rows {
        for j in 0..*cols {
            let value = at(i, j);
            if value != 0.0 {
                entries.push(Entry { row: i as u32, col: j as u32, value });
            }
        }
    }
    Ok(Rectangular { rows: *rows, columns: *cols, entries }.checked()?.transposed())
}

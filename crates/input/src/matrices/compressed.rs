//! Complete arrays with the entries of a sparse matrix in binary files, with checks of each entry, made compressed
//! columns.

use super::assemble::{
    ColumnEntries, Entry, Sides, assemble_columns, check_size, refuse_beyond_memory, undeclared_triangle,
};
use crate::array::Array;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::RawMatrix;
use std::path::Path;

/// Compressed columns or rows as in a file, with indices from 0. Rows are read as columns: symmetric matrices have
/// equal rows and columns.
pub(super) struct Compressed<'a> {
    /// Number of columns.
    pub n: usize,
    /// True for rows; the other fields then describe rows instead of columns.
    pub by_rows: bool,
    /// Index of the first entry of each column, and the number of entries at the end.
    pub pointers: Vec<u64>,
    /// Name of the pointers in messages.
    pub pointers_name: &'static str,
    /// Number of entries in the file.
    pub entries: usize,
    /// Function that returns row and value of an entry.
    pub entry: &'a dyn Fn(usize) -> (i64, f64),
    /// Help for messages: the way to write the file again.
    pub help: &'static str,
    /// Help for messages: the way to write both triangles.
    pub both_triangles: &'static str,
}

/// Square matrix of which a file stores every entry, column by column or row by row.
pub(super) struct Full<'a> {
    /// Number of columns.
    pub n: usize,
    /// True if the entries of a row are contiguous, false if those of a column are.
    pub by_rows: bool,
    /// Function that returns an entry by its place in the file.
    pub value: &'a dyn Fn(usize) -> f64,
    /// Help for messages: the way to write the file again.
    pub help: &'static str,
    /// Help for messages: the way to write both triangles.
    pub both_triangles: &'static str,
}

impl Full<'_> {
    /// Builds the matrix without its zeros. Both triangles must be stored; symmetry is not checked.
    ///
    /// # Errors
    /// The errors of [`Compressed::assemble`].
    pub(super) fn assemble(self, path: &Path) -> Result<RawMatrix, Diagnostic> {
        let Self { n, by_rows, value, help, both_triangles } = self;
        let compressed = Compressed {
            n,
            by_rows,
            pointers: (0..=n as u64).map(|column| column * n as u64).collect(),
            pointers_name: "the list of columns",
            entries: n * n,
            entry: &|k| ((k % n) as i64, value(k)),
            help,
            both_triangles,
        };
        compressed.assemble(path)
    }
}

/// Builds the square matrix of an array with both triangles; `help` and `both_triangles` are those of [`Full`].
///
/// # Errors
/// FB305 for an array that is not square, FB601; the errors of [`Full::assemble`].
pub(super) fn assemble_array(
    array: Array,
    help: &'static str,
    both_triangles: &'static str,
    path: &Path,
) -> Result<RawMatrix, Diagnostic> {
    let Array { rows, cols, row_major, values, digits } = array;
    let n = check_size(rows as u64, cols as u64, values.len() as u64)?;
    refuse_beyond_memory(values.len() as u64)?;
    let raw = Full { n, by_rows: row_major, value: &|k| values[k], help, both_triangles }.assemble(path)?;
    Ok(RawMatrix { digits: digits.min(raw.digits), ..raw })
}

impl Compressed<'_> {
    /// Builds the matrix. Both triangles must be stored; symmetry is not checked.
    ///
    /// # Errors
    /// FB301, FB304 for pointers that do not fit the entries, FB303 for indices outside the matrix, FB306 for values
    /// that are not finite, FB307 for a single triangle, FB312 if there is no nonzero entry.
    pub(super) fn assemble(self, path: &Path) -> Result<RawMatrix, Diagnostic> {
        self.check_pointers()?;
        let mut columns = ColumnEntries::with_capacity(self.n, self.entries);
        let mut check = EntryCheck::new(self.n, self.help);
        for (column, pair) in self.pointers.windows(2).enumerate() {
            for k in pair[0]..pair[1] {
                let (index, value) = (self.entry)(k as usize);
                let [row, col] = if self.by_rows { [column as i64, index] } else { [index, column as i64] };
                check.entry(row, col, value)?;
                if value != 0.0 {
                    columns.push(Entry { row: index as u32, col: column as u32, value });
                }
            }
        }
        match undeclared_triangle(check.sides, |_| self.both_triangles.to_owned()) {
            Some(triangle) => Err(triangle),
            None => assemble_columns(columns, 17, path),
        }
    }

    fn check_pointers(&self) -> Result<(), Diagnostic> {
        let (n, entries, name) = (self.n, self.entries, self.pointers_name);
        let wrong = |code, message| Err(Diagnostic::new(code, message).with_help(self.help));
        if self.pointers.len() != n + 1 {
            let message =
                format!("{name} has {} values, expected {} for {n} columns", self.pointers.len(), n + 1);
            return wrong(Code::MatrixCount, message);
        }
        if !self.pointers.is_sorted() || self.pointers[0] != 0 || self.pointers[n] != entries as u64 {
            let message = format!("{name} does not rise from 0 to {entries}, the number of values");
            return wrong(Code::MatrixSyntax, message);
        }
        Ok(())
    }
}

/// Checks the entries of a matrix one by one, and records their sides of the diagonal.
pub(super) struct EntryCheck {
    n: usize,
    help: &'static str,
    pub sides: Sides,
}

impl EntryCheck {
    /// Creates the check for a matrix with `n` rows; `help` says how to write the matrix again.
    pub(super) fn new(n: usize, help: &'static str) -> Self {
        Self { n, help, sides: Sides::default() }
    }

    /// Checks the entry at (`row`, `column`), from 0.
    ///
    /// # Errors
    /// FB303 outside the matrix, FB306 for a value that is not finite.
    pub(super) fn entry(&mut self, row: i64, column: i64, value: f64) -> Result<Entry, Diagnostic> {
        let inside = |index: i64| (0..self.n as i64).contains(&index);
        if !inside(row) || !inside(column) {
            let message = format!(
                "an entry is at ({row}, {column}), the matrix has indices 0 to {}",
                self.n as i64 - 1
            );
            return Err(Diagnostic::new(Code::MatrixIndex, message).with_help(self.help));
        }
        if !value.is_finite() {
            let message = format!("entry ({row}, {column}), counted from 0, is {value}");
            return Err(Diagnostic::new(Code::MatrixNotFinite, message));
        }
        self.sides.lower |= row > column && value != 0.0;
        self.sides.upper |= row < column && value != 0.0;
        Ok(Entry { row: row as u32, col: column as u32, value })
    }
}

//! Entries of matrices in binary files, whose arrays are there in full: checks of each, and compressed columns.

use super::assemble::{ColumnEntries, Entry, Sides, assemble_columns, undeclared_triangle};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::RawMatrix;
use std::path::Path;

/// Compressed columns, or rows, as a file has them, indices from 0. Both become columns: for the symmetric
/// matrices that are wanted they are the same.
pub(super) struct Compressed<'a> {
    /// Number of columns.
    pub n: usize,
    /// Whether they are rows: what follows is said of columns.
    pub by_rows: bool,
    /// Where each column begins among the entries, and their number.
    pub pointers: Vec<u64>,
    /// Name of the pointers in messages.
    pub pointers_name: &'static str,
    /// Number of entries that the file has.
    pub entries: usize,
    /// Row and value of an entry.
    pub entry: &'a dyn Fn(usize) -> (i64, f64),
    /// How to write the file again.
    pub help: &'static str,
    /// How to write both triangles.
    pub both_triangles: &'static str,
}

impl Compressed<'_> {
    /// The matrix; symmetry is not checked, but that both triangles are there.
    ///
    /// # Errors
    /// FB301, FB303, FB304, FB306, FB307, FB312.
    pub(super) fn assemble(self, path: &Path) -> Result<RawMatrix, Diagnostic> {
        self.check_pointers()?;
        let mut columns = ColumnEntries::with_room(self.n, self.entries);
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

/// Checks the entries of a matrix one by one, and remembers on which sides of the diagonal they lie.
pub(super) struct EntryCheck {
    n: usize,
    help: &'static str,
    pub sides: Sides,
}

impl EntryCheck {
    /// Of a matrix with `n` rows; `help` says how to write it again.
    pub(super) fn new(n: usize, help: &'static str) -> Self {
        Self { n, help, sides: Sides::default() }
    }

    /// The entry at (`row`, `column`), from 0.
    ///
    /// # Errors
    /// FB303 outside of the matrix, FB306 for a value that is not finite.
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

//! Matrices that need not be square, such as operators.

use super::assemble::Entry;
use super::operator::OperatorColumns;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::CscMatrix;

/// Matrix that need not be square, with entries from 0.
pub(crate) struct Rectangular {
    pub rows: usize,
    pub columns: usize,
    pub entries: Vec<Entry>,
}

impl Rectangular {
    /// Returns the matrix if all entries lie within it and are finite.
    ///
    /// # Errors
    /// FB303 and FB306.
    pub(crate) fn checked(self) -> Result<Self, Diagnostic> {
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

    /// Returns the operator whose rows are those of the matrix.
    pub(super) fn operator(self) -> OperatorColumns {
        OperatorColumns::Matrix(self.transposed())
    }

    /// Returns the transposed matrix.
    pub(crate) fn transposed(&self) -> CscMatrix {
        let entries: Vec<(u32, u32, f64)> = self.entries.iter().map(|e| (e.col, e.row, e.value)).collect();
        CscMatrix::from_triplets(self.columns, self.rows, &entries)
    }
}

//! Matrices that need not be square, such as operators.

use super::assemble::Entry;
use super::operator::OperatorColumns;
use crate::array::Array;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::CscMatrix;

/// Decimal digits of a number of 64 bits.
const ALL_DIGITS: u8 = 17;

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

    /// Returns the matrix as a dense array.
    ///
    /// # Errors
    /// FB313 for an array that memory does not hold.
    pub(super) fn array(&self) -> Result<Array, Diagnostic> {
        let (rows, cols) = (self.rows, self.columns);
        let mut values: Vec<f64> = Vec::new();
        let count = rows.checked_mul(cols).filter(|count| values.try_reserve_exact(*count).is_ok());
        let Some(count) = count else {
            let message = format!("an array of {rows} x {cols} numbers does not fit into memory");
            return Err(Diagnostic::new(Code::MatrixTooLarge, message));
        };
        values.resize(count, 0.0);
        for Entry { row, col, value } in &self.entries {
            values[*col as usize * rows + *row as usize] += value;
        }
        Ok(Array { rows, cols, row_major: false, values, digits: ALL_DIGITS })
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

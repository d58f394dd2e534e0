//! A dense array of numbers, whatever format it came in.

/// A dense array as its file has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub rows: usize,
    pub cols: usize,
    /// Whether the values of a row, or of a column, follow each other.
    pub row_major: bool,
    /// As many as rows x cols.
    pub values: Vec<f64>,
    /// Significant decimal digits that they carry at the most.
    pub digits: u8,
}

//! A dense array, independent of the format of its file.

/// Dense array as read from its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// True if the values of a row are contiguous, false if those of a column are.
    pub row_major: bool,
    /// Values; their number is rows x cols.
    pub values: Vec<f64>,
    /// Largest number of significant decimal digits that the format stores.
    pub digits: u8,
}

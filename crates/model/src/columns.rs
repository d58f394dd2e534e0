//! Sparse columns computed by several threads.

use flexbody_linalg::CscMatrix;

/// Columns of a sparse matrix, one after the other.
#[derive(Default)]
pub(super) struct Columns {
    ends: Vec<usize>,
    row_idx: Vec<u32>,
    values: Vec<f64>,
}

impl Columns {
    /// Creates `count` columns without entries.
    pub(crate) fn empty(count: usize) -> Self {
        Self { ends: vec![0; count], ..Self::default() }
    }

    /// Adds an entry to the present column, unless it is zero; rows must ascend.
    pub(crate) fn push(&mut self, row: usize, value: f64) {
        if value != 0.0 {
            self.row_idx.push(row as u32);
            self.values.push(value);
        }
    }

    /// Ends the present column.
    pub(crate) fn end(&mut self) {
        self.ends.push(self.row_idx.len());
    }

    /// Returns the n x n matrix whose columns are these parts in their order.
    pub(crate) fn joined(n: usize, parts: Vec<Self>) -> CscMatrix {
        let entries = parts.iter().map(|part| part.values.len()).sum();
        let (mut row_idx, mut values) = (Vec::with_capacity(entries), Vec::with_capacity(entries));
        let mut col_ptr = Vec::with_capacity(n + 1);
        col_ptr.push(0);
        for part in parts {
            let before = row_idx.len();
            col_ptr.extend(part.ends.iter().map(|end| before + end));
            row_idx.extend(part.row_idx);
            values.extend(part.values);
        }
        CscMatrix::from_parts(n, n, col_ptr, row_idx, values)
    }
}

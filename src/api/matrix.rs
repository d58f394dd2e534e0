//! Dense arrays in the interface of the library.

use faer::MatRef;

/// Dense matrix, stored column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    values: Vec<f64>,
}

impl Matrix {
    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns all entries, column by column.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the entries of column `j`.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.values[j * self.rows..(j + 1) * self.rows]
    }
}

impl std::ops::Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.column(j)[i]
    }
}

/// Converts a matrix of the engine. It is not an implementation of `From`, whose signature would expose a type of the
/// engine.
pub(super) fn shown(matrix: MatRef<'_, f64>) -> Matrix {
    let mut values = Vec::with_capacity(matrix.nrows() * matrix.ncols());
    matrix.col_iter().for_each(|column| values.extend(column.iter().copied()));
    Matrix { rows: matrix.nrows(), columns: matrix.ncols(), values }
}

/// Returns the matrix with these rows, each of `columns` numbers.
pub(super) fn by_rows(columns: usize, rows: &[Vec<f64>]) -> Matrix {
    let values = (0..columns).flat_map(|j| rows.iter().map(move |row| row[j])).collect();
    Matrix { rows: rows.len(), columns, values }
}

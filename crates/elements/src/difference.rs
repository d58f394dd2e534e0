//! Difference of a stiffness matrix and the sum of elements.

use crate::places::Place;
use flexbody_linalg::SymmetricMatrix;
use std::collections::BTreeMap;

/// Symmetric matrix from whose upper triangle matrices of elements are subtracted.
pub(crate) struct Difference<'k> {
    matrix: &'k SymmetricMatrix,
    /// Values left, parallel to those of the matrix; those below the diagonal are not changed.
    left: Vec<f64>,
    /// Values where the matrix has no entry, by row and column.
    outside: BTreeMap<(u32, u32), f64>,
    /// Sum of the magnitudes of each row of the matrix.
    row_sums: Vec<f64>,
}

impl<'k> Difference<'k> {
    pub(crate) fn new(matrix: &'k SymmetricMatrix) -> Self {
        let sum = |i: usize| matrix.row(i).1.iter().map(|value| value.abs()).sum();
        Self {
            matrix,
            left: matrix.as_csc().values().to_vec(),
            outside: BTreeMap::new(),
            row_sums: (0..matrix.n()).map(sum).collect(),
        }
    }

    /// Subtracts the symmetric matrix of an element (row by row), whose degrees of freedom have the places `places`.
    pub(crate) fn subtract(&mut self, element: &[f64], places: &[&Place]) {
        let size = places.len();
        for (a, place) in places.iter().enumerate() {
            place.for_each(|row, by_row| {
                for (b, other) in places.iter().enumerate() {
                    let value = by_row * element[a * size + b];
                    other.for_each(|column, by_column| {
                        if row <= column && value != 0.0 {
                            self.subtract_entry(row, column, value * by_column);
                        }
                    });
                }
            });
        }
    }

    fn subtract_entry(&mut self, row: u32, column: u32, value: f64) {
        let first = self.matrix.as_csc().col_ptr()[row as usize];
        match self.matrix.row(row as usize).0.binary_search(&column) {
            Ok(at) => self.left[first + at] -= value,
            Err(_) => *self.outside.entry((row, column)).or_default() -= value,
        }
    }

    /// Returns every entry of the upper triangle that is left: row, column and its magnitude over the smaller of the sums of
    /// its row and column.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (u32, u32, f64)> {
        let pointers = self.matrix.as_csc().col_ptr();
        let inside = (0..self.matrix.n()).flat_map(move |row| {
            let (columns, from) = (self.matrix.row(row).0, pointers[row]);
            let above = columns.partition_point(|column| (*column as usize) < row);
            (above..columns.len()).map(move |at| (row as u32, columns[at], self.left[from + at]))
        });
        let all = inside.chain(self.outside.iter().map(|(&(row, column), &value)| (row, column, value)));
        all.map(|(row, column, value)| {
            let scale = self.row_sums[row as usize].min(self.row_sums[column as usize]);
            let share = if value == 0.0 { 0.0 } else { value.abs() / scale };
            (row, column, share)
        })
    }
}

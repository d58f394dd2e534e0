//! Vertices that a matrix couples.

use crate::rows::Rows;
use flexbody_linalg::SymmetricMatrix;

/// Returns the other vertices to which `matrix` has an entry from the rows of `vertex`, ascending. `counts`
/// gets row, column and value of an entry and returns true if it counts.
pub(crate) fn neighbours(
    matrix: &SymmetricMatrix,
    rows: &Rows,
    vertex: usize,
    counts: impl Fn(usize, usize, f64) -> bool,
) -> Vec<u32> {
    let mut others = Vec::new();
    for row in rows.of_vertex(vertex) {
        let (columns, values) = matrix.row(row);
        for (&column, &value) in columns.iter().zip(values) {
            let other = rows.vertex(column as usize) as u32;
            if others.last() != Some(&other) && counts(row, column as usize, value) {
                others.push(other);
            }
        }
    }
    others.sort();
    others.dedup();
    others.retain(|&other| other as usize != vertex);
    others
}

//! Rows that are empty in all matrices: nodes without elements, rotations of solids.

use flexbody_linalg::CscMatrix;

/// Returns for each of `n` rows true if one of the matrices has an entry in its row or its column. Both are
/// tested, since symmetry is checked later.
pub fn filled_rows<'m>(matrices: impl IntoIterator<Item = &'m CscMatrix>, n: usize) -> Vec<bool> {
    let mut filled = vec![false; n];
    for matrix in matrices {
        for column in 0..n.min(matrix.n_cols()) {
            let (rows, _) = matrix.column(column);
            filled[column] |= !rows.is_empty();
            rows.iter().filter(|row| (**row as usize) < n).for_each(|&row| filled[row as usize] = true);
        }
    }
    filled
}

//! Models whose matrices differ by rounding.

use flexbody_linalg::{CscMatrix, uniform};
use flexbody_model::{RawMatrix, RawModel};

/// Returns the model with every entry of K and M changed by up to 1e-15 of itself. Both triangles have the same change.
pub fn rounded(raw: &RawModel, seed: u64) -> RawModel {
    let matrix = |raw: &RawMatrix, seed: u64| RawMatrix { matrix: changed(&raw.matrix, seed), ..raw.clone() };
    let (stiffness, mass) = (matrix(&raw.stiffness, 2 * seed), matrix(&raw.mass, 2 * seed + 1));
    RawModel { stiffness, mass, ..raw.clone() }
}

fn changed(matrix: &CscMatrix, seed: u64) -> CscMatrix {
    let column = |j: usize| {
        let (rows, values) = matrix.column(j);
        rows.iter().zip(values).map(move |(&i, value)| {
            let (low, high) = ((i as usize).min(j) as u64, (i as usize).max(j) as u64);
            value * (1.0 + 1e-15 * uniform(seed, low, high))
        })
    };
    let values: Vec<f64> = (0..matrix.n_cols()).flat_map(column).collect();
    let (pointers, rows) = (matrix.col_ptr().to_vec(), matrix.row_idx().to_vec());
    CscMatrix::from_parts(matrix.n_rows(), matrix.n_cols(), pointers, rows, values)
}

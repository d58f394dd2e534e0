//! Rounding for tests of decisions: with a seed in the variable `FLEXBODY_TEST_ROUNDING`, every entry of K and M is
//! changed by up to 1e-15 of itself, as another order of the sums behind it would. Builds without debug assertions do
//! not have it.

use flexbody_linalg::{CscMatrix, SymmetricMatrix, uniform};

/// Largest relative change of an entry.
const CHANGE: f64 = 1e-15;

/// Returns the matrices with changed entries if the variable is set, else unchanged.
///
/// # Panics
/// If the value of the variable is no whole number: no test runs without the rounding that it asks for.
pub(crate) fn rounded(matrices: [SymmetricMatrix; 2]) -> [SymmetricMatrix; 2] {
    let Some(seed) = std::env::var_os("FLEXBODY_TEST_ROUNDING") else { return matrices };
    let seed: u64 =
        seed.to_str().and_then(|seed| seed.parse().ok()).expect("FLEXBODY_TEST_ROUNDING is a whole number");
    let [stiffness, mass] = matrices;
    [changed(stiffness.as_csc(), 2 * seed), changed(mass.as_csc(), 2 * seed + 1)]
}

fn changed(matrix: &CscMatrix, seed: u64) -> SymmetricMatrix {
    let column = |j: usize| {
        let (rows, values) = matrix.column(j);
        rows.iter().zip(values).map(move |(&i, value)| {
            // Both triangles have the same change.
            let (low, high) = ((i as usize).min(j) as u64, (i as usize).max(j) as u64);
            value * (1.0 + CHANGE * uniform(seed, low, high))
        })
    };
    let values: Vec<f64> = (0..matrix.n_cols()).flat_map(column).collect();
    let (pointers, rows) = (matrix.col_ptr().to_vec(), matrix.row_idx().to_vec());
    let matrix = CscMatrix::from_parts(matrix.n_rows(), matrix.n_cols(), pointers, rows, values);
    SymmetricMatrix::new(matrix).expect("a symmetric change of a symmetric matrix")
}

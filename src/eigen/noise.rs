//! Rounding floors: how small a residual or an eigenvalue can be told from zero with the digits that are there.

use crate::linalg::SymmetricMatrix;
use faer::MatRef;
use rayon::prelude::*;

/// Unit roundoff of f64.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Rows per partial sum.
const ROWS: usize = 4096;

/// For each column x of X: the standard deviation of x'Kx when every entry of K carries an independent relative
/// error of `relative`: relative * sqrt(sum_ij (K_ij x_i x_j)^2), times sqrt(2) for the equal errors of symmetric pairs.
pub fn energy_noise(k: &SymmetricMatrix, x: MatRef<'_, f64>, relative: f64) -> Vec<f64> {
    let relative = relative.max(ROUNDOFF);
    per_column(k, x, |xi, row_entries| row_entries.map(|(v, xj)| (v * xj * xi) * (v * xj * xi)).sum::<f64>())
        .iter()
        .map(|sum| relative * (2.0 * sum).sqrt())
        .collect()
}

/// For each column x of X: eps | |K| |x| |_2, the norm of K x that rounding alone can leave.
pub fn rounding_residual(k: &SymmetricMatrix, x: MatRef<'_, f64>) -> Vec<f64> {
    per_column(k, x, |_, row_entries| row_entries.map(|(v, xj)| (v * xj).abs()).sum::<f64>().powi(2))
        .iter()
        .map(|sum| f64::EPSILON * sum.sqrt())
        .collect()
}

/// Sum over the rows i of `term(x_i, entries (K_ij, x_j))`, for each column.
fn per_column(
    k: &SymmetricMatrix,
    x: MatRef<'_, f64>,
    term: impl Fn(f64, &mut dyn Iterator<Item = (f64, f64)>) -> f64 + Sync,
) -> Vec<f64> {
    (0..x.ncols())
        .map(|c| {
            let column = x.col(c).try_as_col_major().expect("blocks are column-major").as_slice();
            let partial: Vec<f64> = column
                .par_chunks(ROWS)
                .enumerate()
                .map(|(chunk, part)| {
                    let mut sum = 0.0;
                    for (r, &xi) in part.iter().enumerate() {
                        let (columns, values) = k.row(chunk * ROWS + r);
                        sum +=
                            term(xi, &mut columns.iter().zip(values).map(|(&j, &v)| (v, column[j as usize])));
                    }
                    sum
                })
                .collect();
            partial.iter().sum()
        })
        .collect()
}

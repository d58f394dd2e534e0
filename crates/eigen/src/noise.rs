//! Rounding floors: how small a residual or an eigenvalue can be told from zero with the digits that are
//! there.

use faer::{ColRef, MatRef};
use flexbody_linalg::{SymmetricMatrix, Tall, column_norms, sum_terms};

/// Unit roundoff of f64.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// For each column x of X: the standard deviation of x'Kx when every entry of K carries an independent
/// relative error of `relative`: relative * sqrt(sum_ij (K_ij x_i x_j)^2), times sqrt(2) for the equal errors
/// of symmetric pairs.
pub fn energy_noise(k: &SymmetricMatrix, x: MatRef<'_, f64>, relative: f64) -> Vec<f64> {
    let relative = relative.max(ROUNDOFF);
    let terms = row_sums(k, x, |term| term * term);
    let columns = x.col_iter().zip(terms.as_ref().col_iter());
    let sum = |(x, terms): (ColRef<'_, f64>, ColRef<'_, f64>)| -> f64 {
        x.iter().zip(terms.iter()).map(|(x, term)| x * x * term).sum()
    };
    columns.map(|pair| relative * (2.0 * sum(pair)).sqrt()).collect()
}

/// For each column x of X: eps | |K| |x| |_2, the norm of K x that rounding alone can leave.
pub fn rounding_residual(k: &SymmetricMatrix, x: MatRef<'_, f64>) -> Vec<f64> {
    column_norms(row_sums(k, x, f64::abs).as_ref()).into_iter().map(|norm| f64::EPSILON * norm).collect()
}

/// Whether rounding keeps a K-residual above `tolerance`, as in thin or fine shells: a part eps |K| |x| of K x,
/// divided by distances of eigenvalues, is then what plain projections turn modes into each other by.
pub(super) fn is_noisy(floors: &[f64], tolerance: f64) -> bool {
    floors.iter().any(|floor| *floor > tolerance)
}

/// sum_j f(K_ij x_j) for each row i and each column x.
fn row_sums(k: &SymmetricMatrix, x: MatRef<'_, f64>, f: impl Fn(f64) -> f64 + Copy + Sync) -> Tall {
    let mut sums = Tall::zeros(x.nrows(), x.ncols());
    sum_terms(k, 1, x, sums.as_mut(), f);
    sums
}

//! Removal of rigid motion from the modes at nodes: psi'_j(x) = psi_j(x) - t_j - theta_j x x.

use faer::{Mat, MatRef};

/// Returns the displacements of nodes (3n x nf) at `positions` without the translations and rotations
/// `taken` (6 x nf) about the origin.
pub(super) fn shapes_without(taken: &Mat<f64>, shape: &Mat<f64>, positions: &[[f64; 3]]) -> Mat<f64> {
    Mat::from_fn(shape.nrows(), shape.ncols(), |row, j| {
        let (x, k) = (positions[row / 3], row % 3);
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        shape[(row, j)] - (taken[(k, j)] + taken[(3 + l, j)] * x[m] - taken[(3 + m, j)] * x[l])
    })
}

/// Returns the rotations of nodes (3n x nf) without those of `taken` (6 x nf); nodes without rotations keep
/// their zeros.
pub(super) fn rotations_without(taken: &Mat<f64>, rotation: &Mat<f64>) -> Mat<f64> {
    let turns: Vec<bool> =
        (0..rotation.nrows() / 3).map(|node| has_rotations(rotation.as_ref(), node)).collect();
    Mat::from_fn(rotation.nrows(), rotation.ncols(), |row, j| {
        if turns[row / 3] { rotation[(row, j)] - taken[(3 + row % 3, j)] } else { 0.0 }
    })
}

/// Returns true if `node` has rotations; nodes without have zeros in their rows (3n x nf).
pub(super) fn has_rotations(rotation: MatRef<'_, f64>, node: usize) -> bool {
    (0..rotation.ncols()).any(|j| (0..3).any(|k| rotation[(3 * node + k, j)] != 0.0))
}

/// Returns the translations stacked over the rotations (6 x nf).
pub(super) fn stacked(translation: &Mat<f64>, rotation: &Mat<f64>) -> Mat<f64> {
    let entry = |i: usize, j: usize| if i < 3 { translation[(i, j)] } else { rotation[(i - 3, j)] };
    Mat::from_fn(6, translation.ncols(), entry)
}

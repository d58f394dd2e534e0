//! Dense symmetric eigenproblems of moderate size.

use faer::{Mat, MatRef, Side};

/// Eigenvalues ascending and orthonormal eigenvectors (columns) of a symmetric matrix.
#[derive(Debug, Clone)]
pub struct SymmetricEigen {
    /// Eigenvalues, ascending.
    pub values: Vec<f64>,
    /// Eigenvectors, column i belongs to value i.
    pub vectors: Mat<f64>,
}

/// Eigenvalues and eigenvectors of the symmetric matrix whose lower triangle is that of `a`; `None` when the
/// iteration does not converge or the matrix has non-finite entries.
pub fn symmetric_eigen(a: MatRef<'_, f64>) -> Option<SymmetricEigen> {
    if a.nrows() == 0 {
        return Some(SymmetricEigen { values: Vec::new(), vectors: Mat::zeros(0, 0) });
    }
    if !(0..a.ncols()).all(|j| (j..a.nrows()).all(|i| a[(i, j)].is_finite())) {
        return None;
    }
    let eigen = a.self_adjoint_eigen(Side::Lower).ok()?;
    let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
    Some(SymmetricEigen { values, vectors: eigen.U().to_owned() })
}

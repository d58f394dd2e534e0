//! Principal directions of many vectors, in descending order of their size.

use faer::Mat;
use flexbody_linalg::{combine, gram, side_by_side, subtract_combination, symmetric_eigen};

/// Returns an orthonormal basis (k x p) of the principal directions of the columns of `columns` (k x m), in descending
/// order of their size. It stops when the rest of the sum of squares is at most `left_out` of the whole, or after `most`
/// directions. Returns `None` if the columns are zero or not finite.
pub(super) fn principal_directions(columns: &Mat<f64>, left_out: f64, most: usize) -> Option<Mat<f64>> {
    let mut rest = columns.clone();
    let stages = Stages::new(columns, left_out);
    let mut basis = Mat::zeros(columns.nrows(), 0);
    while let Some(left_out) = stages.next(&rest, most - basis.ncols()) {
        let covariance = combine(rest.as_ref(), rest.transpose().to_owned().as_ref());
        let Some((own, _)) = principal(covariance, left_out, most - basis.ncols()) else { break };
        let along = gram(own.as_ref(), rest.as_ref());
        subtract_combination(rest.as_mut(), own.as_ref(), along.as_ref());
        basis = side_by_side(&[basis.as_ref(), own.as_ref()]);
    }
    (basis.ncols() > 0).then_some(basis)
}

/// Stages of a search for principal directions. An eigenvector of a Gram matrix has as many wrong digits as its
/// eigenvalue is smaller than the largest: small directions are looked for after the large ones have been subtracted.
pub(super) struct Stages {
    whole: f64,
    left_out: f64,
}

impl Stages {
    /// Part of the sum of squares that one stage leaves to the next. The directions of a stage are accurate to rounding
    /// over this part; a larger value takes more stages.
    const LEFT_OUT_OF_ONE: f64 = 1e-5;

    pub(super) fn new(columns: &Mat<f64>, left_out: f64) -> Self {
        // Subtractions leave the square of rounding.
        Self { whole: columns.squared_norm_l2(), left_out: left_out.max(f64::EPSILON.powi(2) * 1e4) }
    }

    /// Returns the part of the sum of squares that the next stage leaves out; `None` if the `rest` is small enough or no
    /// direction is left to find.
    pub(super) fn next(&self, rest: &Mat<f64>, most: usize) -> Option<f64> {
        let left = rest.squared_norm_l2();
        let enough = self.left_out * self.whole;
        (most > 0 && left > enough).then(|| Self::LEFT_OUT_OF_ONE.max(enough / left))
    }
}

/// Returns eigenvectors (m x k) of a Gram matrix and the square roots of their eigenvalues, in descending order. It
/// stops when the remaining eigenvalues sum to at most `left_out` of the whole, or after `most` vectors. Returns `None`
/// if the matrix is zero or not finite.
pub(super) fn principal(gram: Mat<f64>, left_out: f64, most: usize) -> Option<(Mat<f64>, Vec<f64>)> {
    let eigen = symmetric_eigen(gram.as_ref())?;
    let sum: f64 = eigen.values.iter().map(|v| v.max(0.0)).sum();
    if !(sum.is_finite() && sum > 0.0) {
        return None;
    }
    let m = eigen.values.len();
    let mut rest = sum;
    let mut kept = Vec::new();
    for j in (0..m).rev().take(most) {
        if rest <= left_out * sum || eigen.values[j] <= f64::EPSILON * sum {
            break;
        }
        rest -= eigen.values[j];
        kept.push(j);
    }
    let values = kept.iter().map(|&j| eigen.values[j].sqrt()).collect();
    Some((Mat::from_fn(m, kept.len(), |i, c| eigen.vectors[(i, kept[c])]), values))
}

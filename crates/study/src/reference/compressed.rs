//! Many forces as combinations of a few (proper orthogonal decomposition).

use faer::Mat;
use flexbody_linalg::{combine, gram, symmetric_eigen};
use flexbody_model::FeModel;

/// Part of the sum of squares, weighted by the inverse of the diagonal of K, that may be left out.
const LEFT_OUT: f64 = 1e-12;

/// Combinations at the most.
pub(super) const MOST_FORCES: usize = 32;

/// A basis B (N x k) of forces F that is orthonormal where each row counts by one over the diagonal of K:
/// about the energy that a force does work with at that row alone.
pub(super) struct Compressed {
    pub basis: Mat<f64>,
    /// Roots of these weights, and the basis times them.
    weights: Vec<f64>,
    weighted: Mat<f64>,
}

impl Compressed {
    /// The first principal directions of `forces` (N x m). Nothing where the forces are zero, or beyond the
    /// range of numbers.
    pub(super) fn new(model: &FeModel, forces: &Mat<f64>) -> Option<Self> {
        let diagonal = model.stiffness().diagonal();
        let weights: Vec<f64> =
            diagonal.iter().map(|k| if *k > 0.0 { k.sqrt().recip() } else { 0.0 }).collect();
        let weigh = |forces: &Mat<f64>| {
            Mat::from_fn(forces.nrows(), forces.ncols(), |i, j| weights[i] * forces[(i, j)])
        };
        let weighted = weigh(forces);
        let (directions, values) =
            principal(gram(weighted.as_ref(), weighted.as_ref()), LEFT_OUT, MOST_FORCES)?;
        let scaled =
            Mat::from_fn(directions.nrows(), directions.ncols(), |i, j| directions[(i, j)] / values[j]);
        let basis = combine(forces.as_ref(), scaled.as_ref());
        let weighted = weigh(&basis);
        Some(Self { basis, weights, weighted })
    }

    /// C (k x m) with B C next to the `forces` F (N x m).
    pub(super) fn amplitudes(&self, forces: &Mat<f64>) -> Mat<f64> {
        let weighted = Mat::from_fn(forces.nrows(), forces.ncols(), |i, j| self.weights[i] * forces[(i, j)]);
        gram(self.weighted.as_ref(), weighted.as_ref())
    }
}

/// Eigenvectors (m x k) of a Gram matrix and the roots of their eigenvalues, descending, up to the part
/// `left_out` of their sum and at most `most`. `None` where there is nothing.
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

//! Compression of many force vectors to a few by proper orthogonal decomposition.

use faer::Mat;
use flexbody_linalg::{combine, gram, symmetric_eigen};
use flexbody_model::FeModel;

/// Part of the sum of squares (weighted by the inverse diagonal of K) that compression may drop. A larger value keeps
/// fewer forces.
const LEFT_OUT: f64 = 1e-12;

/// Largest number of compressed forces. Memory and static responses grow with it.
pub(super) const MOST_FORCES: usize = 32;

/// Basis B (N x k) of forces F, orthonormal in the norm that weights each row by the inverse diagonal of K. This norm
/// is about the energy of a force that acts at one row alone.
pub(super) struct Compressed {
    pub basis: Mat<f64>,
    /// Square roots of the row weights (N), and the basis multiplied by them (N x k).
    weights: Vec<f64>,
    weighted: Mat<f64>,
}

impl Compressed {
    /// Computes the first principal directions of `forces` (N x m). Returns `None` if the forces are zero or not
    /// finite.
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

    /// Returns C (k x m) such that B C is the best approximation of `forces` F (N x m) in the weighted norm.
    pub(super) fn amplitudes(&self, forces: &Mat<f64>) -> Mat<f64> {
        let weighted = Mat::from_fn(forces.nrows(), forces.ncols(), |i, j| self.weights[i] * forces[(i, j)]);
        gram(self.weighted.as_ref(), weighted.as_ref())
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

//! The answer of the eigen-solver where there are modes.

use super::completeness::Completeness;
use super::plan::Plan;
use super::settings::{Accuracy, keeps};
use super::zero_energy::is_noisy;
use faer::Mat;

/// Guaranteed bounds of the eigenvalues of K and M as they are stored, at [`Accuracy::Certified`].
#[derive(Debug, Clone, PartialEq)]
pub struct EigenvalueBounds {
    /// lower\[j\] <= lambda_j, ascending.
    pub lower: Vec<f64>,
    /// lambda_j <= upper\[j\], ascending.
    pub upper: Vec<f64>,
    /// Upper bound of the distance of each mode to the exact eigenspace of its cluster, in the norm of M.
    pub shape_error: Vec<f64>,
    /// Shift between the rigid modes and the first flexible one.
    pub shift_below: f64,
    /// Negative pivots of K - shift_below M: the number of rigid modes.
    pub pivots_below: usize,
}

impl EigenvalueBounds {
    /// Moves eigenvalues that lie outside of their bounds onto them: the bounds know more digits than a
    /// projection in f64.
    pub(super) fn clamp(&self, eigenvalues: &mut [f64]) {
        for ((lambda, lower), upper) in eigenvalues.iter_mut().zip(&self.lower).zip(&self.upper) {
            *lambda = lambda.clamp(*lower, *upper);
        }
    }
}

/// Flexible modes, ascending.
#[derive(Debug, Clone)]
pub struct EigenSolution {
    /// lambda, ascending.
    pub eigenvalues: Vec<f64>,
    /// Modes (N x nf): M-orthonormal, M-orthogonal to the rigid modes.
    pub vectors: Mat<f64>,
    /// K-residual of each mode.
    pub residuals: Vec<f64>,
    /// K-residual that rounding alone explains, for each mode.
    pub rounding_floors: Vec<f64>,
    /// Knowledge about missed modes.
    pub completeness: Completeness,
    /// Memory and precision as decided (not on the dense path); the precision is the one used in the end.
    pub plan: Option<Plan>,
    /// Bounds of the eigenvalues, at [`Accuracy::Certified`].
    pub bounds: Option<EigenvalueBounds>,
    /// Eigenvalues that were computed beyond the last mode given, at least loosely (for cluster and gap
    /// decisions).
    pub next_eigenvalue: Option<f64>,
    /// Number of flexible modes with a finite eigenvalue, where it is known (dense path).
    pub finite_modes: Option<usize>,
    /// Shift tau of K + tau M that was used last.
    pub shift: f64,
}

impl EigenSolution {
    /// Returns the number of modes, wherever they come from, that are eigenvectors to the K-residual of `accuracy` or to
    /// rounding.
    pub fn eigenvectors(&self, accuracy: Accuracy) -> usize {
        let pairs = self.residuals.iter().zip(&self.rounding_floors);
        pairs.filter(|(residual, floor)| keeps(**residual, **floor, accuracy.residual())).count()
    }

    /// Returns true when rounding keeps a K-residual above what [`Accuracy::Standard`] promises: products with K in double
    /// precision then cost digits of what is made of these modes.
    pub fn is_noisy(&self) -> bool {
        is_noisy(&self.rounding_floors, Accuracy::Standard.residual())
    }
}

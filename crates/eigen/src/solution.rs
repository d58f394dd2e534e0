//! The modes with their accuracy and the proof of completeness.

use super::bounds::EigenvalueBounds;
use super::count::Completeness;
use super::plan::Plan;
use super::refine::{is_noisy, keeps};
use super::settings::Accuracy;
use faer::Mat;

/// Flexible modes, ascending, with their accuracy and the proof of completeness.
#[derive(Debug, Clone)]
pub struct EigenSolution {
    /// Eigenvalues lambda, ascending.
    pub eigenvalues: Vec<f64>,
    /// Modes (N x nf): M-orthonormal, M-orthogonal to the rigid modes.
    pub vectors: Mat<f64>,
    /// K-residual of each mode.
    pub residuals: Vec<f64>,
    /// K-residual of each mode that rounding alone explains.
    pub rounding_floors: Vec<f64>,
    /// Proof that no mode is missing, or the reason why there is none.
    pub completeness: Completeness,
    /// Attempts with memory and precision, as planned and as they ended; `None` for the dense path.
    pub plan: Option<Plan>,
    /// Bounds of the eigenvalues, at [`Accuracy::Certified`].
    pub bounds: Option<EigenvalueBounds>,
    /// First eigenvalue beyond the returned modes, if it was computed, at least roughly (for decisions about clusters
    /// and gaps).
    pub next_eigenvalue: Option<f64>,
    /// Number of flexible modes with a finite eigenvalue, if it is known (dense path).
    pub finite_modes: Option<usize>,
    /// Last shift tau of K + tau M.
    pub shift: f64,
}

impl EigenSolution {
    /// Returns the number of modes, of any origin, that are eigenvectors to the K-residual of `accuracy` or to
    /// rounding.
    pub fn eigenvectors(&self, accuracy: Accuracy) -> usize {
        let pairs = self.residuals.iter().zip(&self.rounding_floors);
        pairs.filter(|(residual, floor)| keeps(**residual, **floor, accuracy.residual())).count()
    }

    /// Returns true when rounding keeps a K-residual above the guarantee of [`Accuracy::Standard`]. Products of these
    /// modes with K in double precision then lose digits.
    pub fn is_noisy(&self) -> bool {
        is_noisy(&self.rounding_floors, Accuracy::Standard.residual())
    }
}

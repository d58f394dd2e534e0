//! Stages of a step of the Gauss methods.

use nalgebra::Complex;

/// Number of stages of the method of the highest order.
pub const STAGES: usize = 3;

/// Eigenvalue mu of the matrix A of the method, with its part of every stage: the sum over all eigenvalues
/// of right_i mu left_j is A_ij. Of a conjugate pair only the eigenvalue above the real axis is stored, and
/// twice the real part of its contribution counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageMode {
    /// Eigenvalue mu; mu and mu^2 lie to the right of the imaginary axis.
    pub value: Complex<f64>,
    /// Weights that extract the part of this eigenvalue from the stages.
    pub left: [Complex<f64>; STAGES],
    /// Weights that distribute this part to the stages.
    pub right: [Complex<f64>; STAGES],
    /// True if there is a conjugate eigenvalue.
    pub paired: bool,
}

//! The eigenproblem that is to be solved.

use super::resume::Resume;
use crate::numerics::linalg::{Analysis, Pencil};
use faer::MatRef;
use std::sync::Arc;

/// K psi = lambda M psi on the M-orthogonal complement of the known rigid modes.
#[derive(Debug, Clone, Copy)]
pub struct EigenProblem<'a> {
    /// K and M.
    pub pencil: Pencil<'a>,
    /// Rigid modes (N x r), M-orthonormal: exact null vectors of K, projected out at every step.
    pub rigid: MatRef<'a, f64>,
    /// A Rayleigh quotient of some flexible field: an upper bound of the first flexible eigenvalue.
    pub first_estimate: f64,
    /// Relative error of the entries of K: half a unit of the last digit that the input carries.
    pub input_error: f64,
    /// The order of elimination, where it is known already.
    pub order: Option<&'a Arc<Analysis>>,
    /// Where an iterative search starts, and who keeps how far it came.
    pub resume: Resume<'a>,
}

impl EigenProblem<'_> {
    /// The order of elimination and the structure of the factor; `None` when memory runs out.
    pub(super) fn analysis(&self) -> Option<Arc<Analysis>> {
        match self.order {
            Some(order) => Some(Arc::clone(order)),
            None => Analysis::new(&self.pencil).map(Arc::new),
        }
    }
}

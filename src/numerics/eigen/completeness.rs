//! The proof that no mode is missed: by Sylvester's law the number of negative pivots of K - sigma M is the
//! number of eigenvalues below sigma (M positive semidefinite).

use super::counters::Counters;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use crate::numerics::linalg::{Analysis, Inertia};

/// A probe residual above this means that element growth may have spoilt the count.
const GROWTH_LIMIT: f64 = 1e-4;

/// How complete the modes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// The inertia count equals the number of modes found.
    InertiaCount,
    /// No count was made.
    NotProved,
}

/// What is known about missed modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Completeness {
    /// Whether and how it is proved.
    pub proof: Proof,
    /// The shift sigma of the count, between the last mode and the next eigenvalue.
    pub shift: f64,
    /// Negative pivots of K - sigma M: rigid and flexible modes below sigma.
    pub negative_pivots: Option<usize>,
    /// Flexible modes below sigma that were computed; those after the wanted ones complete a repeated
    /// eigenvalue.
    pub modes_below: usize,
    /// Why there is no proof; empty when there is one.
    pub remark: String,
}

impl Completeness {
    /// Flexible modes below the shift: counted where there is a count, otherwise those found.
    pub(super) fn counted(&self, rigid: usize) -> usize {
        self.negative_pivots.map_or(self.modes_below, |negative| negative.saturating_sub(rigid))
    }
}

/// Eigenvalues of the pencil below `sigma`, rigid modes included.
pub(super) fn count_below(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    sigma: f64,
    counters: &mut Counters,
) -> Result<usize, EigenFailure> {
    counters.factorizations += 1;
    let inertia = Inertia::new(analysis, &problem.pencil, sigma);
    if inertia.zero > 0 || inertia.backward_error.is_nan() || inertia.backward_error > GROWTH_LIMIT {
        return Err(EigenFailure::Inaccurate { residual: inertia.backward_error });
    }
    Ok(inertia.negative)
}

//! The factor that a search solves with, and the shift that suits the modes.

use super::failure::EigenFailure;
use super::lanczos::Outcome;
use super::problem::{EigenProblem, Task};
use super::refine::FoundModes;
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::{Analysis, Cholesky, Real, Solve, largest, largest_entry};

/// Relative difference of lambda and the Rayleigh quotient of a mode up to which the mode counts as converged.
pub const SAME_EIGENVALUE: f64 = 1e-6;

/// Ratio of the first shift of a search to the upper bound of the first flexible eigenvalue. A smaller shift costs
/// digits of the last modes, a larger one more steps.
pub const FIRST_SHIFT: f64 = 0.3;

/// Returns the shift tau with which an iterative search begins.
pub(super) fn first_shift(problem: &EigenProblem<'_>) -> f64 {
    FIRST_SHIFT * problem.first_estimate
}

/// Computes the Cholesky factor of K + tau M, and tests its accuracy with one solve.
pub(super) fn factorise<'a, T: Real>(
    problem: &EigenProblem<'_>,
    analysis: &'a Analysis,
    tau: f64,
    context: &Context<'_>,
) -> Result<Cholesky<'a, T>, EigenFailure> {
    context.count(|work| work.factorizations += 1);
    let pencil = &problem.pencil;
    let factor =
        Cholesky::new(analysis, pencil, tau).ok_or(EigenFailure::NotPositiveDefinite { shift: tau })?;
    let b = Mat::from_fn(pencil.n(), 1, |i, _| if i % 3 == i % 2 { 1.0 } else { -0.5 });
    let mut x = b.clone();
    factor.solve_in_place(x.as_mut());
    let residual = &b - pencil.apply_stiffness(x.as_ref()) - pencil.apply_mass(x.as_ref()) * faer::Scale(tau);
    // The backward error measures a factor however ill-conditioned the matrix is.
    let row_sum = |i: usize| pencil.stiffness().row(i).1.iter().map(|v| v.abs()).sum::<f64>();
    let scale = b.norm_max() + largest((0..pencil.n()).map(row_sum)) * x.norm_max();
    let relative = largest_entry(residual.as_ref()) / scale;
    // A backward stable factor leaves about the unit roundoff; a wrong factor leaves O(1).
    if relative.is_nan() || relative > T::ROUNDOFF.sqrt() {
        return Err(EigenFailure::Inaccurate { residual: relative });
    }
    Ok(factor)
}

/// Searches with a factor in the precision of `T`, and again with another shift as long as the search asks for one.
pub(super) fn with_suited_shift<T: Real>(
    task: &Task<'_>,
    search: impl Fn(Cholesky<'_, T>) -> Result<Outcome<FoundModes>, EigenFailure>,
) -> Result<FoundModes, EigenFailure> {
    let Task { problem, analysis, context, .. } = task;
    let mut tau = first_shift(problem);
    loop {
        context.phase("factorisation");
        let factor = factorise(problem, analysis, tau, context)?;
        context.phase("modes");
        match search(factor)? {
            Outcome::Reached(modes) => return Ok(modes),
            Outcome::ShiftTooLarge(shift) => tau = shift,
        }
    }
}

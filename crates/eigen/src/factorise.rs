//! The factor that a search solves with, and the shift that suits the modes.

use super::counters::Counters;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::resume::Snapshot;
use super::start::first_shift;
use faer::Mat;
use flexbody_linalg::progress::{Event, Watch};
use flexbody_linalg::{Analysis, Cholesky, Real, Solve, largest, largest_entry};

/// Cholesky factor with a probe of its accuracy.
pub(super) fn factorise<'a, T: Real>(
    problem: &EigenProblem<'_>,
    analysis: &'a Analysis,
    tau: f64,
    counters: &mut Counters,
) -> Result<Cholesky<'a, T>, EigenFailure> {
    counters.factorizations += 1;
    let pencil = &problem.pencil;
    let factor =
        Cholesky::new(analysis, pencil, tau).ok_or(EigenFailure::NotPositiveDefinite { shift: tau })?;
    let b = Mat::from_fn(pencil.n(), 1, |i, _| if i % 3 == i % 2 { 1.0 } else { -0.5 });
    let mut x = b.clone();
    factor.solve_in_place(x.as_mut());
    let residual = &b - pencil.apply_stiffness(x.as_ref()) - pencil.apply_mass(x.as_ref()) * faer::Scale(tau);
    // The backward error: what matters of a factor, however ill-conditioned the matrix.
    let row_sum = |i: usize| pencil.stiffness().row(i).1.iter().map(|v| v.abs()).sum::<f64>();
    let scale = b.norm_max() + largest((0..pencil.n()).map(row_sum)) * x.norm_max();
    let relative = largest_entry(residual.as_ref()) / scale;
    // Backward stable factors leave about the unit roundoff here; a wrong one leaves O(1).
    if relative.is_nan() || relative > T::ROUNDOFF.sqrt() {
        return Err(EigenFailure::Inaccurate { residual: relative });
    }
    Ok(factor)
}

/// How far a search came with one shift.
pub(super) enum Attempt<R> {
    /// To its result.
    Done(R),
    /// It is to begin anew with this shift: it would be shorter or more accurate.
    Anew(f64),
}

/// Searches with a factor in the precision of `T`, the first time from `start`, until the shift suits the
/// modes. Returns the result and the shift.
pub(super) fn with_suited_shift<T: Real, R>(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    mut start: Option<&Snapshot>,
    watch: Watch<'_>,
    counters: &mut Counters,
    search: impl Fn(Cholesky<'_, T>, Option<&Snapshot>, &mut Counters) -> Result<Attempt<R>, EigenFailure>,
) -> Result<(R, f64), EigenFailure> {
    let mut tau = first_shift(problem, start);
    loop {
        watch(Event::Phase("factorisation"));
        let factor = factorise(problem, analysis, tau, counters)?;
        watch(Event::Phase("modes"));
        match search(factor, start, counters)? {
            Attempt::Done(result) => return Ok((result, tau)),
            Attempt::Anew(shift) => (tau, start) = (shift, None),
        }
    }
}

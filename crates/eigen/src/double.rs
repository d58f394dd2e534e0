//! The attempts with factors in double precision: Lanczos with one shift below the modes, or with a second shift among
//! them.
//!
//! With a shift below all modes the last modes converge slowest, and many modes take three columns each. With a second
//! shift among the modes they take two.

use super::attempt::{Attempt, Goal};
use super::failure::EigenFailure;
use super::lanczos::{Iteration, Outcome, columns_per_step};
use super::needs::{Needs, Unusable, basis_columns, factor_needs, resident, vector_bytes};
use super::problem::{EigenProblem, Task};
use super::refine::{FoundModes, refine};
use super::settings::{Accuracy, FactorChoice, Precision};
use super::shift::{factorise, with_suited_shift};
use flexbody_linalg::context::Context;
use flexbody_linalg::{Analysis, Cholesky, Indefinite, Solve};

/// Lanczos with a factor in double precision.
pub(super) struct DoublePrecision;

impl Attempt for DoublePrecision {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        if task.settings.factor == FactorChoice::Always(Precision::Single)
            && task.settings.accuracy != Accuracy::Certified
        {
            return Err(Unusable::Unsuited);
        }
        factor_needs(task, wanted, Precision::Double)
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        with_suited_shift(task, |factor: Cholesky<'_, f64>| {
            let block = columns_per_step(goal.wanted);
            let iteration = Iteration::begin(task.problem, &factor, goal, block, task.context);
            find_refined(task, iteration, &factor, goal)
        })
    }

    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        true
    }
}

/// Finds the modes with one factor, and refines them with the same factor.
fn find_refined(
    task: &Task<'_>,
    mut iteration: Iteration<'_>,
    factor: &dyn Solve,
    goal: &Goal,
) -> Result<Outcome<FoundModes>, EigenFailure> {
    let found = match iteration.find(factor)? {
        Outcome::Reached(found) => found,
        Outcome::ShiftTooLarge(shift) => return Ok(Outcome::ShiftTooLarge(shift)),
    };
    // Refine with the first factor, whose shift is below all modes.
    drop(iteration);
    let refined = refine(task.problem, factor, found.refined, goal.tolerance, task.context)?;
    Ok(Outcome::Reached(FoundModes { refined, ..found }))
}

/// Lanczos with a second factor, at a shift among the modes, which replaces the first one.
pub(super) struct SecondShift;

impl Attempt for SecondShift {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        let needs = DoublePrecision.needs(task, wanted).map_err(|_| Unusable::Unsuited)?;
        if task.settings.accuracy == Accuracy::Certified || !saves_time(task, wanted) {
            return Err(Unusable::Unsuited);
        }
        // The first factor is released before the second one is computed. It is computed again if the modes need
        // refinement.
        let vectors = vector_bytes(task.problem, wanted, Precision::Double);
        let bytes = needs.bytes.max(resident(8 * task.peaks.retained_inertia + vectors));
        if bytes > task.context.available() { Err(Unusable::Unsuited) } else { Ok(Needs { bytes, ..needs }) }
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        with_suited_shift(task, |factor: Cholesky<'_, f64>| {
            let block = columns_per_step(goal.wanted);
            let mut iteration = Iteration::begin(task.problem, &factor, goal, block, task.context);
            match iteration.expand_to(goal.wanted, &factor)? {
                Outcome::ShiftTooLarge(shift) => Ok(Outcome::ShiftTooLarge(shift)),
                Outcome::Reached(()) => from_midway(task, iteration, factor, goal),
            }
        })
    }

    /// Returns false for modes that did not converge: the reason may be the second shift instead of the model.
    fn is_conclusive(&self, failure: &EigenFailure) -> bool {
        !matches!(failure, EigenFailure::NotConverged { .. })
    }

    fn is_repeated(&self) -> bool {
        false
    }
}

/// Continues with a second shift if the Ritz values show a gap for it, else with the first one.
fn from_midway(
    task: &Task<'_>,
    mut iteration: Iteration<'_>,
    first: Cholesky<'_, f64>,
    goal: &Goal,
) -> Result<Outcome<FoundModes>, EigenFailure> {
    let Task { problem, analysis, context, .. } = task;
    if iteration.is_complete() {
        return find_refined(task, iteration, &first, goal);
    }
    let not_converged = || EigenFailure::NotConverged { converged: 0, wanted: goal.wanted };
    // Ritz values of the first shift show the gap for the second one; the first factor makes room for its factor.
    let midway = iteration.midway()?;
    let tau = first.shift();
    drop(first);
    let first_factor = || factorise::<f64>(problem, analysis, tau, context);
    let second = SecondFactor::new(problem, analysis, &midway.eigenvalues, goal.wanted, context);
    // Continue with the second shift, or with the first one if there is no gap.
    let found = match second {
        Some(second) => {
            iteration.change_shift(midway, &second.factor, second.below);
            iteration.find(&second.factor)
        }
        None => iteration.find(&first_factor()?),
    };
    // From here on every failure may be due to the second shift.
    let Ok(Outcome::Reached(FoundModes { mut refined, next, finite, .. })) = found else {
        return Err(not_converged());
    };
    drop(iteration);
    if refined.excess(goal.tolerance) > 1.0 {
        refined = refine(problem, &first_factor()?, refined, goal.tolerance, context)?;
    }
    if refined.excess(goal.tolerance) > 1.0 {
        return Err(not_converged());
    }
    Ok(Outcome::Reached(FoundModes { refined, next, tau, finite }))
}

/// Fraction of the wanted modes that lie below the second shift, by the Ritz values of a basis of as many vectors.
/// These Ritz values are too high: in truth a tenth more modes lie below the shift. A larger value lets the first shift
/// serve more modes and leaves fewer to the second one. (Columns solved for 200 modes without a second shift, and with
/// the values 0.6 and 0.65: bar of 100,000 rows 632, 440, 440; cube of 100,000 rows 672, 440, 520; tetrahedra of 64,000
/// rows 600, 521, 400.)
const SECOND_SHIFT_POSITION: f64 = 0.65;

/// Half the width of the range around [`SECOND_SHIFT_POSITION`] in which the widest gap is chosen, as a fraction of the
/// wanted modes. A larger value finds wider gaps farther from the best position.
const SECOND_SHIFT_WINDOW: f64 = 0.025;

/// Largest number of modes below the second shift, per wanted mode, with which that shift is used. With a larger value
/// the second shift may lie above all wanted modes.
const MAX_BELOW_SECOND_SHIFT: f64 = 1.2;

/// Largest backward error of the factor at the second shift: modes are requested to 1e-9 at the best. With a larger
/// value inaccurate factors leave their error in the modes.
const MAX_BACKWARD_ERROR: f64 = 1e-12;

/// Smallest number of wanted modes for a second shift: with fewer, a basis of as many vectors is a poor estimate.
const MIN_MODES_FOR_SECOND_SHIFT: usize = 40;

/// Estimated number of solved columns that a second shift saves per wanted mode. A larger value uses the second shift
/// for larger models.
const SAVED_COLUMNS_PER_MODE: f64 = 0.9;

/// Number of operations of a factorisation that take as long as one operation of solving and orthogonalising. A larger
/// value uses the second shift for larger models.
const FACTOR_OPERATION_SPEED: f64 = 1.4;

/// Factor at a shift among the modes, and the number of flexible modes below the shift.
struct SecondFactor<'a> {
    factor: Indefinite<'a>,
    below: usize,
}

impl<'a> SecondFactor<'a> {
    /// Factors at a shift in the widest gap among the Ritz values `eigenvalues` (ascending). Returns `None` if there is
    /// no gap, if the factor is inaccurate, or if too many or no modes lie below the shift.
    fn new(
        problem: &EigenProblem<'_>,
        analysis: &'a Analysis,
        eigenvalues: &[f64],
        wanted: usize,
        context: &Context<'_>,
    ) -> Option<Self> {
        let sigma = second_shift_at(eigenvalues, wanted)?;
        context.count(|work| work.factorizations += 1);
        let factor = Indefinite::new(analysis, &problem.pencil, sigma);
        let inertia = factor.inertia();
        let below = inertia.negative.checked_sub(problem.rigid.ncols())?;
        let is_good = inertia.zero == 0 && inertia.backward_error <= MAX_BACKWARD_ERROR;
        let is_useful = below > 0 && below as f64 <= MAX_BELOW_SECOND_SHIFT * wanted as f64;
        (is_good && is_useful).then_some(Self { factor, below })
    }
}

/// Returns the middle of the widest gap of `eigenvalues` near the [`SECOND_SHIFT_POSITION`] of the wanted modes; `None`
/// if there is no gap.
fn second_shift_at(eigenvalues: &[f64], wanted: usize) -> Option<f64> {
    let count_at = |fraction: f64| (fraction * wanted as f64).round() as usize;
    let (middle, window) = (count_at(SECOND_SHIFT_POSITION), count_at(SECOND_SHIFT_WINDOW).max(1));
    // Widest gap in the window around the best position.
    let near = eigenvalues.get(middle.checked_sub(window)?..=middle + window)?;
    let widest = near.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    let sigma = 0.5 * (widest[0] + widest[1]);
    (widest[0] > 0.0 && sigma > widest[0] && sigma < widest[1]).then_some(sigma)
}

/// Returns true when solving the columns that a second shift saves takes longer than its factor.
fn saves_time(task: &Task<'_>, wanted: usize) -> bool {
    let Task { problem, analysis, .. } = task;
    // Operations for one column: substitution with the factor and orthogonalisation.
    let vectors = problem.pencil.n() as f64 * basis_columns(wanted) as f64;
    let column = 4.0 * analysis.factor_len() as f64 + 8.0 * vectors;
    wanted >= MIN_MODES_FOR_SECOND_SHIFT
        && analysis.flops() < FACTOR_OPERATION_SPEED * SAVED_COLUMNS_PER_MODE * wanted as f64 * column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shift_is_in_the_widest_gap_near_its_place() {
        let mut eigenvalues: Vec<f64> = (0..200).map(f64::from).collect();
        // Wider gaps lie outside the searched range.
        eigenvalues[10..].iter_mut().for_each(|lambda| *lambda += 50.0);
        eigenvalues[118..].iter_mut().for_each(|lambda| *lambda += 2.0);
        assert_eq!(second_shift_at(&eigenvalues, 180), Some(168.5));
        assert_eq!(second_shift_at(&eigenvalues[..110], 180), None);
        assert_eq!(second_shift_at(&[1.0; 200], 200), None);
        assert_eq!(second_shift_at(&[-1.0; 200], 200), None);
    }
}

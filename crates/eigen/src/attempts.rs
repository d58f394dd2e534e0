//! The attempts by iterations: cycles without a factor, Lanczos with a factor in single precision, and Lanczos with
//! factors in double precision, with one shift below the modes or with a second shift among them.
//!
//! Cycles suit compact bodies, whose factor would take most of the time and of the memory.
//! Cycles, and a factor in single precision, find rough modes, which are corrected against the true K and M in double
//! precision until the true residuals keep the tolerance. The factor T of K + tau M in single precision is accurate to
//! about 1e-7 times its condition number, so that Lanczos on its operator finds the modes to 1e-2 or 1e-4. A correction
//! T r of the residual r = K x - lambda M x, with Rayleigh-Ritz on all vectors, gains that number of digits again for
//! one solved column. Refining every solve of Lanczos would cost several columns.
//!
//! In double precision with a shift below all modes the last modes converge slowest, and many modes take three columns
//! each. With a second shift among the modes they take two.

use super::correction::{Correction, Corrector, capacity_with_levels};
use super::failure::EigenFailure;
use super::lanczos::{Iteration, Outcome, columns_per_step};
use super::needs::{
    Needs, Unusable, basis_columns, factor_needs, made_of_modes, resident, search_seconds, vector_bytes,
};
use super::problem::{EigenProblem, Task};
use super::refine::{FoundModes, refine};
use super::search::{Attempt, Goal};
use super::settings::{Accuracy, FactorChoice, Method, Precision, Wanted};
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::multigrid::{can_have_levels, levels};
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{Analysis, Cholesky, Indefinite, Real, Solve, largest, largest_entry};

/// Largest number of modes that are searched for without a factor. With more, the products of all pairs of vectors take
/// longer than the solutions.
const MAX_MULTIGRID_MODES: usize = 100;

/// Bytes of all levels and of their construction per stored entry of K. Together with [`LEVEL_BYTES_PER_ROW`], a larger
/// value refuses cycles for models that would fit the memory.
const LEVEL_BYTES_PER_ENTRY: u64 = 12;

/// Bytes of all levels and of their construction per row of K, in addition to those of the entries.
const LEVEL_BYTES_PER_ROW: u64 = 400;

/// Approximate number of entries in a row of K of linear hexahedra.
const LINEAR_HEXAHEDRON_ROW_ENTRIES: f64 = 64.0;

/// Largest factor by which the stronger coupling of second-order elements raises the threshold, beside the coupling
/// itself. Hexahedra of second order have not been measured beyond it.
const MAX_THRESHOLD_FACTOR: f64 = 2.1;

/// Number of modes up to which the threshold is that of the settings. More modes raise the threshold: corrections take
/// more time the more modes they must be orthogonal to, while a factor is computed once. (Measured: equal times with 35
/// modes of a bar of 100,000 rows, with 80 of a cube, whose factor takes three times the operations.)
const UNRAISED_MODES: f64 = 28.0;

/// Cycles over levels of groups of nodes, without a factor.
pub(super) struct Cycles;

impl Attempt for Cycles {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        if !is_faster_than_factor(task, wanted) {
            return Err(Unusable::Unsuited);
        }
        let pencil = &task.problem.pencil;
        let (n, entries) = (pencil.n(), pencil.stiffness().as_csc().nnz() as u64);
        let levels = LEVEL_BYTES_PER_ENTRY * entries + LEVEL_BYTES_PER_ROW * n as u64;
        let needed = (levels + cycle_vector_bytes(n, wanted)).max(made_of_modes(n, wanted));
        if resident(needed) > task.context.available() {
            return Err(Unusable::Unsuited);
        }
        // Solutions are estimated like those with a factor of the size of K.
        let seconds = search_seconds(n, wanted, entries);
        Ok(Needs { bytes: resident(needed), factor_bytes: 0, seconds })
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        let Task { problem, context, .. } = task;
        context.phase("multigrid");
        let unsuited = || EigenFailure::NotConverged { converged: 0, wanted: goal.wanted };
        let levels = levels(&problem.pencil, problem.rigid, first_shift(problem)).ok_or_else(unsuited)?;
        context.phase("modes");
        let rough = levels.rough_modes(goal.wanted + guards(goal.wanted)).ok_or_else(unsuited)?;
        if rough.ncols() <= goal.wanted {
            return Err(unsuited());
        }
        Correction::begin(task, Corrector::Levels(&*levels), goal, rough, goal.wanted)?.modes()
    }

    /// Returns false: a failure of cycles does not concern the model, and another attempt may succeed.
    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        false
    }
}

/// Returns the number of vectors beside the wanted modes. Hexahedral cubes of 100,000 and 300,000 rows take 285 solved
/// columns for 20 modes with 8 of them, 258 with 16, 233 with 24, and the least time with 16.
fn guards(wanted: usize) -> usize {
    8 + 2 * wanted / 5
}

/// Returns true when cycles take less time than a factor.
fn is_faster_than_factor(task: &Task<'_>, wanted: usize) -> bool {
    let Task { problem, settings, analysis, .. } = task;
    let entries = problem.pencil.stiffness().as_csc().nnz() as f64;
    // Elements of the second order couple more rows, and take more cycles. (Measured: tetrahedra of 100,000 rows, which
    // couple a quarter more, take twice the time of a factor.)
    let coupled = (entries / (problem.pencil.n() as f64 * LINEAR_HEXAHEDRON_ROW_ENTRIES)).max(1.0);
    let many = (wanted as f64 / UNRAISED_MODES).max(1.0);
    let threshold = settings.multigrid_pays * many * coupled * coupled.powi(2).min(MAX_THRESHOLD_FACTOR);
    settings.accuracy != Accuracy::Certified
        && settings.factor == FactorChoice::Auto
        && settings.method == Method::Auto
        && matches!(settings.wanted, Wanted::Lowest(_))
        && can_have_levels(&problem.pencil, problem.rigid.ncols())
        && (1..=MAX_MULTIGRID_MODES).contains(&wanted)
        && analysis.flops() > threshold * entries
}

/// Returns the bytes of the vectors: the span with its products with K and M; and for each vector of the start a
/// product, a force, a correction, and the copies in single precision that cycles use. All other memory of cycles is
/// less than what was in use before and has been released.
fn cycle_vector_bytes(n: usize, wanted: usize) -> u64 {
    let base = wanted + guards(wanted);
    8 * (n * (3 * capacity_with_levels(base) + 4 * base)) as u64
}

/// Columns per step of Lanczos: the number that the solves handle together. In single precision four columns cost as
/// much as eight.
const COLUMNS_PER_STEP: usize = 8;

/// Ritz residual at which the corrections take over: further steps find no modes that the error of the factor does not
/// hide.
const HANDOVER_RESIDUAL: f64 = 1e-4;

/// Lanczos with a factor in single precision, and corrections.
pub(super) struct SinglePrecision;

impl Attempt for SinglePrecision {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        let settings = task.settings;
        let pays = match settings.factor {
            _ if settings.accuracy == Accuracy::Certified => false,
            FactorChoice::Always(precision) => precision == Precision::Single,
            FactorChoice::Auto => {
                task.analysis.flops() > settings.single_pays || DoublePrecision.needs(task, wanted).is_err()
            }
        };
        if pays { factor_needs(task, wanted, Precision::Single) } else { Err(Unusable::Unsuited) }
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        let rough = Goal { tolerance: HANDOVER_RESIDUAL, ..*goal };
        with_suited_shift(task, |factor: Cholesky<'_, f32>| {
            let mut iteration =
                Iteration::begin(task.problem, &factor, &rough, COLUMNS_PER_STEP, task.context);
            let ritz = match iteration.estimate(&factor)? {
                Outcome::Reached(ritz) => ritz,
                Outcome::ShiftTooLarge(shift) => return Ok(Outcome::ShiftTooLarge(shift)),
            };
            if iteration.is_complete() {
                return iteration.find_from(ritz, &factor);
            }
            let (vectors, wanted) = (iteration.rough_modes(&ritz), ritz.last());
            drop(iteration);
            let factor: &dyn Solve = &factor;
            Correction::begin(task, Corrector::Factor(factor), goal, vectors, wanted)?
                .modes()
                .map(Outcome::Reached)
        })
    }

    /// Returns false: a failure with this factor often comes from its precision, and does not concern the model.
    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        false
    }
}

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
        if task.settings.accuracy == Accuracy::Certified || !second_shift_saves_time(task, wanted) {
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
    let widest = first_largest(near.windows(2), |pair| pair[1] - pair[0])?;
    let sigma = 0.5 * (widest[0] + widest[1]);
    (widest[0] > 0.0 && sigma > widest[0] && sigma < widest[1]).then_some(sigma)
}

/// Returns true when solving the columns that a second shift saves takes longer than its factor.
fn second_shift_saves_time(task: &Task<'_>, wanted: usize) -> bool {
    let Task { problem, analysis, .. } = task;
    // Operations for one column: substitution with the factor and orthogonalisation.
    let vectors = problem.pencil.n() as f64 * basis_columns(wanted) as f64;
    let column = 4.0 * analysis.factor_len() as f64 + 8.0 * vectors;
    wanted >= MIN_MODES_FOR_SECOND_SHIFT
        && analysis.flops() < FACTOR_OPERATION_SPEED * SAVED_COLUMNS_PER_MODE * wanted as f64 * column
}

/// Relative difference of lambda and the Rayleigh quotient of a mode up to which the mode counts as converged.
pub const SAME_EIGENVALUE: f64 = 1e-6;

/// Ratio of the first shift of a search to the upper bound of the first flexible eigenvalue. A smaller shift costs
/// digits of the last modes, a larger one more steps.
pub const FIRST_SHIFT: f64 = 0.3;

/// Returns the shift tau with which an iterative search begins.
fn first_shift(problem: &EigenProblem<'_>) -> f64 {
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
fn with_suited_shift<T: Real>(
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

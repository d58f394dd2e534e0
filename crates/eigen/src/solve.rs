//! The entry point of the eigen-solver: plans, searches, counts, and puts the modes into canonical form.

use super::bounds::{EigenvalueBounds, enclose};
use super::canonical::{CLUSTER_GAP, canonical_basis, clusters};
use super::count::{Completeness, CountPlan, Counting, Proof, SINGLE_COUNT_DISTANCE, count, is_near};
use super::failure::EigenFailure;
use super::needs::gigabytes;
use super::plan::{Plan, PlannedAttempt, Way};
use super::problem::{EigenProblem, Task};
use super::refine::{FoundModes, Refined, check_zero_energy, keeps};
use super::search::Goal;
use super::settings::{Accuracy, EigenSettings, Wanted};
use super::solution::EigenSolution;
use flexbody_linalg::context::Context;
use flexbody_linalg::{Analysis, is_positive_semidefinite};
use std::ops::Range;
use std::sync::Arc;

/// Part of the guaranteed residual that the search aims at. The canonical basis of an eigenvalue with m copies mixes
/// their residuals, up to the root of m times the largest.
const SEARCH_RESIDUAL_FRACTION: f64 = 0.4;

/// Gap of eigenvalues that a count in single precision needs, over [`SINGLE_COUNT_DISTANCE`]. The shift is in the
/// middle of the gap, which gives a factor of 2; a fifth more, since the gap is not known yet.
const SINGLE_COUNT_GAP: f64 = 2.4;

/// Largest number of searches for the same modes: a second one follows if the count finds missing modes.
const MAX_SEARCHES: usize = 2;

/// Computes the wanted flexible modes.
///
/// # Errors
/// [`EigenFailure`] with the reason why no trustworthy modes exist.
pub fn solve(
    problem: &EigenProblem<'_>,
    settings: &EigenSettings,
    context: &Context<'_>,
) -> Result<EigenSolution, EigenFailure> {
    // Structure of the factors, and the plan of attempts.
    let analysis = analyse(problem, context)?;
    let task = Task::new(problem, settings, &analysis, context);
    let wanted = wanted_count(&task)?;
    let mut plan = Plan::new(&task, wanted)?;
    // Modes with the proof that none is missing, and their guaranteed bounds.
    let (found, completeness) = find_all(&task, &mut plan, wanted)?;
    let bounds = bounds(&task, &found.refined, &completeness)?;
    context.count(|work| work.factor_bytes = plan.current().needs.factor_bytes);
    finish(&task, found, completeness, bounds, wanted, plan)
}

/// Returns the plan of [`solve`] without a search. A request for all flexible modes below an eigenvalue counts as
/// [`EigenSettings::DEFAULT_COUNT`] modes.
///
/// # Errors
/// [`EigenFailure`] of the analysis, or the failure that no attempt fits the limits of the context.
pub fn plan(
    problem: &EigenProblem<'_>,
    settings: &EigenSettings,
    context: &Context<'_>,
) -> Result<Plan, EigenFailure> {
    let analysis = analyse(problem, context)?;
    let task = Task::new(problem, settings, &analysis, context);
    let wanted = match settings.wanted {
        Wanted::Lowest(count) => count.min(task.flexible_rows()),
        Wanted::Below(_) => EigenSettings::DEFAULT_COUNT,
    };
    Plan::new(&task, wanted)
}

/// Computes the elimination order, and checks that M is positive semidefinite.
fn analyse(problem: &EigenProblem<'_>, context: &Context<'_>) -> Result<Arc<Analysis>, EigenFailure> {
    context.phase("ordering");
    let analysis = problem.analysis().ok_or(EigenFailure::TooLarge)?;
    context.count(|work| {
        work.factor_len = analysis.factor_len() as u64;
        work.factor_flops = analysis.flops() as u64;
    });
    if !is_positive_semidefinite(&problem.pencil, &analysis) {
        return Err(EigenFailure::MassIndefinite);
    }
    Ok(analysis)
}

/// Returns the number of wanted modes, at most the number of flexible modes.
fn wanted_count(task: &Task<'_>) -> Result<usize, EigenFailure> {
    match task.settings.wanted {
        Wanted::Lowest(count) => Ok(count.min(task.flexible_rows())),
        Wanted::Below(lambda) => {
            task.context.phase("counting modes");
            let counting = CountPlan::new(task, 0).counting.unwrap_or(Counting::Double);
            let below = count(task, lambda, counting)?.below;
            Ok(below.saturating_sub(task.problem.rigid.ncols()))
        }
    }
}

/// Searches and counts until no mode is missing. If modes are missing, the search is repeated from other random
/// vectors, for as many more modes as the count found missing.
fn find_all(
    task: &Task<'_>,
    plan: &mut Plan,
    wanted: usize,
) -> Result<(FoundModes, Completeness), EigenFailure> {
    let rigid = task.problem.rigid.ncols();
    let (mut requested, mut round) = (wanted, 0);
    loop {
        // Search, then count the modes below a shift above the last one.
        let found = search(task, plan, requested, round)?;
        let completeness = prove(task, plan, &found)?;
        let (found_below, counted) = (completeness.modes_below, completeness.counted(rigid));
        round += 1;
        if found_below == counted {
            return Ok((found, completeness));
        }
        // More modes than counted, or still missing modes, cannot be repaired.
        if found_below > counted || round == MAX_SEARCHES {
            return Err(EigenFailure::CountDiffers {
                found: found_below,
                counted,
                shift: completeness.shift,
            });
        }
        // The next search asks for the missing modes as well.
        requested = wanted + counted - found_below;
    }
}

/// Makes the attempts of the plan in their order until one of them finds the modes.
fn search(task: &Task<'_>, plan: &mut Plan, wanted: usize, round: usize) -> Result<FoundModes, EigenFailure> {
    let Task { problem, settings, context, .. } = task;
    // The goal is stricter than the guarantee, and asks for a gap wide enough for a count in single precision.
    let tolerance = SEARCH_RESIDUAL_FRACTION * settings.accuracy.residual();
    let separation = match plan.count.counting {
        Some(Counting::Single { .. }) => SINGLE_COUNT_GAP * SINGLE_COUNT_DISTANCE,
        _ => 0.0,
    };
    let goal = Goal { wanted, tolerance, separation, round };
    let mut failed = None;
    for number in 0..plan.attempts.len() {
        let PlannedAttempt { way, failure, .. } = &plan.attempts[number];
        let (way, attempt) = (*way, way.attempt());
        // Skip attempts that failed before, and those that would only repeat themselves.
        if failure.is_some() || (round > 0 && !attempt.is_repeated()) {
            continue;
        }
        if way != Way::Dense {
            context.plan(&plan.to_string());
        }
        match attempt.search(task, &goal) {
            // Modes: sharpen their residuals and refuse those without strain energy.
            Ok(found) => {
                let refined = found.refined.sharpened(problem, tolerance, context);
                check_zero_energy(problem, &refined)?;
                return Ok(FoundModes { refined, ..found });
            }
            Err(failure) if attempt.is_conclusive(&failure) => return Err(failure),
            Err(failure) => {
                plan.attempts[number].failure = Some(failure.to_string());
                failed = Some((way, failure));
            }
        }
    }
    Err(match (failed, plan.refused.clone()) {
        (Some((Way::SinglePrecision, failure)), _) => EigenFailure::SinglePrecision(Box::new(failure)),
        // The next attempt would not fit the limits of the context.
        (_, Some(refused)) => refused,
        (Some((_, failure)), None) => failure,
        (None, None) => EigenFailure::NotConverged { converged: 0, wanted },
    })
}

/// Returns guaranteed bounds of the counted eigenvalues at [`Accuracy::Certified`]; `None` at other accuracies.
fn bounds(
    task: &Task<'_>,
    refined: &Refined,
    completeness: &Completeness,
) -> Result<Option<EigenvalueBounds>, EigenFailure> {
    let found = completeness.modes_below;
    if task.settings.accuracy != Accuracy::Certified || found == 0 {
        return Ok(None);
    }
    task.context.phase("bounds");
    let modes = refined.vectors.as_ref().subcols(0, found);
    enclose(task, modes, &refined.eigenvalues[..found], completeness.shift, CLUSTER_GAP).map(Some)
}

/// Counts the modes below a shift in the gap above the last one, unless there is no count.
fn prove(task: &Task<'_>, plan: &Plan, search: &FoundModes) -> Result<Completeness, EigenFailure> {
    let Task { problem, settings, context, .. } = task;
    let found = search.refined.eigenvalues.len();
    let last = search.refined.eigenvalues.last().copied().unwrap_or(0.0);
    let shift = match (settings.wanted, search.next.first()) {
        (Wanted::Below(lambda), _) => lambda,
        (_, Some(&next)) if found == 0 => 0.5 * next,
        (_, Some(&next)) => 0.5 * (last + next),
        // No eigenvalue above: every finite mode was computed.
        (_, None) => 1.1 * last,
    };
    // Without a count the modes are returned unproved, with the reason.
    let remark = match plan.count.too_large {
        _ if settings.accuracy == Accuracy::Fast => Some("accuracy `fast` leaves the count out".to_owned()),
        Some((needed, available)) => Some(format!(
            "the count needs {} of memory, {} are available",
            gigabytes(needed),
            gigabytes(available)
        )),
        None => None,
    };
    if let Some(remark) = remark {
        let proof = Proof::NotProved;
        return Ok(Completeness { proof, shift, negative_pivots: None, modes_below: found, remark });
    }
    context.phase("completeness");
    let below = search.refined.eigenvalues.iter().filter(|&&l| l < shift).count();
    // Count in double precision if the shift is too near to a mode for single precision.
    let counting = match plan.count.counting {
        Some(Counting::Single { double_fits: true }) if is_near(problem, &search.refined, shift) => {
            Counting::Double
        }
        counting => counting.unwrap_or(Counting::Double),
    };
    // The inertia of K - shift M.
    let count = count(task, shift, counting)?;
    Ok(Completeness {
        proof: Proof::InertiaCount,
        shift,
        negative_pivots: Some(count.below),
        modes_below: below,
        remark: count.remark(),
    })
}

/// Puts the modes into canonical form, and returns the wanted ones with their final residuals.
fn finish(
    task: &Task<'_>,
    search: FoundModes,
    completeness: Completeness,
    mut bounds: Option<EigenvalueBounds>,
    wanted: usize,
    plan: Plan,
) -> Result<EigenSolution, EigenFailure> {
    let mut modes = search.refined;
    // Canonical basis of every cluster, and eigenvalues within their bounds.
    let groups = clusters(&modes.eigenvalues, CLUSTER_GAP);
    canonical_basis(modes.vectors.as_mut(), &groups);
    if let Some(bounds) = &bounds {
        bounds.clamp(&mut modes.eigenvalues);
    }
    // Rotated or moved modes get new residuals.
    let is_changed = |group: &Range<usize>| bounds.is_some() || group.len() > 1;
    let changed: Vec<usize> = groups.into_iter().filter(is_changed).flatten().collect();
    modes.renew(task.problem, &changed, task.context);
    let Refined { eigenvalues, mut vectors, residuals, floors } = modes;
    // Every mode keeps the guaranteed residual.
    let tolerance = task.settings.accuracy.residual();
    let is_converged = |i: &usize| keeps(residuals[*i], floors[*i], tolerance);
    let converged = (0..eigenvalues.len()).filter(is_converged).count();
    if converged < eigenvalues.len() {
        return Err(EigenFailure::NotConverged { converged, wanted });
    }
    // Modes that only complete the last cluster are left out.
    let given = wanted.min(eigenvalues.len());
    let next_eigenvalue = eigenvalues.get(given).copied().or(search.next.first().copied());
    vectors.truncate(vectors.nrows(), given);
    if let Some(bounds) = &mut bounds {
        for column in [&mut bounds.lower, &mut bounds.upper, &mut bounds.shape_error] {
            column.truncate(given);
        }
    }
    let dense = plan.current().way == Way::Dense;
    Ok(EigenSolution {
        plan: (!dense).then_some(plan),
        bounds,
        eigenvalues: eigenvalues[..given].to_vec(),
        vectors,
        residuals: residuals[..given].to_vec(),
        rounding_floors: floors[..given].to_vec(),
        completeness,
        next_eigenvalue,
        finite_modes: search.finite,
        shift: search.tau,
    })
}

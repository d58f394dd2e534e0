//! The one entry: chooses the method, refines, counts, puts into canonical form.

use super::bounds::enclose;
use super::canonical::{CLUSTER_GAP, canonical_basis, cluster_end, clusters};
use super::completeness::{Completeness, Counting, NEAR, Proof, count, size_along};
use super::counters::Counters;
use super::dense;
use super::factorise::{Attempt, factorise, with_suited_shift};
use super::failure::EigenFailure;
use super::lanczos::{self, Goal, LanczosOutcome, columns_per_step};
use super::plan::{CountPlan, Multigrid, Plan, gigabytes};
use super::problem::EigenProblem;
use super::refine::{FoundModes, Refined, refine};
use super::resume::Snapshot;
use super::second_shift::SecondShift;
use super::settings::{Accuracy, EigenSettings, FactorChoice, Method, Precision, Wanted, keeps};
use super::single;
use super::solution::{EigenSolution, EigenvalueBounds};
use super::start::{first_shift, fitting_start};
use super::without_factor;
use super::zero_energy::check_zero_energy;
use faer::Mat;
use flexbody_linalg::progress::{Event, Watch};
use flexbody_linalg::{Analysis, Cholesky, Solve, is_positive_semidefinite};
use std::cell::Cell;
use std::ops::Range;
use std::sync::Arc;

/// Models up to this size are solved densely: all modes take less than a second.
const DENSE_ALWAYS: usize = 600;

/// Largest model that is solved densely because most of its modes are wanted (n^2 numbers, three times).
const DENSE_AT_MOST: usize = 9000;

/// Part of all modes beyond which the dense path does less work than a Krylov basis of twice that size.
const DENSE_PART: f64 = 0.2;

/// Part of the shift of a dense eigenproblem below which a shift among the wanted modes is worth another one:
/// a digit.
const FAR: f64 = 0.1;

/// Part of the promised residual that the search aims at: the canonical basis of an eigenvalue with m copies
/// mixes their residuals, up to the root of m times the largest.
const SEARCHED: f64 = 0.4;

/// Computes the wanted flexible modes.
///
/// # Errors
/// [`EigenFailure`] says why no trustworthy modes exist.
pub fn solve(
    problem: &EigenProblem<'_>,
    settings: &EigenSettings,
    watch: Watch<'_>,
) -> Result<EigenSolution, EigenFailure> {
    let mut counters = Counters::default();
    let analysis = analyse(problem, watch, &mut counters)?;
    let wanted = count_wanted(problem, settings, &analysis, watch, &mut counters)?;
    let dense = is_dense(problem, settings, wanted);
    let plan = Plan::new(problem, settings, &analysis, wanted, dense)?;
    let tolerance = SEARCHED * settings.accuracy.residual();
    let mut sparse = Sparse { problem, settings, analysis: &analysis, plan };
    let (search, finite_modes) = if dense {
        let (search, finite) = search_densely(problem, wanted, tolerance, watch, &mut counters)?;
        (search, Some(finite))
    } else {
        watch(Event::Plan(&sparse.plan.to_string()));
        (sparse.search(wanted, 0, watch, &mut counters)?, None)
    };
    let (search, completeness) = complete(&mut sparse, search, wanted, watch, &mut counters)?;
    let bounds = bounds(&sparse, &search, &completeness, watch, &mut counters)?;
    let plan = (!dense).then_some(sparse.plan);
    finish(
        problem,
        search,
        (completeness, bounds),
        (wanted, settings.accuracy.residual()),
        (plan, finite_modes),
        counters,
    )
}

/// Bytes that [`solve`] holds at the most, by its plan; all flexible modes below an eigenvalue count as
/// [`EigenSettings::DEFAULT_COUNT`].
///
/// # Errors
/// [`EigenFailure`] of the analysis.
pub fn planned_bytes(
    problem: &EigenProblem<'_>,
    settings: &EigenSettings,
    watch: Watch<'_>,
) -> Result<u64, EigenFailure> {
    let analysis = analyse(problem, watch, &mut Counters::default())?;
    let wanted = match settings.wanted {
        Wanted::Lowest(count) => count.min(flexible_rows(problem)),
        Wanted::Below(_) => EigenSettings::DEFAULT_COUNT,
    };
    let free = EigenSettings { memory: None, longest: None, ..*settings };
    Plan::new(problem, &free, &analysis, wanted, is_dense(problem, settings, wanted)).map(|plan| plan.bytes)
}

/// The order of elimination, and whether M is a mass at all.
fn analyse(
    problem: &EigenProblem<'_>,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<Arc<Analysis>, EigenFailure> {
    watch(Event::Phase("ordering"));
    let analysis = problem.analysis().ok_or(EigenFailure::TooLarge)?;
    counters.factor_len = analysis.factor_len() as u64;
    counters.factor_flops = analysis.flops() as u64;
    if !is_positive_semidefinite(&problem.pencil, &analysis) {
        return Err(EigenFailure::MassIndefinite);
    }
    Ok(analysis)
}

/// How many modes are wanted, of those that there may be.
fn count_wanted(
    problem: &EigenProblem<'_>,
    settings: &EigenSettings,
    analysis: &Analysis,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<usize, EigenFailure> {
    match settings.wanted {
        Wanted::Lowest(count) => Ok(count.min(flexible_rows(problem))),
        Wanted::Below(lambda) => {
            watch(Event::Phase("counting modes"));
            let counting =
                CountPlan::new(problem, settings, analysis, 0).counting.unwrap_or(Counting::Double);
            let below = count(problem, analysis, lambda, counting, counters)?.below;
            Ok(below.saturating_sub(problem.rigid.ncols()))
        }
    }
}

/// As many modes as there are beside rigid motion, at the most.
fn flexible_rows(problem: &EigenProblem<'_>) -> usize {
    problem.pencil.n() - problem.rigid.ncols()
}

/// Whether the dense path finds so many modes with less work, or was asked for.
fn is_dense(problem: &EigenProblem<'_>, settings: &EigenSettings, wanted: usize) -> bool {
    let n = problem.pencil.n();
    let most = || wanted as f64 > DENSE_PART * flexible_rows(problem) as f64;
    match settings.method {
        Method::Dense => true,
        Method::Lanczos => false,
        Method::Auto => n <= DENSE_ALWAYS || (n <= DENSE_AT_MOST && most()),
    }
}

/// The proof that no mode is missing; where one is, it is searched for once more, from other directions and
/// for as many modes as there are.
fn complete(
    sparse: &mut Sparse<'_>,
    mut search: FoundModes,
    wanted: usize,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<(FoundModes, Completeness), EigenFailure> {
    let rigid = sparse.problem.rigid.ncols();
    let mut completeness = prove(sparse, &search, watch, counters)?;
    let missed = completeness.counted(rigid).saturating_sub(completeness.modes_below);
    if missed > 0 {
        search = sparse.search(wanted + missed, 1, watch, counters)?;
        completeness = prove(sparse, &search, watch, counters)?;
    }
    let (found, counted) = (completeness.modes_below, completeness.counted(rigid));
    if found != counted {
        return Err(EigenFailure::CountDiffers { found, counted, shift: completeness.shift });
    }
    Ok((search, completeness))
}

/// Guaranteed bounds of the eigenvalues that were counted, where they are asked for.
fn bounds(
    sparse: &Sparse<'_>,
    search: &FoundModes,
    completeness: &Completeness,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<Option<EigenvalueBounds>, EigenFailure> {
    let Sparse { problem, settings, analysis, .. } = sparse;
    let found = completeness.modes_below;
    if settings.accuracy != Accuracy::Certified || found == 0 {
        return Ok(None);
    }
    watch(Event::Phase("bounds"));
    let Refined { vectors, eigenvalues, .. } = &search.refined;
    let modes = vectors.as_ref().subcols(0, found);
    enclose(problem, analysis, modes, &eigenvalues[..found], completeness.shift, CLUSTER_GAP, counters)
        .map(Some)
}

fn search_densely(
    problem: &EigenProblem<'_>,
    wanted: usize,
    tolerance: f64,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<(FoundModes, usize), EigenFailure> {
    watch(Event::Phase("dense eigenproblem"));
    let pencil = &problem.pencil;
    let finite = dense::finite_eigenvalues(pencil).ok_or(EigenFailure::MassIndefinite)?;
    let flexible = finite.saturating_sub(problem.rigid.ncols());
    let mean = dense::shift(problem.first_estimate, dense::highest_estimate(pencil));
    let mut spectrum = dense::Spectrum::new(problem, mean)?;
    let end =
        |spectrum: &dense::Spectrum| cluster_end(wanted, flexible, CLUSTER_GAP, |i| spectrum.eigenvalue(i));
    let mut last = end(&spectrum);
    // Far above the wanted modes a shift crowds them together, which costs the digits by which they differ.
    // Once it is known where they are, another is placed between them, if that matrix can be factored.
    let highest = if last > 0 { spectrum.eigenvalue(last - 1) } else { mean };
    let among = dense::shift(problem.first_estimate.min(highest), highest);
    if among < FAR * mean
        && let Ok(closer) = dense::Spectrum::new(problem, among)
    {
        spectrum = closer;
        last = end(&spectrum);
    }
    let tau = spectrum.factor.shift();
    let found = Refined::new(problem, spectrum.vectors(last), counters)?;
    let refined = refine(problem, &spectrum.factor, found, tolerance, counters)?;
    let refined = refined.sharpened(problem, tolerance, counters);
    check_zero_energy(problem, &refined)?;
    problem.resume.save(|| Snapshot {
        // That of an iterative search: it may go on from here when other modes are wanted.
        shift: first_shift(problem, None),
        eigenvalues: refined.eigenvalues.clone(),
        basis: refined.vectors.clone(),
        coupling: Mat::zeros(0, last),
        converged: last,
    });
    let next = (last..flexible).map(|i| spectrum.eigenvalue(i)).collect();
    Ok((FoundModes { refined, next, tau }, flexible))
}

/// The iterative search and what it goes by.
struct Sparse<'a> {
    problem: &'a EigenProblem<'a>,
    settings: &'a EigenSettings,
    analysis: &'a Analysis,
    plan: Plan,
}

impl Sparse<'_> {
    /// Searches by the plan. Where cycles over levels do not converge, with a factor; from single precision
    /// back to double where that fails, if that fits.
    fn search(
        &mut self,
        wanted: usize,
        attempt: u64,
        watch: Watch<'_>,
        counters: &mut Counters,
    ) -> Result<FoundModes, EigenFailure> {
        let Self { problem, analysis, .. } = *self;
        let tolerance = SEARCHED * self.settings.accuracy.residual();
        // The shift of the count is in the middle of the gap; a fifth more, since the gap is not known yet.
        let separation = match self.plan.counting {
            Some(Counting::Single { .. }) => 2.4 * NEAR,
            _ => 0.0,
        };
        let goal = Goal {
            wanted,
            tolerance,
            cluster_gap: CLUSTER_GAP,
            separation,
            block: columns_per_step(wanted),
            rough: false,
            second_shift: self.plan.second_shift && attempt == 0,
            attempt,
        };
        let mut found = self.search_without_factor(&goal, watch, counters)?;
        if found.is_none() {
            found = self.search_in_single(&goal, watch, counters)?;
        }
        let FoundModes { refined, next, tau } = match found {
            Some(found) => found,
            None => search_in_double(problem, analysis, &goal, watch, counters)?,
        };
        counters.factor_bytes = self.plan.factor_bytes;
        let refined = refined.sharpened(problem, tolerance, counters);
        check_zero_energy(problem, &refined)?;
        Ok(FoundModes { refined, next, tau })
    }

    /// `None` where the plan has a factor, as it has after a search without one that failed.
    fn search_without_factor(
        &mut self,
        goal: &Goal,
        watch: Watch<'_>,
        counters: &mut Counters,
    ) -> Result<Option<FoundModes>, EigenFailure> {
        if self.plan.multigrid != Multigrid::Used {
            return Ok(None);
        }
        if let Ok(found) = without_factor::search(self.problem, goal, watch, counters) {
            return Ok(Some(found));
        }
        let plan = Plan::with_factor(self.problem, self.settings, self.analysis, goal.wanted, false)?;
        self.plan = Plan { multigrid: Multigrid::Failed, ..plan };
        watch(Event::Plan(&self.plan.to_string()));
        Ok(None)
    }

    /// `None` where the plan is in double precision, as it is after a search in single that failed.
    fn search_in_single(
        &mut self,
        goal: &Goal,
        watch: Watch<'_>,
        counters: &mut Counters,
    ) -> Result<Option<FoundModes>, EigenFailure> {
        let Self { problem, settings, analysis, plan } = self;
        if plan.precision == Precision::Double {
            return Ok(None);
        }
        let failure = match single::search(problem, analysis, goal, watch, counters) {
            Ok(found) => return Ok(Some(found)),
            Err(failure) => failure,
        };
        let double = match settings.factor {
            FactorChoice::Auto => Plan::in_double(problem, settings, analysis, goal.wanted).ok(),
            FactorChoice::Always(_) => None,
        };
        let double = double.ok_or_else(|| EigenFailure::SinglePrecision(Box::new(failure)))?;
        *plan = Plan { single_failed: true, multigrid: plan.multigrid, ..double };
        Ok(None)
    }
}

fn search_in_double(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    goal: &Goal,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<FoundModes, EigenFailure> {
    let start = fitting_start(problem, goal.attempt);
    let may_change = Cell::new(goal.second_shift);
    let search = |factor: Cholesky<'_, f64>, start: Option<&Snapshot>, counters: &mut Counters| {
        let goal = &Goal { second_shift: may_change.get(), ..*goal };
        match lanczos::lowest_modes(problem, &factor, goal, start, watch, counters)? {
            LanczosOutcome::Found { modes, next } => {
                Ok(Attempt::Done((refine(problem, &factor, modes, goal.tolerance, counters)?, next)))
            }
            LanczosOutcome::Midway(iteration) => {
                may_change.set(false);
                let tau = factor.shift();
                let found = with_second_shift(problem, analysis, *iteration, (factor, goal), counters);
                Ok(found.map_or(Attempt::Anew(tau), Attempt::Done))
            }
            LanczosOutcome::ShiftTooLarge(shift) => Ok(Attempt::Anew(shift)),
            LanczosOutcome::Rough { .. } => unreachable!("not asked for"),
        }
    };
    let ((refined, next), tau) = with_suited_shift(problem, analysis, start, watch, counters, search)?;
    Ok(FoundModes { refined, next, tau })
}

/// Goes on with a second shift, whose factor takes the place of `first`; `None` where that does not find modes that keep
/// the tolerance.
fn with_second_shift(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    mut iteration: lanczos::Iteration<'_>,
    (first, goal): (Cholesky<'_, f64>, &Goal),
    counters: &mut Counters,
) -> Option<(Refined, Vec<f64>)> {
    let midway = iteration.look_midway(counters).ok()?;
    let tau = first.shift();
    drop(first);
    let again = |counters: &mut Counters| factorise::<f64>(problem, analysis, tau, counters).ok();
    let found = match SecondShift::new(problem, analysis, &midway.eigenvalues, goal.wanted, counters) {
        Some(second) => {
            iteration.change_shift(midway, &second, counters);
            iteration.run(&second.factor, counters)
        }
        None => iteration.run(&again(counters)?, counters),
    };
    let LanczosOutcome::Found { mut modes, next } = found.ok()? else { return None };
    if modes.excess(goal.tolerance) > 1.0 {
        modes = refine(problem, &again(counters)?, modes, goal.tolerance, counters).ok()?;
    }
    (modes.excess(goal.tolerance) <= 1.0).then_some((modes, next))
}

/// The inertia count in the gap above the last mode.
fn prove(
    sparse: &Sparse<'_>,
    search: &FoundModes,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<Completeness, EigenFailure> {
    let Sparse { problem, settings, analysis, plan } = sparse;
    let found = search.refined.eigenvalues.len();
    let last = search.refined.eigenvalues.last().copied().unwrap_or(0.0);
    let shift = match (settings.wanted, search.next.first()) {
        (Wanted::Below(lambda), _) => lambda,
        (_, Some(&next)) if found == 0 => 0.5 * next,
        (_, Some(&next)) => 0.5 * (last + next),
        // Nothing above: every finite mode was computed.
        (_, None) => 1.1 * last,
    };
    let remark = match plan.proof_too_large {
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
    watch(Event::Phase("completeness"));
    let below = search.refined.eigenvalues.iter().filter(|&&l| l < shift).count();
    let counting = match plan.counting {
        Some(Counting::Single { double_fits: true }) if is_near(problem, &search.refined, shift) => {
            Counting::Double
        }
        counting => counting.unwrap_or(Counting::Double),
    };
    let count = count(problem, analysis, shift, counting, counters)?;
    Ok(Completeness {
        proof: Proof::InertiaCount,
        shift,
        negative_pivots: Some(count.below),
        modes_below: below,
        remark: count.remark(),
    })
}

/// Whether the shift is so near to the last mode below it, for the size of the matrix along this mode, that
/// the rounding of a factor in single precision is likely to move one across the other.
fn is_near(problem: &EigenProblem<'_>, found: &Refined, shift: f64) -> bool {
    let Some(last) = found.eigenvalues.iter().rposition(|&lambda| lambda < shift) else { return false };
    shift - found.eigenvalues[last] < NEAR * size_along(problem, shift, found.vectors.col(last))
}

/// Canonical form, the wanted number of modes, residuals of what is handed out.
fn finish(
    problem: &EigenProblem<'_>,
    search: FoundModes,
    (completeness, mut bounds): (Completeness, Option<EigenvalueBounds>),
    (wanted, tolerance): (usize, f64),
    (plan, finite_modes): (Option<Plan>, Option<usize>),
    mut counters: Counters,
) -> Result<EigenSolution, EigenFailure> {
    let mut modes = search.refined;
    let groups = clusters(&modes.eigenvalues, CLUSTER_GAP);
    canonical_basis(modes.vectors.as_mut(), &groups);
    if let Some(bounds) = &bounds {
        bounds.clamp(&mut modes.eigenvalues);
    }
    let is_changed = |group: &Range<usize>| bounds.is_some() || group.len() > 1;
    let changed: Vec<usize> = groups.into_iter().filter(is_changed).flatten().collect();
    modes.renew(problem, &changed, &mut counters);
    let Refined { eigenvalues, mut vectors, residuals, floors } = modes;
    let kept = |i: &usize| keeps(residuals[*i], floors[*i], tolerance);
    let converged = (0..eigenvalues.len()).filter(kept).count();
    if converged < eigenvalues.len() {
        return Err(EigenFailure::NotConverged { converged, wanted });
    }
    let given = wanted.min(eigenvalues.len());
    let next_eigenvalue = eigenvalues.get(given).copied().or(search.next.first().copied());
    vectors.truncate(vectors.nrows(), given);
    if let Some(bounds) = &mut bounds {
        for column in [&mut bounds.lower, &mut bounds.upper, &mut bounds.shape_error] {
            column.truncate(given);
        }
    }
    Ok(EigenSolution {
        plan,
        bounds,
        eigenvalues: eigenvalues[..given].to_vec(),
        vectors,
        residuals: residuals[..given].to_vec(),
        rounding_floors: floors[..given].to_vec(),
        completeness,
        next_eigenvalue,
        finite_modes,
        shift: search.tau,
        counters,
    })
}

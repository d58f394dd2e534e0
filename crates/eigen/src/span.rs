//! The modes of a given subspace: Rayleigh-Ritz, canonical form, true residuals, and an inertia count of the modes that
//! are eigenvectors. A factorisation is made for this count only.

use super::bounds::enclose;
use super::canonical::{CLUSTER_GAP, canonical_basis, clusters};
use super::count::{Completeness, Proof, count_below};
use super::failure::EigenFailure;
use super::needs::{factor_needs, gigabytes, resident_for_count};
use super::problem::{EigenProblem, Task};
use super::refine::{Refined, check_zero_energy, keeps};
use super::settings::{Accuracy, EigenSettings, Precision, Wanted};
use super::solution::EigenSolution;
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::is_positive_semidefinite;

/// Distances of the count's shift from the last eigenvector, relative to its eigenvalue. The second is used if the
/// count with the first is too large, since the additional modes may lie beyond the given ones.
const SHIFT_DISTANCES: [f64; 2] = [1e-3, 1e-5];

/// Returns the modes of the body in the span of `basis` (N x k, nearly M-orthonormal): mass-normalised Ritz vectors,
/// M-orthogonal to the rigid modes, ascending.
///
/// The modes are eigenvectors only as far as their residuals say. If the lowest of them keep the K-residual of the
/// accuracy, an inertia count shows whether modes are missing below the last of these. Accuracy `fast` makes no count.
///
/// # Errors
/// [`EigenFailure`] for dependent columns, an indefinite matrix or a mechanism; at [`Accuracy::Certified`] also if a
/// mode is no eigenvector or one is missing.
pub fn modes_of_span(
    problem: &EigenProblem<'_>,
    basis: Mat<f64>,
    settings: &EigenSettings,
    context: &Context<'_>,
) -> Result<EigenSolution, EigenFailure> {
    let refined = Refined::new(problem, basis, context)?;
    // At any accuracy: there is no search, so the modes are only as accurate as this step makes them.
    let refined =
        refined.sharpened(problem, Accuracy::Standard.residual(), context).uncoupled(problem, context);
    check_zero_energy(problem, &refined)?;
    let (mut modes, next_eigenvalue) = canonical_modes(problem, refined, settings, context);
    let exact = modes.exact(settings.accuracy);
    let analysis = (exact > 0 && settings.accuracy != Accuracy::Fast).then(|| {
        context.phase("completeness");
        problem.analysis().ok_or(EigenFailure::TooLarge)
    });
    let analysis = analysis.transpose()?;
    let task = analysis.as_deref().map(|analysis| Task::new(problem, settings, analysis, context));
    let completeness = match &task {
        Some(task) => count(task, &modes.eigenvalues[..exact])?,
        None => without_counter(&modes, exact, settings.accuracy),
    };
    let mut bounds = None;
    if settings.accuracy == Accuracy::Certified && !modes.eigenvalues.is_empty() {
        let task = certifiable(&modes, exact, &completeness, task.as_ref())
            .map_err(|why| EigenFailure::NotCertified { why })?;
        context.phase("bounds");
        let wanted = modes.eigenvalues.len();
        if let Err(unusable) = factor_needs(task, wanted, Precision::Double) {
            unusable.failure(task, wanted).map_or(Ok(()), Err)?;
        }
        let (vectors, high) = (modes.vectors.as_ref(), completeness.shift);
        let found = enclose(task, vectors, &modes.eigenvalues, high, CLUSTER_GAP)?;
        found.clamp(&mut modes.eigenvalues);
        bounds = Some(found);
    }
    Ok(EigenSolution {
        eigenvalues: modes.eigenvalues,
        vectors: modes.vectors,
        residuals: modes.residuals,
        rounding_floors: modes.floors,
        completeness,
        plan: None,
        bounds,
        next_eigenvalue,
        finite_modes: None,
        shift: 0.0,
    })
}

/// Returns the wanted modes in canonical form, with their residuals, and the eigenvalue after them.
fn canonical_modes(
    problem: &EigenProblem<'_>,
    refined: Refined,
    settings: &EigenSettings,
    context: &Context<'_>,
) -> (Refined, Option<f64>) {
    let Refined { mut eigenvalues, mut vectors, mut residuals, mut floors } = refined;
    let given = match settings.wanted {
        Wanted::Lowest(count) => count.min(eigenvalues.len()),
        Wanted::Below(lambda) => eigenvalues.partition_point(|&l| l < lambda),
    };
    let next_eigenvalue = eigenvalues.get(given).copied();
    eigenvalues.truncate(given);
    residuals.truncate(given);
    floors.truncate(given);
    vectors.truncate(vectors.nrows(), given);
    let mut modes = Refined { eigenvalues, vectors, residuals, floors };
    let groups = clusters(&modes.eigenvalues, CLUSTER_GAP);
    canonical_basis(modes.vectors.as_mut(), &groups);
    let mixed: Vec<usize> = groups.into_iter().filter(|group| group.len() > 1).flatten().collect();
    modes.renew(problem, &mixed, context);
    (modes, next_eigenvalue)
}

impl Refined {
    /// Returns the number of the lowest modes that are eigenvectors to the K-residual of `accuracy`.
    fn exact(&self, accuracy: Accuracy) -> usize {
        let pairs = self.residuals.iter().zip(&self.floors);
        pairs.take_while(|(residual, floor)| keeps(**residual, **floor, accuracy.residual())).count()
    }
}

/// Returns the state of the proof without a count.
fn without_counter(modes: &Refined, exact: usize, accuracy: Accuracy) -> Completeness {
    let given = modes.eigenvalues.len();
    let remark = if exact < given {
        let pairs = modes.residuals.iter().zip(&modes.floors);
        let others = pairs.filter(|(r, f)| !keeps(**r, **f, accuracy.residual())).count();
        format!("{others} of {given} modes of the given subspace are not eigenvectors")
    } else {
        "accuracy `fast` leaves the count out".to_owned()
    };
    let shift = modes.eigenvalues.last().copied().unwrap_or(0.0);
    Completeness { proof: Proof::NotProved, shift, negative_pivots: None, modes_below: given, remark }
}

/// Returns the task for the bounds, or the reason why there can be no bounds.
fn certifiable<'t>(
    modes: &Refined,
    exact: usize,
    completeness: &Completeness,
    task: Option<&'t Task<'t>>,
) -> Result<&'t Task<'t>, &'static str> {
    if exact < modes.eigenvalues.len() {
        return Err("not every mode of the subspace is an eigenvector to a K-residual of 1e-12");
    }
    if completeness.proof == Proof::NotProved {
        return Err("the subspace does not contain all modes");
    }
    Ok(task.expect("a count needs the task"))
}

/// Counts the modes below a shift just above the last of `eigenvalues`, all of which belong to eigenvectors.
fn count(task: &Task<'_>, eigenvalues: &[f64]) -> Result<Completeness, EigenFailure> {
    let Task { problem, analysis, context, .. } = *task;
    let (rigid, found) = (problem.rigid.ncols(), eigenvalues.len());
    let last = *eigenvalues.last().expect("counted only where there is one");
    let outcome = |shift: f64, negative_pivots: Option<usize>, remark: String| Completeness {
        proof: if remark.is_empty() { Proof::InertiaCount } else { Proof::NotProved },
        shift,
        negative_pivots,
        modes_below: found,
        remark,
    };
    let needed = resident_for_count(task, found);
    if needed > context.available() {
        let (needed, available) = (gigabytes(needed), gigabytes(context.available()));
        let remark = format!("the count needs {needed} of memory, {available} are available");
        return Ok(outcome(last, None, remark));
    }
    if !is_positive_semidefinite(&problem.pencil, analysis) {
        return Err(EigenFailure::MassIndefinite);
    }
    // The smaller distance is used if the larger one counts too many.
    let mut last_count = (last, 0);
    for above in SHIFT_DISTANCES {
        let shift = (1.0 + above) * last;
        let negative = count_below(problem, analysis, shift, context)?;
        if negative == rigid + found {
            return Ok(outcome(shift, Some(negative), String::new()));
        }
        if negative < rigid + found {
            let counted = negative.saturating_sub(rigid);
            return Err(EigenFailure::CountDiffers { found, counted, shift });
        }
        last_count = (shift, negative);
    }
    let (shift, negative) = last_count;
    let counted = negative - rigid;
    let remark = format!(
        "the body has {counted} flexible modes below lambda = {shift:.6e}, the given subspace has {found}"
    );
    Ok(outcome(shift, Some(negative), remark))
}

//! Canonical bases of repeated eigenvalues and canonical signs. A body has the same modes whatever algorithm computed
//! them.
//!
//! The modes of a given subspace take this form as well: Rayleigh-Ritz, canonical form, true residuals, and an inertia
//! count of the modes that are eigenvectors. A factorisation is made for this count only.

use super::bounds::enclose;
use super::plan::{factor_needs, gigabytes, resident_for_count};
use super::problem::{
    Accuracy, EigenFailure, EigenProblem, EigenSettings, EigenSolution, Precision, Task, Wanted, keeps,
};
use super::refine::{Refined, check_zero_energy};
use super::solve::{Completeness, Proof, count_below};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Mat, MatMut, MatRef};
use flexbody_linalg::context::Context;
use flexbody_linalg::{combine, contiguous_mut, is_positive_semidefinite, parallel};
use std::ops::Range;

/// Relative gap between eigenvalues below which they belong to one cluster, which is completed and put into canonical
/// form as a whole.
pub const CLUSTER_GAP: f64 = 1e-9;

/// Relative difference of squared components below which the components count as equally large. The first of them in
/// row order is chosen, so that neither rounding nor the residual that [`Accuracy::Fast`](super::Accuracy::Fast) allows
/// decides between symmetric nodes.
const EQUAL_COMPONENT_DIFFERENCE: f64 = 1e-4;

/// Returns the index ranges of eigenvalues (ascending) whose neighbours differ by at most `gap` relative to their size.
pub fn clusters(eigenvalues: &[f64], gap: f64) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for i in 1..=eigenvalues.len() {
        let ends = i == eigenvalues.len()
            || eigenvalues[i] - eigenvalues[i - 1] > gap * eigenvalues[i].abs().max(eigenvalues[i - 1].abs());
        if ends {
            ranges.push(start..i);
            start = i;
        }
    }
    ranges
}

/// Returns the number of eigenvalues up to the end of the cluster that contains the last of the first `wanted`.
/// Clusters are formed as by [`clusters`] from the `count` eigenvalues lambda(0), lambda(1), ...
pub(super) fn cluster_end(wanted: usize, count: usize, gap: f64, lambda: impl Fn(usize) -> f64) -> usize {
    let near = |i: usize| {
        let (below, above) = (lambda(i - 1), lambda(i));
        above - below <= gap * above.abs().max(below.abs())
    };
    let wanted = wanted.min(count);
    if wanted == 0 { 0 } else { (wanted..count).find(|&i| !near(i)).unwrap_or(count) }
}

/// Rotates the columns of each cluster into echelon form and fixes all signs.
///
/// Within a cluster, the row with the largest norm is found and the columns are rotated so that only the first has a
/// component in that row; the remaining columns are treated alike. The component of largest magnitude of every column
/// is made positive.
pub fn canonical_basis(mut shapes: MatMut<'_, f64>, clusters: &[Range<usize>]) {
    for cluster in clusters {
        let mut block = shapes.rb_mut().subcols_mut(cluster.start, cluster.len());
        for first in 0..cluster.len().saturating_sub(1) {
            let mut rest = block.rb_mut().subcols_mut(first, cluster.len() - first);
            let row = dominant_row(rest.rb());
            reflect_onto_first(rest.rb_mut(), row);
        }
    }
    parallel::for_each(shapes.col_iter_mut().map(contiguous_mut), |column| {
        if canonical_sign(column.iter().copied()) < 0.0 {
            column.iter_mut().for_each(|x| *x = -*x);
        }
    });
}

/// Returns the sign, 1 or -1, that makes the component of largest magnitude positive.
pub fn canonical_sign(mut shape: impl Iterator<Item = f64> + Clone) -> f64 {
    let dominant = first_largest(shape.clone().map(|x| x * x));
    if shape.nth(dominant).is_some_and(|x| x < 0.0) { -1.0 } else { 1.0 }
}

/// Returns the first row whose norm is the largest, up to [`EQUAL_COMPONENT_DIFFERENCE`].
fn dominant_row(block: MatRef<'_, f64>) -> usize {
    let mut squares = vec![0.0f64; block.nrows()];
    for j in 0..block.ncols() {
        for (square, value) in squares.iter_mut().zip(block.col(j).iter()) {
            *square += value * value;
        }
    }
    first_largest(squares.iter().copied())
}

/// Returns the index of the first square that is the largest, up to [`EQUAL_COMPONENT_DIFFERENCE`].
fn first_largest(mut squares: impl Iterator<Item = f64> + Clone) -> usize {
    let largest = squares.clone().fold(0.0, f64::max);
    squares.position(|square| square >= largest * (1.0 - EQUAL_COMPONENT_DIFFERENCE)).unwrap_or(0)
}

/// Applies the Householder reflection of the columns after which only the first column has a component in `row`.
fn reflect_onto_first(mut block: MatMut<'_, f64>, row: usize) {
    let k = block.ncols();
    let target: Vec<f64> = (0..k).map(|j| block[(row, j)]).collect();
    let norm = target.iter().map(|v| v * v).sum::<f64>().sqrt();
    if norm == 0.0 {
        return;
    }
    // u = target + sign * norm * e1: H = I - 2 u u' / u'u maps the target onto the first axis without cancellation.
    let mut u = target;
    u[0] += if u[0] < 0.0 { -norm } else { norm };
    let square = u.iter().map(|v| v * v).sum::<f64>();
    let coefficients = Mat::from_fn(k, 1, |j, _| u[j]);
    let along = combine(block.rb(), coefficients.as_ref());
    for j in 0..k {
        let factor = 2.0 * u[j] / square;
        for i in 0..block.nrows() {
            block[(i, j)] -= factor * along[(i, 0)];
        }
    }
    // The reflection makes these components zero but for rounding.
    for j in 1..k {
        block[(row, j)] = 0.0;
    }
}

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
    let refined = refined.sharpened(problem, Accuracy::Standard.residual(), context);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_inside_a_cluster_lead_to_the_same_basis() {
        let basis =
            Mat::from_fn(7, 3, |i, j| ((i * 3 + j * 5) as f64).sin() + if i == 2 * j { 2.0 } else { 0.0 });
        let (c, s) = (0.6f64, 0.8f64);
        let rotation = Mat::from_fn(3, 3, |i, j| match (i, j) {
            (0, 0) | (1, 1) => c,
            (0, 1) => -s,
            (1, 0) => s,
            (2, 2) => -1.0,
            _ => 0.0,
        });
        let mut a = basis.clone();
        let mut b = &basis * &rotation;
        canonical_basis(a.as_mut(), std::slice::from_ref(&(0..3)));
        canonical_basis(b.as_mut(), std::slice::from_ref(&(0..3)));
        assert!((&a - &b).norm_max() < 1e-14, "{a:?} {b:?}");
    }

    #[test]
    fn clusters_are_chains_of_close_eigenvalues() {
        assert_eq!(clusters(&[1.0, 1.0 + 1e-10, 2.0, 3.0, 3.0], 1e-9), vec![0..2, 2..3, 3..5]);
        assert!(clusters(&[], 1e-9).is_empty());
    }
}

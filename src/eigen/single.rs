//! Modes with a single-precision factor: Lanczos on the operator that it makes, then corrections against the true K
//! and M in double precision until the true residuals keep the tolerance (a block Davidson method: Davidson, J. Comput.
//! Phys. 17 (1975) 87, with the factor as preconditioner).
//!
//! The factor T of K + tau M is good to about 1e-7 times its condition, so that Lanczos finds the modes to 1e-2 or
//! 1e-4. A correction T r of the residual r = K x - lambda M x, with Rayleigh-Ritz on all that is there, gains as many
//! digits again for one solved column, where refining every solve of Lanczos would cost several.

use super::lanczos::{self, Goal, Search, factorise};
use super::problem::{Counters, EigenFailure, EigenProblem};
use super::refine::{Refined, rayleigh_ritz, residuals};
use crate::linalg::{Analysis, Cholesky, Solve, combine, gram, subtract_combination};
use crate::progress::{Event, Watch};
use faer::{Mat, MatRef};

/// Ritz residual at which Lanczos hands over: below the error of the factor more steps gain nothing.
const HANDED_OVER: f64 = 1e-3;

/// Residual of the first mode beyond the wanted ones: its eigenvalue, good to the square, bounds the gap of the count.
const BEYOND: f64 = 1e-3;

/// Corrections before single precision is given up.
const MAX_ROUNDS: usize = 30;

/// Rounds in a row that gain less than a factor of two before it is given up.
const PATIENCE: usize = 6;

/// The lowest modes, or the reason why single precision does not find them.
pub(super) fn search(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    goal: &Goal,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<(Refined, Vec<f64>, f64), EigenFailure> {
    let rough = Goal { tolerance: HANDED_OVER, rough: true, ..*goal };
    let mut tau = 0.3 * problem.first_estimate;
    loop {
        watch(Event::Phase("factorisation"));
        let factor: Cholesky<'_, f32> = factorise(problem, analysis, tau, counters)?;
        watch(Event::Phase("modes"));
        match lanczos::lowest_modes(problem, &factor, &rough, watch, counters)? {
            Search::ShiftTooLarge(shift) => tau = shift,
            Search::Found { modes, next } => return Ok((modes, next, tau)),
            Search::Rough { vectors, wanted } => {
                let (modes, next) = correct(problem, &factor, vectors, wanted, goal, watch, counters)?;
                return Ok((modes, next, tau));
            }
        }
    }
}

/// Corrects the span of `x` until its lowest `wanted` Ritz pairs keep the tolerance, and the end of their cluster is seen.
fn correct(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    x: Mat<f64>,
    mut wanted: usize,
    goal: &Goal,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<(Refined, Vec<f64>), EigenFailure> {
    let kept = x.ncols() + wanted;
    let (mut lambda, mut x) = rayleigh_ritz(problem, x, counters)?;
    let (mut least, mut since) = (f64::INFINITY, 0);
    for _ in 0..MAX_ROUNDS {
        while wanted < lambda.len()
            && lambda[wanted] - lambda[wanted - 1] <= goal.cluster_gap * lambda[wanted - 1].abs()
        {
            wanted += 1;
        }
        let looked = (wanted + 1).min(lambda.len());
        let (found, floors) = residuals(problem, &lambda[..looked], x.as_ref().subcols(0, looked), counters);
        let excess =
            |i: usize| if i < wanted { found[i] / goal.tolerance.max(floors[i]) } else { found[i] / BEYOND };
        let poor: Vec<usize> = (0..looked).filter(|&i| excess(i) > 1.0).collect();
        watch(Event::Fraction(1.0 - poor.len() as f64 / looked as f64));
        if poor.is_empty() {
            let next = lambda[wanted..looked].to_vec();
            let modes = Refined {
                eigenvalues: lambda[..wanted].to_vec(),
                vectors: x.as_ref().subcols(0, wanted).to_owned(),
                residuals: found[..wanted].to_vec(),
                floors: floors[..wanted].to_vec(),
            };
            return Ok((modes, next));
        }
        let worst = poor.iter().map(|&i| excess(i)).fold(0.0, f64::max);
        if worst < 0.5 * least {
            (least, since) = (worst, 0);
        } else {
            since += 1;
        }
        if since > PATIENCE || worst.is_nan() {
            break;
        }
        let chosen = Mat::from_fn(x.nrows(), poor.len(), |i, j| x[(i, poor[j])]);
        let values: Vec<f64> = poor.iter().map(|&i| lambda[i]).collect();
        let new = corrections(problem, factor, chosen.as_ref(), &values, x.as_ref(), counters);
        let mut all = Mat::zeros(x.nrows(), x.ncols() + new.ncols());
        all.as_mut().subcols_mut(0, x.ncols()).copy_from(&x);
        all.as_mut().subcols_mut(x.ncols(), new.ncols()).copy_from(&new);
        (lambda, x) = rayleigh_ritz(problem, all, counters)?;
        let kept = kept.min(x.ncols());
        lambda.truncate(kept);
        x = x.as_ref().subcols(0, kept).to_owned();
    }
    Err(EigenFailure::NotConverged { converged: 0, wanted })
}

/// T (K x - lambda M x) for some Ritz pairs, M-orthogonal to the basis and of unit M-norm.
fn corrections(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    x: MatRef<'_, f64>,
    lambda: &[f64],
    basis: MatRef<'_, f64>,
    counters: &mut Counters,
) -> Mat<f64> {
    let pencil = &problem.pencil;
    let k = x.ncols() as u64;
    counters.stiffness_columns += k;
    counters.mass_columns += 4 * k;
    counters.solved_columns += k;
    let mx = pencil.apply_mass(x);
    let mut r = pencil.apply_stiffness(x);
    for (j, &lambda) in lambda.iter().enumerate() {
        let column = r.col(j) - mx.col(j) * faer::Scale(lambda);
        // Unit size: residuals near rounding would leave the range of single precision.
        let size = column.norm_max();
        let scale = if size > 0.0 { size.recip() } else { 0.0 };
        r.as_mut().col_mut(j).copy_from(column * faer::Scale(scale));
    }
    factor.solve_in_place(r.as_mut());
    for _ in 0..2 {
        let mr = pencil.apply_mass(r.as_ref());
        let along = gram(basis, mr.as_ref());
        subtract_combination(r.as_mut(), basis, along.as_ref());
    }
    let mr = pencil.apply_mass(r.as_ref());
    let squares = gram(r.as_ref(), mr.as_ref());
    let scale = Mat::from_fn(r.ncols(), r.ncols(), |i, j| {
        if i == j && squares[(i, i)] > 0.0 { squares[(i, i)].sqrt().recip() } else { 0.0 }
    });
    combine(r.as_ref(), scale.as_ref())
}

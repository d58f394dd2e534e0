//! Shift-invert block Lanczos with thick restart: the lowest flexible modes of a large pencil.
//!
//! The operator (K + tau M)^-1 M has the eigenvalues theta = 1 / (lambda + tau) and is self-adjoint in the M inner
//! product. M may be singular: it is only ever multiplied. Full reorthogonalisation (twice) keeps repeated
//! eigenvalues complete up to what the later inertia count proves.

use super::canonical::cluster_end;
use super::counters::Counters;
use super::failure::EigenFailure;
use super::krylov::Krylov;
use super::noise::energy_noise;
use super::problem::EigenProblem;
use super::refine::Refined;
use super::resume::Snapshot;
use super::start::snapshot;
use super::zero_energy::NOISE_FACTOR;
use crate::base::progress::{Event, Watch};
use crate::numerics::linalg::{Analysis, Cholesky, Real, Solve, SymmetricEigen, symmetric_eigen};
use faer::Mat;

/// Columns per step. 20 modes of solids need 64 to 116 solved columns with 4, 60 to 102 with 3, 78 to 138 with 6, 88 to
/// 160 with 8; a hexahedral bar of 100 000 rows takes 6.6 CPU s with 4, 7.0 with 5, 7.1 with 8. 4 is also one more than
/// the copies of an eigenvalue that an isotropic cube has.
pub(super) const BLOCK: usize = 4;

/// Restarts without which every model met so far converged, times ten.
const MAX_RESTARTS: u64 = 100;

/// Basis vectors beyond two for each wanted mode: restarts are then rare.
const SPARE: usize = 128;

/// A search is saved when at least so many more modes have converged, or a quarter of those wanted.
const SAVED_AFTER: usize = 5;

/// A first flexible eigenvalue below this part of the shift asks for a smaller shift: iterations grow.
const SMALLEST_PART: f64 = 0.02;

/// The shift stays above this part of the last eigenvalue wanted, however soft the first modes are: the last ones
/// would lose as many digits. The refinement separates a few much softer modes.
const DIGITS_PART: f64 = 1e-3;

/// How a search ended.
pub(super) enum Search {
    /// With the modes.
    Found {
        /// The wanted modes and those that complete the cluster of the last one.
        modes: Refined,
        /// Further Ritz values, loosely converged.
        next: Vec<f64>,
    },
    /// With rough modes, asked for as such, and some more: the span of these vectors.
    Rough {
        /// Not orthonormal.
        vectors: Mat<f64>,
        /// How many of the lowest are wanted.
        wanted: usize,
    },
    /// Early: with this shift it would be shorter and more accurate.
    ShiftTooLarge(f64),
}

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
    let scale = b.norm_max() + (0..pencil.n()).map(row_sum).fold(0.0, f64::max) * x.norm_max();
    let relative = residual.norm_max() / scale;
    // Backward stable factors leave about the unit roundoff here; a wrong one leaves O(1).
    if relative.is_nan() || relative > T::ROUNDOFF.sqrt() {
        return Err(EigenFailure::Inaccurate { residual: relative });
    }
    Ok(factor)
}

/// Block steps after which the shift is judged: the lowest Ritz value is then near the first eigenvalue.
const STEPS_TO_JUDGE: usize = 6;

/// Judges the shift by the Ritz values so far, upper bounds of the eigenvalues: the shift to use instead when it is far
/// too large for them; an error when there is no strain energy at all.
fn better_shift(
    problem: &EigenProblem<'_>,
    krylov: &Krylov<'_>,
    factor: &dyn Solve,
    wanted: usize,
    counters: &mut Counters,
) -> Result<Option<f64>, EigenFailure> {
    let tau = factor.shift();
    let ritz = descending(krylov)?;
    let (lambda, vectors) = best(krylov, &ritz, wanted.max(1), tau);
    let Some(&lowest) = lambda.first() else { return Ok(None) };
    if lowest > SMALLEST_PART * tau {
        return Ok(None);
    }
    let noise = NOISE_FACTOR
        * energy_noise(problem.pencil.stiffness(), vectors.as_ref().subcols(0, 1), problem.input_error)[0];
    if lowest.abs() <= noise {
        // Far below the shift and within noise: no shift can resolve it, there is no strain energy.
        return Err(zero_energy(problem, factor, tau, counters)?);
    }
    if lowest < 0.0 {
        return Err(EigenFailure::NegativeEigenvalue {
            eigenvalue: lowest,
            vector: vectors.as_ref().subcols(0, 1).to_owned(),
        });
    }
    Ok(suited_shift(lowest, *lambda.last().expect("it has a first"), tau))
}

/// The shift for modes from `first` to `last`, when that is much smaller than `tau`.
fn suited_shift(first: f64, last: f64, tau: f64) -> Option<f64> {
    let suited = (0.5 * first).max(DIGITS_PART * last);
    (first < SMALLEST_PART * tau && suited < 0.1 * tau).then_some(suited)
}

/// Basis in which zero-energy modes are counted: half of its vectors at most.
const ZERO_ENERGY_BASIS: usize = 96;

/// Counts and resolves the modes without strain energy.
fn zero_energy(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    tau: f64,
    counters: &mut Counters,
) -> Result<EigenFailure, EigenFailure> {
    let mut krylov = Krylov::new(problem, factor, ZERO_ENERGY_BASIS);
    krylov.append_random(BLOCK, counters);
    while krylov.room() >= BLOCK && !krylov.exhausted() {
        krylov.step(counters);
    }
    let ritz = descending(&krylov)?;
    let (lambda, vectors) = best(&krylov, &ritz, krylov.projected() / 2, tau);
    let noise = energy_noise(problem.pencil.stiffness(), vectors.as_ref(), problem.input_error);
    let count = lambda.iter().zip(&noise).take_while(|(l, n)| **l <= NOISE_FACTOR * **n).count().max(1);
    Ok(EigenFailure::ZeroEnergy {
        count,
        eigenvalues: lambda[..count].to_vec(),
        vectors: vectors.as_ref().subcols(0, count).to_owned(),
    })
}

/// What a search is for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// Number of modes, extended to the end of the cluster of the last one.
    pub wanted: usize,
    /// K-residual.
    pub tolerance: f64,
    /// Eigenvalues closer than this (relative) are one cluster.
    pub cluster_gap: f64,
    /// Columns per step.
    pub block: usize,
    /// Whether the solves are rough: the modes are then handed out as a span to be corrected.
    pub rough: bool,
    /// Chooses the random start: a search repeated after a count that found more modes starts elsewhere.
    pub attempt: u64,
}

/// The lowest flexible modes.
pub(super) fn lowest_modes(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    goal: &Goal,
    start: Option<&Snapshot>,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<Search, EigenFailure> {
    let Goal { wanted, tolerance, cluster_gap, block, rough, attempt } = *goal;
    let tau = factor.shift();
    let free = problem.pencil.n() - problem.rigid.ncols();
    let capacity = (2 * wanted + SPARE).min(free + block);
    let mut krylov = Krylov::new(problem, factor, capacity);
    krylov.choose_random(1000 * attempt);
    match start {
        // The Ritz vectors that leave room for a step; the relation that the basis satisfies holds for any part of them.
        Some(start) => {
            let room = capacity.saturating_sub(start.coupling.nrows() + block);
            let taken = start.eigenvalues.len().min(room);
            counters.taken_up = taken as u64;
            krylov.take_up(start, tau, taken, counters);
        }
        None => krylov.append_random(block.min(free), counters),
    }
    // A start is looked at before the first step: it may hold all that is wanted.
    let mut taken_up = krylov.projected() > 0 && !krylov.exhausted();
    let (mut checked, mut steps, mut saved) = (0, 0, 0);
    let (mut asked, mut least_excess) = (tolerance, f64::INFINITY);
    loop {
        if krylov.exhausted() {
            // An invariant subspace: go on with new directions, or everything is found.
            krylov.append_random(block.min(krylov.room()), counters);
        }
        let complete = krylov.exhausted();
        let at_start = std::mem::take(&mut taken_up);
        if !complete && !at_start {
            krylov.step(counters);
            steps += 1;
        }
        if steps == STEPS_TO_JUDGE
            && let Some(shift) = better_shift(problem, &krylov, factor, wanted, counters)?
        {
            return Ok(Search::ShiftTooLarge(shift));
        }
        let size = krylov.projected();
        let full = krylov.room() < block;
        // The projected eigenproblem costs size^3: beyond 100 vectors or so not after every step.
        if !(complete || full) && (size < wanted + 1 || size < checked + checked / 25) {
            continue;
        }
        checked = size;
        let ritz = descending(&krylov)?;
        if ritz.values.first().is_some_and(|&theta| theta < -1e-8 * ritz.values[size - 1].abs()) {
            return Err(EigenFailure::MassIndefinite);
        }
        let theta: Vec<f64> = ritz.values.iter().rev().copied().collect();
        let lambda = |i: usize| 1.0 / theta[i] - tau;
        let s = Mat::from_fn(size, size, |i, j| ritz.vectors[(i, size - 1 - j)]);
        let norms = krylov.residual_norms(s.as_ref());
        let good = |i: usize, tol: f64| norms[i] <= tol * theta[i];
        let last = cluster_end(wanted, size, cluster_gap, lambda);
        // K x - lambda M x = -M r / theta^2 for x = OP V s / theta and r = V_fresh B s: the K-residual, with M-norms
        // for the Euclidean ones.
        let estimate = |i: usize| 0.5 * norms[i] / (theta[i] * (1.0 - tau * theta[i]).max(SMALLEST_PART));
        let converged = (0..last).take_while(|&i| complete || estimate(i) <= asked).count();
        // One more, as well as the gap below it needs: it shows that the cluster of the last mode has ended.
        let beyond = complete
            || (last < size && {
                let gap = if last > 0 { theta[last - 1] - theta[last] } else { f64::MAX };
                good(last, 1e-3) && norms[last] <= 0.1 * gap
            });
        watch(Event::Fraction(converged as f64 / wanted.max(1) as f64));
        if at_start {
            saved = converged;
        } else if converged > 0
            && !rough
            && (converged >= saved + SAVED_AFTER.max(wanted / 4) || (converged == last && beyond))
        {
            // All Ritz vectors: with a third of those that are no modes yet, 60 modes after 20 take 36 columns more.
            problem.resume.save(|| snapshot(&krylov, s.as_ref(), &theta, (tau, converged)));
            saved = converged;
        }
        if converged == last && beyond && rough && !complete {
            // Half as many again: what the corrections would have to find of the next modes is then there.
            let count = (last + last / 2 + 2 * block).min(size);
            let vectors = krylov.inverse_iterated(s.as_ref().subcols(0, count), &theta[..count]);
            return Ok(Search::Rough { vectors, wanted: last });
        }
        if converged == last && beyond {
            let x = krylov.inverse_iterated(s.as_ref().subcols(0, last), &theta[..last]);
            let modes = Refined::new(problem, x, counters)?;
            let excess = modes.excess(tolerance);
            // Another step costs a block, the refinement a column for each mode that needs it.
            if excess <= 1.0 || complete || excess > 0.5 * least_excess {
                let next = (last..size).take_while(|&i| complete || good(i, 1e-2)).map(lambda).collect();
                return Ok(Search::Found { modes, next });
            }
            least_excess = excess;
            asked /= 1.2 * excess;
        }
        if complete || counters.restarts >= MAX_RESTARTS {
            return Err(EigenFailure::NotConverged { converged, wanted });
        }
        if full {
            if let Some(shift) = suited_shift(lambda(0), lambda(last.max(1) - 1), tau) {
                return Ok(Search::ShiftTooLarge(shift));
            }
            counters.restarts += 1;
            let keep = (last + (capacity - last) / 3).min(size.saturating_sub(block));
            krylov.restart(s.as_ref().subcols(0, keep), &theta[..keep]);
            checked = 0;
        }
    }
}

fn descending(krylov: &Krylov<'_>) -> Result<SymmetricEigen, EigenFailure> {
    symmetric_eigen(krylov.t()).ok_or(EigenFailure::Inaccurate { residual: f64::NAN })
}

/// The `count` Ritz pairs with the largest theta, as lambda ascending and vectors.
fn best(krylov: &Krylov<'_>, ritz: &SymmetricEigen, count: usize, tau: f64) -> (Vec<f64>, Mat<f64>) {
    let size = ritz.values.len();
    let count = count.min(size);
    let lambda = (0..count).map(|i| 1.0 / ritz.values[size - 1 - i] - tau).collect();
    let s = Mat::from_fn(size, count, |i, j| ritz.vectors[(i, size - 1 - j)]);
    (lambda, krylov.combination(s.as_ref()))
}

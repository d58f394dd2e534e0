//! Shift-invert block Lanczos with thick restart: the lowest flexible modes of a large pencil.
//!
//! The operator (K + tau M)^-1 M has the eigenvalues theta = 1 / (lambda + tau) and is self-adjoint in the M
//! inner product. M may be singular: it is only ever multiplied. Full reorthogonalisation (twice) keeps
//! repeated eigenvalues complete up to what the later inertia count proves.

use super::attempt::Goal;
use super::canonical::{CLUSTER_GAP, cluster_end};
use super::failure::EigenFailure;
use super::krylov::Krylov;
use super::problem::EigenProblem;
use super::refine::{FoundModes, Refined, residuals};
use super::zero_energy::NOISE_FACTOR;
use super::zero_energy::{energy_noise, is_noisy};
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::{Solve, SymmetricEigen, symmetric_eigen};
use std::ops::RangeInclusive;

/// Columns per step. 20 modes of solids need 64 to 116 solved columns with 4, 60 to 102 with 3, 78 to 138
/// with 6, 88 to 160 with 8; a hexahedral bar of 100 000 rows takes 6.6 CPU s with 4, 7.0 with 5, 7.1 with 8.
/// 4 is also one more than the copies of an eigenvalue that an isotropic cube has.
const BLOCK: usize = 4;

/// Modes from which on twice as many columns per step take less time: most steps then meet a large basis, which
/// each of them reads from memory, as it does the factor. (Measured on a bar of 100,000 rows: with 30 modes as
/// much, with 50 a tenth less, with 200 a fifth.)
const MANY: usize = 40;

/// Columns per step for so many modes.
pub(super) fn columns_per_step(wanted: usize) -> usize {
    if wanted < MANY { BLOCK } else { 2 * BLOCK }
}

/// Restarts without which every model met so far converged, times ten.
const MAX_RESTARTS: u64 = 100;

/// Basis vectors beyond two for each wanted mode: restarts are then rare.
const SPARE: usize = 128;

/// Part of the tolerance that estimates have to keep where rounding hides the true residuals: the modes are
/// then good to what the estimates say.
const BELOW_NOISE: f64 = 1e-2;

/// Residuals below this are asked of no estimate: the solves have no more digits.
const LEAST_ASKED: f64 = 1e-12;

/// A first flexible eigenvalue below this part of the shift asks for a smaller shift: iterations grow.
const SMALLEST_PART: f64 = 0.02;

/// The shift stays above this part of the last eigenvalue wanted, however soft the first modes are: the last
/// ones would lose as many digits. The refinement separates a few much softer modes.
const DIGITS_PART: f64 = 1e-3;

/// Relative gap of two eigenvalues across which modes that have converged do not mix.
const WIDE: f64 = 1e-3;

/// Block steps after which the shift is judged: the lowest Ritz value is near the first eigenvalue after six;
/// where it is far below the shift it only falls, and a step less is a step saved.
const STEPS_TO_JUDGE: RangeInclusive<usize> = 3..=6;

/// Judges the shift by the Ritz values so far, upper bounds of the eigenvalues: the shift to use instead when
/// it is far too large for them; an error when there is no strain energy at all.
fn better_shift(
    problem: &EigenProblem<'_>,
    krylov: &Krylov<'_>,
    factor: &dyn Solve,
    wanted: usize,
    context: &Context<'_>,
) -> Result<Option<f64>, EigenFailure> {
    let tau = factor.shift();
    let ritz = descending(krylov)?;
    if ritz.values.last().is_none_or(|theta| theta.recip() - tau > SMALLEST_PART * tau) {
        return Ok(None);
    }
    let (lambda, vectors) = best(krylov, &ritz, wanted.max(1), tau);
    let lowest = lambda[0];
    let noise = NOISE_FACTOR
        * energy_noise(problem.pencil.stiffness(), vectors.as_ref().subcols(0, 1), problem.input_error)[0];
    if lowest.abs() <= noise {
        // Far below the shift and within noise: no shift can resolve it, there is no strain energy.
        return Err(zero_energy(problem, factor, tau, context)?);
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
    context: &Context<'_>,
) -> Result<EigenFailure, EigenFailure> {
    let mut krylov = Krylov::new(problem, ZERO_ENERGY_BASIS, context);
    krylov.append_random(BLOCK, factor);
    while krylov.room() >= BLOCK && !krylov.exhausted() {
        krylov.step(factor);
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

/// The end of a search with one shift, or of a part of it.
pub(super) enum Outcome<T> {
    /// The search reached its aim.
    Reached(T),
    /// With this shift the search would be shorter and more accurate.
    ShiftTooLarge(f64),
}

/// A search for the lowest modes in a Krylov basis that grows by a block of columns at each step.
pub(super) struct Iteration<'a> {
    problem: &'a EigenProblem<'a>,
    context: Context<'a>,
    goal: &'a Goal,
    /// Columns per step.
    block: usize,
    /// The shift, as tau.
    tau: f64,
    /// The modes below a second shift, after the change to it.
    first: Option<First>,
    krylov: Krylov<'a>,
    /// Vectors that the basis has room for.
    capacity: usize,
    /// Block steps so far.
    steps: usize,
    /// Thick restarts so far.
    restarts: u64,
    /// True when the basis spans all there is.
    complete: bool,
    /// Size of the projected eigenproblem from which on it is worth being tested again.
    next_test: usize,
    /// K-residual that an estimate has to keep before the true residuals are looked at.
    asked: f64,
    /// Least excess of the true residuals so far.
    least_excess: f64,
}

/// The Ritz pairs of a search that is about to change its shift.
pub(super) struct Midway {
    /// Ritz values, ascending.
    pub eigenvalues: Vec<f64>,
    /// The lowest modes, which have converged.
    modes: Mat<f64>,
}

/// The result of a first shift, kept when the search goes over to a second one.
struct First {
    /// The lowest modes, which had converged: far from the second shift, its operator leaves rounding in them.
    modes: Mat<f64>,
    /// Flexible modes below the second shift.
    below: usize,
}

/// Ritz pairs of a basis, lambda ascending, and which of them are modes.
pub(super) struct Ritz {
    /// 1 / (lambda + tau).
    theta: Vec<f64>,
    /// Coefficients of the vectors.
    s: Mat<f64>,
    /// M-norms of the residuals of the operator.
    norms: Vec<f64>,
    tau: f64,
    /// Number of the modes to find: those wanted and what completes the cluster of the last one.
    last: usize,
    /// Number of modes that are good enough by their estimates.
    converged: usize,
    /// True when the next one shows that the cluster has ended.
    beyond: bool,
}

impl Ritz {
    /// Number of the modes to find.
    pub(super) fn last(&self) -> usize {
        self.last
    }

    fn size(&self) -> usize {
        self.theta.len()
    }

    fn lambda(&self, i: usize) -> f64 {
        1.0 / self.theta[i] - self.tau
    }

    /// Returns true when the residual of the operator is within `tolerance` of theta.
    fn is_good(&self, i: usize, tolerance: f64) -> bool {
        self.norms[i] <= tolerance * self.theta[i].abs()
    }

    /// K x - lambda M x = -M r / theta^2 for x = OP V s / theta and r = V_fresh B s: the K-residual, with
    /// M-norms for the Euclidean ones.
    fn estimate(&self, i: usize) -> f64 {
        let theta = self.theta[i];
        0.5 * self.norms[i] / (theta * (1.0 - self.tau * theta)).abs().max(SMALLEST_PART * theta.abs())
    }

    /// Returns true when the first pair beyond the modes is as good as the gap below it needs.
    fn shows_gap(&self) -> bool {
        let last = self.last;
        last < self.size() && {
            let gap = if last > 0 { (self.theta[last - 1] - self.theta[last]).abs() } else { f64::MAX };
            self.is_good(last, 1e-3) && self.norms[last] <= 0.1 * gap
        }
    }

    /// Returns true when all modes are there by their estimates.
    fn all_there(&self) -> bool {
        self.converged == self.last && self.beyond
    }
}

impl<'a> Iteration<'a> {
    /// Begins with random vectors.
    pub(super) fn begin(
        problem: &'a EigenProblem<'a>,
        factor: &dyn Solve,
        (goal, block): (&'a Goal, usize),
        context: &Context<'a>,
    ) -> Self {
        let free = problem.pencil.n() - problem.rigid.ncols();
        let capacity = (2 * goal.wanted + SPARE).min(free + block);
        let mut krylov = Krylov::new(problem, capacity, context);
        krylov.choose_random(1000 * goal.round as u64);
        krylov.append_random(block.min(free), factor);
        Self {
            problem,
            context: *context,
            goal,
            block,
            tau: factor.shift(),
            first: None,
            krylov,
            capacity,
            steps: 0,
            restarts: 0,
            complete: false,
            next_test: 0,
            asked: goal.tolerance,
            least_excess: f64::INFINITY,
        }
    }

    /// Returns true when the basis spans all there is.
    pub(super) fn is_complete(&self) -> bool {
        self.complete
    }

    /// Expands the basis until it has `size` vectors or spans all there is.
    pub(super) fn expand_to(&mut self, size: usize, factor: &dyn Solve) -> Result<Outcome<()>, EigenFailure> {
        loop {
            self.expand(factor);
            if let Some(shift) = self.better_shift(factor)? {
                return Ok(Outcome::ShiftTooLarge(shift));
            }
            if self.complete || self.krylov.projected() >= size {
                return Ok(Outcome::Reached(()));
            }
        }
    }

    /// Expands the basis until all modes are good enough by their estimates; a full basis is restarted from the best
    /// Ritz pairs.
    pub(super) fn estimate(&mut self, factor: &dyn Solve) -> Result<Outcome<Ritz>, EigenFailure> {
        loop {
            self.expand(factor);
            if let Some(shift) = self.better_shift(factor)? {
                return Ok(Outcome::ShiftTooLarge(shift));
            }
            if !self.is_test_due() {
                continue;
            }
            let ritz = self.test()?;
            if ritz.all_there() {
                return Ok(Outcome::Reached(ritz));
            }
            if let Some(shift) = self.restart(&ritz)? {
                return Ok(Outcome::ShiftTooLarge(shift));
            }
        }
    }

    /// Expands the basis until the true residuals of the modes keep the tolerance, or further steps gain nothing.
    pub(super) fn find(&mut self, factor: &dyn Solve) -> Result<Outcome<FoundModes>, EigenFailure> {
        match self.estimate(factor)? {
            Outcome::Reached(ritz) => self.find_from(ritz, factor),
            Outcome::ShiftTooLarge(shift) => Ok(Outcome::ShiftTooLarge(shift)),
        }
    }

    /// Does the work of [`Self::find`] from the moment on when the modes are good enough by their estimates.
    pub(super) fn find_from(
        &mut self,
        mut ritz: Ritz,
        factor: &dyn Solve,
    ) -> Result<Outcome<FoundModes>, EigenFailure> {
        loop {
            if let Some(found) = self.hand_over(&ritz)? {
                return Ok(Outcome::Reached(found));
            }
            if let Some(shift) = self.restart(&ritz)? {
                return Ok(Outcome::ShiftTooLarge(shift));
            }
            ritz = match self.estimate(factor)? {
                Outcome::Reached(ritz) => ritz,
                Outcome::ShiftTooLarge(shift) => return Ok(Outcome::ShiftTooLarge(shift)),
            };
        }
    }

    /// Returns the span of the modes and of half as many Ritz vectors again: the corrections would otherwise have to
    /// find what is already there of the next modes.
    pub(super) fn rough_modes(&self, ritz: &Ritz) -> Mat<f64> {
        self.vectors(ritz, (ritz.last + ritz.last / 2 + 2 * self.block).min(ritz.size()))
    }

    /// Expands the basis by a block, unless it spans all there is.
    fn expand(&mut self, factor: &dyn Solve) {
        let Self { krylov, block, .. } = self;
        if krylov.exhausted() {
            // An invariant subspace: go on with new directions, or everything is found.
            krylov.append_random((*block).min(krylov.room()), factor);
        }
        self.complete = krylov.exhausted();
        if !self.complete {
            krylov.step(factor);
            self.steps += 1;
        }
    }

    /// Midway: the Ritz values, ascending, and what is to be kept when the shift changes.
    pub(super) fn look_midway(&mut self) -> Result<Midway, EigenFailure> {
        let mut ritz = self.test()?;
        if self.asks_below_noise(&ritz) {
            ritz = self.test()?;
        }
        let eigenvalues: Vec<f64> = (0..ritz.size()).map(|i| ritz.lambda(i)).collect();
        let modes = self.vectors(&ritz, settled(&eigenvalues, ritz.converged));
        Ok(Midway { eigenvalues, modes })
    }

    /// Goes over to the shift of `second`, which `below` flexible modes lie below.
    pub(super) fn change_shift(&mut self, midway: Midway, second: &dyn Solve, below: usize) {
        let tau = second.shift();
        self.krylov.change_shift(tau - self.tau);
        self.first = Some(First { modes: midway.modes, below });
        (self.tau, self.next_test) = (tau, 0);
    }

    /// The shift to use instead of this one, once the lowest Ritz value tells.
    fn better_shift(&self, factor: &dyn Solve) -> Result<Option<f64>, EigenFailure> {
        if self.first.is_some() || !STEPS_TO_JUDGE.contains(&self.steps) {
            return Ok(None);
        }
        better_shift(self.problem, &self.krylov, factor, self.goal.wanted, &self.context)
    }

    /// Returns true when no further step fits before a restart.
    fn is_full(&self) -> bool {
        self.krylov.room() < self.block
    }

    /// Returns true when the Ritz pairs are worth their price. The projected eigenproblem costs size^3: beyond 100
    /// vectors or so not after every step, and not while many modes are missing, of which a step finds a few.
    fn is_test_due(&self) -> bool {
        let size = self.krylov.projected();
        let small = size < self.goal.wanted + 1 || size < self.next_test;
        self.complete || self.is_full() || !small
    }

    /// Solves the projected eigenproblem, and sees which Ritz pairs are modes.
    fn test(&mut self) -> Result<Ritz, EigenFailure> {
        let (krylov, wanted) = (&self.krylov, self.goal.wanted);
        let tau = self.tau;
        let (below, settled) = self.first.as_ref().map_or((0, 0), |first| (first.below, first.modes.ncols()));
        let size = krylov.projected();
        let found = descending(krylov)?;
        let is_negative = |theta: &f64| *theta < -1e-8 * found.values[size - 1].abs();
        if below == 0 && found.values.first().is_some_and(is_negative) {
            return Err(EigenFailure::MassIndefinite);
        }
        // lambda ascends where theta descends, below the shift and above it.
        let below = below.min(size);
        let order: Vec<usize> = (0..below).rev().chain((below..size).rev()).collect();
        let theta: Vec<f64> = order.iter().map(|&i| found.values[i]).collect();
        let s = Mat::from_fn(size, size, |i, j| found.vectors[(i, order[j])]);
        let all_below_are_there = below == 0 || found.values[below - 1] < 0.0;
        let norms = krylov.residual_norms(s.as_ref());
        let last = cluster_end(wanted, size, CLUSTER_GAP, |i| 1.0 / theta[i] - tau);
        let mut ritz = Ritz { theta, s, norms, tau, last, converged: 0, beyond: false };
        let is_mode = |i: &usize| self.complete || *i < settled || ritz.estimate(*i) <= self.asked;
        let converged = if all_below_are_there { (0..last).take_while(is_mode).count() } else { settled };
        ritz.converged = converged;
        ritz.beyond = self.complete || ritz.shows_gap();
        self.next_test = size + (size / 25).max((last - converged) / 4);
        self.context.fraction(converged as f64 / wanted.max(1) as f64);
        Ok(ritz)
    }

    /// Returns the modes where they keep the tolerance; else asks more of the estimates.
    fn hand_over(&mut self, ritz: &Ritz) -> Result<Option<FoundModes>, EigenFailure> {
        if self.asks_below_noise(ritz) {
            return Ok(None);
        }
        let (size, last) = (ritz.size(), ritz.last);
        let refined = Refined::new(self.problem, self.vectors(ritz, last), &self.context)?;
        let excess = refined.excess(self.goal.tolerance);
        // Another step costs a block, the refinement a column for each mode that needs it.
        let gains_nothing = excess.is_nan() || excess > 0.5 * self.least_excess;
        if excess <= 1.0 || self.complete || gains_nothing {
            let is_known = |i: &usize| self.complete || ritz.is_good(*i, 1e-2);
            let next = (last..size).take_while(is_known).map(|i| ritz.lambda(i)).collect();
            return Ok(Some(FoundModes { refined, next, tau: self.tau, finite: None }));
        }
        self.least_excess = excess;
        self.asked /= 1.2 * excess;
        Ok(None)
    }

    /// The vectors of the first Ritz pairs, after an inverse iteration.
    fn vectors(&self, ritz: &Ritz, count: usize) -> Mat<f64> {
        let mut vectors =
            self.krylov.inverse_iterated(ritz.s.as_ref().subcols(0, count), &ritz.theta[..count]);
        if let Some(First { modes, .. }) = &self.first {
            let known = modes.ncols().min(count);
            vectors.as_mut().subcols_mut(0, known).copy_from(modes.as_ref().subcols(0, known));
        }
        vectors
    }

    /// Asks more of the estimates where rounding hides the true residual of the first mode, whose strain energy is least.
    /// Returns true when it does.
    fn asks_below_noise(&mut self, ritz: &Ritz) -> bool {
        let below_noise = (BELOW_NOISE * self.goal.tolerance).max(LEAST_ASKED);
        let may_ask = !self.complete && self.asked > below_noise;
        let asks = may_ask && {
            let count = ritz.last.min(1);
            let (first, eigenvalues) = (self.vectors(ritz, count), &[ritz.lambda(0)][..count]);
            let (_, floors) = residuals(self.problem, eigenvalues, first.as_ref(), &self.context);
            is_noisy(&floors, self.goal.tolerance)
        };
        if asks {
            self.asked = below_noise;
        }
        asks
    }

    /// Restarts a full basis from the lowest Ritz pairs; or tells the shift with which the search had better
    /// start anew.
    ///
    /// # Errors
    /// [`EigenFailure::NotConverged`] when there is nothing left to search in, or after too many restarts.
    fn restart(&mut self, ritz: &Ritz) -> Result<Option<f64>, EigenFailure> {
        let Ritz { last, converged, .. } = *ritz;
        if self.complete || self.restarts >= MAX_RESTARTS {
            return Err(EigenFailure::NotConverged { converged, wanted: self.goal.wanted });
        }
        if !self.is_full() {
            return Ok(None);
        }
        if let Some(shift) = suited_shift(ritz.lambda(0), ritz.lambda(last.max(1) - 1), ritz.tau) {
            return Ok(Some(shift));
        }
        self.restarts += 1;
        self.context.count(|work| work.restarts += 1);
        let keep = (last + (self.capacity - last) / 3).min(ritz.size().saturating_sub(self.block));
        self.krylov.restart(ritz.s.as_ref().subcols(0, keep), &ritz.theta[..keep]);
        self.next_test = 0;
        Ok(None)
    }
}

/// Modes that stay what they are when the search goes on with another shift: of those that have `converged`, all up to
/// a gap. Within a cluster they may turn.
fn settled(eigenvalues: &[f64], converged: usize) -> usize {
    let is_end = |end: &usize| {
        let (last, next) = (eigenvalues[end - 1], eigenvalues.get(*end).copied());
        next.is_some_and(|next| next - last > WIDE * next)
    };
    (1..=converged).rev().find(is_end).unwrap_or(0)
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

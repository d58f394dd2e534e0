//! Shift-invert block Lanczos with thick restart: the lowest flexible modes of a large pencil.
//!
//! The operator (K + tau M)^-1 M has the eigenvalues theta = 1 / (lambda + tau) and is self-adjoint in the M inner
//! product. M may be singular: it is only ever multiplied. Full reorthogonalisation (twice) finds the copies of
//! repeated eigenvalues; the later inertia count proves that none is missing.

use super::canonical::{CLUSTER_GAP, cluster_end};
use super::failure::EigenFailure;
use super::krylov::Krylov;
use super::problem::EigenProblem;
use super::refine::{FoundModes, NOISE_DEVIATIONS, Refined, energy_noise, is_noisy, residuals};
use super::search::Goal;
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::{Solve, SymmetricEigen, symmetric_eigen};
use std::ops::RangeInclusive;

/// Columns per step. 20 modes of solids need 64 to 116 solved columns with 4, 60 to 102 with 3, 78 to 138 with 6, 88 to
/// 160 with 8; a hexahedral bar of 100 000 rows takes 6.6 CPU s with 4, 7.0 with 5, 7.1 with 8. The value 4 is also one
/// more than the multiplicity of an eigenvalue of an isotropic cube.
const COLUMNS_PER_STEP: usize = 4;

/// Number of modes from which on twice as many columns per step take less time: most steps then work on a large basis,
/// which each step reads from memory, as it does the factor. (Measured on a bar of 100,000 rows: no difference with 30
/// modes, a tenth less time with 50, a fifth less with 200.)
const MIN_MODES_FOR_DOUBLE_STEPS: usize = 40;

/// Returns the number of columns per step for `wanted` modes.
pub(super) fn columns_per_step(wanted: usize) -> usize {
    if wanted < MIN_MODES_FOR_DOUBLE_STEPS { COLUMNS_PER_STEP } else { 2 * COLUMNS_PER_STEP }
}

/// Largest number of restarts: ten times the number that any model needed so far.
const MAX_RESTARTS: u64 = 100;

/// Number of basis vectors beyond two for each wanted mode. With this value restarts are rare.
const SPARE_VECTORS: usize = 128;

/// Part of the tolerance that the estimates must keep where rounding hides the true residuals: the modes are then as
/// accurate as the estimates say.
const NOISE_TOLERANCE_FRACTION: f64 = 1e-2;

/// Smallest residual that is asked of an estimate: the solves have no more digits.
const MIN_RESIDUAL: f64 = 1e-12;

/// Part of the shift below which the first flexible eigenvalue asks for a smaller shift: with a lower one the number of
/// iterations grows.
const MIN_EIGENVALUE_PER_SHIFT: f64 = 0.02;

/// Smallest shift relative to the last wanted eigenvalue, however low the first eigenvalues are: with a smaller shift
/// the last modes would lose as many digits. The refinement separates a few much softer modes.
const MIN_SHIFT_FRACTION: f64 = 1e-3;

/// Relative gap of two eigenvalues across which converged modes do not mix.
const SEPARATING_GAP: f64 = 1e-3;

/// Numbers of block steps after which the shift is judged. The lowest Ritz value is near the first eigenvalue after
/// six. A Ritz value far below the shift can only fall further, so an early judgement saves steps.
const SHIFT_JUDGEMENT_STEPS: RangeInclusive<usize> = 3..=6;

/// Judges the shift by the current Ritz values, which are upper bounds of the eigenvalues. Returns the shift to use
/// instead if this one is far too large for them.
///
/// # Errors
/// The failure [`EigenFailure::ZeroEnergy`] if the lowest mode has no strain energy,
/// [`EigenFailure::NegativeEigenvalue`] if its eigenvalue is clearly negative.
fn better_shift(
    problem: &EigenProblem<'_>,
    krylov: &Krylov<'_>,
    factor: &dyn Solve,
    wanted: usize,
    context: &Context<'_>,
) -> Result<Option<f64>, EigenFailure> {
    let tau = factor.shift();
    let ritz = projected_pairs(krylov)?;
    if ritz.values.last().is_none_or(|theta| theta.recip() - tau > MIN_EIGENVALUE_PER_SHIFT * tau) {
        return Ok(None);
    }
    // The lowest eigenvalue is far below the shift: find out if it has strain energy.
    let (lambda, vectors) = largest_pairs(krylov, &ritz, wanted.max(1), tau);
    let lowest = lambda[0];
    let noise = NOISE_DEVIATIONS
        * energy_noise(problem.pencil.stiffness(), vectors.as_ref().subcols(0, 1), problem.input_error)[0];
    if lowest.abs() <= noise {
        // The value is far below the shift and within noise. No shift can resolve it: the mode has no strain energy.
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

/// Returns the shift for modes from `first` to `last` if it is much smaller than `tau`.
fn suited_shift(first: f64, last: f64, tau: f64) -> Option<f64> {
    let suited = (0.5 * first).max(MIN_SHIFT_FRACTION * last);
    (first < MIN_EIGENVALUE_PER_SHIFT * tau && suited < 0.1 * tau).then_some(suited)
}

/// Size of the basis in which zero-energy modes are counted; at most half of its vectors can be such modes.
const ZERO_ENERGY_BASIS: usize = 96;

/// Counts and resolves the modes without strain energy. Returns them as a failure.
fn zero_energy(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    tau: f64,
    context: &Context<'_>,
) -> Result<EigenFailure, EigenFailure> {
    let mut krylov = Krylov::new(problem, ZERO_ENERGY_BASIS, context);
    krylov.append_random(COLUMNS_PER_STEP, factor);
    // Fill the basis.
    while krylov.free_columns() >= COLUMNS_PER_STEP && !krylov.exhausted() {
        krylov.step(factor);
    }
    let ritz = projected_pairs(&krylov)?;
    let (lambda, vectors) = largest_pairs(&krylov, &ritz, krylov.projected() / 2, tau);
    // Modes within the noise of K have no strain energy.
    let noise = energy_noise(problem.pencil.stiffness(), vectors.as_ref(), problem.input_error);
    let count = lambda.iter().zip(&noise).take_while(|(l, n)| **l <= NOISE_DEVIATIONS * **n).count().max(1);
    Ok(EigenFailure::ZeroEnergy {
        count,
        eigenvalues: lambda[..count].to_vec(),
        vectors: vectors.as_ref().subcols(0, count).to_owned(),
    })
}

/// Outcome of a search, or of a part of it, with one shift.
pub(super) enum Outcome<T> {
    /// The goal of the search or of its part was reached.
    Reached(T),
    /// The shift that would make the search shorter and more accurate.
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
    /// State kept from the first shift after the change to a second one.
    first: Option<First>,
    krylov: Krylov<'a>,
    /// Largest number of basis vectors.
    capacity: usize,
    /// Number of block steps so far.
    steps: usize,
    /// Number of thick restarts so far.
    restarts: u64,
    /// True if the basis spans the whole space.
    complete: bool,
    /// Size of the projected eigenproblem from which on it is solved again.
    next_test: usize,
    /// K-residual that the estimates must keep before the true residuals are computed.
    requested: f64,
    /// Least excess of the true residuals so far.
    least_excess: f64,
}

/// Ritz pairs of a search that is about to change its shift.
pub(super) struct Midway {
    /// Ritz values, ascending.
    pub eigenvalues: Vec<f64>,
    /// Lowest modes, which have converged.
    modes: Mat<f64>,
}

/// State kept from the first shift after the change to a second one.
struct First {
    /// Lowest modes, converged with the first shift. The operator of the second shift would leave rounding in them,
    /// because their eigenvalues are far from it.
    modes: Mat<f64>,
    /// Number of flexible modes below the second shift.
    below: usize,
}

/// Ritz pairs of a basis, lambda ascending, and the number of them that are modes.
pub(super) struct Ritz {
    /// 1 / (lambda + tau).
    theta: Vec<f64>,
    /// Coefficients of the vectors.
    s: Mat<f64>,
    /// M-norms of the residuals of the operator.
    norms: Vec<f64>,
    tau: f64,
    /// Number of modes to find: the wanted ones and the rest of the cluster of the last one.
    last: usize,
    /// Number of modes whose estimates keep the tolerance.
    converged: usize,
    /// True if the pair after the modes shows that the cluster has ended.
    beyond: bool,
}

impl Ritz {
    /// Returns the number of modes to find, to the end of the cluster of the last wanted one.
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

    /// Returns an estimate of the K-residual of pair i. With x = OP V s / theta and r = V_fresh B s, K x - lambda M x =
    /// -M r / theta^2; M-norms replace the Euclidean norms.
    fn estimate(&self, i: usize) -> f64 {
        let theta = self.theta[i];
        0.5 * self.norms[i]
            / (theta * (1.0 - self.tau * theta)).abs().max(MIN_EIGENVALUE_PER_SHIFT * theta.abs())
    }

    /// Returns true when the first pair beyond the modes is accurate enough to establish the gap below it.
    fn shows_gap(&self) -> bool {
        let last = self.last;
        last < self.size() && {
            let gap = if last > 0 { (self.theta[last - 1] - self.theta[last]).abs() } else { f64::MAX };
            self.is_good(last, 1e-3) && self.norms[last] <= 0.1 * gap
        }
    }

    /// Returns true when all modes have converged by their estimates and their cluster has ended.
    fn has_all_modes(&self) -> bool {
        self.converged == self.last && self.beyond
    }
}

impl<'a> Iteration<'a> {
    /// Begins with a block of `block` random vectors.
    pub(super) fn begin(
        problem: &'a EigenProblem<'a>,
        factor: &dyn Solve,
        goal: &'a Goal,
        block: usize,
        context: &Context<'a>,
    ) -> Self {
        // The basis holds twice the wanted modes and some spare vectors.
        let free = problem.pencil.n() - problem.rigid.ncols();
        let capacity = (2 * goal.wanted + SPARE_VECTORS).min(free + block);
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
            requested: goal.tolerance,
            least_excess: f64::INFINITY,
        }
    }

    /// Returns true when the basis spans the whole space.
    pub(super) fn is_complete(&self) -> bool {
        self.complete
    }

    /// Expands the basis until it has `size` vectors or spans the whole space.
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

    /// Expands the basis until all modes keep the requested residual by their estimates. A full basis is restarted from
    /// the lowest Ritz pairs.
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
            if ritz.has_all_modes() {
                return Ok(Outcome::Reached(ritz));
            }
            if let Some(shift) = self.restart(&ritz)? {
                return Ok(Outcome::ShiftTooLarge(shift));
            }
        }
    }

    /// Expands the basis until the true residuals of the modes keep the tolerance, or further steps gain too little.
    pub(super) fn find(&mut self, factor: &dyn Solve) -> Result<Outcome<FoundModes>, EigenFailure> {
        match self.estimate(factor)? {
            Outcome::Reached(ritz) => self.find_from(ritz, factor),
            Outcome::ShiftTooLarge(shift) => Ok(Outcome::ShiftTooLarge(shift)),
        }
    }

    /// Continues [`Self::find`] from Ritz pairs `ritz` whose estimates keep the requested residual.
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

    /// Returns the span of the modes and of half as many further Ritz vectors. Without these the corrections would have
    /// to find again what the basis already contains of the next modes.
    pub(super) fn rough_modes(&self, ritz: &Ritz) -> Mat<f64> {
        self.vectors(ritz, (ritz.last + ritz.last / 2 + 2 * self.block).min(ritz.size()))
    }

    /// Expands the basis by a block, unless it spans the whole space.
    fn expand(&mut self, factor: &dyn Solve) {
        let Self { krylov, block, .. } = self;
        if krylov.exhausted() {
            // The basis is an invariant subspace: it continues with new directions, if there are any.
            krylov.append_random((*block).min(krylov.free_columns()), factor);
        }
        self.complete = krylov.exhausted();
        if !self.complete {
            krylov.step(factor);
            self.steps += 1;
        }
    }

    /// Returns the Ritz values, ascending, and the converged modes that are kept when the shift changes.
    pub(super) fn midway(&mut self) -> Result<Midway, EigenFailure> {
        let mut ritz = self.test()?;
        if self.tightens_below_noise(&ritz) {
            ritz = self.test()?;
        }
        let eigenvalues: Vec<f64> = (0..ritz.size()).map(|i| ritz.lambda(i)).collect();
        let modes = self.vectors(&ritz, settled_count(&eigenvalues, ritz.converged));
        Ok(Midway { eigenvalues, modes })
    }

    /// Changes to the shift of `second`, which has `below` flexible modes below it.
    pub(super) fn change_shift(&mut self, midway: Midway, second: &dyn Solve, below: usize) {
        let tau = second.shift();
        self.krylov.change_shift(tau - self.tau);
        self.first = Some(First { modes: midway.modes, below });
        (self.tau, self.next_test) = (tau, 0);
    }

    /// Returns the shift to use instead of the current one, once the lowest Ritz value shows that it is too large.
    fn better_shift(&self, factor: &dyn Solve) -> Result<Option<f64>, EigenFailure> {
        if self.first.is_some() || !SHIFT_JUDGEMENT_STEPS.contains(&self.steps) {
            return Ok(None);
        }
        better_shift(self.problem, &self.krylov, factor, self.goal.wanted, &self.context)
    }

    /// Returns true when no further step fits before a restart.
    fn is_full(&self) -> bool {
        self.krylov.free_columns() < self.block
    }

    /// Returns true when solving the projected eigenproblem pays. It costs size^3: beyond some 100 vectors it is not
    /// solved after every step, nor while many modes are missing, of which a step finds a few.
    fn is_test_due(&self) -> bool {
        let size = self.krylov.projected();
        let small = size < self.goal.wanted + 1 || size < self.next_test;
        self.complete || self.is_full() || !small
    }

    /// Solves the projected eigenproblem, and finds the Ritz pairs that are modes.
    fn test(&mut self) -> Result<Ritz, EigenFailure> {
        let (krylov, wanted) = (&self.krylov, self.goal.wanted);
        let tau = self.tau;
        let (below, settled_count) =
            self.first.as_ref().map_or((0, 0), |first| (first.below, first.modes.ncols()));
        let size = krylov.projected();
        // Eigenpairs of the projected operator; a negative theta without a second shift means an indefinite M.
        let found = projected_pairs(krylov)?;
        let is_negative = |theta: &f64| *theta < -1e-8 * found.values[size - 1].abs();
        if below == 0 && found.values.first().is_some_and(is_negative) {
            return Err(EigenFailure::MassIndefinite);
        }
        // For eigenvalues below the shift and for those above it, lambda ascends where theta descends.
        let below = below.min(size);
        let order: Vec<usize> = (0..below).rev().chain((below..size).rev()).collect();
        let theta: Vec<f64> = order.iter().map(|&i| found.values[i]).collect();
        let s = Mat::from_fn(size, size, |i, j| found.vectors[(i, order[j])]);
        let has_all_below = below == 0 || found.values[below - 1] < 0.0;
        // Residuals, and the end of the cluster of the last wanted mode.
        let norms = krylov.residual_norms(s.as_ref());
        let last = cluster_end(wanted, size, CLUSTER_GAP, |i| 1.0 / theta[i] - tau);
        let mut ritz = Ritz { theta, s, norms, tau, last, converged: 0, beyond: false };
        // A pair counts as a mode by its estimate; pairs that converged with the first shift count without one.
        let is_mode = |i: &usize| self.complete || *i < settled_count || ritz.estimate(*i) <= self.requested;
        let converged = if has_all_below { (0..last).take_while(is_mode).count() } else { settled_count };
        ritz.converged = converged;
        ritz.beyond = self.complete || ritz.shows_gap();
        // Size of the basis at the next test: 4 % more, or a quarter of the missing modes more.
        self.next_test = size + (size / 25).max((last - converged) / 4);
        self.context.fraction(converged as f64 / wanted.max(1) as f64);
        Ok(ritz)
    }

    /// Returns the modes if they keep the tolerance; otherwise lowers the residual asked of the estimates.
    fn hand_over(&mut self, ritz: &Ritz) -> Result<Option<FoundModes>, EigenFailure> {
        if self.tightens_below_noise(ritz) {
            return Ok(None);
        }
        // True residuals of the modes.
        let (size, last) = (ritz.size(), ritz.last);
        let refined = Refined::new(self.problem, self.vectors(ritz, last), &self.context)?;
        let excess = refined.excess(self.goal.tolerance);
        // Another step costs a block, the refinement one column for each mode that needs it.
        let gains_nothing = excess.is_nan() || excess > 0.5 * self.least_excess;
        if excess <= 1.0 || self.complete || gains_nothing {
            let is_known = |i: &usize| self.complete || ritz.is_good(*i, 1e-2);
            let next = (last..size).take_while(is_known).map(|i| ritz.lambda(i)).collect();
            return Ok(Some(FoundModes { refined, next, tau: self.tau, finite: None }));
        }
        // Continue with estimates that must be as much smaller as the true residuals are too large.
        self.least_excess = excess;
        self.requested /= 1.2 * excess;
        Ok(None)
    }

    /// Returns the vectors of the first `count` Ritz pairs, after an inverse iteration.
    fn vectors(&self, ritz: &Ritz, count: usize) -> Mat<f64> {
        let mut vectors =
            self.krylov.inverse_iterated(ritz.s.as_ref().subcols(0, count), &ritz.theta[..count]);
        if let Some(First { modes, .. }) = &self.first {
            let known = modes.ncols().min(count);
            vectors.as_mut().subcols_mut(0, known).copy_from(modes.as_ref().subcols(0, known));
        }
        vectors
    }

    /// Lowers the residual asked of the estimates if rounding hides the true residual of the first mode, whose strain
    /// energy is least. Returns true when it lowered it.
    fn tightens_below_noise(&mut self, ritz: &Ritz) -> bool {
        let below_noise = (NOISE_TOLERANCE_FRACTION * self.goal.tolerance).max(MIN_RESIDUAL);
        let may_tighten = !self.complete && self.requested > below_noise;
        let tightens = may_tighten && {
            let count = ritz.last.min(1);
            let (first, eigenvalues) = (self.vectors(ritz, count), &[ritz.lambda(0)][..count]);
            let (_, floors) = residuals(self.problem, eigenvalues, first.as_ref(), &self.context);
            is_noisy(&floors, self.goal.tolerance)
        };
        if tightens {
            self.requested = below_noise;
        }
        tightens
    }

    /// Restarts a full basis from the lowest Ritz pairs. Returns a shift if the search should begin again with that
    /// one.
    ///
    /// # Errors
    /// [`EigenFailure::NotConverged`] if the basis spans the whole space, or after too many restarts.
    fn restart(&mut self, ritz: &Ritz) -> Result<Option<f64>, EigenFailure> {
        let Ritz { last, converged, .. } = *ritz;
        // Neither a complete basis nor the last restart can continue.
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
        // Keep the wanted Ritz vectors and a third of the spare ones.
        let keep = (last + (self.capacity - last) / 3).min(ritz.size().saturating_sub(self.block));
        self.krylov.restart(ritz.s.as_ref().subcols(0, keep), &ritz.theta[..keep]);
        self.next_test = 0;
        Ok(None)
    }
}

/// Returns the number of modes that do not change when the search continues with another shift: the `converged` ones up
/// to the last wide gap. Within a cluster modes may rotate.
fn settled_count(eigenvalues: &[f64], converged: usize) -> usize {
    let is_end = |end: &usize| {
        let (last, next) = (eigenvalues[end - 1], eigenvalues.get(*end).copied());
        next.is_some_and(|next| next - last > SEPARATING_GAP * next)
    };
    (1..=converged).rev().find(is_end).unwrap_or(0)
}

/// Returns the eigenpairs of the projected operator, theta ascending.
fn projected_pairs(krylov: &Krylov<'_>) -> Result<SymmetricEigen, EigenFailure> {
    symmetric_eigen(krylov.t()).ok_or(EigenFailure::Inaccurate { residual: f64::NAN })
}

/// Returns the `count` Ritz pairs with the largest theta, as eigenvalues lambda, ascending, and vectors.
fn largest_pairs(krylov: &Krylov<'_>, ritz: &SymmetricEigen, count: usize, tau: f64) -> (Vec<f64>, Mat<f64>) {
    let size = ritz.values.len();
    let count = count.min(size);
    let lambda = (0..count).map(|i| 1.0 / ritz.values[size - 1 - i] - tau).collect();
    let s = Mat::from_fn(size, count, |i, j| ritz.vectors[(i, size - 1 - j)]);
    (lambda, krylov.combination(s.as_ref()))
}

//! Corrections of approximate modes against the true K and M until their residuals keep the tolerance, by a block
//! Davidson method (Davidson, J. Comput. Phys. 17 (1975) 87). An inexact factor, or cycles over levels of groups of
//! nodes, turn the residual forces of the modes into corrections; Rayleigh-Ritz on all vectors of the search space
//! makes modes of them.

use super::canonical::{CLUSTER_GAP, cluster_end};
use super::count::size_along;
use super::failure::EigenFailure;
use super::problem::{EigenProblem, Task};
use super::refine::{FoundModes, Refined, independent, leave_unbalanced, residuals, small_ritz};
use super::search::Goal;
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::multigrid::{CorrectionTarget, DeflationSpace, Levels};
use flexbody_linalg::{
    Solve, Tall, combine, combine_in_place, combine_into, gram, largest, parallel, subtract_combination,
};
use std::ops::Range;

/// Residual asked of the first mode beyond the wanted ones. The error of its eigenvalue, which bounds the gap of the
/// count, is the square of this residual.
const NEXT_MODE_RESIDUAL: f64 = 1e-3;

/// Relative distance between the last wanted eigenvalue and the next one up to which the next mode may belong to the
/// same cluster: with a residual of [`NEXT_MODE_RESIDUAL`] its Ritz value does not decide. Such a mode is corrected
/// like the wanted ones, so that the cluster is seen, and its canonical basis does not depend on the progress of the
/// search.
const POSSIBLE_CLUSTER_GAP: f64 = 1e-3;

/// Largest number of rounds of corrections.
const MAX_CORRECTION_ROUNDS: usize = 60;

/// Number of successive rounds without a gain of a factor of two after which the corrections end.
const MAX_STALLED_ROUNDS: usize = 6;

/// Numbers of rounds of cycles, each with the factor by which the residuals must have fallen by then. With a smaller
/// gain a factor takes less time than the remaining rounds. Measured gains: cubes, bars and brackets of every element
/// 2.4 and more after two rounds, 5 to 10^5 after four; blocks with thin bars, flat elements, contrasts of stiffness
/// and nearly incompressible bodies at most 1.25 after two. The test after two rounds halves the time lost on the
/// latter.
const REQUIRED_GAINS: [(usize, f64); 2] = [(2, 1.5), (4, 7.0)];

/// Search space that is corrected until its lowest Ritz pairs keep the tolerance and the end of the cluster of the last
/// wanted mode is known.
pub(super) struct Correction<'a> {
    problem: &'a EigenProblem<'a>,
    corrector: Corrector<'a>,
    goal: &'a Goal,
    context: Context<'a>,
    space: SearchSpace<'a>,
    /// Number of vectors at the start.
    base: usize,
    /// Number of wanted modes, to the end of the cluster of the last one.
    wanted: usize,
    /// Number of modes that keep the tolerance.
    converged: usize,
    /// Rounding floors of the residuals of the examined pairs.
    floors: Vec<f64>,
    /// Size of the matrix along the last examined pair: [`size_along`].
    size: f64,
    /// Number of rounds so far.
    rounds: usize,
    /// Largest excess before the first round.
    first_excess: f64,
    /// Least excess so far.
    least_excess: f64,
    /// Number of rounds since the least excess last halved.
    rounds_since: usize,
}

impl<'a> Correction<'a> {
    /// Begins with the span of `x` and the number of wanted modes.
    pub(super) fn begin(
        task: &Task<'a>,
        corrector: Corrector<'a>,
        goal: &'a Goal,
        x: Mat<f64>,
        wanted: usize,
    ) -> Result<Self, EigenFailure> {
        let Task { problem, context, .. } = *task;
        let base = x.ncols();
        // Levels need a basis of Ritz vectors from the start.
        let mut space = SearchSpace::new(problem, x, corrector.capacity(base), context)?;
        if corrector.must_contract(base, base) {
            space.contract(base);
        }
        Ok(Self {
            problem,
            corrector,
            goal,
            context: *context,
            base: space.lambda.len(),
            space,
            wanted,
            converged: 0,
            floors: Vec::new(),
            size: 0.0,
            rounds: 0,
            first_excess: f64::NAN,
            least_excess: f64::INFINITY,
            rounds_since: 0,
        })
    }

    /// Corrects until the modes keep the tolerance. Returns the modes and the examined eigenvalues after them.
    pub(super) fn modes(mut self) -> Result<FoundModes, EigenFailure> {
        for _ in 0..MAX_CORRECTION_ROUNDS {
            // Examine the wanted pairs and the next one.
            let (forces, examined) = self.excess();
            let keeps = |pair: &Pair| pair.residual <= pair.allowed;
            self.converged = examined[..self.wanted].iter().filter(|pair| keeps(pair)).count();
            let poor: Vec<Pair> = examined.iter().copied().filter(|pair| !keeps(pair)).collect();
            self.context.fraction(1.0 - poor.len() as f64 / examined.len() as f64);
            // Done when all pairs keep their residuals; given up when the gain is too small.
            if poor.is_empty() {
                return self.hand_over(examined.len());
            }
            if !self.is_worthwhile(largest(examined.iter().map(|pair| pair.residual / pair.allowed))) {
                break;
            }
            self.correct(&forces, &poor)?;
        }
        Err(EigenFailure::NotConverged { converged: self.converged, wanted: self.wanted })
    }

    /// Returns the residual forces of the examined pairs, with the relative sizes of the residuals and the sizes
    /// allowed.
    fn excess(&mut self) -> (Tall, Vec<Pair>) {
        let (forces, relative) = self.examine();
        if self.extend_to_gap(&relative) {
            return self.excess();
        }
        let (tolerance, lambda) = (self.goal.tolerance, &self.space.lambda);
        // Pairs that may belong to the cluster of the last wanted one need the full accuracy.
        let may_be_wanted = cluster_end(self.wanted, lambda.len(), POSSIBLE_CLUSTER_GAP, |i| lambda[i]);
        let allowed =
            |j: usize| if j < may_be_wanted { tolerance.max(self.floors[j]) } else { NEXT_MODE_RESIDUAL };
        let pair = |(number, residual)| Pair { number, residual, allowed: allowed(number) };
        (forces, relative.into_iter().enumerate().map(pair).collect())
    }

    /// Returns the residual forces of the wanted pairs and of the next one, and their relative sizes.
    fn examine(&mut self) -> (Tall, Vec<f64>) {
        let Self { problem, context, space, .. } = self;
        let lambda = &space.lambda;
        // The wanted pairs, to the end of their cluster, and the one after it.
        self.wanted = cluster_end(self.wanted, lambda.len(), CLUSTER_GAP, |i| lambda[i]);
        let examined = (self.wanted + 1).min(lambda.len());
        // Rounding floors change little between rounds: they are computed once for each pair.
        if self.floors.len() < examined {
            let lowest = space.some_vectors(0..examined);
            self.floors = residuals(problem, &lambda[..examined], lowest.as_ref(), context).1;
            self.size = size_along(problem, lambda[examined - 1], lowest.as_ref().col(examined - 1));
        }
        space.unbalanced(0..examined)
    }

    /// Extends the wanted modes to the next gap wide enough for the count, if the gap above them is too narrow and such
    /// a gap is near. Does so only when the pairs are accurate enough to decide. Returns true when it extended them.
    fn extend_to_gap(&mut self, relative: &[f64]) -> bool {
        let are_good = relative.iter().all(|relative| *relative <= NEXT_MODE_RESIDUAL);
        if self.goal.separation == 0.0 || !are_good {
            return false;
        }
        let lambda = &self.space.lambda;
        // The last wanted modes converge only if half of the vectors beside the wanted ones remain beyond them.
        let farthest = ((self.goal.wanted + self.base) / 2).min(lambda.len().saturating_sub(1));
        let is_wide =
            |end: &usize| *end > 0 && lambda[*end] - lambda[end - 1] >= self.goal.separation * self.size;
        // The first gap that is wide enough, if there is one within reach.
        let end = (self.wanted..=farthest).find(is_wide).unwrap_or(self.wanted);
        let extends = end > self.wanted;
        if extends {
            self.wanted = end;
            (self.least_excess, self.rounds_since) = (f64::INFINITY, 0);
        }
        extends
    }

    /// Returns the wanted modes of the span, and the examined eigenvalues beyond them.
    fn hand_over(self, examined: usize) -> Result<FoundModes, EigenFailure> {
        let Self { problem, corrector, space, wanted, context, .. } = self;
        let next = space.lambda[wanted..examined].to_vec();
        let refined = Refined::new(problem, space.vectors(0..wanted), &context)?;
        Ok(FoundModes { refined, next, tau: corrector.shift(), finite: None })
    }

    /// Returns true when further corrections pay, given the largest excess `worst`.
    fn is_worthwhile(&mut self, worst: f64) -> bool {
        if self.rounds == 0 {
            self.first_excess = worst;
        }
        // A round counts as a gain if it halves the excess.
        if worst < 0.5 * self.least_excess {
            (self.least_excess, self.rounds_since) = (worst, 0);
        } else {
            self.rounds_since += 1;
        }
        // Cycles must also have reached the gains that justify them.
        let rounds = self.rounds;
        let is_behind = |(after, gain): &(usize, f64)| rounds == *after && worst > self.first_excess / gain;
        let is_slow = matches!(self.corrector, Corrector::Levels(_)) && REQUIRED_GAINS.iter().any(is_behind);
        self.rounds += 1;
        self.rounds_since <= MAX_STALLED_ROUNDS && !is_slow && !worst.is_nan()
    }

    /// Extends the search space by corrections of the poor pairs among the examined ones, and of some pairs after them.
    fn correct(&mut self, forces: &Tall, poor: &[Pair]) -> Result<(), EigenFailure> {
        let Self { corrector, space, base, context, .. } = self;
        let examined = forces.ncols();
        let added = corrector.batch_size(poor.len()) - poor.len();
        // The block is filled up with the residual forces of the next Ritz pairs.
        let (after, relative) = space.unbalanced(examined..space.lambda.len().min(examined + added));
        let later = relative.iter().zip(examined..);
        let later = later.map(|(&residual, number)| Pair { number, residual, allowed: NEXT_MODE_RESIDUAL });
        let pairs: Vec<Pair> = poor.iter().copied().chain(later).collect();
        let poor = poor.iter().map(|pair| forces.as_ref().col(pair.number));
        let columns: Vec<_> = poor.chain(after.as_ref().col_iter()).collect();
        // Columns are scaled to unit size: residuals near rounding would leave the range of single precision.
        let unit = |size: f64| if size > 0.0 { size.recip() } else { 0.0 };
        let scales = parallel::map(&columns, |column| unit(column.norm_max()));
        let mut d = Tall::with_capacity(self.problem.pencil.n(), columns.len());
        columns.iter().zip(scales).for_each(|(column, scale)| d.push_multiple(scale, *column));
        // Solve the correction equations.
        corrector.correct(space, &pairs, &mut d, context);
        // A space without capacity for the corrections is first reduced to its lowest Ritz vectors.
        if d.ncols() > space.free_columns() {
            space.contract(*base);
        }
        space.extend(&mut d, corrector.passes(), context)?;
        if corrector.must_contract(space.lambda.len(), *base) {
            space.contract(*base);
        }
        Ok(())
    }
}
/// Part of the error of a correction that may remain, relative to the residual of the pair: a correction is accurate to
/// about the square of the residual, and the residual is mostly roughness that one step removes. Measured with this
/// value and [`MIN_TARGET_ERROR`] on a bar and a cube of 100,000 rows, 16 to 24 modes: the steps of cycles vary by a
/// twentieth.
const ERROR_PER_RESIDUAL: f64 = 0.2;

/// Smallest part of the error of a correction that is aimed at: the missing directions of the span limit the gain of a
/// more accurate correction.
const MIN_TARGET_ERROR: f64 = 0.007;

/// Part of the allowed residual that a last correction aims at.
const LAST_TARGET_FRACTION: f64 = 0.3;

/// Number of pairs that cycles correct together: their number is filled up to a multiple of it. With additional pairs
/// above the wanted ones the last wanted pairs converge sooner. Fewer poor pairs than this, near the end, are not
/// filled up: they take fewer steps alone.
const PAIRS_PER_CYCLE: usize = 8;

/// Returns the capacity of a search space that levels correct and that starts with `base` vectors.
pub(super) fn capacity_with_levels(base: usize) -> usize {
    2 * base + PAIRS_PER_CYCLE
}

/// Operator that turns residual forces into corrections.
#[derive(Clone, Copy)]
pub(super) enum Corrector<'a> {
    /// Inexact factor of K + tau M: the correction is T r.
    Factor(&'a dyn Solve),
    /// Cycles over levels, for the correction equation of each mode.
    Levels(&'a dyn Levels),
}

/// A Ritz pair under examination.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// Index of the pair, from the lowest.
    pub number: usize,
    /// Relative residual.
    pub residual: f64,
    /// Largest allowed relative residual.
    pub allowed: f64,
}

impl Corrector<'_> {
    /// Returns the shift tau.
    pub(super) fn shift(self) -> f64 {
        match self {
            Self::Factor(factor) => factor.shift(),
            Self::Levels(levels) => levels.shift(),
        }
    }

    /// Returns the number of pairs to correct when `poor` of them are poor.
    pub(super) fn batch_size(self, poor: usize) -> usize {
        match self {
            Self::Levels(_) if poor >= PAIRS_PER_CYCLE => poor.next_multiple_of(PAIRS_PER_CYCLE),
            _ => poor,
        }
    }

    /// Returns the number of passes that orthogonalise corrections against the search space. Corrections by levels are
    /// nearly orthogonal already, and Rayleigh-Ritz accounts for the rest.
    pub(super) fn passes(self) -> usize {
        match self {
            Self::Factor(_) => 2,
            Self::Levels(_) => 1,
        }
    }

    /// Returns true when a search space that started with `base` vectors and now has `vectors` must be contracted. With
    /// earlier corrections by a factor the last modes take half the columns. Earlier corrections by levels add nothing
    /// more, and levels need a basis of Ritz vectors.
    pub(super) fn must_contract(self, vectors: usize, base: usize) -> bool {
        match self {
            Self::Factor(_) => vectors > 2 * base,
            Self::Levels(_) => true,
        }
    }

    /// Returns the capacity of a search space that starts with `base` vectors.
    pub(super) fn capacity(self, base: usize) -> usize {
        match self {
            Self::Factor(_) => 3 * base + 1,
            Self::Levels(_) => capacity_with_levels(base),
        }
    }

    /// Replaces the residual forces of the pairs, of about unit size, by corrections. For levels the space must be one
    /// of Ritz vectors.
    pub(super) fn correct(
        self,
        space: &SearchSpace<'_>,
        pairs: &[Pair],
        forces: &mut Tall,
        context: &Context<'_>,
    ) {
        let solved = match self {
            Self::Factor(factor) => {
                factor.solve_in_place(forces.as_mut());
                forces.ncols() as u64
            }
            Self::Levels(levels) => {
                let targets: Vec<CorrectionTarget> = pairs.iter().map(Pair::target).collect();
                levels.correct(&space.deflation_space(), &targets, forces.as_mut())
            }
        };
        context.count(|work| work.solved_columns += solved);
    }
}

impl Pair {
    /// Returns the part of the error that the correction of this pair may leave.
    fn target(&self) -> CorrectionTarget {
        let last = LAST_TARGET_FRACTION * self.allowed / self.residual;
        CorrectionTarget {
            pair: self.number,
            left: (ERROR_PER_RESIDUAL * self.residual).max(last).max(MIN_TARGET_ERROR),
        }
    }
}

/// Nearly M-orthonormal basis, M-orthogonal to the rigid modes.
pub(super) struct SearchSpace<'a> {
    problem: &'a EigenProblem<'a>,
    /// M times the rigid modes.
    m_rigid: Mat<f64>,
    /// Basis X, and K X and M X.
    x: Tall,
    kx: Tall,
    mx: Tall,
    /// Largest number of vectors.
    capacity: usize,
    /// Gram matrices X'M X and X'K X.
    gm: Mat<f64>,
    gk: Mat<f64>,
    /// Ritz values, ascending.
    pub lambda: Vec<f64>,
    /// Coefficients of the Ritz vectors, which are M-orthonormal.
    ritz: Mat<f64>,
    /// True if the basis consists of Ritz vectors.
    is_ritz: bool,
    /// Buffer for M times vectors. It is kept, because newly allocated memory is cleared first.
    work: Tall,
}

impl<'a> SearchSpace<'a> {
    /// Creates the space from the span of `x`, made M-orthogonal to the rigid modes, with a capacity of `capacity`
    /// vectors.
    pub(super) fn new(
        problem: &'a EigenProblem<'a>,
        x: Mat<f64>,
        capacity: usize,
        context: &Context<'_>,
    ) -> Result<Self, EigenFailure> {
        let n = problem.pencil.n();
        let mut space = Self {
            problem,
            m_rigid: problem.pencil.apply_mass(problem.rigid),
            x: Tall::with_capacity(n, capacity),
            kx: Tall::with_capacity(n, capacity),
            mx: Tall::with_capacity(n, capacity),
            capacity,
            gm: Mat::zeros(0, 0),
            gk: Mat::zeros(0, 0),
            lambda: Vec::new(),
            ritz: Mat::zeros(0, 0),
            is_ritz: false,
            work: Tall::with_capacity(n, x.ncols()),
        };
        let mut first = Tall::copied(x.as_ref());
        drop(x);
        space.extend(&mut first, 1, context)?;
        Ok(space)
    }

    /// Returns the number of vectors that can still be added.
    pub(super) fn free_columns(&self) -> usize {
        self.capacity - self.x.ncols()
    }

    /// Adds the span of `d`, made M-orthogonal to the rigid modes and to the basis in `passes` passes, and
    /// M-orthonormal in itself. Directions that consist of rounding are left out.
    ///
    /// # Panics
    /// If the capacity is too small.
    pub(super) fn extend(
        &mut self,
        d: &mut Tall,
        passes: usize,
        context: &Context<'_>,
    ) -> Result<(), EigenFailure> {
        let Self { problem, m_rigid, x, kx, mx, gm, gk, work, .. } = self;
        let (pencil, columns, used) = (&problem.pencil, d.ncols(), x.ncols());
        // Projection off the rigid modes and the basis.
        for _ in 0..passes {
            let along = gram(m_rigid.as_ref(), d.as_ref());
            subtract_combination(d.as_mut(), problem.rigid, along.as_ref());
            if used > 0 {
                let along = gram(mx.as_ref(), d.as_ref());
                subtract_combination(d.as_mut(), x.as_ref(), along.as_ref());
            }
        }
        // M-orthonormalisation of what remains; dependent directions are dropped.
        context.count(|work| work.mass_columns += columns as u64);
        pencil.mass_times(d.as_ref(), work.first_mut(columns));
        let orthonormal = independent(&gram(d.as_ref(), work.first(columns)))?;
        let added = used..used + orthonormal.ncols();
        context.count(|work| work.stiffness_columns += added.len() as u64);
        // The basis and its products grow by the same combinations; only K times the new vectors is computed afresh.
        [&mut *x, &mut *kx, &mut *mx].into_iter().for_each(|block| block.add_zeros(added.len()));
        combine_into(x.columns_mut(added.clone()), d.as_ref(), orthonormal.as_ref());
        combine_into(mx.columns_mut(added.clone()), work.first(columns), orthonormal.as_ref());
        pencil.stiffness_times(x.columns(added.clone()), kx.columns_mut(added.clone()));
        // The Gram matrices gain a border, and the Ritz pairs are computed from them.
        *gm = bordered(gm, &gram(x.as_ref(), mx.columns(added.clone())));
        *gk = bordered(gk, &gram(x.as_ref(), kx.columns(added)));
        (self.lambda, self.ritz) = small_ritz(gm, gk)?;
        self.is_ritz = false;
        Ok(())
    }

    /// Reduces the space to the span of its lowest Ritz vectors, at most `kept` of them.
    pub(super) fn contract(&mut self, kept: usize) {
        let kept = kept.min(self.lambda.len());
        let lowest = self.ritz.as_ref().subcols(0, kept);
        for block in [&mut self.x, &mut self.kx, &mut self.mx] {
            combine_in_place(block.as_mut(), lowest);
            block.truncate(kept);
        }
        self.lambda.truncate(kept);
        self.gm = Mat::identity(kept, kept);
        self.gk = Mat::from_fn(kept, kept, |i, j| if i == j { self.lambda[i] } else { 0.0 });
        self.ritz = Mat::identity(kept, kept);
        self.is_ritz = true;
    }

    /// Returns the rigid modes and the basis. The basis must consist of Ritz vectors.
    pub(super) fn deflation_space(&self) -> DeflationSpace<'_> {
        DeflationSpace {
            rigid: [self.problem.rigid, self.m_rigid.as_ref()],
            modes: self.x.as_ref(),
            k_modes: self.kx.as_ref(),
            m_modes: self.mx.as_ref(),
            eigenvalues: &self.lambda,
        }
    }

    /// Returns the Ritz vectors of the range `which` (N x k).
    pub(super) fn vectors(&self, which: Range<usize>) -> Mat<f64> {
        combine(self.x.as_ref(), self.ritz.as_ref().subcols(which.start, which.len()))
    }

    /// Returns the Ritz vectors of the range `which` (N x k), computed by all threads.
    pub(super) fn some_vectors(&self, which: Range<usize>) -> Tall {
        let mut vectors = Tall::zeros(self.problem.pencil.n(), which.len());
        combine_into(vectors.as_mut(), self.x.as_ref(), self.ritz.as_ref().subcols(which.start, which.len()));
        vectors
    }

    /// Returns the residual forces K x - lambda M x of the Ritz pairs `which`, and their norms relative to |K x| +
    /// |lambda M x|.
    pub(super) fn unbalanced(&mut self, which: Range<usize>) -> (Tall, Vec<f64>) {
        let Self { problem, kx, mx, lambda, ritz, work, .. } = self;
        let (count, lambda) = (which.len(), &lambda[which.clone()]);
        if self.is_ritz {
            let mut forces = Tall::copied(kx.columns(which.clone()));
            let (_, residuals) = leave_unbalanced(&mut forces, mx.columns(which), lambda);
            return (forces, residuals);
        }
        let ritz = ritz.as_ref().subcols(which.start, count);
        combine_into(work.first_mut(count), mx.as_ref(), ritz);
        let mut forces = Tall::zeros(problem.pencil.n(), count);
        combine_into(forces.as_mut(), kx.as_ref(), ritz);
        let (_, residuals) = leave_unbalanced(&mut forces, work.first(count), lambda);
        (forces, residuals)
    }
}

/// Returns [A, B; B', C], where `last` holds its last columns: B above C.
fn bordered(a: &Mat<f64>, last: &Mat<f64>) -> Mat<f64> {
    let m = a.ncols();
    Mat::from_fn(last.nrows(), last.nrows(), |i, j| match (i < m, j < m) {
        (true, true) => a[(i, j)],
        (_, false) => last[(i, j - m)],
        (false, true) => last[(j, i - m)],
    })
}

//! Corrections of approximate modes against the true K and M until their residuals keep the tolerance: a block
//! Davidson method (Davidson, J. Comput. Phys. 17 (1975) 87). A factor that is not exact, or cycles over levels of
//! groups of nodes, turn the forces that the modes leave unbalanced into corrections; Rayleigh-Ritz on all vectors
//! there are makes modes of them.

use super::attempt::Goal;
use super::canonical::{CLUSTER_GAP, cluster_end};
use super::completeness::size_along;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::problem::Task;
use super::refine::{FoundModes, Refined, residuals};
use super::refine::{independent, leave_unbalanced, small_ritz};
use faer::Mat;
use flexbody_linalg::context::Context;
use flexbody_linalg::multigrid::Near;
use flexbody_linalg::multigrid::{Aim, Levels};
use flexbody_linalg::{
    Solve, Tall, combine, combine_in_place, combine_into, gram, largest, subtract_combination,
};
use rayon::prelude::*;
use std::ops::Range;

/// Residual of the first mode beyond the wanted ones: its eigenvalue, good to the square, bounds the gap of
/// the count.
const BEYOND: f64 = 1e-3;

/// Distance of the first mode beyond the wanted ones from these, relative to its eigenvalue, up to which it may belong to
/// the cluster of the last of them: with a residual of [`BEYOND`] its Ritz value does not tell. It is then corrected like
/// the wanted ones, so that the cluster is seen, and its canonical basis does not depend on how far the search went.
const MAY_REPEAT: f64 = 1e-3;

/// Largest number of rounds of corrections.
const MAX_ROUNDS: usize = 60;

/// Number of rounds in a row without a gain of a factor of two that ends the corrections.
const PATIENCE: usize = 6;

/// Numbers of rounds of cycles, and the factors that they must have gained until then: with less, a factor takes less time
/// than the rounds to come. Measured gains: cubes, bars and brackets of every element 2.4 and more after two rounds, 5 to
/// 10^5 after four; blocks with thin bars, flat elements, contrasts of stiffness and nearly incompressible bodies at most
/// 1.25 after two. Judging after two rounds halves the time that is lost on the latter.
const GAINS_ASKED: [(usize, f64); 2] = [(2, 1.5), (4, 7.0)];

/// A span of vectors that is corrected until its lowest Ritz pairs keep the tolerance, and the end of their
/// cluster is seen.
pub(super) struct Correction<'a> {
    problem: &'a EigenProblem<'a>,
    corrector: Corrector<'a>,
    goal: &'a Goal,
    context: Context<'a>,
    space: SearchSpace<'a>,
    /// First size of the span.
    base: usize,
    /// Modes wanted, to the end of the cluster of the last one.
    wanted: usize,
    /// Number of modes that keep the tolerance.
    converged: usize,
    /// Rounding floors of the pairs that are looked at.
    floors: Vec<f64>,
    /// Size of the matrix along the last of them: [`size_along`].
    size: f64,
    /// Rounds so far, and the largest excess before them.
    rounds: usize,
    first: f64,
    /// Least excess so far, and the rounds since.
    least: f64,
    since: usize,
}

impl<'a> Correction<'a> {
    /// Begins with the span of `x`, for so many wanted modes.
    pub(super) fn begin(
        task: &Task<'a>,
        corrector: Corrector<'a>,
        goal: &'a Goal,
        (x, wanted): (Mat<f64>, usize),
    ) -> Result<Self, EigenFailure> {
        let Task { problem, context, .. } = *task;
        let base = x.ncols();
        let mut space = SearchSpace::new(problem, x, corrector.room(base), context)?;
        if corrector.contracts(base, base) {
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
            first: f64::NAN,
            least: f64::INFINITY,
            since: 0,
        })
    }

    /// Corrects until the modes keep the tolerance; returns them and the eigenvalue after them.
    pub(super) fn modes(mut self) -> Result<FoundModes, EigenFailure> {
        for _ in 0..MAX_ROUNDS {
            let (forces, looked) = self.excess();
            let keeps = |pair: &Pair| pair.residual <= pair.allowed;
            self.converged = looked[..self.wanted].iter().filter(|pair| keeps(pair)).count();
            let poor: Vec<Pair> = looked.iter().copied().filter(|pair| !keeps(pair)).collect();
            self.context.fraction(1.0 - poor.len() as f64 / looked.len() as f64);
            if poor.is_empty() {
                return self.hand_over(looked.len());
            }
            if !self.gains(largest(looked.iter().map(|pair| pair.residual / pair.allowed))) {
                break;
            }
            self.correct(&forces, &poor)?;
        }
        Err(EigenFailure::NotConverged { converged: self.converged, wanted: self.wanted })
    }

    /// Returns the unbalanced forces of the pairs that are looked at, with their sizes and the sizes allowed.
    fn excess(&mut self) -> (Tall, Vec<Pair>) {
        let (forces, relative) = self.look();
        if self.seeks_gap(&relative) {
            return self.excess();
        }
        let (tolerance, lambda) = (self.goal.tolerance, &self.space.lambda);
        let may_be_wanted = cluster_end(self.wanted, lambda.len(), MAY_REPEAT, |i| lambda[i]);
        let allowed = |j: usize| if j < may_be_wanted { tolerance.max(self.floors[j]) } else { BEYOND };
        let pair = |(number, residual)| Pair { number, residual, allowed: allowed(number) };
        (forces, relative.into_iter().enumerate().map(pair).collect())
    }

    /// Returns the unbalanced forces of the wanted pairs and of the one after them, and their relative sizes.
    fn look(&mut self) -> (Tall, Vec<f64>) {
        let Self { problem, context, space, .. } = self;
        let lambda = &space.lambda;
        self.wanted = cluster_end(self.wanted, lambda.len(), CLUSTER_GAP, |i| lambda[i]);
        let looked = (self.wanted + 1).min(lambda.len());
        if self.floors.len() < looked {
            let lowest = space.some_vectors(0..looked);
            self.floors = residuals(problem, &lambda[..looked], lowest.as_ref(), context).1;
            self.size = size_along(problem, lambda[looked - 1], lowest.as_ref().col(looked - 1));
        }
        space.unbalanced(0..looked)
    }

    /// Once the pairs are good enough to tell: where the gap above the wanted modes is too narrow for the
    /// count, wants those up to the next one that is wide enough, if it is near.
    fn seeks_gap(&mut self, relative: &[f64]) -> bool {
        let are_good = relative.iter().all(|relative| *relative <= BEYOND);
        if self.goal.separation == 0.0 || !are_good {
            return false;
        }
        let lambda = &self.space.lambda;
        // Half of the vectors beside the wanted ones remain what lets the last of these converge.
        let farthest = ((self.goal.wanted + self.base) / 2).min(lambda.len().saturating_sub(1));
        let is_wide =
            |end: &usize| *end > 0 && lambda[*end] - lambda[end - 1] >= self.goal.separation * self.size;
        let end = (self.wanted..=farthest).find(is_wide).unwrap_or(self.wanted);
        let seeks = end > self.wanted;
        if seeks {
            self.wanted = end;
            (self.least, self.since) = (f64::INFINITY, 0);
        }
        seeks
    }

    /// Returns the wanted modes of the span, and the eigenvalues beyond them that were looked at.
    fn hand_over(self, looked: usize) -> Result<FoundModes, EigenFailure> {
        let Self { problem, corrector, space, wanted, context, .. } = self;
        let next = space.lambda[wanted..looked].to_vec();
        let refined = Refined::new(problem, space.vectors(0..wanted), &context)?;
        Ok(FoundModes { refined, next, tau: corrector.shift(), finite: None })
    }

    /// Returns true when corrections are worth going on with when the largest excess is `worst`.
    fn gains(&mut self, worst: f64) -> bool {
        if self.rounds == 0 {
            self.first = worst;
        }
        if worst < 0.5 * self.least {
            (self.least, self.since) = (worst, 0);
        } else {
            self.since += 1;
        }
        let rounds = self.rounds;
        let is_behind = |(after, gain): &(usize, f64)| rounds == *after && worst > self.first / gain;
        let is_slow = matches!(self.corrector, Corrector::Levels(_)) && GAINS_ASKED.iter().any(is_behind);
        self.rounds += 1;
        self.since <= PATIENCE && !is_slow && !worst.is_nan()
    }

    /// Extends the space by corrections of the poor pairs, of those that are looked at, and of some pairs after
    /// them.
    fn correct(&mut self, forces: &Tall, poor: &[Pair]) -> Result<(), EigenFailure> {
        let Self { corrector, space, base, context, .. } = self;
        let looked = forces.ncols();
        let filled = corrector.filled(poor.len()) - poor.len();
        let (after, relative) = space.unbalanced(looked..space.lambda.len().min(looked + filled));
        let later = relative.iter().zip(looked..);
        let later = later.map(|(&residual, number)| Pair { number, residual, allowed: BEYOND });
        let pairs: Vec<Pair> = poor.iter().copied().chain(later).collect();
        let poor = poor.iter().map(|pair| forces.as_ref().col(pair.number));
        let columns: Vec<_> = poor.chain(after.as_ref().col_iter()).collect();
        // Of unit size: residuals near rounding would leave the range of single precision.
        let unit = |size: f64| if size > 0.0 { size.recip() } else { 0.0 };
        let scales: Vec<f64> = columns.par_iter().map(|column| unit(column.norm_max())).collect();
        let mut d = Tall::with_room(self.problem.pencil.n(), columns.len());
        columns.iter().zip(scales).for_each(|(column, scale)| d.push_multiple(scale, *column));
        corrector.correct(space, &pairs, &mut d, context);
        if d.ncols() > space.room() {
            space.contract(*base);
        }
        space.extend(&mut d, corrector.passes(), context)?;
        if corrector.contracts(space.lambda.len(), *base) {
            space.contract(*base);
        }
        Ok(())
    }
}
/// Part of the error of a correction that may be left, beside the residual of the pair: a correction is right to
/// about the square of that, and the residual is mostly roughness that a step removes. (Measured with these two
/// numbers on a bar and a cube of 100,000 rows, 16 to 24 modes: steps of cycles vary by a twentieth.)
const LEFT_OF_RESIDUAL: f64 = 0.2;

/// The least part, since what the span lacks limits what a correction gains.
const LEAST_LEFT: f64 = 0.007;

/// Part of the residual that a last correction aims at.
const BELOW_ALLOWED: f64 = 0.3;

/// Pairs that cycles correct, filled up to a multiple: with those above the wanted ones the last of these converge
/// sooner. The few that are poor at the end take fewer steps than those that would fill them up.
const FILLED: usize = 8;

/// Vectors that a span which levels correct has room for, with so many at first.
pub(super) fn room_with_levels(base: usize) -> usize {
    2 * base + FILLED
}

#[derive(Clone, Copy)]
pub(super) enum Corrector<'a> {
    /// A factor of K + tau M that is not exact: T r.
    Factor(&'a dyn Solve),
    /// Cycles over levels, for the correction equation of each mode.
    Levels(&'a dyn Levels),
}

/// A Ritz pair that is looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// Its number, from the lowest.
    pub number: usize,
    /// Its relative residual, and what that may be.
    pub residual: f64,
    pub allowed: f64,
}

impl Corrector<'_> {
    /// The shift tau.
    pub(super) fn shift(self) -> f64 {
        match self {
            Self::Factor(factor) => factor.shift(),
            Self::Levels(levels) => levels.shift(),
        }
    }

    /// The number of pairs that is corrected where so many are poor.
    pub(super) fn filled(self, poor: usize) -> usize {
        match self {
            Self::Levels(_) if poor >= FILLED => poor.next_multiple_of(FILLED),
            _ => poor,
        }
    }

    /// Times that corrections are made orthogonal to the space. Those of levels nearly are already, and Rayleigh-Ritz
    /// accounts for what is left along it.
    pub(super) fn passes(self) -> usize {
        match self {
            Self::Factor(_) => 2,
            Self::Levels(_) => 1,
        }
    }

    /// Returns true when a span of `base` vectors at first, and now so many, has to be contracted. With earlier corrections of a
    /// factor the last modes take half the columns; corrections of levels have used up what these would tell, and
    /// need a basis of Ritz vectors.
    pub(super) fn contracts(self, vectors: usize, base: usize) -> bool {
        match self {
            Self::Factor(_) => vectors > 2 * base,
            Self::Levels(_) => true,
        }
    }

    /// Vectors that a span of `base` vectors at first has room for.
    pub(super) fn room(self, base: usize) -> usize {
        match self {
            Self::Factor(_) => 3 * base + 1,
            Self::Levels(_) => room_with_levels(base),
        }
    }

    /// Replaces the forces, of about unit size, which the pairs of the space leave unbalanced. The space of levels is
    /// one of Ritz vectors.
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
                let aims: Vec<Aim> = pairs.iter().map(Pair::aim).collect();
                levels.correct(&space.near(), &aims, forces.as_mut())
            }
        };
        context.count(|work| work.solved_columns += solved);
    }
}

impl Pair {
    fn aim(&self) -> Aim {
        let last = BELOW_ALLOWED * self.allowed / self.residual;
        Aim { pair: self.number, left: (LEFT_OF_RESIDUAL * self.residual).max(last).max(LEAST_LEFT) }
    }
}

/// A basis M-orthogonal to the rigid modes, nearly M-orthonormal.
pub(super) struct SearchSpace<'a> {
    problem: &'a EigenProblem<'a>,
    /// M times the rigid modes.
    m_rigid: Mat<f64>,
    /// The basis, and K and M times it.
    x: Tall,
    kx: Tall,
    mx: Tall,
    /// Vectors that there is room for.
    capacity: usize,
    /// X'M X and X'K X.
    gm: Mat<f64>,
    gk: Mat<f64>,
    /// Ritz values, ascending.
    pub lambda: Vec<f64>,
    /// Coefficients of the Ritz vectors, which are M-orthonormal.
    ritz: Mat<f64>,
    /// True when the basis is one of Ritz vectors.
    is_ritz: bool,
    /// M times vectors in work: kept, since memory that is taken anew is cleared first.
    work: Tall,
}

impl<'a> SearchSpace<'a> {
    /// The span of `x`, made M-orthogonal to the rigid modes, with room for so many vectors.
    pub(super) fn new(
        problem: &'a EigenProblem<'a>,
        x: Mat<f64>,
        room: usize,
        context: &Context<'_>,
    ) -> Result<Self, EigenFailure> {
        let n = problem.pencil.n();
        let mut own = Self {
            problem,
            m_rigid: problem.pencil.apply_mass(problem.rigid),
            x: Tall::with_room(n, room),
            kx: Tall::with_room(n, room),
            mx: Tall::with_room(n, room),
            capacity: room,
            gm: Mat::zeros(0, 0),
            gk: Mat::zeros(0, 0),
            lambda: Vec::new(),
            ritz: Mat::zeros(0, 0),
            is_ritz: false,
            work: Tall::with_room(n, x.ncols()),
        };
        let mut first = Tall::copied(x.as_ref());
        drop(x);
        own.extend(&mut first, 1, context)?;
        Ok(own)
    }

    /// Vectors that there is room for beside those that it holds.
    pub(super) fn room(&self) -> usize {
        self.capacity - self.x.ncols()
    }

    /// Adds the span of `d`, made M-orthogonal to the rigid modes and to the basis in so many passes and
    /// M-orthonormal in itself. Directions that are only rounding are left out.
    ///
    /// # Panics
    /// When there is no room for it.
    pub(super) fn extend(
        &mut self,
        d: &mut Tall,
        passes: usize,
        context: &Context<'_>,
    ) -> Result<(), EigenFailure> {
        let Self { problem, m_rigid, x, kx, mx, gm, gk, work, .. } = self;
        let (pencil, columns, used) = (&problem.pencil, d.ncols(), x.ncols());
        for _ in 0..passes {
            let along = gram(m_rigid.as_ref(), d.as_ref());
            subtract_combination(d.as_mut(), problem.rigid, along.as_ref());
            if used > 0 {
                let along = gram(mx.as_ref(), d.as_ref());
                subtract_combination(d.as_mut(), x.as_ref(), along.as_ref());
            }
        }
        context.count(|work| work.mass_columns += columns as u64);
        pencil.mass_times(d.as_ref(), work.first_mut(columns));
        let orthonormal = independent(&gram(d.as_ref(), work.first(columns)))?;
        let added = used..used + orthonormal.ncols();
        context.count(|work| work.stiffness_columns += added.len() as u64);
        [&mut *x, &mut *kx, &mut *mx].into_iter().for_each(|block| block.add_zeros(added.len()));
        combine_into(x.columns_mut(added.clone()), d.as_ref(), orthonormal.as_ref());
        combine_into(mx.columns_mut(added.clone()), work.first(columns), orthonormal.as_ref());
        pencil.stiffness_times(x.columns(added.clone()), kx.columns_mut(added.clone()));
        *gm = bordered(gm, &gram(x.as_ref(), mx.columns(added.clone())));
        *gk = bordered(gk, &gram(x.as_ref(), kx.columns(added)));
        (self.lambda, self.ritz) = small_ritz(gm, gk)?;
        self.is_ritz = false;
        Ok(())
    }

    /// Keeps the span of the lowest Ritz vectors, so many of them where there are more.
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

    /// The rigid modes and the basis, as far as that is one of Ritz vectors.
    pub(super) fn near(&self) -> Near<'_> {
        Near {
            rigid: [self.problem.rigid, self.m_rigid.as_ref()],
            modes: self.x.as_ref(),
            k_modes: self.kx.as_ref(),
            m_modes: self.mx.as_ref(),
            eigenvalues: &self.lambda,
        }
    }

    /// Some of the Ritz vectors (N x k).
    pub(super) fn vectors(&self, which: Range<usize>) -> Mat<f64> {
        combine(self.x.as_ref(), self.ritz.as_ref().subcols(which.start, which.len()))
    }

    /// Returns some of the Ritz vectors (N x k), made by all threads.
    pub(super) fn some_vectors(&self, which: Range<usize>) -> Tall {
        let mut own = Tall::zeros(self.problem.pencil.n(), which.len());
        combine_into(own.as_mut(), self.x.as_ref(), self.ritz.as_ref().subcols(which.start, which.len()));
        own
    }

    /// Returns the unbalanced forces K x - lambda M x of some Ritz pairs, and their norms over |K x| + |lambda M x|.
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

/// [A, B; B', C] for B above C: the last columns of the matrix.
fn bordered(a: &Mat<f64>, last: &Mat<f64>) -> Mat<f64> {
    let m = a.ncols();
    Mat::from_fn(last.nrows(), last.nrows(), |i, j| match (i < m, j < m) {
        (true, true) => a[(i, j)],
        (_, false) => last[(i, j - m)],
        (false, true) => last[(j, i - m)],
    })
}

//! Modes with a single-precision factor: Lanczos on the operator that it makes, then corrections against the
//! true K and M in double precision until the true residuals keep the tolerance (a block Davidson method:
//! Davidson, J. Comput. Phys. 17 (1975) 87, with the factor as preconditioner).
//!
//! The factor T of K + tau M is good to about 1e-7 times its condition, so that Lanczos finds the modes to
//! 1e-2 or 1e-4. A correction T r of the residual r = K x - lambda M x, with Rayleigh-Ritz on all that is
//! there, gains as many digits again for one solved column, where refining every solve of Lanczos would cost
//! several.

use super::canonical::cluster_end;
use super::completeness::size_along;
use super::corrector::{Corrector, Pair};
use super::counters::Counters;
use super::factorise::{Attempt, with_suited_shift};
use super::failure::EigenFailure;
use super::lanczos::{self, Goal, LanczosOutcome};
use super::problem::EigenProblem;
use super::refine::{FoundModes, Refined, residuals};
use super::resume::Snapshot;
use super::search_space::SearchSpace;
use super::start::fitting_start;
use faer::Mat;
use flexbody_linalg::progress::{Event, Watch};
use flexbody_linalg::{Analysis, Cholesky, Tall, largest};
use rayon::prelude::*;

/// Columns per step of Lanczos: as many as the solves take together, since with single precision four cost
/// the same.
const BLOCK: usize = 8;

/// Ritz residual at which Lanczos hands over: more steps find no modes that the factor's error does not hide.
const HANDED_OVER: f64 = 1e-4;

/// Residual of the first mode beyond the wanted ones: its eigenvalue, good to the square, bounds the gap of
/// the count.
const BEYOND: f64 = 1e-3;

/// Distance of the first mode beyond the wanted ones from these, beside its eigenvalue, up to which it may belong to the
/// cluster of the last of them: with a residual of [`BEYOND`] its Ritz value does not tell. It is wanted as well as they
/// are then, so that the cluster is seen, and its canonical basis does not depend on how far the search went.
const MAY_REPEAT: f64 = 1e-3;

/// Corrections before single precision is given up.
const MAX_ROUNDS: usize = 60;

/// Rounds in a row that gain less than a factor of two before it is given up.
const PATIENCE: usize = 6;

/// Rounds of cycles after which they must have gained so much: with less, a factor takes less time than the rounds
/// to come. (Bars and cubes of 100,000 and 300,000 rows gain 25 to 10^5, with modes that come late.)
const JUDGED_AFTER: usize = 4;
const LEAST_GAIN: f64 = 7.0;

/// Searches the lowest modes, or returns the reason why single precision does not find them.
pub(super) fn search(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    goal: &Goal,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<FoundModes, EigenFailure> {
    let rough = Goal { tolerance: HANDED_OVER, block: BLOCK, rough: true, second_shift: false, ..*goal };
    let start = fitting_start(problem, goal.attempt).filter(|start| start.converged >= goal.wanted);
    let search = |factor: Cholesky<'_, f32>, start: Option<&Snapshot>, counters: &mut Counters| {
        let (vectors, wanted) = match start {
            Some(start) => {
                counters.taken_up = start.eigenvalues.len() as u64;
                (start.basis.as_ref().subcols(0, start.eigenvalues.len()).to_owned(), goal.wanted)
            }
            None => match lanczos::lowest_modes(problem, &factor, &rough, None, watch, counters)? {
                LanczosOutcome::ShiftTooLarge(shift) => return Ok(Attempt::Anew(shift)),
                LanczosOutcome::Midway(_) => unreachable!("not asked for"),
                LanczosOutcome::Found { modes, next } => return Ok(Attempt::Done((modes, next))),
                LanczosOutcome::Rough { vectors, wanted } => (vectors, wanted),
            },
        };
        let corrected =
            Correction::begin(problem, Corrector::Factor(&factor), goal, vectors, wanted, watch, counters)?;
        corrected.run(counters).map(Attempt::Done)
    };
    let ((refined, next), tau) = with_suited_shift(problem, analysis, start, watch, counters, search)?;
    Ok(FoundModes { refined, next, tau })
}

/// A span of vectors that is corrected until its lowest Ritz pairs keep the tolerance, and the end of their
/// cluster is seen.
pub(super) struct Correction<'a> {
    problem: &'a EigenProblem<'a>,
    corrector: Corrector<'a>,
    goal: &'a Goal,
    watch: Watch<'a>,
    space: SearchSpace<'a>,
    /// First size of the span.
    base: usize,
    /// Modes wanted, to the end of the cluster of the last one.
    wanted: usize,
    /// Those that keep the tolerance.
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
    /// The span of `x`, to be corrected.
    pub(super) fn begin(
        problem: &'a EigenProblem<'a>,
        corrector: Corrector<'a>,
        goal: &'a Goal,
        x: Mat<f64>,
        wanted: usize,
        watch: Watch<'a>,
        counters: &mut Counters,
    ) -> Result<Self, EigenFailure> {
        let base = x.ncols();
        let mut space = SearchSpace::new(problem, x, corrector.room(base), counters)?;
        if corrector.contracts(base, base) {
            space.contract(base);
        }
        Ok(Self {
            problem,
            corrector,
            goal,
            watch,
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

    /// The modes, and the eigenvalue after them.
    pub(super) fn run(mut self, counters: &mut Counters) -> Result<(Refined, Vec<f64>), EigenFailure> {
        for _ in 0..MAX_ROUNDS {
            let (forces, looked) = self.excess(counters);
            let keeps = |pair: &Pair| pair.residual <= pair.allowed;
            self.converged = looked[..self.wanted].iter().filter(|pair| keeps(pair)).count();
            let poor: Vec<Pair> = looked.iter().copied().filter(|pair| !keeps(pair)).collect();
            (self.watch)(Event::Fraction(1.0 - poor.len() as f64 / looked.len() as f64));
            if poor.is_empty() {
                return self.hand_over(looked.len(), counters);
            }
            if !self.gains(largest(looked.iter().map(|pair| pair.residual / pair.allowed))) {
                break;
            }
            self.correct(&forces, &poor, counters)?;
        }
        Err(EigenFailure::NotConverged { converged: self.converged, wanted: self.wanted })
    }

    /// What the pairs that are looked at leave unbalanced, and its size beside what it may be.
    fn excess(&mut self, counters: &mut Counters) -> (Tall, Vec<Pair>) {
        let (forces, relative) = self.look(counters);
        if self.seeks_gap(&relative) {
            return self.excess(counters);
        }
        let (tolerance, lambda) = (self.goal.tolerance, &self.space.lambda);
        let may_be_wanted = cluster_end(self.wanted, lambda.len(), MAY_REPEAT, |i| lambda[i]);
        let allowed = |j: usize| if j < may_be_wanted { tolerance.max(self.floors[j]) } else { BEYOND };
        let pair = |(number, residual)| Pair { number, residual, allowed: allowed(number) };
        (forces, relative.into_iter().enumerate().map(pair).collect())
    }

    /// What the wanted pairs and the one after them leave unbalanced, and its relative size.
    fn look(&mut self, counters: &mut Counters) -> (Tall, Vec<f64>) {
        let Self { problem, goal, space, .. } = self;
        let lambda = &space.lambda;
        self.wanted = cluster_end(self.wanted, lambda.len(), goal.cluster_gap, |i| lambda[i]);
        let looked = (self.wanted + 1).min(lambda.len());
        if self.floors.len() < looked {
            let lowest = space.some_vectors(0..looked);
            self.floors = residuals(problem, &lambda[..looked], lowest.as_ref(), counters).1;
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

    /// Keeps the search, and hands its modes out.
    fn hand_over(self, looked: usize, counters: &mut Counters) -> Result<(Refined, Vec<f64>), EigenFailure> {
        let Self { problem, corrector, space, wanted, .. } = self;
        let lambda = &space.lambda;
        let next = lambda[wanted..looked].to_vec();
        problem.resume.save(|| Snapshot {
            shift: corrector.shift(),
            eigenvalues: lambda.clone(),
            basis: space.vectors(0..lambda.len()),
            coupling: Mat::zeros(0, lambda.len()),
            converged: wanted,
        });
        let modes = Refined::new(problem, space.vectors(0..wanted), counters)?;
        Ok((modes, next))
    }

    /// Whether corrections are worth going on with when the largest excess is `worst`.
    fn gains(&mut self, worst: f64) -> bool {
        if self.rounds == 0 {
            self.first = worst;
        }
        if worst < 0.5 * self.least {
            (self.least, self.since) = (worst, 0);
        } else {
            self.since += 1;
        }
        let enough = self.first / LEAST_GAIN;
        let is_slow =
            matches!(self.corrector, Corrector::Levels(_)) && self.rounds == JUDGED_AFTER && worst > enough;
        self.rounds += 1;
        self.since <= PATIENCE && !is_slow && !worst.is_nan()
    }

    /// Extends the space by corrections of the poor pairs, of those that are looked at, and of some pairs after
    /// them.
    fn correct(&mut self, forces: &Tall, poor: &[Pair], counters: &mut Counters) -> Result<(), EigenFailure> {
        let Self { corrector, space, base, .. } = self;
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
        corrector.correct(space, &pairs, &mut d, counters);
        if d.ncols() > space.room() {
            space.contract(*base);
        }
        space.extend(&mut d, corrector.passes(), counters)?;
        if corrector.contracts(space.lambda.len(), *base) {
            space.contract(*base);
        }
        Ok(())
    }
}

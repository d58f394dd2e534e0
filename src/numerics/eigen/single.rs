//! Modes with a single-precision factor: Lanczos on the operator that it makes, then corrections against the
//! true K and M in double precision until the true residuals keep the tolerance (a block Davidson method:
//! Davidson, J. Comput. Phys. 17 (1975) 87, with the factor as preconditioner).
//!
//! The factor T of K + tau M is good to about 1e-7 times its condition, so that Lanczos finds the modes to
//! 1e-2 or 1e-4. A correction T r of the residual r = K x - lambda M x, with Rayleigh-Ritz on all that is
//! there, gains as many digits again for one solved column, where refining every solve of Lanczos would cost
//! several.

use super::canonical::cluster_end;
use super::counters::Counters;
use super::factorise::{Attempt, with_suited_shift};
use super::failure::EigenFailure;
use super::lanczos::{self, Goal, Search};
use super::problem::EigenProblem;
use super::refine::{Refined, relative_residual, residuals, small_ritz};
use super::resume::Snapshot;
use super::start::fitting_start;
use crate::base::progress::{Event, Watch};
use crate::numerics::linalg::{
    Analysis, Cholesky, Solve, add_combination, combine_into, gram, largest, subtract_combination,
};
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// Columns per step of Lanczos: as many as the solves take together, since with single precision four cost
/// the same.
const BLOCK: usize = 8;

/// Ritz residual at which Lanczos hands over: more steps find no modes that the factor's error does not hide.
const HANDED_OVER: f64 = 1e-4;

/// Residual of the first mode beyond the wanted ones: its eigenvalue, good to the square, bounds the gap of
/// the count.
const BEYOND: f64 = 1e-3;

/// Corrections before single precision is given up.
const MAX_ROUNDS: usize = 60;

/// Rounds in a row that gain less than a factor of two before it is given up.
const PATIENCE: usize = 6;

/// The lowest modes, eigenvalues beyond them, and the shift; or the reason why single precision does not find
/// them.
pub(super) fn search(
    problem: &EigenProblem<'_>,
    analysis: &Analysis,
    goal: &Goal,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<(Refined, Vec<f64>, f64), EigenFailure> {
    let rough = Goal { tolerance: HANDED_OVER, block: BLOCK, rough: true, ..*goal };
    let start = fitting_start(problem, goal.attempt).filter(|start| start.converged >= goal.wanted);
    let search = |factor: &Cholesky<'_, f32>, start: Option<&Snapshot>, counters: &mut Counters| {
        let (vectors, wanted) = match start {
            Some(start) => {
                counters.taken_up = start.eigenvalues.len() as u64;
                (start.basis.as_ref().subcols(0, start.eigenvalues.len()).to_owned(), goal.wanted)
            }
            None => match lanczos::lowest_modes(problem, factor, &rough, None, watch, counters)? {
                Search::ShiftTooLarge(shift) => return Ok(Attempt::ShiftTooLarge(shift)),
                Search::Found { modes, next } => return Ok(Attempt::Done((modes, next))),
                Search::Rough { vectors, wanted } => (vectors, wanted),
            },
        };
        let corrected = Correction::begin(problem, factor, goal, vectors, (wanted, 1), watch, counters)?;
        corrected.run(counters).map(Attempt::Done)
    };
    let ((modes, next), tau) = with_suited_shift(problem, analysis, start, watch, counters, search)?;
    Ok((modes, next, tau))
}

/// Vectors with their products.
struct Vectors {
    x: Mat<f64>,
    kx: Mat<f64>,
    mx: Mat<f64>,
}

impl Vectors {
    fn new(problem: &EigenProblem<'_>, x: Mat<f64>, counters: &mut Counters) -> Self {
        counters.stiffness_columns += x.ncols() as u64;
        counters.mass_columns += x.ncols() as u64;
        let (kx, mx) = (problem.pencil.apply_stiffness(x.as_ref()), problem.pencil.apply_mass(x.as_ref()));
        Self { x, kx, mx }
    }
}

/// Columns, with room for more.
struct Columns {
    room: Mat<f64>,
    used: usize,
}

impl Columns {
    fn as_ref(&self) -> MatRef<'_, f64> {
        self.room.as_ref().subcols(0, self.used)
    }

    /// Replaces the columns by combinations of them and of others, `coefficients` first of its own, then of
    /// the others. `spare` has the same room, and takes the place of what is replaced.
    fn combine(&mut self, others: MatRef<'_, f64>, coefficients: MatRef<'_, f64>, spare: &mut Mat<f64>) {
        let count = coefficients.ncols();
        let (own, rest) = coefficients.split_at_row(self.used);
        let mut new = spare.as_mut().subcols_mut(0, count);
        combine_into(new.as_mut(), self.as_ref(), own);
        add_combination(new, others, rest);
        std::mem::swap(&mut self.room, spare);
        self.used = count;
    }
}

/// A span of vectors with their products. Its memory is taken once: as large a block that is taken anew comes
/// page by page, each cleared by the system, which was a third of a search.
struct Span {
    x: Columns,
    kx: Columns,
    mx: Columns,
    spare: Mat<f64>,
}

impl Span {
    /// Combinations of vectors, with room for twice as many.
    fn new(vectors: &Vectors, coefficients: MatRef<'_, f64>) -> Self {
        let (n, used) = (vectors.x.nrows(), coefficients.ncols());
        let combined = |own: &Mat<f64>| {
            let mut room = Mat::zeros(n, 2 * used);
            combine_into(room.as_mut().subcols_mut(0, used), own.as_ref(), coefficients);
            Columns { room, used }
        };
        let [x, kx, mx] = [&vectors.x, &vectors.kx, &vectors.mx].map(combined);
        Self { x, kx, mx, spare: Mat::zeros(n, 2 * used) }
    }

    /// Replaces the vectors by combinations of them and of others.
    fn combine(&mut self, others: &Vectors, coefficients: MatRef<'_, f64>) {
        let Self { x, kx, mx, spare } = self;
        for (mine, theirs) in [(x, &others.x), (kx, &others.kx), (mx, &others.mx)] {
            mine.combine(theirs.as_ref(), coefficients, spare);
        }
    }
}

/// A span of vectors that is corrected until its lowest Ritz pairs keep the tolerance, and the end of their
/// cluster is seen.
pub(super) struct Correction<'a> {
    problem: &'a EigenProblem<'a>,
    factor: &'a dyn Solve,
    goal: &'a Goal,
    watch: Watch<'a>,
    /// M times the rigid modes.
    m_rigid: Mat<f64>,
    /// Ritz vectors, and their values, ascending.
    span: Span,
    lambda: Vec<f64>,
    /// The span keeps earlier corrections until it has twice this size: with them the last modes take half
    /// the columns.
    base: usize,
    /// Columns that `factor` solves for in the time of one: the pairs above the wanted ones fill them up, and
    /// the last ones converge sooner.
    width: usize,
    /// Modes wanted, to the end of the cluster of the last one.
    wanted: usize,
    /// Those that keep the tolerance.
    converged: usize,
    /// Rounding floors of the pairs that are looked at.
    floors: Vec<f64>,
    /// Least excess so far, and the rounds since.
    least: f64,
    since: usize,
}

impl<'a> Correction<'a> {
    /// Ritz pairs of the span of `x`, to be corrected by `factor`: anything that solves roughly.
    pub(super) fn begin(
        problem: &'a EigenProblem<'a>,
        factor: &'a dyn Solve,
        goal: &'a Goal,
        mut x: Mat<f64>,
        (wanted, width): (usize, usize),
        watch: Watch<'a>,
        counters: &mut Counters,
    ) -> Result<Self, EigenFailure> {
        let m_rigid = problem.pencil.apply_mass(problem.rigid);
        let along = gram(m_rigid.as_ref(), x.as_ref());
        subtract_combination(x.as_mut(), problem.rigid, along.as_ref());
        let vectors = Vectors::new(problem, x, counters);
        let gm = gram(vectors.x.as_ref(), vectors.mx.as_ref());
        let gk = gram(vectors.x.as_ref(), vectors.kx.as_ref());
        let (lambda, coefficients) = small_ritz(gm, gk)?;
        let span = Span::new(&vectors, coefficients.as_ref());
        Ok(Self {
            problem,
            factor,
            goal,
            watch,
            m_rigid,
            span,
            base: lambda.len(),
            lambda,
            width,
            wanted,
            converged: 0,
            floors: Vec::new(),
            least: f64::INFINITY,
            since: 0,
        })
    }

    /// The modes, and the eigenvalue after them.
    pub(super) fn run(mut self, counters: &mut Counters) -> Result<(Refined, Vec<f64>), EigenFailure> {
        for _ in 0..MAX_ROUNDS {
            let excess = self.excess(counters);
            self.converged = excess[..self.wanted].iter().filter(|e| **e <= 1.0).count();
            let poor: Vec<usize> =
                (0..excess.len()).filter(|&i| excess[i].is_nan() || excess[i] > 1.0).collect();
            (self.watch)(Event::Fraction(1.0 - poor.len() as f64 / excess.len() as f64));
            if poor.is_empty() {
                return self.hand_over(excess.len(), counters);
            }
            let after = excess.len()..self.lambda.len();
            if !self.gains(largest(excess)) {
                break;
            }
            let filled = poor.len().next_multiple_of(self.width) - poor.len();
            let corrected: Vec<usize> = poor.into_iter().chain(after.take(filled)).collect();
            self.extend(&corrected, counters)?;
        }
        Err(EigenFailure::NotConverged { converged: self.converged, wanted: self.wanted })
    }

    /// Residuals of the wanted pairs and the one after them, in units of what they may have.
    fn excess(&mut self, counters: &mut Counters) -> Vec<f64> {
        let Self { problem, goal, span, lambda, .. } = self;
        self.wanted = cluster_end(self.wanted, lambda.len(), goal.cluster_gap, |i| lambda[i]);
        let looked = (self.wanted + 1).min(lambda.len());
        if self.floors.len() < looked {
            let lowest = span.x.as_ref().subcols(0, looked);
            self.floors = residuals(problem, &lambda[..looked], lowest, counters).1;
        }
        let (kx, mx) = (span.kx.as_ref(), span.mx.as_ref());
        let excess = |j: usize| {
            let allowed = if j < self.wanted { goal.tolerance.max(self.floors[j]) } else { BEYOND };
            relative_residual(kx.col(j), mx.col(j), lambda[j]) / allowed
        };
        (0..looked).into_par_iter().map(excess).collect()
    }

    /// Keeps the search, and hands its modes out.
    fn hand_over(self, looked: usize, counters: &mut Counters) -> Result<(Refined, Vec<f64>), EigenFailure> {
        let Self { problem, factor, span, lambda, wanted, .. } = self;
        let next = lambda[wanted..looked].to_vec();
        problem.resume.save(|| Snapshot {
            shift: factor.shift(),
            eigenvalues: lambda.clone(),
            basis: span.x.as_ref().to_owned(),
            coupling: Mat::zeros(0, lambda.len()),
            converged: wanted,
        });
        let modes = Refined::new(problem, span.x.as_ref().subcols(0, wanted).to_owned(), counters)?;
        Ok((modes, next))
    }

    /// Whether corrections are worth going on with when the largest excess is `worst`.
    fn gains(&mut self, worst: f64) -> bool {
        if worst < 0.5 * self.least {
            (self.least, self.since) = (worst, 0);
        } else {
            self.since += 1;
        }
        self.since <= PATIENCE && !worst.is_nan()
    }

    /// Adds corrections of some pairs to the span, and takes its Ritz pairs.
    fn extend(&mut self, poor: &[usize], counters: &mut Counters) -> Result<(), EigenFailure> {
        let Self { problem, factor, m_rigid, span, lambda, base, width, .. } = self;
        // Ritz values count with what is left along the span; twice costs as much as a cycle.
        let passes = if *width > 1 { 1 } else { 2 };
        let new = corrections(problem, *factor, span, (poor, lambda), (m_rigid.as_ref(), passes), counters);
        // X' M X = I and X' K X = Lambda hold already.
        let ones = vec![1.0; lambda.len()];
        let bordered_by = |corner: &[f64], products: &Mat<f64>| {
            let across = gram(span.x.as_ref(), products.as_ref());
            bordered(corner, &across, &gram(new.x.as_ref(), products.as_ref()))
        };
        let (gm, gk) = (bordered_by(&ones, &new.mx), bordered_by(lambda, &new.kx));
        let (values, coefficients) = small_ritz(gm, gk)?;
        let kept = if values.len() <= 2 * *base { values.len() } else { *base };
        span.combine(&new, coefficients.as_ref().subcols(0, kept));
        *lambda = values[..kept].to_vec();
        Ok(())
    }
}

/// [diag(a), B; B', C].
fn bordered(a: &[f64], b: &Mat<f64>, c: &Mat<f64>) -> Mat<f64> {
    let m = a.len();
    Mat::from_fn(m + c.ncols(), m + c.ncols(), |i, j| match (i < m, j < m) {
        (true, true) if i == j => a[i],
        (true, true) => 0.0,
        (true, false) => b[(i, j - m)],
        (false, true) => b[(j, i - m)],
        (false, false) => c[(i - m, j - m)],
    })
}

/// T (K x - lambda M x) for the chosen Ritz pairs, made M-orthogonal to the span and to the rigid modes in one
/// pass or two.
fn corrections(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    span: &Span,
    (chosen, lambda): (&[usize], &[f64]),
    (m_rigid, passes): (MatRef<'_, f64>, usize),
    counters: &mut Counters,
) -> Vectors {
    counters.solved_columns += chosen.len() as u64;
    let (x, kx, mx) = (span.x.as_ref(), span.kx.as_ref(), span.mx.as_ref());
    let mut d = Mat::zeros(x.nrows(), chosen.len());
    let columns: Vec<_> = d.col_iter_mut().zip(chosen).collect();
    columns.into_par_iter().for_each(|(mut d, &j)| {
        let r = kx.col(j) - mx.col(j) * faer::Scale(lambda[j]);
        // Unit size: residuals near rounding would leave the range of single precision.
        let size = r.norm_max();
        d.copy_from(r * faer::Scale(if size > 0.0 { size.recip() } else { 0.0 }));
    });
    factor.solve_in_place(d.as_mut());
    for _ in 0..passes {
        for (basis, m_basis) in [(problem.rigid, m_rigid), (x, mx)] {
            let along = gram(m_basis, d.as_ref());
            subtract_combination(d.as_mut(), basis, along.as_ref());
        }
    }
    Vectors::new(problem, d, counters)
}

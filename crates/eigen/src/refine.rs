//! Refinement shared by all methods: inverse iteration, Rayleigh-Ritz, orthogonality to the rigid modes, residuals; and
//! the motions whose energy cannot be distinguished from zero with the digits of K.

use super::failure::EigenFailure;
use super::problem::EigenProblem;
use faer::{ColRef, Mat, MatRef};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Cholesky, DoubleDouble, Inertia, Pencil, Solve, SymmetricMatrix, Tall, column_norms, combine,
    combine_in_place, combine_into, dense_cholesky, gram, largest, left_singular_vectors,
    projection_compensated, small_pencil, subtract_columns, subtract_combination, sum_terms, symmetric_eigen,
};
use std::ops::Range;

/// Refined modes with their residuals and the rounding floors of these.
pub(super) struct Refined {
    pub eigenvalues: Vec<f64>,
    pub vectors: Mat<f64>,
    pub residuals: Vec<f64>,
    pub floors: Vec<f64>,
}

/// Modes found by a search.
pub(super) struct FoundModes {
    pub refined: Refined,
    /// Eigenvalues beyond the modes, ascending.
    pub next: Vec<f64>,
    /// Shift tau of the search.
    pub tau: f64,
    /// Number of flexible modes with a finite eigenvalue, if all were computed.
    pub finite: Option<usize>,
}

/// Performs one inverse iteration: X <- (K + tau M)^-1 M X. It removes components in the null space of M and the
/// rounding of the basis. With `correct`, one step of iterative refinement follows, which brings the residual of the
/// solve to its rounding floor.
fn inverse_iteration(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    x: MatRef<'_, f64>,
    correct: bool,
    context: &Context<'_>,
) -> Mat<f64> {
    let pencil = &problem.pencil;
    let k = x.ncols() as u64;
    context.count(|work| work.mass_columns += k);
    context.count(|work| work.solved_columns += k);
    let b = pencil.apply_mass(x);
    let mut y = b.clone();
    factor.solve_in_place(y.as_mut());
    if correct {
        context.count(|work| work.mass_columns += k);
        context.count(|work| work.stiffness_columns += k);
        context.count(|work| work.solved_columns += k);
        let shifted =
            pencil.apply_stiffness(y.as_ref()) + pencil.apply_mass(y.as_ref()) * faer::Scale(factor.shift());
        let mut correction = b - shifted;
        factor.solve_in_place(correction.as_mut());
        y += correction;
    }
    y
}

/// Squared M-norm, relative to that of the columns, below which a direction of their span counts as rounding.
const DEPENDENT_SQUARED_NORM: f64 = 1e-8;

/// Largest number of modes whose projections are computed in double-double arithmetic. The time of such small
/// eigenproblems grows with the third power, and is a second with 200.
const MAX_SHARPENED_MODES: usize = 200;

/// Ratio of eigenvalues up to which the rounding of a small eigenproblem couples its modes by less than
/// [`MAX_COUPLING`]: 2e-16 times this ratio.
const WIDE_SPREAD: f64 = 4e4;

/// Coupling of two modes by K, relative to the root of the product of their eigenvalues, that is left as rounding. Bodies
/// whose modes are coupled by 1e-9 are refused.
const MAX_COUPLING: f64 = 1e-11;

/// Number of columns whose products with K and M are held at a time. The products of 200 modes would take twice the
/// memory of the modes, and newly allocated memory is cleared first, which takes longer than the products.
pub(super) const COLUMNS_PER_PRODUCT: usize = 32;

/// Returns ranges of `count` columns, [`COLUMNS_PER_PRODUCT`] at a time.
fn columns_together(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count).step_by(COLUMNS_PER_PRODUCT).map(move |first| first..count.min(first + COLUMNS_PER_PRODUCT))
}

/// Performs Rayleigh-Ritz on the span of X after projecting out the rigid modes. Returns the Ritz values, ascending,
/// and M-orthonormal Ritz vectors. Directions in which X is dependent are left out.
fn rayleigh_ritz(
    problem: &EigenProblem<'_>,
    mut x: Mat<f64>,
    context: &Context<'_>,
) -> Result<(Vec<f64>, Mat<f64>), EigenFailure> {
    let (pencil, n, k) = (&problem.pencil, x.nrows(), x.ncols());
    context.count(|work| work.mass_columns += (problem.rigid.ncols() + k) as u64);
    context.count(|work| work.stiffness_columns += k as u64);
    let along = gram(pencil.apply_mass(problem.rigid).as_ref(), x.as_ref());
    subtract_combination(x.as_mut(), problem.rigid, along.as_ref());
    let [mut gm, mut gk] = [(); 2].map(|()| Mat::zeros(k, k));
    for columns in columns_together(k) {
        let block = x.as_ref().subcols(columns.start, columns.len());
        let above = x.as_ref().subcols(0, columns.end);
        let mut product = Tall::zeros(n, columns.len());
        pencil.mass_times(block, product.as_mut());
        mirror(&mut gm, columns.start, &gram(above, product.as_ref()));
        pencil.stiffness_times(block, product.as_mut());
        mirror(&mut gk, columns.start, &gram(above, product.as_ref()));
    }
    let (values, coefficients) = small_ritz(&gm, &gk)?;
    combine_in_place(x.as_mut(), coefficients.as_ref());
    x.truncate(n, values.len());
    Ok((values, x))
}

/// Writes columns of a symmetric matrix, from number `first` on and down to the square on the diagonal, and their
/// mirror image.
fn mirror(matrix: &mut Mat<f64>, first: usize, columns: &Mat<f64>) {
    for j in 0..columns.ncols() {
        for i in 0..columns.nrows() {
            matrix[(i, first + j)] = columns[(i, j)];
            if i < first {
                matrix[(first + j, i)] = columns[(i, j)];
            }
        }
    }
}

/// Returns the Ritz values of a basis, ascending, and the coefficients of its M-orthonormal Ritz vectors, from its Gram
/// matrices with M and with K. Directions in which the basis is dependent are left out.
pub(super) fn small_ritz(gm: &Mat<f64>, gk: &Mat<f64>) -> Result<(Vec<f64>, Mat<f64>), EigenFailure> {
    let scale = scales(gm)?;
    let orthonormal = independent_directions(&scaled(gm, &scale))?;
    let projected =
        gram(orthonormal.as_ref(), combine(scaled(gk, &scale).as_ref(), orthonormal.as_ref()).as_ref());
    let ritz = symmetric_eigen(projected.as_ref()).ok_or(EigenFailure::Inaccurate { residual: f64::NAN })?;
    let coefficients = combine(orthonormal.as_ref(), ritz.vectors.as_ref());
    Ok((ritz.values, scaled_rows(&coefficients, &scale)))
}

/// Returns the coefficients of M-orthonormal vectors that span the space of a basis with this Gram matrix, without the
/// directions in which the basis is dependent.
pub(super) fn independent(gm: &Mat<f64>) -> Result<Mat<f64>, EigenFailure> {
    let scale = scales(gm)?;
    Ok(scaled_rows(&independent_directions(&scaled(gm, &scale))?, &scale))
}

/// Returns one over the M-norm of each vector of a basis; zero for a zero vector.
fn scales(gm: &Mat<f64>) -> Result<Vec<f64>, EigenFailure> {
    let scale: Vec<f64> =
        (0..gm.ncols()).map(|j| if gm[(j, j)] == 0.0 { 0.0 } else { gm[(j, j)].sqrt().recip() }).collect();
    let all_finite = scale.iter().all(|s| s.is_finite());
    if all_finite { Ok(scale) } else { Err(EigenFailure::MassIndefinite) }
}

/// Returns the Gram matrix of scaled vectors, made symmetric.
fn scaled(g: &Mat<f64>, scale: &[f64]) -> Mat<f64> {
    Mat::from_fn(g.nrows(), g.ncols(), |i, j| 0.5 * (g[(i, j)] + g[(j, i)]) * scale[i] * scale[j])
}

fn scaled_rows(a: &Mat<f64>, scale: &[f64]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| scale[i] * a[(i, j)])
}

/// Returns V / sqrt(Lambda) of a Gram matrix with a diagonal of one, for the eigenvalues above rounding.
fn independent_directions(gm: &Mat<f64>) -> Result<Mat<f64>, EigenFailure> {
    let eigen = symmetric_eigen(gm.as_ref()).ok_or(EigenFailure::Inaccurate { residual: f64::NAN })?;
    let first = eigen.values.partition_point(|&v| v < DEPENDENT_SQUARED_NORM);
    Ok(Mat::from_fn(gm.nrows(), gm.ncols() - first, |i, j| {
        eigen.vectors[(i, first + j)] / eigen.values[first + j].sqrt()
    }))
}

/// Returns the K-residuals |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) and their floors: the parts that no
/// refinement removes. These are rounding, and M R (R'K psi) of the rigid modes R, which are null vectors of K only as
/// accurately as the node positions are known.
pub(super) fn residuals(
    problem: &EigenProblem<'_>,
    eigenvalues: &[f64],
    x: MatRef<'_, f64>,
    context: &Context<'_>,
) -> (Vec<f64>, Vec<f64>) {
    context.count(|work| work.mass_columns += x.ncols() as u64);
    context.count(|work| work.stiffness_columns += x.ncols() as u64);
    let m_rigid = problem.pencil.apply_mass(problem.rigid);
    columns_together(x.ncols())
        .flat_map(|columns| {
            let block = x.subcols(columns.start, columns.len());
            residuals_together(problem, m_rigid.as_ref(), &eigenvalues[columns], block)
        })
        .unzip()
}

/// Returns residual and floor of each of a few pairs.
fn residuals_together(
    problem: &EigenProblem<'_>,
    m_rigid: MatRef<'_, f64>,
    eigenvalues: &[f64],
    x: MatRef<'_, f64>,
) -> Vec<(f64, f64)> {
    let pencil = &problem.pencil;
    let [mut kx, mut mx, mut rigid] = [(); 3].map(|()| Tall::zeros(x.nrows(), x.ncols()));
    pencil.stiffness_times(x, kx.as_mut());
    pencil.mass_times(x, mx.as_mut());
    combine_into(rigid.as_mut(), m_rigid, gram(problem.rigid, kx.as_ref()).as_ref());
    let (sizes, residuals) = leave_unbalanced(&mut kx, mx.as_ref(), eigenvalues);
    let rounding = rounding_residual(pencil.stiffness(), x).into_iter().zip(column_norms(rigid.as_ref()));
    let floors = rounding.zip(sizes).map(|((rounding, rigid), size)| beside(rounding + rigid, size));
    residuals.into_iter().zip(floors).collect()
}

/// Replaces K X by the residual forces K x - lambda M x of the pairs. Returns the sizes |K x| + |lambda M x|, and the
/// norms of the residual forces relative to these sizes.
pub(super) fn leave_unbalanced(
    kx: &mut Tall,
    mx: MatRef<'_, f64>,
    eigenvalues: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let norms = column_norms(kx.as_ref()).into_iter().zip(column_norms(mx)).zip(eigenvalues);
    let sizes: Vec<f64> = norms.map(|((stiff, heavy), lambda)| stiff + lambda.abs() * heavy).collect();
    subtract_columns(kx.as_mut(), eigenvalues, mx);
    let left = column_norms(kx.as_ref()).into_iter().zip(&sizes);
    let residuals = left.map(|(left, size)| beside(left, *size)).collect();
    (sizes, residuals)
}

/// Returns `part` / `size`; zero for a size of zero.
fn beside(part: f64, size: f64) -> f64 {
    if size == 0.0 { 0.0 } else { part / size }
}

/// Returns |K psi| + |lambda| |M psi|, to which K-residuals are relative.
pub fn residual_scale(k_psi: ColRef<'_, f64>, m_psi: ColRef<'_, f64>, lambda: f64) -> f64 {
    k_psi.norm_l2() + lambda.abs() * m_psi.norm_l2()
}

/// Returns the K-residual |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|): zero for a mode of zeros, NaN for a
/// mode with NaN.
pub fn relative_residual(k_psi: ColRef<'_, f64>, m_psi: ColRef<'_, f64>, lambda: f64) -> f64 {
    beside((k_psi - m_psi * faer::Scale(lambda)).norm_l2(), residual_scale(k_psi, m_psi, lambda))
}

impl Refined {
    /// Performs Rayleigh-Ritz on the span of `x`, and computes the true K-residuals of the result.
    ///
    /// # Errors
    /// [`EigenFailure::Inaccurate`] if the columns of `x` are dependent.
    pub(super) fn new(
        problem: &EigenProblem<'_>,
        x: Mat<f64>,
        context: &Context<'_>,
    ) -> Result<Self, EigenFailure> {
        let given = x.ncols();
        let (eigenvalues, vectors) = rayleigh_ritz(problem, x, context)?;
        if vectors.ncols() < given {
            return Err(EigenFailure::Inaccurate { residual: DEPENDENT_SQUARED_NORM });
        }
        let (residuals, floors) = residuals(problem, &eigenvalues, vectors.as_ref(), context);
        Ok(Self { eigenvalues, vectors, residuals, floors })
    }

    /// Repeats Rayleigh-Ritz on the span in double-double arithmetic if it [is noisy](is_noisy) and has [few enough
    /// modes](SHARPENED_AT_MOST). The Ritz vectors are then those of the span up to the rounding of the vectors
    /// themselves. Their residuals remain those of double precision.
    pub(super) fn sharpened(self, problem: &EigenProblem<'_>, tolerance: f64, context: &Context<'_>) -> Self {
        if !is_noisy(&self.floors, tolerance) || self.eigenvalues.len() > MAX_SHARPENED_MODES {
            return self;
        }
        let (pencil, x) = (&problem.pencil, self.vectors.as_ref());
        context.count(|work| work.mass_columns += x.ncols() as u64);
        context.count(|work| work.stiffness_columns += x.ncols() as u64);
        let stiffness = projection_compensated(pencil.stiffness(), x);
        // Products with M have no cancellation.
        let mass = gram(x, pencil.apply_mass(x).as_ref());
        let entry = |i: usize, j: usize| DoubleDouble::from(0.5 * (mass[(i, j)] + mass[(j, i)]));
        let mass = (0..x.ncols()).map(|i| (0..x.ncols()).map(|j| entry(i, j)).collect()).collect();
        // Modes without strain energy have no such projection; they are refused later.
        let Some(ritz) = small_pencil(stiffness, &mass) else { return self };
        let eigenvalues: Vec<f64> = ritz.values.iter().map(|lambda| lambda.hi).collect();
        let vectors = combine(x, ritz.vectors.as_ref());
        let (residuals, floors) = residuals(problem, &eigenvalues, vectors.as_ref(), context);
        Self { eigenvalues, vectors, residuals, floors }
    }

    /// Removes the coupling of the modes by K that rounding of the small eigenproblem leaves, relative to the highest
    /// eigenvalue, where eigenvalues differ [widely](WIDE_SPREAD).
    pub(super) fn uncoupled(self, problem: &EigenProblem<'_>, context: &Context<'_>) -> Self {
        let lambda = &self.eigenvalues;
        let is_wide =
            lambda.first().zip(lambda.last()).is_some_and(|(first, last)| *last > WIDE_SPREAD * first);
        if !is_wide || lambda[0] <= 0.0 {
            return self;
        }
        let x = self.vectors.as_ref();
        context.count(|work| work.stiffness_columns += x.ncols() as u64);
        let product = gram(x, problem.pencil.apply_stiffness(x).as_ref());
        let stiffness = Mat::from_fn(x.ncols(), x.ncols(), |i, j| 0.5 * (product[(i, j)] + product[(j, i)]));
        let beside = |i: usize, j: usize| stiffness[(i, j)].abs() / (lambda[i] * lambda[j]).sqrt();
        let pairs = (0..x.ncols()).flat_map(|j| (0..j).map(move |i| (i, j)));
        if largest(pairs.map(|(i, j)| beside(i, j))) <= MAX_COUPLING {
            return self;
        }
        // Rotations of pairs of rows of the Cholesky factor keep the digits of every eigenvalue.
        let rotated = dense_cholesky(stiffness).and_then(left_singular_vectors);
        let Some((roots, rotation)) = rotated else { return self };
        let eigenvalues: Vec<f64> = roots.iter().map(|root| root * root).collect();
        let vectors = combine(x, rotation.as_ref());
        let (residuals, floors) = residuals(problem, &eigenvalues, vectors.as_ref(), context);
        Self { eigenvalues, vectors, residuals, floors }
    }

    /// Recomputes the residuals and floors of the modes `changed`, whose vectors or eigenvalues have changed.
    pub(super) fn renew(&mut self, problem: &EigenProblem<'_>, changed: &[usize], context: &Context<'_>) {
        if changed.is_empty() {
            return;
        }
        let x = Mat::from_fn(self.vectors.nrows(), changed.len(), |i, j| self.vectors[(i, changed[j])]);
        let lambda: Vec<f64> = changed.iter().map(|&i| self.eigenvalues[i]).collect();
        let (found, rounding) = residuals(problem, &lambda, x.as_ref(), context);
        for ((&i, residual), floor) in changed.iter().zip(found).zip(rounding) {
            (self.residuals[i], self.floors[i]) = (residual, floor);
        }
    }

    /// Returns the K-residual of mode i divided by the residual asked for: the tolerance, or the rounding floor if that
    /// is higher.
    fn excess_of(&self, i: usize, tolerance: f64) -> f64 {
        self.residuals[i] / tolerance.max(self.floors[i])
    }

    /// Returns the largest excess: at most 1 if all modes keep the tolerance or have reached their floors; NaN if an
    /// excess is NaN.
    pub(super) fn excess(&self, tolerance: f64) -> f64 {
        largest((0..self.residuals.len()).map(|i| self.excess_of(i, tolerance)))
    }
}

/// Refines approximate modes until the K-residuals keep `tolerance` or have reached the rounding floor, by at most
/// three inverse iterations of the modes that have not.
pub(super) fn refine(
    problem: &EigenProblem<'_>,
    factor: &dyn Solve,
    mut best: Refined,
    tolerance: f64,
    context: &Context<'_>,
) -> Result<Refined, EigenFailure> {
    for round in 0..3 {
        let least = best.excess(tolerance);
        // No inverse iteration repairs a NaN.
        if least.is_nan() || least <= 1.0 {
            break;
        }
        // Only the modes above the tolerance are iterated; Rayleigh-Ritz then acts on all modes.
        let poor: Vec<usize> =
            (0..best.residuals.len()).filter(|&i| best.excess_of(i, tolerance) > 1.0).collect();
        let mut x = best.vectors.clone();
        let chosen = Mat::from_fn(x.nrows(), poor.len(), |i, j| x[(i, poor[j])]);
        let improved = inverse_iteration(problem, factor, chosen.as_ref(), round > 0, context);
        for (from, &to) in poor.iter().enumerate() {
            x.as_mut().col_mut(to).copy_from(improved.col(from));
        }
        let refined = Refined::new(problem, x, context)?;
        let excess = refined.excess(tolerance);
        if excess < least {
            best = refined;
        }
        // A round that does not halve the excess is the last one.
        if excess.is_nan() || excess > 0.5 * least {
            break;
        }
    }
    Ok(best)
}

/// Unit roundoff of f64.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Returns for each column x of X the standard deviation of x'Kx when every entry of K has an independent relative
/// error of `relative`: relative * sqrt(sum_ij (K_ij x_i x_j)^2), times sqrt(2) for the equal errors of symmetric
/// pairs.
pub fn energy_noise(k: &SymmetricMatrix, x: MatRef<'_, f64>, relative: f64) -> Vec<f64> {
    let relative = relative.max(ROUNDOFF);
    let terms = row_sums(k, x, |term| term * term);
    let columns = x.col_iter().zip(terms.as_ref().col_iter());
    let sum = |(x, terms): (ColRef<'_, f64>, ColRef<'_, f64>)| -> f64 {
        x.iter().zip(terms.iter()).map(|(x, term)| x * x * term).sum()
    };
    columns.map(|pair| relative * (2.0 * sum(pair)).sqrt()).collect()
}

/// Returns for each column x of X the norm of K x that rounding alone can leave: eps | |K| |x| |_2.
pub fn rounding_residual(k: &SymmetricMatrix, x: MatRef<'_, f64>) -> Vec<f64> {
    column_norms(row_sums(k, x, f64::abs).as_ref()).into_iter().map(|norm| f64::EPSILON * norm).collect()
}

/// Returns true when rounding keeps a K-residual above `tolerance`, as in thin or fine shells. Plain projections then
/// rotate modes into each other by eps |K| |x|, the rounding of K x, divided by distances of eigenvalues.
pub(super) fn is_noisy(floors: &[f64], tolerance: f64) -> bool {
    floors.iter().any(|floor| *floor > tolerance)
}

/// Returns true when a K-residual keeps the guarantee: the tolerance, or 30 times the rounding floor (measured:
/// residuals of up to 6 times the estimate of the floor).
pub(super) fn keeps(residual: f64, floor: f64, tolerance: f64) -> bool {
    residual <= tolerance.max(30.0 * floor)
}

/// Returns sum_j f(K_ij x_j) for each row i and each column x.
fn row_sums(k: &SymmetricMatrix, x: MatRef<'_, f64>, f: impl Fn(f64) -> f64 + Copy + Sync) -> Tall {
    let mut sums = Tall::zeros(x.nrows(), x.ncols());
    sum_terms(k, x, sums.as_mut(), f);
    sums
}

/// Number of standard deviations of the noise of K above which energy counts as real.
pub(super) const NOISE_DEVIATIONS: f64 = 30.0;

/// Refuses modes whose eigenvalues cannot be distinguished from zero (mechanisms), and clearly negative eigenvalues (an
/// indefinite K).
pub(super) fn check_zero_energy(problem: &EigenProblem<'_>, refined: &Refined) -> Result<(), EigenFailure> {
    let lowest = refined.vectors.as_ref().subcols(0, refined.vectors.ncols().min(32));
    let noise = energy_noise(problem.pencil.stiffness(), lowest, problem.input_error);
    if let Some(&lambda) = refined.eigenvalues.first()
        && lambda < -NOISE_DEVIATIONS * noise[0]
    {
        let vector = refined.vectors.as_ref().subcols(0, 1).to_owned();
        return Err(EigenFailure::NegativeEigenvalue { eigenvalue: lambda, vector });
    }
    let count =
        refined.eigenvalues.iter().zip(&noise).take_while(|(l, n)| **l <= NOISE_DEVIATIONS * **n).count();
    if count > 0 {
        return Err(EigenFailure::ZeroEnergy {
            count,
            eigenvalues: refined.eigenvalues[..count].to_vec(),
            vectors: refined.vectors.as_ref().subcols(0, count).to_owned(),
        });
    }
    Ok(())
}

/// Motions with neither strain energy nor mass.
#[derive(Debug, Clone)]
pub struct Unresisted {
    /// Number of such motions. Rigid motions do not count, since they have mass.
    pub count: usize,
    /// Some of the motions (N x at most 8), each with a largest entry of one.
    pub vectors: Mat<f64>,
}

/// Largest number of vectors that are computed.
const MAX_VECTORS: usize = 8;

/// Number of steps of inverse iteration. The first amplifies the motions relative to all others by the digits of K.
const INVERSE_ITERATIONS: usize = 2;

/// Returns the motions to which K + tau M gives no energy up to the digits of K (`input_error` is the relative error of
/// its entries). Returns `None` if there is none, or if K + tau M is clearly indefinite.
///
/// The count is that of the eigenvalues mu of (K + tau M) x = mu diag(K) x within noise of zero, by the inertia of K +
/// tau M -+ delta diag(K).
pub fn unresisted_motions(pencil: &Pencil<'_>, tau: f64, input_error: f64) -> Option<Unresisted> {
    let delta = NOISE_DEVIATIONS * input_error.max(f64::EPSILON);
    let analysis = Analysis::new(pencil)?;
    let moved = |part: f64| pencil.stiffness().with_diagonal(|_, k| k + part * k);
    let with = |stiffness: &SymmetricMatrix| {
        Inertia::new(&analysis, &Pencil::new(stiffness, pencil.mass(), pencil.block()), -tau)
    };
    // Eigenvalues mu between -delta and delta become negative in one pencil and positive in the other.
    let (lowered, raised) = (moved(-delta)?, moved(delta)?);
    let count = with(&lowered).negative;
    if count == 0 || with(&raised).negative > 0 {
        return None;
    }
    // Inverse iteration on the positive definite pencil resolves some of the motions.
    let raised = Pencil::new(&raised, pencil.mass(), pencil.block());
    let factor = Cholesky::<f64>::new(&analysis, &raised, tau)?;
    let start = |i: usize, j: usize| ((i + 1) as f64 * (j as f64 + 1.37) * 0.754_877_666).fract() - 0.5;
    let mut vectors = Mat::from_fn(pencil.n(), count.min(MAX_VECTORS), start);
    for _ in 0..INVERSE_ITERATIONS {
        factor.solve_in_place(vectors.as_mut());
        for column in vectors.col_iter_mut() {
            let size = column.norm_max();
            column.iter_mut().for_each(|value| *value /= size);
        }
    }
    Some(Unresisted { count, vectors })
}

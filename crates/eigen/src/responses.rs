//! Responses to loads on the M-orthogonal complement of known motions: static responses by conjugate gradients,
//! preconditioned by the factor of K + tau M, and harmonic responses with the factor of K - w^2 M.

use super::attempts::factorise;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::refine::rounding_residual;
use super::settings::Precision;
use faer::{Mat, MatRef, Scale};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Cholesky, Indefinite, Pencil, Real, Solve, column_products, gram, largest, side_by_side,
    subtract_combination,
};

/// M-orthogonal complement of M-orthonormal columns P, and the loads that do no work on P.
pub(super) struct Complement {
    /// Columns P, and M P.
    known: Mat<f64>,
    products: Mat<f64>,
}

impl Complement {
    /// Returns the complement of the columns of `parts` (rigid motions and modes).
    pub(crate) fn of(pencil: &Pencil<'_>, parts: &[MatRef<'_, f64>]) -> Self {
        let known = side_by_side(parts);
        Self { products: pencil.apply_mass(known.as_ref()), known }
    }

    /// Returns true when there are no known motions: the complement is the whole space.
    pub(crate) fn is_everything(&self) -> bool {
        self.known.ncols() == 0
    }

    /// Projects X onto the complement: X <- (I - P P'M) X.
    pub(crate) fn deflate(&self, x: &mut Mat<f64>) {
        let along = gram(self.products.as_ref(), x.as_ref());
        subtract_combination(x.as_mut(), self.known.as_ref(), along.as_ref());
    }

    /// Projects loads onto the self-equilibrated ones: F <- (I - M P P') F.
    pub(crate) fn equilibrate(&self, f: &mut Mat<f64>) {
        let along = gram(self.known.as_ref(), f.as_ref());
        subtract_combination(f.as_mut(), self.products.as_ref(), along.as_ref());
    }
}

/// Largest number of iterations of one cycle. With lambda >= tau on the complement each reduces the error by a factor
/// of six or more.
const MAX_ITERATIONS: usize = 40;

/// Shift of the factor over the first eigenvalue with which K + tau M is definite in spite of rounding.
const SAFE_SHIFT: f64 = 0.5;

/// Accuracy of responses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseAccuracy {
    /// Number of cycles. Each begins with the true residual, from which that of the recurrence drifts.
    cycles: usize,
    /// Energy norm of the error, relative to the start, at which a cycle ends.
    reached: f64,
    /// Residual |f - K x| / |f| above which a response is refused, unless rounding explains it.
    accepted: f64,
    /// Shift of the factor over the first eigenvalue. A smaller shift makes the factor nearer to K, and iterations fewer: one
    /// reduces the error by about 4 / shift. K + tau M is then nearer to singular.
    shift: f64,
}

impl ResponseAccuracy {
    /// Accuracy to the rounding floor of f64.
    pub const FULL: Self = Self { cycles: 3, reached: 1e-14, accepted: 1e-9, shift: SAFE_SHIFT };
    /// Accuracy of stresses: eight digits and more, with a quarter of the iterations of one cycle of `FULL`.
    pub const STRESS: Self = Self { cycles: 1, reached: 1e-10, accepted: 1e-7, shift: 0.01 };
    /// Accuracy of a few digits, for estimates.
    pub const ROUGH: Self = Self { cycles: 1, reached: 1e-5, accepted: 1e-2, shift: SAFE_SHIFT };
}

/// Returns for each load (column of `loads`, N x m) the part of K^+ f outside `modes`. With P = \[R, Psi\] of rigid
/// modes and eigenvectors (`modes`, M-orthonormal), K x = (I - M P P') f and P'M x = 0. The loads are thereby
/// self-equilibrated (inertia relief).
///
/// `first` is the first flexible eigenvalue, which scales the shift. Without rigid modes and `modes` (a body that is
/// held) x = K^-1 f.
///
/// # Errors
/// Failures of the factorisation; [`EigenFailure::Inaccurate`] with the residual of a response that is not accurate
/// enough.
pub fn static_responses(
    problem: &EigenProblem<'_>,
    modes: MatRef<'_, f64>,
    loads: Mat<f64>,
    first: f64,
    precision: Precision,
    accuracy: ResponseAccuracy,
    context: &Context<'_>,
) -> Result<Mat<f64>, EigenFailure> {
    let respond = |responses: &StaticResponses<'_>| responses.of(loads, context);
    with_static_responses(problem, modes, first, precision, accuracy, context, respond)
}

/// Returns the responses K^+ f of [`static_responses`] without known modes, and with one factor also the responses to
/// further loads. `further` receives the first responses and returns these loads.
///
/// # Errors
/// The errors of [`static_responses`].
pub fn static_responses_twice(
    problem: &EigenProblem<'_>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
    first: f64,
    precision: Precision,
    accuracy: ResponseAccuracy,
    context: &Context<'_>,
) -> Result<[Mat<f64>; 2], EigenFailure> {
    let none = Mat::zeros(problem.pencil.n(), 0);
    let respond =
        |responses: &StaticResponses<'_>| twice(|loads| responses.of(loads, context), loads, further);
    with_static_responses(problem, none.as_ref(), first, precision, accuracy, context, respond)
}

/// Returns the responses `of` the loads, and the responses to the loads that `further` makes of them.
pub(super) fn twice(
    mut of: impl FnMut(Mat<f64>) -> Result<Mat<f64>, EigenFailure>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
) -> Result<[Mat<f64>; 2], EigenFailure> {
    let first = of(loads)?;
    let loads = further(&first);
    Ok([first, of(loads)?])
}

/// Factors K + tau M in the given precision and calls `respond` with it.
fn with_static_responses<T>(
    problem: &EigenProblem<'_>,
    modes: MatRef<'_, f64>,
    first: f64,
    precision: Precision,
    accuracy: ResponseAccuracy,
    context: &Context<'_>,
    respond: impl FnOnce(&StaticResponses<'_>) -> Result<T, EigenFailure>,
) -> Result<T, EigenFailure> {
    let analysis = problem.analysis().ok_or(EigenFailure::TooLarge)?;
    let complement = Complement::of(&problem.pencil, &[problem.rigid, modes]);
    // Without known motions K itself is definite, and its factor gives the solution up to rounding.
    let scale = if complement.is_everything() { 0.0 } else { first };
    let shifts = [accuracy.shift * scale, SAFE_SHIFT * scale];
    match precision {
        Precision::Double => {
            let factor: Cholesky<'_, f64> = definite_factor(problem, &analysis, shifts, context)?;
            respond(&StaticResponses { pencil: &problem.pencil, complement, factor: &factor, accuracy })
        }
        Precision::Single => {
            let factor: Cholesky<'_, f32> = definite_factor(problem, &analysis, shifts, context)?;
            respond(&StaticResponses { pencil: &problem.pencil, complement, factor: &factor, accuracy })
        }
    }
}

/// Returns the factor of K + tau M for the first of two shifts tau, or for the second if the first is too small for the
/// rounding of the factor.
fn definite_factor<'a, T: Real>(
    problem: &EigenProblem<'_>,
    analysis: &'a Analysis,
    [small, safe]: [f64; 2],
    context: &Context<'_>,
) -> Result<Cholesky<'a, T>, EigenFailure> {
    match factorise(problem, analysis, small, context) {
        Err(EigenFailure::NotPositiveDefinite { .. } | EigenFailure::Inaccurate { .. }) if small < safe => {
            factorise(problem, analysis, safe, context)
        }
        found => found,
    }
}

/// Static responses with one factor.
struct StaticResponses<'a> {
    pencil: &'a Pencil<'a>,
    complement: Complement,
    factor: &'a dyn Solve,
    accuracy: ResponseAccuracy,
}

impl StaticResponses<'_> {
    fn of(&self, mut loads: Mat<f64>, context: &Context<'_>) -> Result<Mat<f64>, EigenFailure> {
        // Two passes: a load may be rigid but for its last digits.
        self.complement.equilibrate(&mut loads);
        self.complement.equilibrate(&mut loads);
        let mut x = Mat::zeros(loads.nrows(), loads.ncols());
        let mut residual = loads.clone();
        for _ in 0..self.accuracy.cycles {
            x += self.cycle(residual, context);
            self.complement.deflate(&mut x);
            context.count(|work| work.stiffness_columns += x.ncols() as u64);
            residual = &loads - self.pencil.apply_stiffness(x.as_ref());
            self.complement.equilibrate(&mut residual);
        }
        let rounding = rounding_residual(self.pencil.stiffness(), x.as_ref());
        for (j, rounding) in rounding.iter().enumerate() {
            let (left, load) = (residual.col(j).norm_l2(), loads.col(j).norm_l2());
            if left.is_nan() || left > (self.accuracy.accepted * load).max(30.0 * rounding) {
                return Err(EigenFailure::Inaccurate { residual: left / load });
            }
        }
        Ok(x)
    }

    /// Performs conjugate gradients from zero on all columns side by side. Returns the approximate solutions.
    fn cycle(&self, mut residual: Mat<f64>, context: &Context<'_>) -> Mat<f64> {
        let columns = residual.ncols();
        let precondition = |r: &Mat<f64>| {
            context.count(|work| work.solved_columns += columns as u64);
            let mut z = r.clone();
            self.factor.solve_in_place(z.as_mut());
            self.complement.deflate(&mut z);
            z
        };
        // Preconditioned start: z = (K + tau M)^-1 r on the complement.
        let mut x = Mat::zeros(residual.nrows(), columns);
        let mut direction = precondition(&residual);
        let start = column_products(residual.as_ref(), direction.as_ref());
        let mut energy = start.clone();
        for _ in 0..MAX_ITERATIONS {
            if energy.iter().zip(&start).all(|(e, s)| *e <= self.accuracy.reached.powi(2) * s) {
                break;
            }
            context.count(|work| work.stiffness_columns += columns as u64);
            let product = self.pencil.apply_stiffness(direction.as_ref());
            let curvature = column_products(direction.as_ref(), product.as_ref());
            // A column whose residual is zero does not move.
            let step = ratios(&energy, &curvature);
            for j in 0..columns {
                for i in 0..x.nrows() {
                    x[(i, j)] += step[j] * direction[(i, j)];
                    residual[(i, j)] -= step[j] * product[(i, j)];
                }
            }
            // Conjugate direction from the new preconditioned residual.
            let z = precondition(&residual);
            let next = column_products(residual.as_ref(), z.as_ref());
            let turn = ratios(&next, &energy);
            direction = Mat::from_fn(z.nrows(), columns, |i, j| z[(i, j)] + turn[j] * direction[(i, j)]);
            energy = next;
        }
        x
    }
}

/// Returns a / b, zero where b is not positive.
fn ratios(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| if *b > 0.0 { a / b } else { 0.0 }).collect()
}

/// Largest number of refinements with the true residual.
const MAX_REFINEMENTS: usize = 5;

/// Backward error above which a factor is refused as a preconditioner.
const MAX_PRECONDITIONER_ERROR: f64 = 1e-4;

/// Residual |f - (K - w^2 M) x| / |f| at which refinement ends, and the residual above which a response is refused.
const TARGET_RESIDUAL: f64 = 1e-13;
const MAX_RESIDUAL: f64 = 1e-9;

/// Returns for each load (column of `loads`, N x m) the part of (K - w^2 M)^-1 f outside `modes`. With P = \[R, Psi\]
/// of rigid modes and eigenvectors (`modes`, M-orthonormal), (K - w^2 M) x = (I - M P P') f and P'M x = 0. The part of
/// the response in the modes is Psi (Lambda - w^2)^-1 Psi'f.
///
/// * `square`: w^2 > 0, which may lie among the eigenvalues of the modes.
///
/// # Errors
/// [`EigenFailure::Inaccurate`] with the residual of a response, if w^2 is an eigenvalue outside the modes, or too near
/// to an eigenvalue of the modes; [`EigenFailure::TooLarge`].
pub fn dynamic_responses(
    problem: &EigenProblem<'_>,
    modes: MatRef<'_, f64>,
    loads: Mat<f64>,
    square: f64,
    context: &Context<'_>,
) -> Result<Mat<f64>, EigenFailure> {
    let respond = |responses: &DynamicResponses<'_>| responses.of(loads, context);
    with_dynamic_responses(problem, modes, square, context, respond)
}

/// Returns the responses of [`dynamic_responses`] without known modes, and with one factor also the responses to
/// further loads. `further` receives the first responses and returns these loads.
///
/// # Errors
/// The errors of [`dynamic_responses`].
pub fn dynamic_responses_twice(
    problem: &EigenProblem<'_>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
    square: f64,
    context: &Context<'_>,
) -> Result<[Mat<f64>; 2], EigenFailure> {
    let none = Mat::zeros(problem.pencil.n(), 0);
    let respond =
        |responses: &DynamicResponses<'_>| twice(|loads| responses.of(loads, context), loads, further);
    with_dynamic_responses(problem, none.as_ref(), square, context, respond)
}

/// Factors K - w^2 M and calls `respond` with the factor.
fn with_dynamic_responses<T>(
    problem: &EigenProblem<'_>,
    modes: MatRef<'_, f64>,
    square: f64,
    context: &Context<'_>,
    respond: impl FnOnce(&DynamicResponses<'_>) -> Result<T, EigenFailure>,
) -> Result<T, EigenFailure> {
    let pencil = &problem.pencil;
    let analysis = Analysis::new(pencil).ok_or(EigenFailure::TooLarge)?;
    context.count(|work| work.factorizations += 1);
    let factor = Indefinite::<f64>::new(&analysis, pencil, square);
    let inertia = factor.inertia();
    if inertia.zero > 0
        || inertia.backward_error.is_nan()
        || inertia.backward_error > MAX_PRECONDITIONER_ERROR
    {
        return Err(EigenFailure::Inaccurate { residual: inertia.backward_error });
    }
    let complement = Complement::of(pencil, &[problem.rigid, modes]);
    respond(&DynamicResponses { pencil, complement, factor, square })
}

/// Harmonic responses with one factor.
struct DynamicResponses<'a> {
    pencil: &'a Pencil<'a>,
    complement: Complement,
    factor: Indefinite<'a, f64>,
    square: f64,
}

impl DynamicResponses<'_> {
    fn of(&self, mut loads: Mat<f64>, context: &Context<'_>) -> Result<Mat<f64>, EigenFailure> {
        // Two passes: a load may be the inertia force of a mode but for its last digits.
        self.complement.equilibrate(&mut loads);
        self.complement.equilibrate(&mut loads);
        let mut x = Mat::zeros(loads.nrows(), loads.ncols());
        let mut residual = loads.clone();
        // Iterative refinement with the true residual.
        for _ in 0..=MAX_REFINEMENTS {
            context.count(|work| work.solved_columns += loads.ncols() as u64);
            self.factor.solve_in_place(residual.as_mut());
            x += residual;
            self.complement.deflate(&mut x);
            residual = &loads - self.pencil.apply_stiffness(x.as_ref())
                + self.pencil.apply_mass(x.as_ref()) * Scale(self.square);
            self.complement.equilibrate(&mut residual);
            if largest_ratio(&residual, &loads) <= TARGET_RESIDUAL {
                break;
            }
        }
        match largest_ratio(&residual, &loads) {
            left if left <= MAX_RESIDUAL => Ok(x),
            residual => Err(EigenFailure::Inaccurate { residual }),
        }
    }
}

/// Returns the largest |residual| / |load| of all columns; NaN if one of them is NaN.
fn largest_ratio(residual: &Mat<f64>, loads: &Mat<f64>) -> f64 {
    let part = |j: usize| match (residual.col(j).norm_l2(), loads.col(j).norm_l2()) {
        (0.0, _) => 0.0,
        (left, load) => left / load,
    };
    largest((0..loads.ncols()).map(part))
}

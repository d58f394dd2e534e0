//! Responses to loads on the M-orthogonal complement of known motions: static ones, by conjugate gradients that the
//! factor of K + tau M preconditions, and ones that oscillate, with the factor of K - w^2 M.

use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::settings::Precision;
use super::shift::factorise;
use super::zero_energy::rounding_residual;
use faer::{Mat, MatRef, Scale};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Cholesky, Indefinite, Pencil, Solve, column_products, gram, largest, side_by_side,
    subtract_combination,
};

/// The M-orthogonal complement of M-orthonormal columns P, and the loads that do no work on P.
pub(super) struct Complement {
    /// P and M P.
    known: Mat<f64>,
    products: Mat<f64>,
}

impl Complement {
    /// Returns the complement of rigid motions and modes.
    pub(crate) fn of(pencil: &Pencil<'_>, parts: &[MatRef<'_, f64>]) -> Self {
        let known = side_by_side(parts);
        Self { products: pencil.apply_mass(known.as_ref()), known }
    }

    /// Returns true when nothing is known: all is in the complement.
    pub(crate) fn is_everything(&self) -> bool {
        self.known.ncols() == 0
    }

    /// X <- (I - P P'M) X.
    pub(crate) fn deflate(&self, x: &mut Mat<f64>) {
        let along = gram(self.products.as_ref(), x.as_ref());
        subtract_combination(x.as_mut(), self.known.as_ref(), along.as_ref());
    }

    /// F <- (I - M P P') F.
    pub(crate) fn equilibrate(&self, f: &mut Mat<f64>) {
        let along = gram(self.known.as_ref(), f.as_ref());
        subtract_combination(f.as_mut(), self.products.as_ref(), along.as_ref());
    }
}

/// Iterations of one cycle at the most: with lambda >= tau on the complement the error falls by a factor of
/// six in each.
const ITERATIONS: usize = 40;

/// Accuracy asked of responses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseAccuracy {
    /// Cycles: each begins with the true residual, which the recurrence loses sight of.
    cycles: usize,
    /// Energy norm of the error, relative to that of the start, at which a cycle ends.
    reached: f64,
    /// Residual |f - K x| / |f| above which a response is no result, unless rounding explains it.
    accepted: f64,
}

impl ResponseAccuracy {
    /// To the floor of f64.
    pub const FULL: Self = Self { cycles: 3, reached: 1e-14, accepted: 1e-9 };
    /// Some digits, for estimates.
    pub const ROUGH: Self = Self { cycles: 1, reached: 1e-5, accepted: 1e-2 };
}

/// For each load (column of `loads`, N x m) the part of K^+ f that `modes` do not have: with P = \[R, Psi\]
/// of rigid modes and eigenvectors (`modes` M-orthonormal), K x = (I - M P P') f and P'M x = 0. The loads are
/// thereby self-equilibrated (inertia relief).
///
/// `first` is the first flexible eigenvalue, the scale of the shift. Without rigid modes and `modes` (a body
/// that is held) x = K^-1 f.
///
/// # Errors
/// Failures of the factorisation; [`EigenFailure::Inaccurate`] with the residual of a response.
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

/// The responses K^+ f of [`static_responses`] without known modes, and with the same factor those to further
/// loads that these responses tell.
///
/// # Errors
/// Those of [`static_responses`].
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

/// The responses `of` loads, and those of further loads that these tell.
pub(super) fn twice(
    mut of: impl FnMut(Mat<f64>) -> Result<Mat<f64>, EigenFailure>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
) -> Result<[Mat<f64>; 2], EigenFailure> {
    let first = of(loads)?;
    let loads = further(&first);
    Ok([first, of(loads)?])
}

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
    // Without known modes K itself is definite, and its factor the solution but for rounding.
    let tau = if complement.is_everything() { 0.0 } else { 0.5 * first };
    match precision {
        Precision::Double => {
            let factor: Cholesky<'_, f64> = factorise(problem, &analysis, tau, context)?;
            respond(&StaticResponses { pencil: &problem.pencil, complement, factor: &factor, accuracy })
        }
        Precision::Single => {
            let factor: Cholesky<'_, f32> = factorise(problem, &analysis, tau, context)?;
            respond(&StaticResponses { pencil: &problem.pencil, complement, factor: &factor, accuracy })
        }
    }
}

struct StaticResponses<'a> {
    pencil: &'a Pencil<'a>,
    complement: Complement,
    factor: &'a dyn Solve,
    accuracy: ResponseAccuracy,
}

impl StaticResponses<'_> {
    fn of(&self, mut loads: Mat<f64>, context: &Context<'_>) -> Result<Mat<f64>, EigenFailure> {
        // Twice: a load may be rigid but for its last digits.
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

    /// Conjugate gradients of all columns side by side from zero.
    fn cycle(&self, mut residual: Mat<f64>, context: &Context<'_>) -> Mat<f64> {
        let columns = residual.ncols();
        let precondition = |r: &Mat<f64>| {
            context.count(|work| work.solved_columns += columns as u64);
            let mut z = r.clone();
            self.factor.solve_in_place(z.as_mut());
            self.complement.deflate(&mut z);
            z
        };
        let mut x = Mat::zeros(residual.nrows(), columns);
        let mut direction = precondition(&residual);
        let start = column_products(residual.as_ref(), direction.as_ref());
        let mut energy = start.clone();
        for _ in 0..ITERATIONS {
            if energy.iter().zip(&start).all(|(e, s)| *e <= self.accuracy.reached.powi(2) * s) {
                break;
            }
            context.count(|work| work.stiffness_columns += columns as u64);
            let product = self.pencil.apply_stiffness(direction.as_ref());
            let curvature = column_products(direction.as_ref(), product.as_ref());
            // A column that has converged to nothing stands still.
            let step = ratios(&energy, &curvature);
            for j in 0..columns {
                for i in 0..x.nrows() {
                    x[(i, j)] += step[j] * direction[(i, j)];
                    residual[(i, j)] -= step[j] * product[(i, j)];
                }
            }
            let z = precondition(&residual);
            let next = column_products(residual.as_ref(), z.as_ref());
            let turn = ratios(&next, &energy);
            direction = Mat::from_fn(z.nrows(), columns, |i, j| z[(i, j)] + turn[j] * direction[(i, j)]);
            energy = next;
        }
        x
    }
}

/// a / b, zero where b is not positive.
fn ratios(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| if *b > 0.0 { a / b } else { 0.0 }).collect()
}

/// Refinements with the true residual at the most.
const REFINEMENTS: usize = 5;

/// A factor with a larger backward error is no preconditioner.
const GROWTH_LIMIT: f64 = 1e-4;

/// Residual |f - (K - w^2 M) x| / |f| at which refinement ends, and above which a response is no result.
const REACHED: f64 = 1e-13;
const ACCEPTED: f64 = 1e-9;

/// For each load (column of `loads`, N x m) the part of (K - w^2 M)^-1 f that `modes` do not have: with P =
/// \[R, Psi\] of rigid modes and eigenvectors (`modes` M-orthonormal), (K - w^2 M) x = (I - M P P') f and P'M x
/// = 0. What the modes have of the response is Psi (Lambda - w^2)^-1 Psi'f.
///
/// * `square`: w^2 > 0, which may lie among the eigenvalues of the modes.
///
/// # Errors
/// [`EigenFailure::Inaccurate`] with the residual of a response: where w^2 is an eigenvalue that the modes do
/// not have, or too near to one of theirs; [`EigenFailure::TooLarge`].
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

/// The responses of [`dynamic_responses`] without known modes, and with the same factor those to further loads that
/// these responses tell.
///
/// # Errors
/// Those of [`dynamic_responses`].
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
    if inertia.zero > 0 || inertia.backward_error.is_nan() || inertia.backward_error > GROWTH_LIMIT {
        return Err(EigenFailure::Inaccurate { residual: inertia.backward_error });
    }
    let complement = Complement::of(pencil, &[problem.rigid, modes]);
    respond(&DynamicResponses { pencil, complement, factor, square })
}

struct DynamicResponses<'a> {
    pencil: &'a Pencil<'a>,
    complement: Complement,
    factor: Indefinite<'a, f64>,
    square: f64,
}

impl DynamicResponses<'_> {
    fn of(&self, mut loads: Mat<f64>, context: &Context<'_>) -> Result<Mat<f64>, EigenFailure> {
        // Twice: a load may be that of a mode but for its last digits.
        self.complement.equilibrate(&mut loads);
        self.complement.equilibrate(&mut loads);
        let mut x = Mat::zeros(loads.nrows(), loads.ncols());
        let mut residual = loads.clone();
        for _ in 0..=REFINEMENTS {
            context.count(|work| work.solved_columns += loads.ncols() as u64);
            self.factor.solve_in_place(residual.as_mut());
            x += residual;
            self.complement.deflate(&mut x);
            residual = &loads - self.pencil.apply_stiffness(x.as_ref())
                + self.pencil.apply_mass(x.as_ref()) * Scale(self.square);
            self.complement.equilibrate(&mut residual);
            if largest_part(&residual, &loads) <= REACHED {
                break;
            }
        }
        match largest_part(&residual, &loads) {
            left if left <= ACCEPTED => Ok(x),
            residual => Err(EigenFailure::Inaccurate { residual }),
        }
    }
}

/// The largest |residual| / |load| of all columns; not a number where one is none.
fn largest_part(residual: &Mat<f64>, loads: &Mat<f64>) -> f64 {
    let part = |j: usize| match (residual.col(j).norm_l2(), loads.col(j).norm_l2()) {
        (0.0, _) => 0.0,
        (left, load) => left / load,
    };
    largest((0..loads.ncols()).map(part))
}

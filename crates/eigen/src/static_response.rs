//! Static responses of the free body: x = K^+ f on the M-orthogonal complement of given modes, by conjugate
//! gradients that the factor of K + tau M preconditions.

use super::complement::Complement;
use super::counters::Counters;
use super::factorise::factorise;
use super::failure::EigenFailure;
use super::noise::rounding_residual;
use super::problem::EigenProblem;
use super::settings::Precision;
use faer::{Mat, MatRef};
use flexbody_linalg::{Cholesky, Pencil, Solve, column_products};

/// Iterations of one cycle at the most: with lambda >= tau on the complement the error falls by a factor of
/// six in each.
const ITERATIONS: usize = 40;

/// How accurate responses are to be.
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
    counters: &mut Counters,
) -> Result<Mat<f64>, EigenFailure> {
    let respond = |responses: &Responses<'_>, counters: &mut Counters| responses.of(loads, counters);
    with_responses(problem, modes, first, precision, accuracy, counters, respond)
}

/// The responses K^+ f of [`static_responses`] without known modes, and with the same factor those to further
/// loads that these responses tell.
///
/// # Errors
/// As [`static_responses`].
pub fn static_responses_twice(
    problem: &EigenProblem<'_>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
    first: f64,
    precision: Precision,
    accuracy: ResponseAccuracy,
    counters: &mut Counters,
) -> Result<[Mat<f64>; 2], EigenFailure> {
    let none = Mat::zeros(problem.pencil.n(), 0);
    let respond = |responses: &Responses<'_>, counters: &mut Counters| {
        twice(|loads| responses.of(loads, counters), loads, further)
    };
    with_responses(problem, none.as_ref(), first, precision, accuracy, counters, respond)
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

fn with_responses<T>(
    problem: &EigenProblem<'_>,
    modes: MatRef<'_, f64>,
    first: f64,
    precision: Precision,
    accuracy: ResponseAccuracy,
    counters: &mut Counters,
    respond: impl FnOnce(&Responses<'_>, &mut Counters) -> Result<T, EigenFailure>,
) -> Result<T, EigenFailure> {
    let analysis = problem.analysis().ok_or(EigenFailure::TooLarge)?;
    let complement = Complement::of(&problem.pencil, &[problem.rigid, modes]);
    // Without known modes K itself is definite, and its factor the solution but for rounding.
    let tau = if complement.is_everything() { 0.0 } else { 0.5 * first };
    match precision {
        Precision::Double => {
            let factor: Cholesky<'_, f64> = factorise(problem, &analysis, tau, counters)?;
            respond(&Responses { pencil: &problem.pencil, complement, factor: &factor, accuracy }, counters)
        }
        Precision::Single => {
            let factor: Cholesky<'_, f32> = factorise(problem, &analysis, tau, counters)?;
            respond(&Responses { pencil: &problem.pencil, complement, factor: &factor, accuracy }, counters)
        }
    }
}

struct Responses<'a> {
    pencil: &'a Pencil<'a>,
    complement: Complement,
    factor: &'a dyn Solve,
    accuracy: ResponseAccuracy,
}

impl Responses<'_> {
    fn of(&self, mut loads: Mat<f64>, counters: &mut Counters) -> Result<Mat<f64>, EigenFailure> {
        // Twice: a load may be rigid but for its last digits.
        self.complement.equilibrate(&mut loads);
        self.complement.equilibrate(&mut loads);
        let mut x = Mat::zeros(loads.nrows(), loads.ncols());
        let mut residual = loads.clone();
        for _ in 0..self.accuracy.cycles {
            x += self.cycle(residual, counters);
            self.complement.deflate(&mut x);
            counters.stiffness_columns += x.ncols() as u64;
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
    fn cycle(&self, mut residual: Mat<f64>, counters: &mut Counters) -> Mat<f64> {
        let columns = residual.ncols();
        let precondition = |r: &Mat<f64>, counters: &mut Counters| {
            counters.solved_columns += columns as u64;
            let mut z = r.clone();
            self.factor.solve_in_place(z.as_mut());
            self.complement.deflate(&mut z);
            z
        };
        let mut x = Mat::zeros(residual.nrows(), columns);
        let mut direction = precondition(&residual, counters);
        let start = column_products(residual.as_ref(), direction.as_ref());
        let mut energy = start.clone();
        for _ in 0..ITERATIONS {
            if energy.iter().zip(&start).all(|(e, s)| *e <= self.accuracy.reached.powi(2) * s) {
                break;
            }
            counters.stiffness_columns += columns as u64;
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
            let z = precondition(&residual, counters);
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

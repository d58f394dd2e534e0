//! Responses of the free body to loads that oscillate: x = (K - w^2 M)^-1 f on the M-orthogonal complement of
//! given modes.

use super::complement::Complement;
use super::counters::Counters;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::static_response::twice;
use faer::{Mat, MatRef, Scale};
use flexbody_linalg::{Analysis, Indefinite, Pencil, largest};

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
    counters: &mut Counters,
) -> Result<Mat<f64>, EigenFailure> {
    let respond = |responses: &Responses<'_>, counters: &mut Counters| responses.of(loads, counters);
    with_responses(problem, modes, square, counters, respond)
}

/// The responses of [`dynamic_responses`] without known modes, and with the same factor those to further loads that
/// these responses tell.
///
/// # Errors
/// As [`dynamic_responses`].
pub fn dynamic_responses_twice(
    problem: &EigenProblem<'_>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
    square: f64,
    counters: &mut Counters,
) -> Result<[Mat<f64>; 2], EigenFailure> {
    let none = Mat::zeros(problem.pencil.n(), 0);
    let respond = |responses: &Responses<'_>, counters: &mut Counters| {
        twice(|loads| responses.of(loads, counters), loads, further)
    };
    with_responses(problem, none.as_ref(), square, counters, respond)
}

fn with_responses<T>(
    problem: &EigenProblem<'_>,
    modes: MatRef<'_, f64>,
    square: f64,
    counters: &mut Counters,
    respond: impl FnOnce(&Responses<'_>, &mut Counters) -> Result<T, EigenFailure>,
) -> Result<T, EigenFailure> {
    let pencil = &problem.pencil;
    let analysis = Analysis::new(pencil).ok_or(EigenFailure::TooLarge)?;
    counters.factorizations += 1;
    let factor = Indefinite::<f64>::new(&analysis, pencil, square);
    let inertia = factor.inertia();
    if inertia.zero > 0 || inertia.backward_error.is_nan() || inertia.backward_error > GROWTH_LIMIT {
        return Err(EigenFailure::Inaccurate { residual: inertia.backward_error });
    }
    let complement = Complement::of(pencil, &[problem.rigid, modes]);
    respond(&Responses { pencil, complement, factor, square }, counters)
}

struct Responses<'a> {
    pencil: &'a Pencil<'a>,
    complement: Complement,
    factor: Indefinite<'a, f64>,
    square: f64,
}

impl Responses<'_> {
    fn of(&self, mut loads: Mat<f64>, counters: &mut Counters) -> Result<Mat<f64>, EigenFailure> {
        // Twice: a load may be that of a mode but for its last digits.
        self.complement.equilibrate(&mut loads);
        self.complement.equilibrate(&mut loads);
        let mut x = Mat::zeros(loads.nrows(), loads.ncols());
        let mut residual = loads.clone();
        for _ in 0..=REFINEMENTS {
            counters.solved_columns += loads.ncols() as u64;
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

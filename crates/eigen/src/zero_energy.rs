//! Rounding floors, and motions whose energy cannot be distinguished from zero with the digits of K.

use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::refine::Refined;
use faer::Mat;
use faer::{ColRef, MatRef};
use flexbody_linalg::{
    Analysis, Cholesky, Inertia, Pencil, Solve, SymmetricMatrix, Tall, column_norms, sum_terms,
};

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

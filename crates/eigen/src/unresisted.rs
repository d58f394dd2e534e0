//! Motions that neither K nor M resists: why K + tau M cannot be factored although none of the two is
//! indefinite.

use super::zero_energy::NOISE_FACTOR;
use faer::Mat;
use flexbody_linalg::{Analysis, Cholesky, Inertia, Pencil, Solve, SymmetricMatrix};

/// Motions with neither strain energy nor mass.
#[derive(Debug, Clone)]
pub struct Unresisted {
    /// How many there are, rigid motions not among them: these have mass.
    pub count: usize,
    /// Some of them (N x at most `SHOWN`), of largest entry one.
    pub vectors: Mat<f64>,
}

/// Vectors that are computed at the most.
const SHOWN: usize = 8;

/// Steps of inverse iteration: the first lifts the motions by as many digits as K has above all others.
const STEPS: usize = 2;

/// The motions that K + tau M leaves without energy up to the digits of K (`input_error` is the relative
/// error of its entries); `None` where there is none, or where K + tau M is truly indefinite.
///
/// Counted are the eigenvalues mu of (K + tau M) x = mu diag(K) x within noise of zero, by the inertia of K +
/// tau M -+ delta diag(K).
pub fn unresisted_motions(pencil: &Pencil<'_>, tau: f64, input_error: f64) -> Option<Unresisted> {
    let delta = NOISE_FACTOR * input_error.max(f64::EPSILON);
    let analysis = Analysis::new(pencil)?;
    let moved = |part: f64| pencil.stiffness().with_diagonal(|_, k| k + part * k);
    let with = |stiffness: &SymmetricMatrix| {
        Inertia::new(&analysis, &Pencil::new(stiffness, pencil.mass(), pencil.block()), -tau)
    };
    let (lowered, raised) = (moved(-delta)?, moved(delta)?);
    let count = with(&lowered).negative;
    if count == 0 || with(&raised).negative > 0 {
        return None;
    }
    let raised = Pencil::new(&raised, pencil.mass(), pencil.block());
    let factor = Cholesky::<f64>::new(&analysis, &raised, tau)?;
    let start = |i: usize, j: usize| ((i + 1) as f64 * (j as f64 + 1.37) * 0.754_877_666).fract() - 0.5;
    let mut vectors = Mat::from_fn(pencil.n(), count.min(SHOWN), start);
    for _ in 0..STEPS {
        factor.solve_in_place(vectors.as_mut());
        for column in vectors.col_iter_mut() {
            let size = column.norm_max();
            column.iter_mut().for_each(|value| *value /= size);
        }
    }
    Some(Unresisted { count, vectors })
}

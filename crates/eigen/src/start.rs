//! Taking up a search where an earlier one stood.

use super::krylov::Krylov;
use super::problem::EigenProblem;
use super::resume::Snapshot;
use faer::MatRef;
use flexbody_linalg::{gram, largest, largest_entry};

/// Largest entry of V' M V - I and R' M V of a basis that is orthonormal to rounding.
const ORTHONORMAL: f64 = 1e-9;

/// Largest relative difference of lambda and the Rayleigh quotient of a converged mode.
pub const SAME_EIGENVALUE: f64 = 1e-6;

/// The shift that a search begins with, as a part of the upper bound of the first flexible eigenvalue.
pub const FIRST_SHIFT: f64 = 0.3;

/// The start of a search, where there is one that fits the problem. A repeated search (`attempt` > 0) has
/// none: it must not start from the directions that led to a wrong count.
pub(super) fn fitting_start<'a>(problem: &EigenProblem<'a>, attempt: u64) -> Option<&'a Snapshot> {
    problem.resume.start.filter(|snapshot| attempt == 0 && fits(problem, snapshot))
}

/// The shift that an iterative search begins with: that of its start, or a part of the upper bound of the
/// first eigenvalue.
pub(super) fn first_shift(problem: &EigenProblem<'_>, start: Option<&Snapshot>) -> f64 {
    start.map_or(FIRST_SHIFT * problem.first_estimate, |start| start.shift)
}

fn fits(problem: &EigenProblem<'_>, snapshot: &Snapshot) -> bool {
    let Snapshot { shift, eigenvalues, basis, coupling, converged } = snapshot;
    let (k, pencil) = (eigenvalues.len(), &problem.pencil);
    let shapes = basis.nrows() == pencil.n()
        && basis.ncols() == k + coupling.nrows()
        && basis.ncols() <= pencil.n()
        && (coupling.nrows() == 0 || coupling.ncols() == k)
        && *converged <= k;
    // A search starts with this shift and only ever lowers it.
    let range = *shift > 0.0 && *shift <= problem.first_estimate;
    let ordered = eigenvalues.first().is_some_and(|&l| l > 0.0) && eigenvalues.is_sorted();
    if !(shapes && range && ordered) {
        return false;
    }
    // A few columns at a time: the products need no memory of the size of the basis.
    (0..basis.ncols()).step_by(CHECKED).all(|from| {
        let width = CHECKED.min(basis.ncols() - from);
        let x = basis.as_ref().subcols(from, width);
        let mx = pencil.apply_mass(x);
        let orthonormal = off_identity(gram(basis.as_ref(), mx.as_ref()).as_ref(), from) <= ORTHONORMAL
            && largest_entry(gram(problem.rigid, mx.as_ref()).as_ref()) <= ORTHONORMAL;
        let modes = converged.saturating_sub(from).min(width);
        let energy = gram(x, pencil.apply_stiffness(x).as_ref());
        orthonormal
            && (0..modes).all(|j| {
                let lambda = eigenvalues[from + j];
                (energy[(j, j)] - lambda).abs() <= SAME_EIGENVALUE * lambda
            })
    })
}

/// Columns of a start that are checked at a time.
const CHECKED: usize = 16;

/// Largest difference of `block` from the columns `from..` of the identity; NaN when one is no number.
fn off_identity(block: MatRef<'_, f64>, from: usize) -> f64 {
    let off = |i: usize, j: usize| (block[(i, j)] - f64::from(i == from + j)).abs();
    largest((0..block.ncols()).flat_map(|j| (0..block.nrows()).map(move |i| off(i, j))))
}

/// A snapshot of a search with the Ritz vectors S (projected x k), theta descending.
pub(super) fn snapshot(
    krylov: &Krylov<'_>,
    s: MatRef<'_, f64>,
    theta: &[f64],
    (shift, converged): (f64, usize),
) -> Snapshot {
    let (basis, coupling) = krylov.state(s);
    let eigenvalues = theta[..s.ncols()].iter().map(|theta| theta.recip() - shift).collect();
    Snapshot { shift, eigenvalues, basis, coupling, converged }
}

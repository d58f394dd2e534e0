//! Taking up a search where an earlier one stood.

use super::krylov::Krylov;
use super::problem::EigenProblem;
use crate::numerics::linalg::gram;
use faer::{Mat, MatRef};

/// A search as it stands: (K + tau M)^-1 M V = V Theta + F C with theta = 1 / (lambda + tau). It does not depend on how
/// the factor was made, and a search for more modes, or for the same ones more accurately, goes on from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// tau.
    pub shift: f64,
    /// lambda of the k Ritz vectors V, ascending.
    pub eigenvalues: Vec<f64>,
    /// V, then the newest block F (N x (k + b)): M-orthonormal, M-orthogonal to the rigid modes.
    pub basis: Mat<f64>,
    /// C (b x k).
    pub coupling: Mat<f64>,
    /// How many of the Ritz vectors are modes at the accuracy that was asked for.
    pub converged: usize,
}

/// Takes a snapshot whenever modes have converged.
pub type Save<'a> = &'a (dyn Fn(&Snapshot) + Sync);

/// Where a search starts, and who keeps how far it came. Neither changes what a result promises: residuals and
/// completeness are those of the outcome, whatever the start was.
#[derive(Clone, Copy, Default)]
pub struct Resume<'a> {
    /// An earlier search on the same pencil; one that does not fit the pencil is left aside.
    pub start: Option<&'a Snapshot>,
    /// Called in the thread of the search.
    pub save: Option<Save<'a>>,
}

impl std::fmt::Debug for Resume<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let start = self.start.map(|snapshot| snapshot.converged);
        f.debug_struct("Resume").field("start", &start).field("save", &self.save.is_some()).finish()
    }
}

impl Resume<'_> {
    /// Hands a snapshot to whoever keeps them; it is only made where there is somebody.
    pub(super) fn save(&self, snapshot: impl FnOnce() -> Snapshot) {
        if let Some(save) = self.save {
            save(&snapshot());
        }
    }
}

/// Largest entry of V' M V - I and R' M V of a basis that is orthonormal to rounding.
const ORTHONORMAL: f64 = 1e-9;

/// Largest relative difference of lambda and the Rayleigh quotient of a converged mode.
const SAME_EIGENVALUE: f64 = 1e-6;

/// The start of a search, where there is one that fits the problem. A repeated search (`attempt` > 0) has none: it must
/// not start from the directions that led to a wrong count.
pub(super) fn fitting_start<'a>(problem: &EigenProblem<'a>, attempt: u64) -> Option<&'a Snapshot> {
    problem.resume.start.filter(|snapshot| attempt == 0 && fits(problem, snapshot))
}

/// The shift that an iterative search begins with: that of its start, or a part of the upper bound of the first eigenvalue.
pub(super) fn first_shift(problem: &EigenProblem<'_>, start: Option<&Snapshot>) -> f64 {
    start.map_or(0.3 * problem.first_estimate, |start| start.shift)
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
            && gram(problem.rigid, mx.as_ref()).norm_max() <= ORTHONORMAL;
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

/// Largest difference of `block` from the columns `from..` of the identity; infinite when one is no number.
fn off_identity(block: MatRef<'_, f64>, from: usize) -> f64 {
    let mut largest = 0.0f64;
    for j in 0..block.ncols() {
        for i in 0..block.nrows() {
            let off = (block[(i, j)] - f64::from(i == from + j)).abs();
            if off.is_nan() {
                return f64::INFINITY;
            }
            largest = largest.max(off);
        }
    }
    largest
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

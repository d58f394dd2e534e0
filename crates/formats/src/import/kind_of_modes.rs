//! Tests of the modes of a file: mass-normalised with a diagonal stiffness, free of rigid motion.

use super::any_body::{ANY_BODY, DIGITS};
use flexbody_body::invariants::{Expected, IdentityCheck, Invariants, identities};
use flexbody_linalg::larger;

/// Largest entry of K_ff off its diagonal for which it counts as diagonal, above the rounding of FE matrices.
/// Eigenvalues then differ from the diagonal by the square of this value, relative.
const NEARLY_DIAGONAL: f64 = 1e-5;

/// Returns the distance of the modes from mass-normalised free-surface modes, the largest violation of their
/// identities; `None` if they are such modes.
pub(crate) fn beside_free_surface(invariants: &Invariants) -> Option<f64> {
    beside(invariants, &["modal_mass_identity", "c1_zero", "c2_zero"])
}

/// Returns the distance of the modes from mass-normalised modes with a diagonal stiffness, for any reference
/// conditions; `None` if they are such modes.
pub(crate) fn beside_normalised(invariants: &Invariants) -> Option<f64> {
    beside(invariants, &["modal_mass_identity"])
}

/// Returns the largest value of the failed identities `about_modes`; `None` if all hold and K_ff is diagonal,
/// positive and ascending.
fn beside(invariants: &Invariants, about_modes: &[&str]) -> Option<f64> {
    let missed = of_modes(invariants)
        .into_iter()
        .filter(|check| about_modes.contains(&check.name) && !check.passed)
        .map(|check| check.value)
        .fold(0.0, larger);
    let beside = beside_diagonal(invariants);
    let k = invariants.modal_stiffness();
    let nearly = |j: usize| k[(j - 1, j - 1)] - k[(j, j)] <= DIGITS * k[(j, j)];
    let ascending = k[(0, 0)] > 0.0 && (1..k.ncols()).all(nearly);
    let diagonal = beside <= NEARLY_DIAGONAL;
    let missed = if diagonal { missed } else { missed.max(beside) };
    // A NaN is not zero and counts as a failure.
    (missed != 0.0 || !diagonal || !ascending).then_some(missed)
}

/// Returns the largest entry of K_ff off its diagonal, relative to the diagonal entries of its row and
/// column.
pub(crate) fn beside_diagonal(invariants: &Invariants) -> f64 {
    let diagonal = of_modes(invariants).into_iter().find(|check| check.name == "modal_stiffness_diagonal");
    diagonal.map_or(f64::NAN, |check| check.value)
}

/// Returns the identities of mass-normalised free-surface modes with the frequencies from the diagonal of
/// K_ff.
fn of_modes(invariants: &Invariants) -> Vec<IdentityCheck> {
    let eigenvalues: Vec<f64> =
        (0..invariants.n_modes()).map(|j| invariants.modal_stiffness()[(j, j)]).collect();
    let expected =
        Expected { mass_normalised: true, free_surface: true, eigenvalues: Some(&eigenvalues), ..ANY_BODY };
    identities(invariants, &expected)
}

//! Deflection at which the kinetic energy of a body that holds W3 without W2 stops being positive definite
//! (theory section 7).

use super::equations::{EquationsOfMotion, Terms};
use super::evaluation::Evaluation;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::symmetric_eigen;
use nalgebra::{DMatrix, Vector3};

/// Largest deflection that is examined, relative to the largest extent of the body: linear elasticity ends there.
const LARGEST_DEFLECTION: f64 = 0.1;

/// Halvings of the interval in which the deflection is sought.
const HALVINGS: usize = 20;

/// Returns a warning (FB560) if `body` holds W3 without W2 and its mass matrix is not positive definite at some
/// deflection within the range of linear elasticity.
pub fn indefinite_inertia(body: &FlexBody) -> Option<Diagnostic> {
    let deflection = deflection_of_indefinite_inertia(body)?;
    let message = format!(
        "W3 is kept without W2: the kinetic energy is not positive definite from deflections of {:.2} % of the largest extent of the body on",
        100.0 * deflection / body.extent()
    );
    Some(Diagnostic::new(Code::InertiaIndefinite, message))
}

/// Returns a deflection of a node at which the mass matrix of a body with W3 and without W2 stops being positive
/// definite: the smallest over the principal axes e of the deformations with the largest |Q'W3 e|. Returns `None` if
/// the body holds W2 or no W3, or if its mass matrix is positive definite for all of them up to
/// 0.1 of the extent of the body.
pub fn deflection_of_indefinite_inertia(body: &FlexBody) -> Option<f64> {
    let groups = body.groups();
    if groups.w2 || !groups.w3 {
        return None;
    }
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let mut evaluation = Evaluation::new(&equations);
    let deformations = axes(body).into_iter().filter_map(|axis| largest_coupling(body, &axis));
    let limits =
        deformations.flat_map(|q| [1.0, -1.0].map(|sign| q.iter().map(|value| sign * value).collect()));
    limits.filter_map(|q: Vec<f64>| limit(body, &mut evaluation, &q)).reduce(f64::min)
}

/// Returns the axes about which rotation is examined: principal axes of inertia, of a plane body its normal.
fn axes(body: &FlexBody) -> Vec<Vector3<f64>> {
    if body.dimension() == 2 {
        return vec![Vector3::z()];
    }
    let principal = body.invariants().inertia().symmetric_eigen().eigenvectors;
    principal.column_iter().map(|axis| axis.into_owned()).collect()
}

/// Returns the modal coordinates with the largest |Q'W3 e| of all with |q| = 1; `None` if W3 e vanishes.
fn largest_coupling(body: &FlexBody, e: &Vector3<f64>) -> Option<Vec<f64>> {
    let (w3, nf) = (body.invariants().w3()?, body.n_modes());
    let along = DMatrix::from_fn(nf, nf, |i, j| (0..3).map(|a| e[a] * w3[(a * nf + i, j)]).sum::<f64>());
    let squares = &along * along.transpose();
    let eigen = symmetric_eigen(faer::Mat::from_fn(nf, nf, |i, j| squares[(i, j)]).as_ref())?;
    let largest = eigen.values.len().checked_sub(1)?;
    (eigen.values[largest] > 0.0).then(|| (0..nf).map(|i| eigen.vectors[(i, largest)]).collect())
}

/// Returns the largest displacement of a node for modal coordinates at which the mass matrix stops being positive
/// definite along the line through `q`; `None` if it does not up to [`LARGEST_DEFLECTION`].
fn limit(body: &FlexBody, evaluation: &mut Evaluation<'_>, q: &[f64]) -> Option<f64> {
    let per_unit = largest_displacement(body, q);
    let (mut definite, mut indefinite) = (0.0, LARGEST_DEFLECTION * body.extent() / per_unit);
    if !indefinite.is_finite() || is_definite(evaluation, q, indefinite) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (definite + indefinite);
        if is_definite(evaluation, q, middle) {
            definite = middle;
        } else {
            indefinite = middle;
        }
    }
    Some(indefinite * per_unit)
}

/// Returns the largest displacement of a node at the modal coordinates `q`.
fn largest_displacement(body: &FlexBody, q: &[f64]) -> f64 {
    let shape = &body.modes().shape;
    let moved = |row: usize| q.iter().enumerate().map(|(j, q)| shape[(row, j)] * q).sum::<f64>();
    let square = |node: usize| (0..3).map(|k| moved(3 * node + k).powi(2)).sum::<f64>();
    (0..body.n_nodes()).map(square).fold(0.0, f64::max).sqrt()
}

/// Returns true if the mass matrix at `factor` times `q` is positive definite.
fn is_definite(evaluation: &mut Evaluation<'_>, q: &[f64], factor: f64) -> bool {
    let n = evaluation.equations().n_velocities();
    let scaled: Vec<f64> = q.iter().map(|value| factor * value).collect();
    evaluation.set(&scaled, &vec![0.0; n]);
    let mut matrix = vec![0.0; n * n];
    evaluation.mass_matrix(&mut matrix);
    DMatrix::from_vec(n, n, matrix).cholesky().is_some()
}

//! Independent oracle: the dense generalised eigenproblem, and mass properties summed from their definitions.
//!
//! Only the matrix type of the library is used, nothing of its eigen-solver or condensation.

use super::mesh::{Assembly, entries};
use faer::{Mat, MatRef, Par, Side};
use flexbody_linalg::CscMatrix;
use nalgebra::{Matrix3, Vector3};

/// All modes of a body.
pub struct DenseModes {
    /// Number of zero-energy modes.
    pub zero: usize,
    /// Finite flexible eigenvalues, ascending.
    pub eigenvalues: Vec<f64>,
    /// Number of infinite eigenvalues: the rank deficiency of M.
    pub infinite: usize,
    /// Mass-normalised shapes (3n x number of finite flexible modes).
    pub shapes: Mat<f64>,
}

/// Computes all modes of an assembly of solid elements.
pub fn dense_modes(assembly: &Assembly) -> DenseModes {
    modes_of(&dense(&assembly.stiffness), &dense(&assembly.mass()))
}

/// Solves K psi = lambda M psi in full, through theta = 1 / (lambda - sigma) with sigma near -lambda_7. Low eigenvalues
/// keep all their digits, and a singular M needs no special treatment.
pub fn modes_of(k: &Mat<f64>, m: &Mat<f64>) -> DenseModes {
    let n = k.nrows();
    let trace = |a: &Mat<f64>| (0..n).map(|i| a[(i, i)]).sum::<f64>();
    let mut sigma = -1e-3 * trace(k) / trace(m);
    for _ in 0..2 {
        let (theta, _) = shifted(k.as_ref(), m.as_ref(), sigma);
        let lambda: Vec<f64> = theta.iter().rev().map(|t| 1.0 / t + sigma).collect();
        sigma = -lambda.iter().find(|l| **l > -1e-7 * sigma).expect("a flexible mode");
    }
    let (theta, vectors) = shifted(k.as_ref(), m.as_ref(), sigma);
    let limit = 1e-12 * theta[n - 1];
    let infinite = theta.iter().filter(|t| **t < limit).count();
    let zero = theta.iter().filter(|t| (1.0 / **t + sigma).abs() < -1e-6 * sigma).count();
    let flexible = n - zero - infinite;
    let eigenvalues = (0..flexible).map(|j| 1.0 / theta[n - 1 - zero - j] + sigma).collect();
    let shapes = Mat::from_fn(n, flexible, |i, j| {
        let column = n - 1 - zero - j;
        vectors[(i, column)] / theta[column].sqrt()
    });
    DenseModes { zero, eigenvalues, infinite, shapes }
}

/// Returns the eigenvalues theta (ascending) of M x = theta (K - sigma M) x, and vectors with x'(K - sigma M) x = 1.
fn shifted(k: MatRef<f64>, m: MatRef<f64>, sigma: f64) -> (Vec<f64>, Mat<f64>) {
    let shifted = k - faer::Scale(sigma) * m;
    let l = shifted.llt(Side::Lower).expect("K - sigma M is positive definite").L().to_owned();
    let mut reduced = m.to_owned();
    let solve = |x: &mut Mat<f64>| {
        faer::linalg::triangular_solve::solve_lower_triangular_in_place(l.as_ref(), x.as_mut(), Par::Seq);
    };
    solve(&mut reduced);
    reduced = reduced.transpose().to_owned();
    solve(&mut reduced);
    let (theta, mut vectors) = symmetric_eigen(reduced.as_ref());
    let upper = l.transpose();
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(upper, vectors.as_mut(), Par::Seq);
    (theta, vectors)
}

/// Returns the eigenvalues (ascending) and orthonormal eigenvectors of the symmetric part of `a`, by a library that the
/// tested code does not use.
pub fn symmetric_eigen(a: MatRef<f64>) -> (Vec<f64>, Mat<f64>) {
    let n = a.nrows();
    let eigen = nalgebra::DMatrix::from_fn(n, n, |i, j| 0.5 * (a[(i, j)] + a[(j, i)])).symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let vectors = Mat::from_fn(n, n, |i, j| eigen.eigenvectors[(i, order[j])]);
    (order.iter().map(|&j| eigen.eigenvalues[j]).collect(), vectors)
}

pub fn dense(matrix: &CscMatrix) -> Mat<f64> {
    let mut full = Mat::zeros(matrix.n_rows(), matrix.n_cols());
    for (r, c, v) in entries(matrix) {
        full[(r as usize, c as usize)] = v;
    }
    full
}

/// Returns mass, centre of mass, and inertia tensor about the centre of mass, from M by their definitions.
pub fn rigid_data(nodes: &[[f64; 3]], scalar_mass: &CscMatrix) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let mut mass = 0.0;
    let mut moment = Vector3::zeros();
    let x0 = Vector3::from(nodes[0]); // near the body: no digits are lost far from the origin
    for (r, _, v) in entries(scalar_mass) {
        mass += v;
        moment += v * (Vector3::from(nodes[r as usize]) - x0);
    }
    let com = x0 + moment / mass;
    let mut inertia = Matrix3::zeros();
    for (r, c, v) in entries(scalar_mass) {
        let (a, b) = (Vector3::from(nodes[r as usize]) - com, Vector3::from(nodes[c as usize]) - com);
        inertia += v * (Matrix3::identity() * a.dot(&b) - a * b.transpose());
    }
    (mass, com, inertia)
}

/// Returns the 18 flexible eigenvalues, ascending, of a free unit cube of unit density that is one trilinear element
/// with consistent mass. The products of coordinates that span its displacements are orthogonal in both K and M.
pub fn unit_cube_eigenvalues(lambda: f64, mu: f64) -> Vec<f64> {
    let mut values = vec![12.0 * (3.0 * lambda + 2.0 * mu), 48.0 * mu];
    values.extend([12.0 * mu; 2]);
    values.extend([24.0 * mu; 5]);
    values.extend([36.0 * mu; 3]);
    values.extend([12.0 * (2.0 * lambda + 3.0 * mu); 3]);
    values.extend([12.0 * (lambda + 4.0 * mu); 3]);
    values.sort_by(f64::total_cmp);
    values
}

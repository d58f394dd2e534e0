//! A model of solid elements that is held at an interface, as dense matrices of its free motions.

use crate::reference::dense;
use flexbody_linalg::CscMatrix;
use flexbody_model::RawModel;
use nalgebra::{DMatrix, Vector3};

/// K and M of a model whose mean motion of some nodes is held, and the remaining motions.
pub struct HeldModel {
    /// Basis of the remaining motions (N x (N - 6)).
    pub motions: DMatrix<f64>,
    pub stiffness: DMatrix<f64>,
    pub mass: DMatrix<f64>,
}

impl HeldModel {
    /// Holds `nodes`, numbered from 1, of a model whose rows are displacements.
    pub fn new(raw: &RawModel, nodes: &[i64]) -> Self {
        let (k, m) = (dense_matrix(&raw.stiffness.matrix), dense_matrix(&raw.mass.matrix));
        let nodes: Vec<usize> = nodes.iter().map(|id| *id as usize - 1).collect();
        let at = |i: usize| Vector3::from(raw.nodes.positions[i]);
        let centre = nodes.iter().map(|&i| at(i)).sum::<Vector3<f64>>() / nodes.len() as f64;
        // The mean rigid motion vanishes if the displacements are orthogonal to all rigid motions of the nodes.
        let mut rigid = DMatrix::zeros(k.nrows(), 6);
        for &i in &nodes {
            for axis in 0..3 {
                let turn = Vector3::ith(axis, 1.0).cross(&(at(i) - centre));
                rigid[(3 * i + axis, axis)] = 1.0;
                (0..3).for_each(|c| rigid[(3 * i + c, 3 + axis)] = turn[c]);
            }
        }
        // The null space of R R' is the space of motions that are left.
        let eigen = (&rigid * rigid.transpose()).symmetric_eigen();
        let free: Vec<usize> = (0..k.nrows()).filter(|&j| eigen.eigenvalues[j].abs() < 1e-9).collect();
        assert_eq!(free.len(), k.nrows() - 6);
        let motions = DMatrix::from_fn(k.nrows(), free.len(), |i, j| eigen.eigenvectors[(i, free[j])]);
        let (stiffness, mass) = (motions.tr_mul(&k) * &motions, motions.tr_mul(&m) * &motions);
        Self { motions, stiffness, mass }
    }

    /// Returns the eigenvalues of K and M, ascending.
    pub fn eigenvalues(&self) -> Vec<f64> {
        let lower = self.mass.clone().cholesky().expect("mass").l();
        let half = lower.solve_lower_triangular(&self.stiffness).expect("regular");
        let small = lower.solve_lower_triangular(&half.transpose()).expect("regular");
        let mut values: Vec<f64> = small.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        values
    }
}

/// Returns a sparse matrix as a dense one.
pub fn dense_matrix(a: &CscMatrix) -> DMatrix<f64> {
    let a = dense(a);
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

//! Symmetric pencil K - sigma M with M = Ms kron I_block, the input of the eigen-solver.

use super::tall::zeros;
use super::{SymmetricMatrix, multiply};
use faer::{Mat, MatMut, MatRef};

/// Stiffness K (N x N) and mass M = Ms kron I_block (Ms: N/block x N/block), with their products.
#[derive(Debug, Clone, Copy)]
pub struct Pencil<'a> {
    stiffness: &'a SymmetricMatrix,
    mass: &'a SymmetricMatrix,
    block: usize,
}

impl<'a> Pencil<'a> {
    /// Creates the pencil of `stiffness` and `mass` kron I_block.
    ///
    /// # Panics
    /// If the sizes do not match.
    pub fn new(stiffness: &'a SymmetricMatrix, mass: &'a SymmetricMatrix, block: usize) -> Self {
        assert_eq!(stiffness.n(), mass.n() * block, "sizes of a pencil");
        Self { stiffness, mass, block }
    }

    /// Returns the number of rows N.
    pub fn n(&self) -> usize {
        self.stiffness.n()
    }

    /// Returns K.
    pub fn stiffness(&self) -> &'a SymmetricMatrix {
        self.stiffness
    }

    /// Returns Ms.
    pub fn mass(&self) -> &'a SymmetricMatrix {
        self.mass
    }

    /// Returns the number of components per node.
    pub fn block(&self) -> usize {
        self.block
    }

    /// Returns K X.
    pub fn apply_stiffness(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = zeros(x.nrows(), x.ncols());
        self.stiffness_times(x, y.as_mut());
        y
    }

    /// Returns M X.
    pub fn apply_mass(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = zeros(x.nrows(), x.ncols());
        self.mass_times(x, y.as_mut());
        y
    }

    /// Computes Y = K X.
    pub fn stiffness_times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>) {
        multiply(self.stiffness, 1, x, y);
    }

    /// Computes Y = M X.
    pub fn mass_times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>) {
        multiply(self.mass, self.block, x, y);
    }

    /// Returns the diagonal of M, row by row.
    pub fn mass_diagonal(&self) -> Vec<f64> {
        self.mass.diagonal().into_iter().flat_map(|m| std::iter::repeat_n(m, self.block)).collect()
    }
}

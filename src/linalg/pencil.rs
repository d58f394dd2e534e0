//! The symmetric pencil K - sigma M with M = Ms kron I_block, as the eigen-solver sees it.

use super::{SymmetricMatrix, multiply};
use faer::{Mat, MatRef};

/// Stiffness K (N x N) and mass M = Ms kron I_block (Ms: N/block x N/block): products and shifted combinations.
#[derive(Debug, Clone, Copy)]
pub struct Pencil<'a> {
    stiffness: &'a SymmetricMatrix,
    mass: &'a SymmetricMatrix,
    block: usize,
}

impl<'a> Pencil<'a> {
    /// The pencil of `stiffness` and `mass` kron I_block.
    ///
    /// # Panics
    /// When the sizes disagree.
    pub fn new(stiffness: &'a SymmetricMatrix, mass: &'a SymmetricMatrix, block: usize) -> Self {
        assert_eq!(stiffness.n(), mass.n() * block, "sizes of a pencil");
        Self { stiffness, mass, block }
    }

    /// Number of rows N.
    pub fn n(&self) -> usize {
        self.stiffness.n()
    }

    /// K.
    pub fn stiffness(&self) -> &'a SymmetricMatrix {
        self.stiffness
    }

    /// Ms.
    pub fn mass(&self) -> &'a SymmetricMatrix {
        self.mass
    }

    /// Components per node.
    pub fn block(&self) -> usize {
        self.block
    }

    /// K X.
    pub fn apply_stiffness(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        multiply(self.stiffness, 1, x, y.as_mut());
        y
    }

    /// M X.
    pub fn apply_mass(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        multiply(self.mass, self.block, x, y.as_mut());
        y
    }

    /// Lower triangle of K - sigma M in compressed column form (column pointers, rows, values). The pattern is the
    /// union of both and does not depend on sigma.
    pub(super) fn shifted_lower(&self, sigma: f64) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
        let n = self.n();
        let capacity = self.stiffness.as_csc().nnz() / 2 + n;
        let mut pointers = Vec::with_capacity(n + 1);
        let (mut rows, mut values) = (Vec::with_capacity(capacity), Vec::with_capacity(capacity));
        pointers.push(0);
        for j in 0..n {
            let (node, component) = (j / self.block, j % self.block);
            let (kr, kv) = self.stiffness.row(j);
            let (mr, mv) = self.mass.row(node);
            let mass_row = |i: usize| mr[i] as usize * self.block + component;
            let mut a = kr.partition_point(|&r| (r as usize) < j);
            let mut b = mr.partition_point(|&r| (r as usize) < node);
            loop {
                let k_row = kr.get(a).map(|&r| r as usize);
                let m_row = (b < mr.len()).then(|| mass_row(b));
                let row = match (k_row, m_row) {
                    (Some(k), Some(m)) => k.min(m),
                    (Some(k), None) => k,
                    (None, Some(m)) => m,
                    (None, None) => break,
                };
                let mut value = 0.0;
                if k_row == Some(row) {
                    value += kv[a];
                    a += 1;
                }
                if m_row == Some(row) {
                    value -= sigma * mv[b];
                    b += 1;
                }
                rows.push(row);
                values.push(value);
            }
            pointers.push(rows.len());
        }
        (pointers, rows, values)
    }
}

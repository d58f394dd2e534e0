//! From modal coordinates to nodal displacements and back.

use super::equations::NodalEquations;
use crate::flex_body::FlexBody;
use crate::linalg::{combine, gram};
use faer::{Mat, MatRef};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The modes of a body in the rows of its model: trajectories of the reduced and of the nodal equations compare.
#[derive(Debug, Clone)]
pub struct NodalModes {
    vectors: Mat<f64>,
    /// M Psi.
    weighted: Mat<f64>,
    modal_mass: Cholesky<f64, Dyn>,
}

impl NodalModes {
    /// The modes of `body`, which was made of the model of `equations`; `None` when it has other rows, or modes that depend on each
    /// other.
    pub fn new(equations: &NodalEquations<'_>, body: &FlexBody) -> Option<Self> {
        let vectors = body.vectors_of(equations.model)?;
        let weighted = equations.model.pencil().apply_mass(vectors.as_ref());
        let mass = gram(vectors.as_ref(), weighted.as_ref());
        let modal_mass = DMatrix::from_fn(mass.nrows(), mass.ncols(), |i, j| mass[(i, j)]).cholesky()?;
        Some(Self { vectors, weighted, modal_mass })
    }

    /// Psi (N x nf), model axes.
    pub fn vectors(&self) -> MatRef<'_, f64> {
        self.vectors.as_ref()
    }

    /// u = Psi q.
    ///
    /// # Panics
    /// When `q` has not nf entries.
    pub fn lift(&self, q: &[f64]) -> Vec<f64> {
        assert_eq!(q.len(), self.vectors.ncols(), "one coordinate per mode");
        combine(self.vectors.as_ref(), MatRef::from_column_major_slice(q, q.len(), 1))
            .col_as_slice(0)
            .to_vec()
    }

    /// q = (Psi'M Psi)^-1 Psi'M u: the coordinates of what is nearest to u in the norm of M.
    ///
    /// # Panics
    /// When `u` has not N entries.
    pub fn project(&self, u: &[f64]) -> Vec<f64> {
        assert_eq!(u.len(), self.vectors.nrows(), "one entry per row");
        let product = gram(self.weighted.as_ref(), MatRef::from_column_major_slice(u, u.len(), 1));
        let q = DVector::from_column_slice(product.col_as_slice(0));
        self.modal_mass.solve(&q).as_slice().to_vec()
    }
}

//! Conversion between modal coordinates and nodal displacements.

use super::NodalConfiguration;
use super::equations::NodalEquations;
use crate::dynamics::Configuration;
use faer::{Mat, MatRef};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::{combine, gram};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Modes of a body in the rows of its model, to compare motions of the reduced and of the nodal equations.
#[derive(Debug, Clone)]
pub struct NodalModes {
    vectors: Mat<f64>,
    /// M Psi.
    weighted: Mat<f64>,
    modal_mass: Cholesky<f64, Dyn>,
}

impl NodalModes {
    /// Returns the modes of `body`, which was made of the model of `equations`. Returns `None` if the body
    /// has other rows, another frame, or modes that depend on each other.
    pub fn new(equations: &NodalEquations<'_>, body: &FlexBody) -> Option<Self> {
        let vectors = body.vectors_of(equations.model).filter(|_| *body.frame() == equations.frame)?;
        let weighted = equations.model.pencil().apply_mass(vectors.as_ref());
        let mass = gram(vectors.as_ref(), weighted.as_ref());
        let modal_mass = DMatrix::from_fn(mass.nrows(), mass.ncols(), |i, j| mass[(i, j)]).cholesky()?;
        Some(Self { vectors, weighted, modal_mass })
    }

    /// Returns Psi (N x nf), model axes.
    pub fn vectors(&self) -> MatRef<'_, f64> {
        self.vectors.as_ref()
    }

    /// Returns the state of all nodes, u = Psi q.
    ///
    /// # Panics
    /// When the length of q or its rates is not nf.
    pub fn lift(&self, modal: &Configuration) -> NodalConfiguration {
        let Configuration { origin, attitude, velocity, omega, q, qd } = modal;
        let lifted = |q: &[f64]| {
            assert_eq!(q.len(), self.vectors.ncols(), "one coordinate per mode");
            let u = combine(self.vectors.as_ref(), MatRef::from_column_major_slice(q, q.len(), 1));
            u.col_as_slice(0).to_vec()
        };
        let (u, ud) = (lifted(q), lifted(qd));
        NodalConfiguration { origin: *origin, attitude: *attitude, velocity: *velocity, omega: *omega, u, ud }
    }

    /// Returns the nearest modal state, q = (Psi'M Psi)^-1 Psi'M u.
    ///
    /// # Panics
    /// When the length of u or its rates is not N.
    pub fn project(&self, nodal: &NodalConfiguration) -> Configuration {
        let NodalConfiguration { origin, attitude, velocity, omega, u, ud } = nodal;
        let projected = |u: &[f64]| {
            assert_eq!(u.len(), self.vectors.nrows(), "one entry per row");
            let product = gram(self.weighted.as_ref(), MatRef::from_column_major_slice(u, u.len(), 1));
            self.modal_mass.solve(&DVector::from_column_slice(product.col_as_slice(0))).as_slice().to_vec()
        };
        let (q, qd) = (projected(u), projected(ud));
        Configuration { origin: *origin, attitude: *attitude, velocity: *velocity, omega: *omega, q, qd }
    }
}

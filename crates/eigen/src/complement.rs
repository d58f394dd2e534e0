//! The M-orthogonal complement of known motions.

use faer::{Mat, MatRef};
use flexbody_linalg::{Pencil, gram, side_by_side, subtract_combination};

/// What is M-orthogonal to M-orthonormal columns P, and the loads that do no work on P.
pub(super) struct Complement {
    /// P and M P.
    known: Mat<f64>,
    products: Mat<f64>,
}

impl Complement {
    /// That of rigid motions and modes.
    pub(crate) fn of(pencil: &Pencil<'_>, parts: &[MatRef<'_, f64>]) -> Self {
        let known = side_by_side(parts);
        Self { products: pencil.apply_mass(known.as_ref()), known }
    }

    /// Whether nothing is known: all is in the complement.
    pub(crate) fn is_everything(&self) -> bool {
        self.known.ncols() == 0
    }

    /// X <- (I - P P'M) X.
    pub(crate) fn deflate(&self, x: &mut Mat<f64>) {
        let along = gram(self.products.as_ref(), x.as_ref());
        subtract_combination(x.as_mut(), self.known.as_ref(), along.as_ref());
    }

    /// F <- (I - M P P') F.
    pub(crate) fn equilibrate(&self, f: &mut Mat<f64>) {
        let along = gram(self.known.as_ref(), f.as_ref());
        subtract_combination(f.as_mut(), self.products.as_ref(), along.as_ref());
    }
}

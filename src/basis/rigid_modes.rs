//! The rigid modes, which every basis is freed from.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::linalg::{Pencil, combine, gram, symmetric_eigen};
use crate::model::{centre_and_length, rigid_fields};
use faer::Mat;

/// The M-orthonormal rigid modes from the node positions: six, in the plane three.
pub(super) fn rigid_modes(pencil: &Pencil<'_>, positions: &[[f64; 3]]) -> Result<Mat<f64>> {
    let (centre, length) = centre_and_length(positions);
    let fields = rigid_fields(positions, pencil.block(), centre, length);
    let orthonormal = |r: &Mat<f64>| {
        let mass = gram(r.as_ref(), pencil.apply_mass(r.as_ref()).as_ref());
        let eigen = symmetric_eigen(mass.as_ref())?;
        let largest = eigen.values.last().copied().unwrap_or(0.0);
        // A body on one line has a rotation that moves nothing.
        if eigen.values[0].is_nan() || eigen.values[0] <= 1e-14 * largest {
            return None;
        }
        let root = Mat::from_fn(r.ncols(), r.ncols(), |i, j| eigen.vectors[(i, j)] / eigen.values[j].sqrt());
        Some(combine(r.as_ref(), root.as_ref()))
    };
    // Twice: the second pass removes what the condition of the first Gram matrix left.
    orthonormal(&fields).and_then(|once| orthonormal(&once)).ok_or_else(|| {
        let message = format!("the {} nodes lie on one line or carry mass on one line only", positions.len());
        Error::from(Diagnostic::new(Code::BodyDegenerate, message))
    })
}

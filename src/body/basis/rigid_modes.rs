//! The rigid modes, which every basis is freed from.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::{FeModel, centre_and_length};
use crate::numerics::linalg::{Pencil, combine, gram, symmetric_eigen};
use faer::Mat;

/// The rigid modes of a model from its node positions (N x 6, in the plane N x 3); orthonormal in the mass of
/// `pencil`.
///
/// # Errors
/// [`BodyDegenerate`](Code::BodyDegenerate) where the nodes or the mass lie on one line.
pub fn rigid_modes(model: &FeModel, pencil: &Pencil<'_>) -> Result<Mat<f64>> {
    let positions = &model.nodes().positions;
    let (centre, length) = centre_and_length(positions);
    let fields = model.rigid_fields(centre, length);
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

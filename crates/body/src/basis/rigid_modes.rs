//! Rigid modes, which are removed from every basis.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_linalg::{Pencil, combine, gram, symmetric_eigen};
use flexbody_model::{FeModel, centre_and_length};

/// Returns the rigid modes of a model from its node positions (N x 6, in the plane N x 3), orthonormal in
/// the mass of `pencil`.
///
/// # Errors
/// [`BodyDegenerate`](Code::BodyDegenerate) if the nodes or the mass lie on one line.
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
    // Orthonormalise twice: the second pass removes the error due to the condition of the first Gram
    // matrix.
    orthonormal(&fields)
        .and_then(|once| orthonormal(&once))
        .ok_or_else(|| Error::from(degenerate(model, centre, length)))
}

/// Returns the error FB416, which says if the nodes lie on one line, or only their mass.
fn degenerate(model: &FeModel, centre: [f64; 3], length: f64) -> Diagnostic {
    /// Distance from a line, relative to the extent of the body, below which nodes lie on it.
    const COLLINEAR_DISTANCE: f64 = 1e-7;
    let positions = &model.nodes().positions;
    let nodes = positions.len();
    if model.dimension() == 2 {
        return Diagnostic::new(
            Code::BodyDegenerate,
            format!("all mass of the {nodes} nodes lies in one point"),
        );
    }
    let from_centre = Mat::from_fn(positions.len(), 3, |node, k| (positions[node][k] - centre[k]) / length);
    let spread = symmetric_eigen(gram(from_centre.as_ref(), from_centre.as_ref()).as_ref());
    let is_line = spread.is_none_or(|eigen| eigen.values[1] <= COLLINEAR_DISTANCE.powi(2) * eigen.values[2]);
    if is_line {
        let message = format!("the {nodes} nodes lie on one line, and nothing has inertia about it");
        return Diagnostic::new(Code::BodyDegenerate, message);
    }
    let message =
        format!("the {nodes} nodes do not lie on one line, but all mass does: nothing has inertia about it");
    let help = "use C3D8 or C3D20, or two rows of elements, in a bar of one row of elements of reduced integration (C3D8R), which have their mass in their middles; else look for nodes without mass";
    Diagnostic::new(Code::BodyDegenerate, message).with_help(help)
}

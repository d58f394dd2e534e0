//! Geometric stiffness of the modes: matrices of unit loads given by the user, reduced to the modes and
//! turned to body axes.

use super::body_modes::reduced;
use crate::basis::{BasisChoice, Loads};
use crate::flex_body::{FlexBody, SOFTENING, axis_in_words, stiffness_about};
use faer::{Mat, MatRef, Scale};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, UnitLoad};
use nalgebra::{Matrix3, Vector3};

/// Direction cosines up to this magnitude are rounding and count as zero.
const ROUNDING_COSINE: f64 = 4.0 * f64::EPSILON;

/// Largest entry whose products stay finite.
const MAX_ENTRY: f64 = 1e290;

/// Returns Psi' K_geo Psi of the modes `vectors` (rows and axes of the model, signs of the body) for unit
/// loads along the columns of `axes`. Components that are not given count as zero, so that K_geo of any
/// load is equal in all axes. Components without any contribution are omitted. Kinds are in the order of
/// the model, components in their own order.
///
/// * `shift`: origin of the frame relative to the point that spin and angular acceleration refer to, frame
///   axes; zero except for a frame on an interface. Unit: length.
///
/// # Errors
/// [`MatrixNotFinite`](Code::MatrixNotFinite) if the products overflow.
pub fn modal_geometric_stiffness(
    model: &FeModel,
    vectors: MatRef<'_, f64>,
    axes: &Matrix3<f64>,
    shift: &Vector3<f64>,
) -> Result<Vec<GeometricStiffness<Mat<f64>>>> {
    let mut out: Vec<GeometricStiffness<Mat<f64>>> = Vec::new();
    for GeometricStiffness { load, matrix } in model.geometric_stiffness() {
        let reduced_matrix = reduced(matrix, vectors);
        if reduced_matrix.col_iter().any(|column| column.iter().any(|v| v.is_nan() || v.abs() > MAX_ENTRY)) {
            let message = format!("geometric stiffness for {load} overflows on the modes");
            return Err(Diagnostic::new(Code::MatrixNotFinite, message).into());
        }
        let along =
            load.along(axes).into_iter().enumerate().filter(|(_, factor)| factor.abs() > ROUNDING_COSINE);
        for (component, factor) in along {
            let load = UnitLoad { kind: load.kind.clone(), component };
            let part = &reduced_matrix * Scale(factor);
            match out.iter_mut().find(|known| known.load == load) {
                Some(sum) => sum.matrix += part,
                None => out.push(GeometricStiffness { load, matrix: part }),
            }
        }
    }
    let mut out = stiffness_about(&out, shift, model.dimension());
    let place = |kind: &LoadKind| model.geometric_stiffness().iter().position(|one| one.load.kind == *kind);
    out.sort_by_key(|one| (place(&one.load.kind), one.load.component));
    Ok(out)
}

/// Returns a warning if the basis contains centrifugal loads, which means that the body spins, but
/// geometric stiffness for spin is not given. The warning states the spin rate at which softening becomes
/// significant.
pub(super) fn softening_warning(model: &FeModel, basis: &BasisChoice, body: &FlexBody) -> Option<Diagnostic> {
    let BasisChoice::Free(free) = basis else { return None };
    let given = model.geometric_stiffness().iter().any(|one| one.load.kind == LoadKind::Spin);
    if given || !free.residual_vectors.contains(&Loads::Centrifugal) {
        return None;
    }
    let (axis, part) = body.worst_spin().filter(|(_, part)| *part > 0.0)?;
    let axis = axis_in_words(&axis);
    let hertz = model.units().frequency_of(SOFTENING / part);
    let message = format!(
        "centrifugal loads are wanted without geometric stiffness for spin: the centrifugal term takes 1 % of the stiffness of a motion at {hertz:.4e} Hz about axis {axis} of the model"
    );
    Some(Diagnostic::new(Code::GeometricStiffnessNone, message))
}

//! Modes of a body whose frame is fixed to an interface.
//!
//! With R the rigid motions about the reference point (model rows) and t (6 x nf) the motion of the interface in
//! the free modes Psi, the shapes
//!
//! ```text
//! Psi' = Psi - R t,    m' = Psi''M Psi' = I + t'(R'M R) t,    Psi''K Psi' = diag(lambda)
//! ```
//!
//! leave the interface at rest. Together with the motion of the frame they have the span of the free modes.
//! The constrained modes are Psi' X with X'm'X = I and X'diag(lambda)X = diag(mu): the modes of the body
//! held at the interface, within that span.

use super::{BodyModes, NodesInFrame, rigid_mass};
use crate::basis::ModalBasis;
use crate::flex_body::Interface;
use crate::invariants::Frame;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_eigen::{Completeness, Proof, relative_residual};
use flexbody_linalg::{
    combine, dense_cholesky, left_singular_vectors, solve_lower, solve_upper, subtract_combination,
};
use flexbody_model::{Coupling, FeModel, Nodes, rigid_axes};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// Returns the frame at interface `name` of `model`: its reference point and the axes of the model.
///
/// # Errors
/// [`SceneBody`](Code::SceneBody) if the model has no such interface, [`CarrierImpossible`](Code::CarrierImpossible)
/// if it has no reference point.
pub(super) fn frame_of_interface(model: &FeModel, name: &str) -> Result<Frame> {
    let Some(set) = model.interfaces().iter().find(|set| set.name == name) else {
        let names: Vec<&str> = model.interfaces().iter().map(|set| set.name.as_str()).collect();
        let known = if names.is_empty() { "it has none".to_owned() } else { names.join(", ") };
        let message = format!("the model has no interface `{name}` for the frame: {known}");
        return Err(Diagnostic::new(Code::SceneBody, message).into());
    };
    match set.reference.point() {
        Some(point) if set.coupling != Some(Coupling::Free) => {
            Ok(Frame { origin: Vector3::from(point), axes: Matrix3::identity() })
        }
        _ => Err(impossible(format!("interface `{name}` is free and has no reference point for the frame"))),
    }
}

/// Returns the interfaces of a model in the body frame. For a `coupled` basis, interfaces without a stated
/// coupling get the coupling that the basis used.
pub fn interfaces_in_frame(model: &FeModel, frame: &Frame, coupled: bool) -> Vec<Interface> {
    let index: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let sets = model.interfaces().iter();
    sets.map(|set| Interface {
        name: set.name.clone(),
        nodes: set.nodes.iter().filter_map(|id| index.get(id)).copied().collect(),
        coupling: if coupled { Some(set.coupling()) } else { set.coupling },
        reference: set.reference.point().map(|x| frame.to_body(&[x])[0]),
    })
    .collect()
}

fn impossible(message: String) -> Error {
    Diagnostic::new(Code::CarrierImpossible, message).into()
}

/// Replaces the free modes of `found` by the modes of the body held at interface `name`; `place` is the
/// frame of [`frame_of_interface`].
///
/// # Errors
/// [`CarrierImpossible`](Code::CarrierImpossible) if the nodes of the interface do not determine its rotation.
pub(super) fn constrain(
    model: &FeModel,
    place: &NodesInFrame,
    name: &str,
    coupled: bool,
    found: &mut ModalBasis,
) -> Result<()> {
    let free = BodyModes::new(model, place, std::mem::replace(&mut found.solution.vectors, Mat::new()));
    let taken = motion_of_interface(model, place, name, coupled, &free)?;

    // Psi' = Psi - R t.
    let mut shapes = free.vectors;
    let rigid = model.rigid_fields(place.frame.origin.into(), 1.0);
    subtract_combination(shapes.as_mut(), rigid.as_ref(), taken.as_ref());

    // m' = L L' and L^-1 diag(lambda)^(1/2) = U diag(mu)^(1/2) V' give X = L^-T U.
    let unresolved =
        || impossible(format!("the modes of the body held at interface `{name}` were not found"));
    let nf = taken.ncols();
    let added = taken.transpose() * rigid_mass(model, &place.frame) * &taken;
    let mass = Mat::from_fn(nf, nf, |i, j| 0.5 * (added[(i, j)] + added[(j, i)]) + f64::from(i == j));
    let lower = dense_cholesky(mass).ok_or_else(unresolved)?;
    let roots: Vec<f64> = found.solution.eigenvalues.iter().map(|lambda| lambda.sqrt()).collect();
    let root = Mat::from_fn(nf, nf, |i, j| if i == j { roots[i] } else { 0.0 });
    let (values, left) = left_singular_vectors(solve_lower(&lower, &root)).ok_or_else(unresolved)?;
    let modes = combine(shapes.as_ref(), solve_upper(&lower, &left).as_ref());
    let eigenvalues: Vec<f64> = values.iter().map(|root| root * root).collect();

    // Residuals refer to the equations of the free body and include the reaction at the interface.
    let pencil = model.pencil();
    let (kx, mx) = (pencil.apply_stiffness(modes.as_ref()), pencil.apply_mass(modes.as_ref()));
    let residual = |(j, mu): (usize, &f64)| relative_residual(kx.col(j), mx.col(j), *mu);
    let solution = &mut found.solution;
    solution.residuals = eigenvalues.iter().enumerate().map(residual).collect();
    solution.completeness = not_proved(&solution.completeness, name, nf);
    (solution.eigenvalues, solution.vectors) = (eigenvalues, modes);
    (solution.rounding_floors, solution.bounds, solution.next_eigenvalue) = (Vec::new(), None, None);
    found.provenance = vec![format!("constrained mode: held at {name}"); nf];
    (found.coordinates, found.fixed_interface) = (None, None);
    Ok(())
}

/// Returns translation and rotation (6 x nf, in the plane 3 x nf) of the reference point of interface
/// `name` in the modes.
fn motion_of_interface(
    model: &FeModel,
    place: &NodesInFrame,
    name: &str,
    coupled: bool,
    modes: &BodyModes,
) -> Result<Mat<f64>> {
    let interfaces = interfaces_in_frame(model, &place.frame, coupled);
    let interface = interfaces.iter().find(|interface| interface.name == name);
    let nodes = Nodes { ids: model.nodes().ids.clone(), positions: place.positions.clone() };
    let rows = |interface: &Interface| {
        let rotations = modes.rotations.as_ref().map(Mat::as_ref);
        interface.rows(&nodes, modes.of_nodes(), rotations, model.dimension())
    };
    let Some(motion) = interface.and_then(rows).and_then(|rows| rows.rigid_motion()) else {
        return Err(impossible(format!(
            "the nodes of interface `{name}` lie on one line: its orientation is not known, no frame can stand on it"
        )));
    };
    let axes = rigid_axes(model.dimension());
    Ok(Mat::from_fn(axes.len(), motion.ncols(), |i, j| motion[(axes[i], j)]))
}

/// Returns the completeness of the constrained modes, for which nothing is proved; the proof about the free
/// modes becomes a remark.
fn not_proved(of_free: &Completeness, name: &str, nf: usize) -> Completeness {
    let free = match of_free.proof {
        Proof::InertiaCount => format!("the {nf} free modes are proved complete below the shift"),
        Proof::NotProved if of_free.remark.is_empty() => format!("{nf} free modes"),
        Proof::NotProved => of_free.remark.clone(),
    };
    Completeness {
        proof: Proof::NotProved,
        negative_pivots: None,
        remark: format!("modes of the body held at interface `{name}` in the span of its free modes; {free}"),
        ..of_free.clone()
    }
}

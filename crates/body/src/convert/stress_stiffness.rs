//! Stress stiffness of unit loads, from elements that the stiffness of the model proves.

use super::free_basis::{FreeBasis, StaticLoads};
use super::modal_matrices::unit_rotations;
use super::stress_loads::StressLoads;
use crate::flex_body::Frame;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_eigen::ResponseAccuracy;
use flexbody_linalg::context::Context;
use flexbody_linalg::{SymmetricMatrix, gram, multiply, side_by_side, zeros};
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, UnitLoad};

/// Loads whose stress stiffness by nodes is in memory at a time.
const LOADS_AT_ONCE: usize = 8;

/// Size of a static response, relative to the largest of its kind, below which the load stresses nothing.
const MIN_RESPONSE: f64 = 1e-9;

/// Returns true if the stress stiffness of a load is wanted. That of a preload belongs to K.
fn is_wanted(wanted: StressLoads, model: &FeModel, load: &UnitLoad) -> bool {
    match &load.kind {
        LoadKind::Spin => wanted.spin,
        LoadKind::Force(_) | LoadKind::Moment(_) => wanted.interfaces,
        LoadKind::Named(name) => {
            let is_preload =
                model.named_loads().iter().any(|named_load| named_load.preload && named_load.name == *name);
            wanted.loads && !is_preload
        }
        LoadKind::Acceleration | LoadKind::AngularAcceleration => false,
    }
}

/// Modes whose stress stiffness is wanted.
pub(crate) struct StressedModes<'a> {
    /// Modes of the body by the rows of the model (N x nf).
    pub modes: &'a Mat<f64>,
    /// Psi' K Psi.
    pub modal_stiffness: &'a Mat<f64>,
    /// About the first flexible eigenvalue.
    pub lowest: f64,
    /// Frame of the body.
    pub frame: &'a Frame,
}

/// Returns S' K_geo S for each wanted load that the model does not state a stiffness for, where S are the modes and then the
/// unit rotations about the frame: K_geo of the stress of the static response G f, balanced by inertia relief.
///
/// # Errors
/// [`ElementsUnproved`](flexbody_base::diagnostic::Code::ElementsUnproved); failures of the factor.
pub(crate) fn stress_stiffness(
    model: &FeModel,
    wanted: StressLoads,
    of: &StressedModes<'_>,
    context: &Context<'_>,
) -> Result<Vec<GeometricStiffness<Mat<f64>>>> {
    let loads = StaticLoads::of_model(model)?;
    let is_given = |load: &UnitLoad| {
        model.geometric_stiffness().iter().any(|stiffness| stiffness.load.kind == load.kind)
    };
    let unit_loads = loads.unit_loads();
    let columns: Vec<usize> = (0..unit_loads.len())
        .filter(|&at| is_wanted(wanted, model, &unit_loads[at]) && !is_given(&unit_loads[at]))
        .collect();
    if columns.is_empty() {
        return Ok(Vec::new());
    }
    let elements = model.proved_elements()?;
    context.phase("stress stiffness");
    let basis = FreeBasis::new(model, of.modes, of.modal_stiffness.clone())?;
    let mut responses =
        basis.responses_to(loads.forces_of(&columns), of.lowest, ResponseAccuracy::STRESS, context)?;
    basis.remove_rigid_motion(&mut responses);
    let norms = basis.norms(&responses);
    let shapes = side_by_side(&[of.modes.as_ref(), unit_rotations(model, of.frame).as_ref()]);
    let shapes = elements.displacements(shapes.as_ref());
    let moved = elements.displacements(responses.as_ref());
    let is_stressed = |column: &usize| {
        let kind = &unit_loads[columns[*column]].kind;
        let alike = columns.iter().zip(&norms).filter(|(at, _)| unit_loads[**at].kind == *kind);
        let largest = alike.map(|(_, norm)| *norm).fold(0.0, f64::max);
        norms[*column] > MIN_RESPONSE * largest
    };
    let stressed: Vec<usize> = (0..columns.len()).filter(is_stressed).collect();
    let mut all = Vec::with_capacity(stressed.len());
    for part in stressed.chunks(LOADS_AT_ONCE) {
        let moved = Mat::from_fn(moved.nrows(), part.len(), |i, c| moved[(i, part[c])]);
        for (column, by_nodes) in part.iter().zip(elements.stress_stiffness(moved.as_ref())) {
            let load = unit_loads[columns[*column]].clone();
            all.push(GeometricStiffness { load, matrix: reduced_by_nodes(&by_nodes, &shapes) });
        }
    }
    Ok(all)
}

/// Returns S' (g kron I3) S for a stress stiffness g and shapes S by the nodes of the elements.
fn reduced_by_nodes(by_nodes: &SymmetricMatrix, shapes: &Mat<f64>) -> Mat<f64> {
    let mut product = zeros(shapes.nrows(), shapes.ncols());
    multiply(by_nodes, 3, shapes.as_ref(), product.as_mut());
    let reduced = gram(shapes.as_ref(), product.as_ref());
    Mat::from_fn(reduced.nrows(), reduced.ncols(), |i, j| 0.5 * (reduced[(i, j)] + reduced[(j, i)]))
}

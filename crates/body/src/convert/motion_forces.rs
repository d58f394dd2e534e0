//! Nodal forces that the deformed body exerts by its motion: damping and the inertia of the deformation (theory section
//! 12).

use crate::flex_body::{LoadKind, MotionLoad};
use faer::Mat;
use flexbody_linalg::{multiply, side_by_side};
use flexbody_model::{Damping, FeModel, InertialRows};
use nalgebra::Vector3;

/// Part of damping forces that the modes do not hold, relative to the forces, below which it is rounding: eigenmodes of a
/// body hold all forces of Rayleigh damping.
const MIN_DAMPING: f64 = 1e-9;

/// Forces of one kind at the nodes, along the axes of the model.
#[derive(Debug, Clone)]
pub(super) struct MotionForces {
    pub load: MotionLoad,
    /// Nodal forces (N x components nf), of the components of the dimension of the model: those of all modes for each
    /// component.
    pub forces: Mat<f64>,
}

/// Returns the forces of the modes `vectors` (N x nf): the damping forces of a model with a damping matrix or with damping
/// in proportion to the mass and, if `inertia` is true, those of the inertia of the deformation.
///
/// * `outside`: returns the parts of nodal forces that neither the inertia nor the stiffness of the modes balances.
pub(super) fn motion_forces(
    model: &FeModel,
    vectors: &Mat<f64>,
    inertia: bool,
    outside: impl Fn(&Mat<f64>) -> [Mat<f64>; 2],
) -> Vec<MotionForces> {
    let damping = damping_forces(model, vectors);
    let acts = |forces: &Mat<f64>| {
        outside(forces).iter().any(|part| part.norm_l2() > MIN_DAMPING * forces.norm_l2())
    };
    let damping = damping.filter(acts).map(|forces| MotionForces { load: MotionLoad::Damping, forces });
    let kinds = if inertia { &MotionLoad::INERTIA[..] } else { &[] };
    let of_inertia =
        kinds.iter().map(|&load| MotionForces { load, forces: inertia_forces(model, vectors, load) });
    damping.into_iter().chain(of_inertia).collect()
}

/// Returns -D Psi; `None` without damping whose forces the modes may not hold. Damping in proportion to the stiffness
/// deforms the body as the stiffness does, and damping ratios belong to the modes.
fn damping_forces(model: &FeModel, vectors: &Mat<f64>) -> Option<Mat<f64>> {
    match model.damping()? {
        Damping::Ratio(_) | Damping::Bands(_) => None,
        Damping::Rayleigh { alpha, .. } => {
            (*alpha != 0.0).then(|| model.pencil().apply_mass(vectors.as_ref()) * faer::Scale(-alpha))
        }
        Damping::Matrix(damping) => {
            let mut forces = Mat::zeros(vectors.nrows(), vectors.ncols());
            multiply(damping, 1, vectors.as_ref(), forces.as_mut());
            Some(-forces)
        }
    }
}

/// Returns the inertia forces of a kind per unit of its amplitudes. With directors they act on points and directors
/// (theory section 6).
fn inertia_forces(model: &FeModel, vectors: &Mat<f64>, load: MotionLoad) -> Mat<f64> {
    let rows = InertialRows::new(model, Vector3::zeros());
    let extended = rows.extend(vectors);
    let axis = |k: usize| Vector3::ith(k, 1.0);
    // -S_k M S_l Psi.
    let centrifugal = |k: usize, l: usize| {
        let momenta = rows.weigh(rows.turned(&axis(l), &extended).as_ref());
        rows.turned(&-axis(k), &momenta)
    };
    let force = |&component: &usize| match load {
        MotionLoad::Damping | MotionLoad::Acceleration => {
            rows.weigh(extended.as_ref().as_ref()) * faer::Scale(-1.0)
        }
        MotionLoad::Turning => rows.weigh(rows.turned(&-axis(component), &extended).as_ref()),
        MotionLoad::Centrifugal => {
            let (k, l) = LoadKind::SPIN[component];
            if k == l { centrifugal(k, k) } else { centrifugal(k, l) + centrifugal(l, k) }
        }
    };
    let parts: Vec<Mat<f64>> = load
        .of_dimension(model.dimension())
        .iter()
        .map(|component| rows.restrict(force(component)))
        .collect();
    side_by_side(&parts.iter().map(Mat::as_ref).collect::<Vec<_>>())
}

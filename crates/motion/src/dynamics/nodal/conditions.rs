//! Reference conditions, which tie the frame to the body.

use super::error::NodalError;
use faer::{Mat, MatRef};
use flexbody_base::error::Result;
use flexbody_body::basis::interface_loads;
use flexbody_model::{DofLabel, FeModel, ModelLoad};
use nalgebra::{Vector3, Vector6};

/// Conditions C u = 0 on the displacements, as many as rigid motions, that define the frame of the deformed
/// body.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum ReferenceConditions {
    /// R'M u = 0 with the rigid motions R (Tisserand): deformation carries no momentum to first order.
    /// Free-surface modes fulfil it.
    #[default]
    MeanAxes,
    /// Degrees of freedom that are zero, which fixes the frame to nodes: six, for a plane body three.
    Held(Vec<DofLabel>),
    /// Point at rest in displacement and rotation, which carries the frame.
    AtRest(NodalPoint),
}

impl ReferenceConditions {
    /// Returns C', given M R; all held rows have mass.
    pub(super) fn columns(
        &self,
        model: &FeModel,
        moving: &[usize],
        mass_rigid: &Motions,
    ) -> std::result::Result<Motions, NodalError> {
        let held = match self {
            Self::MeanAxes => return Ok(mass_rigid.clone()),
            Self::AtRest(point) => return of_point(model, moving, point),
            Self::Held(held) => held,
        };
        if held.len() != moving.len() {
            return Err(NodalError::ConditionCount { expected: moving.len(), found: held.len() });
        }
        let mut columns = vec![[0.0; 6]; model.rows().len()];
        for (dof, &column) in held.iter().zip(moving) {
            let row = (0..columns.len()).find(|&row| model.label(row) == *dof);
            let row = row.ok_or(NodalError::DofUnknown(*dof))?;
            refuse_massless(model, row)?;
            columns[row][column] = 1.0;
        }
        Ok(columns)
    }
}

/// Returns C' of a point at rest: its weights.
fn of_point(
    model: &FeModel,
    moving: &[usize],
    point: &NodalPoint,
) -> std::result::Result<Motions, NodalError> {
    let loads = point.unit_loads(model);
    let mut columns = vec![[0.0; 6]; model.rows().len()];
    for (row, columns) in columns.iter_mut().enumerate() {
        moving.iter().enumerate().for_each(|(at, &motion)| columns[motion] = loads[(row, at)]);
        if columns.iter().any(|weight| *weight != 0.0) {
            refuse_massless(model, row)?;
        }
    }
    Ok(columns)
}

/// Returns an error for a condition on a row without mass, which does not constrain the motion.
fn refuse_massless(model: &FeModel, row: usize) -> std::result::Result<(), NodalError> {
    let pencil = model.pencil();
    if pencil.mass().row(row / pencil.block()).0.is_empty() {
        Err(NodalError::HeldWithoutMass(model.label(row)))
    } else {
        Ok(())
    }
}

// Points of a body among its nodes, where loads act and motion is measured.

/// Rows of the model with their weights in the three components of a vector.
pub(super) type Weights = Vec<(usize, [f64; 3])>;

/// Node, or reference point of an interface: the matrices C_t and C_r give its displacement and rotation
/// vector from the displacements u of all rows, in model axes. Forces b and torques t at the point are the
/// nodal forces C_t'b + C_r't. With Psi_t = C_t Psi and Psi_r = C_r Psi it corresponds to
/// [`BodyPoint`](crate::dynamics::BodyPoint) without modes.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalPoint {
    /// Position in the undeformed model.
    place: Vector3<f64>,
    pub(super) translation: Weights,
    /// Empty if the point has no orientation.
    pub(super) rotation: Weights,
    /// True if the point stands for the nodal forces of a named load; its resultants are zero for a preload.
    pub(super) named: Option<NamedForces>,
}

/// Kind of the nodal forces of a named load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedForces {
    /// Forces from outside, with a resultant on the deformed body.
    Applied,
    /// Forces between parts of the body.
    Preload,
}

impl NodalPoint {
    /// Creates a point at node `node` of `model`, given by its index. The point has an orientation if the
    /// node has rotations.
    ///
    /// # Panics
    /// When the index is not below the number of nodes.
    pub fn node(model: &FeModel, node: usize) -> Self {
        let d = model.dimension();
        let unit = |axis: usize| std::array::from_fn(|k| f64::from(k == axis));
        let rotations = (model.rows().displacements()..).zip(model.rows().rotations());
        let of_node = rotations.filter(|(_, (of, _))| *of as usize == node);
        Self {
            place: model.nodes().positions[node].into(),
            translation: (0..d).map(|k| (d * node + k, unit(k))).collect(),
            rotation: of_node.map(|(row, &(_, axis))| (row, unit(axis.into()))).collect(),
            named: None,
        }
    }

    /// Creates a point at the reference point of the interface `name`: the rigid motion that best fits the
    /// motion of its nodes, for every coupling (theory (5.3)). Returns `None` if the interface does not
    /// exist or has no reference point.
    ///
    /// # Errors
    /// FB150 if the model has no interfaces.
    pub fn interface(model: &FeModel, name: &str) -> Result<Option<Self>> {
        let set = model.interfaces().iter().find(|set| set.name == name);
        let Some(place) = set.and_then(|set| set.reference.point()) else { return Ok(None) };
        let Some(loads) = interface_loads(model, name)? else { return Ok(None) };
        let d = model.dimension();
        let (forces, torques) = loads.as_ref().split_at_col(d);
        let about = if d == 2 { 2 } else { 0 };
        Ok(Some(Self {
            place: place.into(),
            translation: weights(forces, 0),
            rotation: weights(torques, about),
            named: None,
        }))
    }

    /// Creates the place of a named load: a force (a, 0, 0) at it, along the axes of the frame, is the load with the
    /// amplitude a, and its displacement along x is f'u of the forces f.
    pub fn named_load(load: &ModelLoad) -> Self {
        let loaded = load.forces.iter().enumerate().filter(|(_, force)| **force != 0.0);
        Self {
            place: Vector3::zeros(),
            translation: loaded.map(|(row, force)| (row, [*force, 0.0, 0.0])).collect(),
            rotation: Vec::new(),
            named: Some(if load.preload { NamedForces::Preload } else { NamedForces::Applied }),
        }
    }

    /// Returns the nodal loads (N x 3) whose products with the displacements u are the torque sum u_i x f_i that a named
    /// load with the amplitude 1 gains by them, model axes; `None` for a point.
    pub fn turning_loads(&self, model: &FeModel) -> Option<Mat<f64>> {
        let kind = self.named?;
        let mut loads = Mat::zeros(model.rows().len(), 3);
        let d = model.dimension();
        let displaced = self.translation.iter().filter(|(row, _)| *row < d * model.nodes().len());
        for &(row, [force, ..]) in displaced.filter(|_| kind == NamedForces::Applied) {
            let (first, force) = (row / d * d, Vector3::ith(row % d, force));
            for k in 0..3 {
                // (u x f)_k = u . (f x e_k)
                let by_u = force.cross(&Vector3::ith(k, 1.0));
                (0..d).for_each(|l| loads[(first + l, k)] += by_u[l]);
            }
        }
        Some(loads)
    }

    /// Returns the position in the undeformed model, model axes.
    pub fn place(&self) -> Vector3<f64> {
        self.place
    }

    /// Returns true if the point has an orientation.
    pub fn turns(&self) -> bool {
        !self.rotation.is_empty()
    }

    /// Returns C_t u, model axes.
    pub fn displacement(&self, u: &[f64]) -> Vector3<f64> {
        sum(&self.translation, u)
    }

    /// Returns theta = C_r u, model axes; zero if the point has no orientation.
    pub fn rotation(&self, u: &[f64]) -> Vector3<f64> {
        sum(&self.rotation, u)
    }

    /// Returns \[C_t', C_r'\] (N x 6, in the plane N x 3): nodal forces of unit forces and torques, model
    /// axes.
    pub fn unit_loads(&self, model: &FeModel) -> Mat<f64> {
        let d = model.dimension();
        let axes: &[usize] = if d == 2 { &[0, 1, 5] } else { &[0, 1, 2, 3, 4, 5] };
        let mut loads = Mat::zeros(model.rows().len(), axes.len());
        for (column, &axis) in axes.iter().enumerate() {
            let point_weights = if axis < 3 { &self.translation } else { &self.rotation };
            point_weights.iter().for_each(|(row, weights)| loads[(*row, column)] = weights[axis % 3]);
        }
        loads
    }
}

/// Returns the nonzero rows of `loads`, whose columns are the components from `first` on.
fn weights(loads: MatRef<'_, f64>, first: usize) -> Weights {
    let row = |i: usize| {
        let mut components = [0.0; 3];
        (0..loads.ncols()).for_each(|k| components[first + k] = loads[(i, k)]);
        (i, components)
    };
    (0..loads.nrows())
        .map(row)
        .filter(|(_, components)| components.iter().any(|weight| *weight != 0.0))
        .collect()
}

fn sum(weights: &Weights, u: &[f64]) -> Vector3<f64> {
    weights.iter().map(|(row, weights)| Vector3::from(*weights) * u[*row]).sum()
}

// Motions of the frame, on the rows of a model.

/// Six numbers per row, one for each rigid motion; zero for motions that a plane body does not have.
pub(super) type Motions = Vec<[f64; 6]>;

/// Returns the sums over all rows of `motions` times x.
pub(super) fn sums(motions: &Motions, x: &[f64]) -> Vector6<f64> {
    let mut sum = [0.0; 6];
    for (motion, x) in motions.iter().zip(x) {
        sum.iter_mut().zip(motion).for_each(|(sum, motion)| *sum += motion * x);
    }
    sum.into()
}

/// Computes x += factor (motions) nu.
pub(super) fn add_motion(motions: &[[f64; 6]], factor: f64, nu: &Vector6<f64>, x: &mut [f64]) {
    let nu: [f64; 6] = (nu * factor).into();
    for (x, motion) in x.iter_mut().zip(motions) {
        *x += motion.iter().zip(&nu).map(|(motion, nu)| motion * nu).sum::<f64>();
    }
}

/// Returns a linear and an angular part as one vector.
pub(super) fn joined(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
    Vector6::from_iterator(linear.iter().chain(angular).copied())
}

/// Returns the linear and the angular part.
pub(super) fn halves(both: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (both.fixed_rows::<3>(0).into_owned(), both.fixed_rows::<3>(3).into_owned())
}

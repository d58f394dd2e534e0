//! Transformation of a body to a frame along the axes of its model, and its modes in the rows of the model.

use super::rotated_stiffness::{about_axes, split, transformed};
use super::{
    FlexBody, GeometricStiffness, Interface, InternalRows, LumpedBody, NamedLoad, ReferenceConditions,
    UnitLoad,
};
use crate::basis::CoupledModel;
use crate::invariants::InertiaStiffness;
use faer::{Mat, MatRef, Scale};
use flexbody_base::error::Result;
use flexbody_linalg::gram;
use flexbody_model::{FeModel, LoadKind, NodeSet};
use nalgebra::{Matrix3, Vector3};

/// Direction cosines up to this magnitude are rounding and count as zero.
const ROUNDING_COSINE: f64 = 4.0 * f64::EPSILON;

impl FlexBody {
    /// Returns this body in a frame along the axes of the model with its origin at `origin` (body frame).
    /// Only the description changes: modal coordinates, spatial mode shapes and energies stay equal.
    /// Interface coordinates are dropped.
    ///
    /// Positions become x' = A (x - d), shapes A psi with A = `frame().axes`; the invariants follow (5.1)
    /// of the theory. Geometric stiffness for spin and angular acceleration about the new origin follows
    /// from that for acceleration, a = a' - alpha x d - omega x (omega x d).
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`], if numbers overflow.
    pub fn in_model_axes(&self, origin: Vector3<f64>) -> Result<Self> {
        let mut body = self.in_frame(origin, self.frame().axes.transpose())?;
        // Set the axes exactly: the product of axes with their transpose has rounding errors.
        body.parts_mut().frame.axes = Matrix3::identity();
        Ok(body)
    }

    /// Returns the body in a frame at `origin` with the columns of `axes` as its axes, both given in the
    /// body frame; see [`FlexBody::in_model_axes`] for the changes.
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`], if numbers overflow.
    pub fn in_frame(&self, origin: Vector3<f64>, axes: Matrix3<f64>) -> Result<Self> {
        let (to_new, to_body) = (axes.transpose(), axes);
        let mut parts = self.parts().clone();
        if !parts.conditions.is_mean() && origin != Vector3::zeros() {
            // The frame stays tied to the interface, but its origin is elsewhere.
            parts.conditions = ReferenceConditions::Unstated;
        }
        parts.frame.origin += parts.frame.axes * origin;
        parts.frame.axes *= axes;
        let moved = |x: &[f64; 3]| (to_new * (Vector3::from(*x) - origin)).into();
        parts.nodes.positions = parts.nodes.positions.iter().map(moved).collect();
        for interface in &mut parts.interfaces {
            interface.reference = interface.reference.as_ref().map(moved);
        }
        parts.modes.shape = turned(parts.modes.shape.as_ref(), &to_new, usize::MAX);
        parts.modes.rotation =
            parts.modes.rotation.map(|rotation| turned(rotation.as_ref(), &to_new, usize::MAX));
        parts.modes.internal = parts.modes.internal.map(|internal| internal.in_axes(&to_body));
        parts.invariants = parts.invariants.shifted(origin).rotated(&to_body);
        parts.lumped = parts
            .lumped
            .into_iter()
            .map(|lumped| LumpedBody {
                invariants: lumped.invariants.shifted(origin).rotated(&to_body),
                ..lumped
            })
            .collect();
        (parts.geometric_stiffness, parts.rotated_stiffness) = match self.stiffness_with_rotation() {
            Some(all) => {
                let all = along(&stiffness_about(&all, &origin, self.dimension()), &to_body);
                split(transformed(all, &about_axes(self.n_modes(), &to_body)))
            }
            None => (self.geometric_stiffness_in(&origin, &to_body), Vec::new()),
        };
        // The estimate is about the centre of mass, so that it does not depend on the origin.
        parts.estimated_stiffness = along(self.estimated_stiffness(), &to_body);
        parts.inertia_stiffness = self.inertia_stiffness_in(&origin, &to_body);
        parts.named_loads = self.named_loads_in(&origin, &to_body);
        parts.recoveries = parts.recoveries.iter().map(|recovery| recovery.in_axes(&to_body)).collect();
        parts.coordinates = None;
        Self::new(parts)
    }

    /// Returns the geometric stiffness of unit loads about the point `d` and along the columns of `axes`,
    /// both in the body frame.
    pub fn geometric_stiffness_in(
        &self,
        d: &Vector3<f64>,
        axes: &Matrix3<f64>,
    ) -> Vec<GeometricStiffness<Mat<f64>>> {
        along(&stiffness_about(self.geometric_stiffness(), d, self.dimension()), axes)
    }

    /// Returns the named loads about the point `d` and along the columns of `axes`, both in the body frame.
    pub fn named_loads_in(&self, d: &Vector3<f64>, axes: &Matrix3<f64>) -> Vec<NamedLoad> {
        self.named_loads().iter().map(|load| load.in_frame(d, axes)).collect()
    }

    /// Returns the stiffness of inertia about the point `d` and along the columns of `axes`, both in the
    /// body frame; `None` if the body has none.
    pub fn inertia_stiffness_in(&self, d: &Vector3<f64>, axes: &Matrix3<f64>) -> Option<InertiaStiffness> {
        let (inertia, rotation) = (self.inertia_stiffness()?, self.modes().rotation.as_ref()?);
        if *d == Vector3::zeros() && *axes == Matrix3::identity() {
            return Some(inertia.clone());
        }
        let rotation = turned(rotation.as_ref(), &axes.transpose(), usize::MAX);
        Some(inertia.in_frame(d, axes, rotation.as_ref(), self.dimension()))
    }
}

impl InternalRows {
    /// Returns the rows with their vectors along the columns of `axes`. Rows that are no vectors come last
    /// and do not change.
    pub fn in_axes(&self, axes: &Matrix3<f64>) -> Self {
        let shape = turned(self.shape.as_ref(), &axes.transpose(), vectors(self));
        Self { dofs: self.dofs.clone(), shape }
    }
}

/// Returns the number of rows that belong to vectors: they come first, three per vector, with the
/// directions 1, 2, 3 in their labels.
fn vectors(internal: &InternalRows) -> usize {
    let complete =
        |dofs: &[[i64; 2]]| dofs.len() == 3 && (0..3).all(|k| dofs[k] == [dofs[0][0], (k + 1) as i64]);
    3 * internal.dofs.chunks(3).take_while(|dofs| complete(dofs)).count()
}

/// Returns vectors (groups of three rows) in other axes; rows from `end` on do not change.
fn turned(shape: MatRef<'_, f64>, axes: &Matrix3<f64>, end: usize) -> Mat<f64> {
    Mat::from_fn(shape.nrows(), shape.ncols(), |row, j| {
        if row >= end {
            return shape[(row, j)];
        }
        let (first, k) = (row / 3 * 3, row % 3);
        (0..3).map(|l| axes[(k, l)] * shape[(first + l, j)]).sum()
    })
}

/// Returns the geometric stiffness for motion of the point `d` instead of the origin.
pub fn stiffness_about(
    given: &[GeometricStiffness<Mat<f64>>],
    d: &Vector3<f64>,
    dimension: usize,
) -> Vec<GeometricStiffness<Mat<f64>>> {
    let mut all = given.to_vec();
    if *d == Vector3::zeros() {
        return all;
    }
    let unit = |axis: usize| Vector3::ith(axis, 1.0);
    for stiffness in given.iter().filter(|stiffness| stiffness.load.kind == LoadKind::Acceleration) {
        let along = stiffness.load.component;
        for kind in [LoadKind::AngularAcceleration, LoadKind::Spin] {
            for &component in kind.of_dimension(dimension) {
                let acceleration = match kind {
                    LoadKind::Spin => {
                        let (a, b) = LoadKind::SPIN[component];
                        let part = |a: usize, b: usize| unit(a).cross(&unit(b).cross(d));
                        if a == b { part(a, b) } else { part(a, b) + part(b, a) }
                    }
                    _ => unit(component).cross(d),
                };
                let part = &stiffness.matrix * Scale(-acceleration[along]);
                if acceleration[along] != 0.0 {
                    add(&mut all, UnitLoad { kind: kind.clone(), component }, part);
                }
            }
        }
    }
    all
}

/// Returns the geometric stiffness for loads along the columns of `axes` (given in the present axes).
pub fn along(
    given: &[GeometricStiffness<Mat<f64>>],
    axes: &Matrix3<f64>,
) -> Vec<GeometricStiffness<Mat<f64>>> {
    let mut all = Vec::new();
    for GeometricStiffness { load, matrix } in given {
        let factors =
            load.along(axes).into_iter().enumerate().filter(|(_, factor)| factor.abs() > ROUNDING_COSINE);
        for (component, factor) in factors {
            add(&mut all, UnitLoad { kind: load.kind.clone(), component }, matrix * Scale(factor));
        }
    }
    all
}

fn add(all: &mut Vec<GeometricStiffness<Mat<f64>>>, load: UnitLoad, part: Mat<f64>) {
    match all.iter_mut().find(|known| known.load == load) {
        Some(sum) => sum.matrix += part,
        None => all.push(GeometricStiffness { load, matrix: part }),
    }
}

impl FlexBody {
    /// Returns the modes Psi (N x nf) in the rows and axes of the model that the body was made of; `None`
    /// if the body has other rows than the model.
    pub fn vectors_of(&self, model: &FeModel) -> Option<Mat<f64>> {
        let split = self.rows_in_space(model)? - 3 * model.nodes().len();
        let (rows, modes, d) = (model.rows(), self.modes(), model.dimension());
        let massless = rows.without_place()[1].start;
        let axes = &self.frame().axes;
        let turned = |shape: &dyn Fn(usize) -> f64, vector: usize, k: usize| -> f64 {
            (0..3).map(|l| axes[(k, l)] * shape(3 * vector + l)).sum()
        };
        let (first, nodes) = (rows.displacements(), model.nodes().len());
        Some(Mat::from_fn(rows.len(), self.n_modes(), |row, j| {
            match (row.checked_sub(first), &modes.rotation) {
                (None, _) => turned(&|at| self.displacement(nodes, at, j), row / d, row % d),
                (Some(after), Some(rotation)) if after < rows.rotations().len() => {
                    let (node, axis) = rows.rotations()[after];
                    turned(&|at| rotation[(at, j)], node as usize, axis.into())
                }
                (Some(_), _) => modes
                    .internal
                    .as_ref()
                    .map_or(0.0, |internal| internal.shape[(split + row - massless, j)]),
            }
        }))
    }

    /// Returns the model with the couplings that every mode preserves: rigid interfaces of a Craig-Bampton
    /// body move as rigid bodies there as well.
    ///
    /// * `vectors`: modes in the rows of the model, as returned by [`FlexBody::vectors_of`].
    pub fn coupled_model<'m>(&self, model: &'m FeModel, vectors: MatRef<'_, f64>) -> CoupledModel<'m> {
        let set = |interface: &Interface| NodeSet {
            coupling: interface.coupling,
            ..NodeSet::new(&interface.name, interface.nodes.iter().map(|&at| self.nodes().ids[at]).collect())
        };
        let sets: Vec<NodeSet> = self.interfaces().iter().map(set).collect();
        CoupledModel::of_modes(model, &sets, vectors)
    }

    /// Returns Psi'K Psi_r (nf x nr) with the modes Psi_r of another body of the same model: the elastic
    /// coupling of the two bases. Returns `None` in the cases of [`FlexBody::vectors_of`].
    pub fn stiffness_beside(&self, other: &Self, model: &FeModel) -> Option<Mat<f64>> {
        let (vectors, others) = (self.vectors_of(model)?, other.vectors_of(model)?);
        Some(gram(vectors.as_ref(), model.pencil().apply_stiffness(others.as_ref()).as_ref()))
    }

    /// Returns the displacements of the modes in body axes, three per node, then three per vector without a
    /// position. Returns `None` in the cases of [`FlexBody::vectors_of`].
    pub(crate) fn displacements_of(&self, model: &FeModel) -> Option<Mat<f64>> {
        let rows = self.rows_in_space(model)?;
        let nodes = model.nodes().len();
        Some(Mat::from_fn(rows, self.n_modes(), |row, j| self.displacement(nodes, row, j)))
    }

    /// Returns the number of spatial displacement rows of nodes and of vectors without a position, if the
    /// body has the rows of the model.
    fn rows_in_space(&self, model: &FeModel) -> Option<usize> {
        let (rows, modes) = (model.rows(), self.modes());
        let massless = rows.without_place()[1].len();
        let internal = modes.internal.as_ref().map_or(0, |internal| internal.shape.nrows());
        let same = self.n_nodes() == model.nodes_of_body().len()
            && self.dimension() == model.dimension()
            && internal == 3 * rows.vectors() + massless
            && modes.rotation.is_some() == model.has_rotations();
        same.then(|| 3 * (model.nodes().len() + rows.vectors()))
    }

    /// Returns a displacement of a model with this number of nodes: those of the nodes, then those of vectors
    /// without a position.
    fn displacement(&self, nodes: usize, row: usize, j: usize) -> f64 {
        match (row.checked_sub(3 * nodes), &self.modes().internal) {
            (Some(row), Some(internal)) => internal.shape[(row, j)],
            _ => self.modes().shape[(row, j)],
        }
    }
}

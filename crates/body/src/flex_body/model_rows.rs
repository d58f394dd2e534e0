//! Modes of a body in the rows and axes of its model.

use super::{FlexBody, Interface};
use crate::basis::CoupledModel;
use faer::{Mat, MatRef};
use flexbody_linalg::gram;
use flexbody_model::{FeModel, NodeSet};

impl FlexBody {
    /// Returns the modes Psi (N x nf) in the rows and axes of the model that the body was made of; `None`
    /// if the body has other rows than the model.
    pub fn vectors_of(&self, model: &FeModel) -> Option<Mat<f64>> {
        let split = self.rows_in_space(model)? - 3 * self.n_nodes();
        let (rows, modes, d) = (model.rows(), self.modes(), model.dimension());
        let massless = rows.without_place()[1].start;
        let axes = &self.frame().axes;
        let turned = |shape: &dyn Fn(usize) -> f64, vector: usize, k: usize| -> f64 {
            (0..3).map(|l| axes[(k, l)] * shape(3 * vector + l)).sum()
        };
        let first = rows.displacements();
        Some(Mat::from_fn(rows.len(), self.n_modes(), |row, j| {
            match (row.checked_sub(first), &modes.rotation) {
                (None, _) => turned(&|at| self.displacement(at, j), row / d, row % d),
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
        Some(Mat::from_fn(rows, self.n_modes(), |row, j| self.displacement(row, j)))
    }

    /// Returns the number of spatial displacement rows of nodes and of vectors without a position, if the
    /// body has the rows of the model.
    fn rows_in_space(&self, model: &FeModel) -> Option<usize> {
        let (rows, modes) = (model.rows(), self.modes());
        let massless = rows.without_place()[1].len();
        let internal = modes.internal.as_ref().map_or(0, |internal| internal.shape.nrows());
        let same = self.n_nodes() == model.nodes().len()
            && self.dimension() == model.dimension()
            && internal == 3 * rows.vectors() + massless
            && modes.rotation.is_some() != rows.rotations().is_empty();
        same.then(|| 3 * (self.n_nodes() + rows.vectors()))
    }

    fn displacement(&self, row: usize, j: usize) -> f64 {
        match (row.checked_sub(3 * self.n_nodes()), &self.modes().internal) {
            (Some(row), Some(internal)) => internal.shape[(row, j)],
            _ => self.modes().shape[(row, j)],
        }
    }
}

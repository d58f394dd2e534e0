//! A model between the checks of its matrices by themselves and those of the body that they describe.

use super::{Damping, GeometricStiffness, Nodes, RawModel, Rows, SurfaceMesh};
use flexbody_linalg::SymmetricMatrix;

/// A model in the internal order whose matrices are sound by themselves.
pub(super) struct Assembled {
    /// What was read, without matrices, nodes, surface and labels.
    pub raw: RawModel,
    /// Nodes with degrees of freedom.
    pub nodes: Nodes,
    /// The surface on these nodes.
    pub mesh: Option<SurfaceMesh>,
    /// What the rows are; how those without a place move is not known yet.
    pub rows: Rows,
    /// K.
    pub stiffness: SymmetricMatrix,
    /// M.
    pub mass: SymmetricMatrix,
    /// Internal row of each matrix row, `u32::MAX` of those that are left out; none when they are the same, or when this is one of several bodies.
    pub row_to_internal: Option<Vec<u32>>,
    /// Damping, a matrix in the same order.
    pub damping: Option<Damping<SymmetricMatrix>>,
    /// Geometric stiffness, in the same order.
    pub geometric_stiffness: Vec<GeometricStiffness<SymmetricMatrix>>,
}

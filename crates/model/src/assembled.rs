//! A model between the checks of its matrices by themselves and those of the body.

use super::{Damping, GeometricStiffness, ModelRecovery, Nodes, RawModel, Rows, SurfaceMesh};
use flexbody_linalg::SymmetricMatrix;

/// Model in the internal order whose matrices are valid by themselves.
pub(super) struct Assembled {
    /// Model as read, without matrices, nodes, surface and labels.
    pub raw: RawModel,
    /// Nodes with degrees of freedom.
    pub nodes: Nodes,
    /// Surface on these nodes.
    pub mesh: Option<SurfaceMesh>,
    /// Meaning of the rows; the motion of rows without a position is not known yet.
    pub rows: Rows,
    /// K.
    pub stiffness: SymmetricMatrix,
    /// M.
    pub mass: SymmetricMatrix,
    /// Internal row of each matrix row, `u32::MAX` for rows that are left out; `None` if the orders are
    /// equal, or for one of several bodies.
    pub row_to_internal: Option<Vec<u32>>,
    /// Damping; a matrix is in the internal order.
    pub damping: Option<Damping<SymmetricMatrix>>,
    /// Geometric stiffness, in the internal order.
    pub geometric_stiffness: Vec<GeometricStiffness<SymmetricMatrix>>,
    /// Rows to read off the body, in the internal order.
    pub recoveries: Vec<ModelRecovery>,
}

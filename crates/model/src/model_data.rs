//! Data of a model that its steps share.

use crate::{
    Damping, Description, GeometricStiffness, ModelLoad, ModelRecovery, NodalStress, NodeSet, SurfaceMesh,
};
use flexbody_base::provenance::Sources;
use flexbody_elements::DescribedElements;
use std::sync::Arc;

/// Data of a model other than K, M, nodes and rows. `M` is the type of its matrices: [`RawMatrix`](crate::RawMatrix) as
/// read, [`SymmetricMatrix`](flexbody_linalg::SymmetricMatrix) after the checks.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelData<M> {
    /// Name and units.
    pub description: Description,
    /// Named node sets.
    pub interfaces: Vec<NodeSet>,
    /// Surface, by indices of the nodes of the model, if elements are known.
    pub mesh: Option<SurfaceMesh>,
    /// Damping, if given; a matrix has the rows of K.
    pub damping: Option<Damping<M>>,
    /// Geometric stiffness of unit loads along the axes of the model, with the rows of K.
    pub geometric_stiffness: Vec<GeometricStiffness<M>>,
    /// Rows to read off the body. The operators have the rows of the files as read, and the internal rows after the
    /// checks.
    pub recoveries: Vec<ModelRecovery>,
    /// Stresses at nodes, from elements that K proves.
    pub nodal_stresses: Vec<NodalStress>,
    /// Nodal forces with a name, by the rows of the files as read, and by internal rows after the checks.
    pub named_loads: Vec<ModelLoad>,
    /// Elements, materials and constraints as the deck describes them, if they were asked for.
    pub elements: Option<Arc<DescribedElements>>,
    /// Role (`stiffness`, `mass`, `nodes`, `dofs`, `damping`, `geometric_stiffness`, `recovery`, `named_load`, `mesh`,
    /// `elements`, `manifest`), file name and SHA-256 (hex) of every file read.
    pub sources: Sources,
}

impl<M> ModelData<M> {
    /// Creates the data of a model that has only K, M and nodes.
    pub fn new(description: Description) -> Self {
        Self {
            description,
            interfaces: Vec::new(),
            mesh: None,
            damping: None,
            geometric_stiffness: Vec::new(),
            recoveries: Vec::new(),
            nodal_stresses: Vec::new(),
            named_loads: Vec::new(),
            elements: None,
            sources: Sources::default(),
        }
    }
}

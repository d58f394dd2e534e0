//! Content of a file with node positions.

use super::sets::NodeSets;
use flexbody_model::{DofLabel, Elements, NodeAxes, Nodes};
use std::collections::HashMap;

/// Nodes, sets and elements of a file.
#[derive(Debug, Default)]
pub(super) struct NodeFile {
    pub nodes: Nodes,
    pub sets: NodeSets,
    pub elements: Elements,
    /// Rows that follow others by constraints of a deck, by the names of the constraints.
    pub followers: Vec<(String, Vec<DofLabel>)>,
    /// Unit vectors along the rows of nodes, where these are not the axes of the model.
    pub axes: HashMap<i64, NodeAxes>,
}

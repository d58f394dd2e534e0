//! Nodes of a file, with the known sets and elements.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_model::{DofLabel, Elements, NodeAxes, Nodes};
use std::collections::HashMap;

/// Named sets of nodes, in the order of their file.
pub(super) type NodeSets = Vec<(String, Vec<i64>)>;

/// Names of node sets that cannot be resolved, with the reason, which becomes an error if such a set is requested.
pub(super) type Unresolved = Vec<(String, Diagnostic)>;

/// Nodes, sets and elements of a file.
#[derive(Debug, Default)]
pub(super) struct NodeFile {
    pub nodes: Nodes,
    pub sets: NodeSets,
    /// Sets whose nodes are unknown.
    pub unresolved: Unresolved,
    pub elements: Elements,
    /// Rows that follow others by constraints of a deck, by the names of the constraints.
    pub followers: Vec<(String, Vec<DofLabel>)>,
    /// Unit vectors along the rows of nodes, where these are not the axes of the model.
    pub axes: HashMap<i64, NodeAxes>,
}

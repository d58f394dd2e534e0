//! Nodes of a file, with what is known of sets and elements of them.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_model::{DofLabel, Elements, NodeAxes, Nodes};
use std::collections::HashMap;

/// Named sets of nodes, in the order of their file.
pub(super) type NodeSets = Vec<(String, Vec<i64>)>;

/// Names of node sets that cannot be resolved, and why: the reason is an error where one of them is asked for.
pub(super) type Unresolved = Vec<(String, Diagnostic)>;

/// Nodes, sets and elements of a file.
#[derive(Debug, Default)]
pub(super) struct NodeFile {
    pub nodes: Nodes,
    pub sets: NodeSets,
    /// Sets of which nobody knows the nodes.
    pub unresolved: Unresolved,
    pub elements: Elements,
    /// Rows that constraints of a deck make follow others, by the names of the constraints.
    pub followers: Vec<(String, Vec<DofLabel>)>,
    /// Unit vectors along the rows of nodes, where these are not the axes of the model.
    pub axes: HashMap<i64, NodeAxes>,
}

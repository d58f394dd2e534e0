//! Requests of stresses at nodes.

use std::collections::HashSet;
use std::path::PathBuf;

/// Stresses at nodes that a model asks for: means over the elements of one material around each node.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalStress {
    /// Name of the recovery that they become, unique in the model.
    pub name: String,
    /// Nodes whose stresses are wanted.
    pub nodes: StressNodes,
    /// File of the nodes, for messages; empty without one.
    pub path: PathBuf,
}

/// Nodes whose stresses are wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StressNodes {
    /// All nodes of elements.
    All,
    /// Nodes on the surface.
    Surface,
    /// Nodes by their numbers.
    These(Vec<i64>),
}

impl NodalStress {
    /// Returns the stresses at those of its nodes that belong to a body; `None` if it has none of them.
    pub(crate) fn among(&self, body: &HashSet<i64>) -> Option<Self> {
        let StressNodes::These(nodes) = &self.nodes else { return Some(self.clone()) };
        let own: Vec<i64> = nodes.iter().copied().filter(|node| body.contains(node)).collect();
        (!own.is_empty()).then(|| Self { nodes: StressNodes::These(own), ..self.clone() })
    }
}

//! Rows of the matrices of a deck, by which constraints and internal nodes are described.

use flexbody_elements::NodeDirection;
use flexbody_model::DofLabel;
use std::collections::{BTreeSet, HashMap, HashSet};

/// Program that assembled the matrices of a deck.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Program {
    /// CalculiX: constraints are eliminated.
    Calculix,
    /// Abaqus.
    Abaqus,
}

/// Rows of the matrices, and the nodes whose displacements are rotations.
#[derive(Debug)]
pub(crate) struct Rows<'r> {
    pub program: Program,
    labels: HashSet<DofLabel>,
    /// Reference node of each node whose displacements 1 to 3 are its rotations.
    rotations: &'r HashMap<i64, i64>,
}

impl<'r> Rows<'r> {
    /// Creates the rows with the labels of the model, in which rotations are directions 4 to 6 of the reference nodes.
    pub(crate) fn new(program: Program, labels: &[DofLabel], rotations: &'r HashMap<i64, i64>) -> Self {
        Self { program, labels: labels.iter().copied().collect(), rotations }
    }

    /// Returns true if a degree of freedom has a row.
    pub(super) fn has(&self, (node, direction): NodeDirection) -> bool {
        self.labels.contains(&DofLabel { node, direction })
    }

    /// Returns the degree of freedom of the model for one of the deck.
    pub(super) fn of_model(&self, (node, direction): NodeDirection) -> NodeDirection {
        match self.rotations.get(&node) {
            Some(reference) if direction <= 3 => (*reference, direction + 3),
            _ => (node, direction),
        }
    }

    /// Returns the nodes with rows for which `is_known` is false, ascending.
    pub(super) fn others(&self, is_known: impl Fn(i64) -> bool) -> Vec<i64> {
        let nodes: BTreeSet<i64> = self.labels.iter().map(|label| label.node).collect();
        nodes.into_iter().filter(|node| !is_known(*node)).collect()
    }
}

//! Scopes of a keyword deck, its parts and its assembly, with the nodes, elements and sets that they define.

use crate::sets::{ElementNodes, SetList};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Elements of one type.
#[derive(Debug, Clone)]
pub(super) struct Elements {
    /// Type in upper case.
    pub kind: String,
    /// Number and nodes of each element.
    pub members: ElementNodes,
}

/// Nodes, elements and sets of a part, of the assembly, or of a deck without either. Instances share those of their part.
#[derive(Debug, Clone, Default)]
pub(super) struct Scope {
    pub nodes: Arc<BTreeMap<i64, [f64; 3]>>,
    pub elements: Arc<Vec<Elements>>,
    pub sets: Arc<SetList>,
    pub element_sets: Arc<SetList>,
    /// Indices in the deck of the cards of sections, springs, axes and constraints.
    pub cards: Arc<Vec<usize>>,
}

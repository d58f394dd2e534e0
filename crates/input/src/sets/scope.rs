//! Scopes with sets, a part, the assembly or a file without either: the nodes and elements that the sets select.

use super::list::SetList;
use std::sync::{Arc, OnceLock};

/// Elements with their nodes.
pub(crate) type ElementNodes = Arc<Vec<(i64, Vec<i64>)>>;

/// Sets of a part, of the assembly, or of a file without either, with the nodes and elements that they select.
#[derive(Debug, Default)]
pub(crate) struct SetScope {
    pub nodes: Arc<SetList>,
    pub elements: Arc<SetList>,
    /// Node numbers in the order of the file.
    pub ids: Arc<Vec<i64>>,
    pub element_nodes: Vec<ElementNodes>,
    /// Difference of the node numbers of the model from those of the scope.
    pub shift: i64,
    pub index: SetIndex,
}

/// Nodes and elements of a scope by their numbers, made when a set is requested.
#[derive(Debug, Default)]
pub(crate) struct SetIndex {
    ids: OnceLock<Arc<Vec<i64>>>,
    elements: OnceLock<ElementIndex>,
}

/// Elements by their numbers.
#[derive(Debug, Default)]
pub(super) struct ElementIndex {
    /// Numbers, ascending, each once.
    pub ids: Arc<Vec<i64>>,
    /// Number, block and place in the block of every element, ascending.
    places: Vec<(i64, u32, u32)>,
}

impl SetScope {
    pub(super) fn sorted_ids(&self) -> Arc<Vec<i64>> {
        let sorted = || {
            if self.ids.is_sorted_by(|a, b| a < b) {
                return Arc::clone(&self.ids);
            }
            let mut ids = self.ids.to_vec();
            ids.sort_unstable();
            ids.dedup();
            Arc::new(ids)
        };
        Arc::clone(self.index.ids.get_or_init(sorted))
    }

    pub(super) fn element_index(&self) -> &ElementIndex {
        self.index.elements.get_or_init(|| {
            let of_block = |(block, elements): (usize, &ElementNodes)| {
                let places = elements.iter().enumerate();
                places.map(|(at, (id, _))| (*id, block as u32, at as u32)).collect::<Vec<_>>()
            };
            let mut places: Vec<_> = self.element_nodes.iter().enumerate().flat_map(of_block).collect();
            places.sort_unstable();
            let mut ids: Vec<i64> = places.iter().map(|(id, ..)| *id).collect();
            ids.dedup();
            ElementIndex { ids: Arc::new(ids), places }
        })
    }

    /// Returns the nodes of elements, ascending.
    pub(super) fn nodes_of(&self, elements: &[i64]) -> Vec<i64> {
        let places = &self.element_index().places;
        let of_element = |id: &i64| {
            let id = *id;
            let first = places.partition_point(|(other, ..)| *other < id);
            places[first..].iter().take_while(move |(other, ..)| *other == id)
        };
        let found = elements.iter().flat_map(of_element);
        let mut nodes: Vec<i64> = found
            .flat_map(|(_, block, at)| self.element_nodes[*block as usize][*at as usize].1.iter().copied())
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// Instance of a part with its sets.
#[derive(Debug)]
pub(crate) struct SetInstance {
    pub name: String,
    pub scope: SetScope,
}

/// Scope of the assembly, or of a file without instances, and the instances.
#[derive(Debug, Default)]
pub(super) struct SetScopes {
    pub top: SetScope,
    pub instances: Vec<SetInstance>,
}

impl SetScopes {
    /// Returns the scope of an instance, or that of the assembly.
    pub(super) fn of(&self, instance: Option<usize>) -> &SetScope {
        instance.map_or(&self.top, |at| &self.instances[at].scope)
    }
}

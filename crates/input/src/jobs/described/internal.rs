//! Internal nodes of C3D8I in CalculiX.
//!
//! Each of these elements has three nodes with displacements 1 to 3 that are not in the deck: the factors of the
//! incompatible modes. CalculiX numbers them after all other nodes, those that constraints create included, element by
//! element in the ascending order of the element numbers.

use super::rows::Rows;
use flexbody_elements::{DescribedElements, NotDescribed};
use std::collections::HashMap;

/// Type of the elements with internal nodes.
const KIND: &str = "C3D8I";

/// Number of internal nodes of an element.
const NODES_EACH: usize = 3;

/// Adds the internal nodes of the elements. Elements whose internal nodes cannot be identified are not described.
///
/// * `is_known`: true for a node of the deck and for one that constraints create.
pub(super) fn with_internal_nodes(
    mut described: DescribedElements,
    rows: &Rows<'_>,
    is_known: impl Fn(i64) -> bool,
) -> DescribedElements {
    let mut elements: Vec<i64> = described
        .groups
        .iter()
        .filter(|group| group.kind == KIND)
        .flat_map(|group| group.ids.iter().copied())
        .collect();
    elements.sort_unstable();
    if elements.is_empty() {
        return described;
    }
    let others = rows.others(is_known);
    // Other programs eliminate the incompatible modes inside each element.
    if others.is_empty() {
        return described;
    }
    if others.len() != NODES_EACH * elements.len() {
        let mut nodes = Vec::new();
        described.groups.retain(|group| {
            if group.kind == KIND {
                nodes.extend(&group.nodes);
            }
            group.kind != KIND
        });
        nodes.sort_unstable();
        nodes.dedup();
        let what = format!(
            "{} elements of type {KIND}: {} nodes outside the deck have rows, {} are their internal nodes",
            elements.len(),
            others.len(),
            NODES_EACH * elements.len()
        );
        described.not_described.push(NotDescribed { what, line: None, nodes });
        return described;
    }
    let own: HashMap<i64, &[i64]> = elements.into_iter().zip(others.chunks(NODES_EACH)).collect();
    for group in described.groups.iter_mut().filter(|group| group.kind == KIND) {
        group.internal = group.ids.iter().flat_map(|id| own[id].iter().copied()).collect();
    }
    described
}

//! The labels of matrix rows that Abaqus writes without labels: nodes in ascending order, each with the directions that
//! its elements give it.

use super::Found;
use super::deck_mesh::DeckMesh;
use super::element_kinds::{family, has_internal_nodes};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::DofLabel;
use std::collections::BTreeMap;
use std::path::Path;

const HELP: &str = "write *MATRIX OUTPUT with FORMAT=MATRIX INPUT, whose lines name node and direction";

/// Returns the labels of the rows of a model with the elements of `mesh`.
///
/// # Errors
/// FB111 for elements whose directions are unknown.
pub(super) fn labels(mesh: &DeckMesh, deck: &Path) -> Found<Vec<DofLabel>> {
    let mut directions: BTreeMap<i64, u8> = BTreeMap::new();
    let mut unknown: Vec<&str> = Vec::new();
    for elements in &mesh.elements {
        let Some(family) = family(&elements.kind) else {
            unknown.push(&elements.kind);
            continue;
        };
        let bits = family.directions().iter().fold(0u8, |bits, direction| bits | 1 << direction);
        for node in elements.members.iter().flat_map(|(_, nodes)| nodes) {
            *directions.entry(*node).or_default() |= bits;
        }
    }
    if !unknown.is_empty() {
        unknown.sort_unstable();
        unknown.dedup();
        let message = format!(
            "the degrees of freedom of the nodes of {} are not known, and the matrices do not name them",
            unknown.join(", ")
        );
        return Err(vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(deck).with_help(HELP)]);
    }
    let label = |(node, bits): (&i64, &u8)| {
        let (node, bits) = (*node, *bits);
        (1..=6u8)
            .filter(move |direction| bits & 1 << direction != 0)
            .map(move |direction| DofLabel { node, direction })
    };
    Ok(directions.iter().flat_map(label).collect())
}

/// Returns FB112: the matrix has other rows than the deck.
pub(super) fn other_rows(mesh: &DeckMesh, labels: usize, rows: usize, matrix: &Path) -> Diagnostic {
    let mut internal: Vec<&str> = mesh
        .elements
        .iter()
        .map(|elements| elements.kind.as_str())
        .filter(|kind| has_internal_nodes(kind))
        .collect();
    internal.sort_unstable();
    internal.dedup();
    let mut message = format!(
        "matrix has {rows} rows, but the elements of the deck give their nodes {labels} degrees of freedom"
    );
    if !internal.is_empty() {
        let kinds = internal.join(", ");
        message +=
            &format!("; elements {kinds} have internal nodes as well, whose rows only labels identify");
    }
    Diagnostic::new(Code::DeckRows, message).in_file(matrix).with_help(HELP)
}

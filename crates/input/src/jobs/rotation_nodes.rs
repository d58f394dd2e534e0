//! Nodes of CalculiX whose directions 1 to 3 are rotations of a reference node.
//!
//! ROT NODE of *RIGID BODY names such a node. *COUPLING with *KINEMATIC creates a node that is not in the deck, but its
//! number follows from the deck: CalculiX reads all *NODE cards, then all *COUPLING cards in their order, and then the
//! cards and elements that create further nodes. Each kinematic coupling takes the next number for its rotation node,
//! and further numbers without rows for its equations (see [`Coupling::n_numbers`]).

use super::Found;
use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use super::deck_surfaces::nodes_of_surface;
use flexbody_base::diagnostic::Code;
use flexbody_base::text::scanner::integer;
use flexbody_model::DofLabel;
use std::collections::{BTreeSet, HashMap};

/// Number of internal nodes of an element with incompatible modes (C3D8I).
const INTERNAL_NODES: usize = 3;

const HELP: &str = "run CalculiX again if the deck has changed since; else write *RIGID BODY, NSET=SET, REF NODE=A, ROT NODE=B instead of the coupling";

/// Returns the rotation nodes of a deck, each with the reference node that rotates. `labels` are the labels of the rows
/// by CalculiX.
///
/// # Errors
/// FB111 if the rows that are rotations, or their reference node, cannot be identified.
pub(super) fn rotation_nodes(deck: &Deck, mesh: &DeckMesh, labels: &[DofLabel]) -> Found<HashMap<i64, i64>> {
    let mut rotations = named_rotation_nodes(deck)?;
    rotations.extend(made_rotation_nodes(deck, mesh, labels)?);
    let with_rows: BTreeSet<i64> = labels.iter().map(|label| label.node).collect();
    let mut turned: HashMap<i64, i64> = HashMap::new();
    let mut nodes = HashMap::new();
    for Rotation { node, reference, card } in rotations {
        // A rotation node belongs to one reference node, and a reference node has one rotation node.
        if let Some(other) = nodes.insert(node, reference).filter(|other| *other != reference) {
            let message = format!("ROT NODE {node} belongs to two reference nodes, {other} and {reference}");
            let diagnostic = deck.about(card, Code::DeckUnsupported, message);
            return Err(vec![diagnostic.with_help("give each *RIGID BODY a separate ROT NODE")]);
        }
        if with_rows.contains(&node) && turned.insert(reference, node).is_some_and(|other| other != node) {
            let message = format!(
                "REF NODE {reference} of *{} is also the REF NODE of another coupling: its rotations are not unique",
                card.title
            );
            let diagnostic = deck.about(card, Code::DeckUnsupported, message);
            return Err(vec![diagnostic.with_help("give each coupling a separate REF NODE")]);
        }
    }
    Ok(nodes)
}

/// Rotation node, its reference node, and the card that defines them.
struct Rotation<'d> {
    node: i64,
    reference: i64,
    card: &'d Card,
}

/// Returns the rotation nodes that *RIGID BODY names.
///
/// # Errors
/// FB111 for *RIGID BODY without REF NODE or ROT NODE.
fn named_rotation_nodes(deck: &Deck) -> Found<Vec<Rotation<'_>>> {
    let mut rotations = Vec::new();
    for card in deck.cards().iter().filter(|card| card.keyword == "RIGIDBODY") {
        let node = |name: &str| {
            card.parameter(name).and_then(|text| fields(text.as_bytes()).next().and_then(integer))
        };
        let message = match (node("REFNODE"), node("ROTNODE")) {
            (Some(reference), Some(node)) => {
                rotations.push(Rotation { node, reference, card });
                continue;
            }
            (Some(_), None) => "*RIGID BODY has no ROT NODE: the rows of its rotations cannot be identified",
            (None, _) => "*RIGID BODY has no REF NODE: its rows cannot be identified",
        };
        let diagnostic = deck.about(card, Code::DeckUnsupported, message);
        return Err(vec![diagnostic.with_help("write *RIGID BODY, NSET=SET, REF NODE=A, ROT NODE=B")]);
    }
    Ok(rotations)
}

/// A *COUPLING with *KINEMATIC.
struct Coupling<'d> {
    card: &'d Card,
    /// Number of lines of directions below *KINEMATIC.
    n_lines: usize,
}

impl Coupling<'_> {
    /// Returns the kinematic couplings of a deck in their order. *DISTRIBUTING only distributes loads over a surface:
    /// it creates no nodes, and its reference node has no rows.
    fn all(deck: &Deck) -> Vec<Coupling<'_>> {
        let cards = deck.cards();
        let mut couplings = Vec::new();
        for (k, card) in cards.iter().enumerate().filter(|(_, card)| card.keyword == "COUPLING") {
            let below = cards[k + 1..].iter().take_while(|card| card.keyword == "KINEMATIC");
            let counts: Vec<usize> = below.map(|card| deck.data(card).count()).collect();
            if !counts.is_empty() {
                couplings.push(Coupling { card, n_lines: counts.iter().sum() });
            }
        }
        couplings
    }

    /// Returns the number of node numbers that the coupling takes besides that of its rotation node. Each line of
    /// directions creates one node for each node of the surface. With ORIENTATION every node of the surface creates a
    /// copy of itself and one node for the equations of the copy, and the lines create none. Returns `None` if the
    /// nodes of the surface are unknown.
    fn n_numbers(&self, deck: &Deck, mesh: &DeckMesh) -> Option<i64> {
        let nodes = nodes_of_surface(deck, mesh, &self.card.name("SURFACE")?)?.len();
        let for_each = if self.card.parameter("ORIENTATION").is_some() { 2 } else { self.n_lines };
        i64::try_from(nodes.checked_mul(for_each)?).ok()
    }

    /// Returns the reference node, given by its number or by a set of one node.
    ///
    /// # Errors
    /// FB111 if REF NODE is neither.
    fn reference(&self, deck: &Deck, mesh: &DeckMesh) -> Found<i64> {
        let text = self.card.parameter("REFNODE").unwrap_or_default();
        let set = || match mesh.set(text)? {
            [node] => Some(*node),
            _ => None,
        };
        integer(text.as_bytes()).or_else(set).ok_or_else(|| {
            let message = format!("REF NODE `{text}` of *COUPLING is neither a node nor a set of one node");
            let diagnostic = deck.about(self.card, Code::DeckUnsupported, message);
            vec![diagnostic.with_help("write the number of the reference node, as in REF NODE=17")]
        })
    }

    /// Returns FB111: the rows of the rotations of the reference node cannot be identified.
    fn refuse<T>(&self, deck: &Deck, reference: i64, why: &str, help: &str) -> Found<T> {
        let message = format!(
            "*COUPLING, *KINEMATIC: the rows of the rotations of REF NODE {reference} cannot be identified: {why}"
        );
        Err(vec![deck.about(self.card, Code::DeckUnsupported, message).with_help(help)])
    }
}

/// Kinematic coupling with its reference node, and the number of its rotation node by the deck.
struct Numbered<'d> {
    coupling: Coupling<'d>,
    reference: i64,
    node: i64,
}

/// Returns the rotation nodes that kinematic couplings create and that have rows.
///
/// # Errors
/// FB111 if rows of nodes outside the deck are not those that its couplings create.
fn made_rotation_nodes<'d>(deck: &'d Deck, mesh: &DeckMesh, labels: &[DofLabel]) -> Found<Vec<Rotation<'d>>> {
    let mut next = mesh.nodes.keys().next_back().and_then(|highest| highest.checked_add(1));
    let mut end = i64::MIN;
    let mut numbered = Vec::new();
    for coupling in Coupling::all(deck) {
        let reference = coupling.reference(deck, mesh)?;
        let Some(node) = next else {
            let why = "the nodes of the surface of a coupling above it cannot be counted";
            let help =
                "write the *SURFACE of each coupling by nodes or by the faces S1 to S6 of solid elements";
            return coupling.refuse(deck, reference, why, help);
        };
        next = coupling.n_numbers(deck, mesh).and_then(|count| node.checked_add(count)?.checked_add(1));
        // Numbers below `end` belong to couplings.
        end = next.unwrap_or(node);
        numbered.push(Numbered { coupling, reference, node });
    }
    let Some(last) = numbered.last() else { return Ok(Vec::new()) };
    let expected: BTreeSet<i64> = numbered.iter().map(|entry| entry.node).collect();
    // Nodes with rows but without a position in the deck: rotation nodes, and others with higher numbers.
    let made: BTreeSet<i64> =
        labels.iter().map(|label| label.node).filter(|node| !mesh.nodes.contains_key(node)).collect();
    let others: Vec<i64> = made.difference(&expected).copied().collect();
    let stray = others.first().filter(|other| **other < end);
    let n_internal = INTERNAL_NODES * n_with_internal_nodes(mesh);
    let is_explained = others.len() == n_internal;
    // A coupling has no rows if all its nodes follow another coupling, or if the deck is not the one that was run.
    let absent = numbered.iter().find(|entry| entry.coupling.n_lines > 0 && !made.contains(&entry.node));
    let Numbered { coupling, reference, node } = absent.unwrap_or(last);
    match stray {
        Some(stray) => {
            let why = format!("by the deck they belong to node {node}, but node {stray} has rows");
            coupling.refuse(deck, *reference, &why, HELP)
        }
        None if !is_explained => {
            let why = format!(
                "by the deck they belong to node {node}, and elements have {n_internal} internal nodes, but {} nodes beyond those of the deck have rows",
                made.len()
            );
            coupling.refuse(deck, *reference, &why, HELP)
        }
        None => {
            let with_rows = numbered.into_iter().filter(|entry| made.contains(&entry.node));
            let rotation = |entry: Numbered<'d>| Rotation {
                node: entry.node,
                reference: entry.reference,
                card: entry.coupling.card,
            };
            Ok(with_rows.map(rotation).collect())
        }
    }
}

/// Returns the number of elements of a deck that have internal nodes.
fn n_with_internal_nodes(mesh: &DeckMesh) -> usize {
    mesh.elements
        .iter()
        .filter(|elements| elements.kind == "C3D8I")
        .map(|elements| elements.members.len())
        .sum()
}

//! Kinematic couplings of a deck: *COUPLING with *KINEMATIC.

use super::deck::{Card, Deck};
use super::deck_mesh::DeckMesh;
use super::deck_surfaces::Surfaces;
use flexbody_base::diagnostic::{Code, Diagnosed};
use flexbody_base::text::scanner::integer;

/// A *COUPLING with *KINEMATIC.
pub(super) struct Coupling<'d> {
    pub card: &'d Card,
    /// Cards *KINEMATIC below it.
    pub kinematic: Vec<&'d Card>,
    /// Number of lines of directions below *KINEMATIC.
    pub n_lines: usize,
}

impl<'d> Coupling<'d> {
    /// Returns the kinematic couplings of a deck in their order. *DISTRIBUTING only distributes loads over a surface:
    /// it creates no nodes, and its reference node has no rows.
    pub(super) fn all(deck: &'d Deck) -> Vec<Self> {
        let cards = deck.cards();
        let mut couplings = Vec::new();
        for (k, card) in cards.iter().enumerate().filter(|(_, card)| card.keyword == "COUPLING") {
            let below = cards[k + 1..].iter().take_while(|card| card.keyword == "KINEMATIC");
            let kinematic: Vec<&Card> = below.collect();
            if !kinematic.is_empty() {
                let n_lines = kinematic.iter().map(|card| deck.data(card).count()).sum();
                couplings.push(Coupling { card, kinematic, n_lines });
            }
        }
        couplings
    }

    /// Returns the number of node numbers that the coupling takes besides that of its rotation node. Each line of
    /// directions creates one node for each node of the surface. With ORIENTATION every node of the surface creates a
    /// copy of itself and one node for the equations of the copy, and the lines create none. Returns `None` if the
    /// nodes of the surface are unknown.
    pub(super) fn n_numbers(&self, surfaces: &mut Surfaces<'_>) -> Option<i64> {
        let nodes = surfaces.count(&self.card.name("SURFACE")?)?;
        let for_each = if self.card.parameter("ORIENTATION").is_some() { 2 } else { self.n_lines };
        i64::try_from(nodes.checked_mul(for_each)?).ok()
    }

    /// Returns the reference node, given by its number or by a set of one node.
    ///
    /// # Errors
    /// FB111 if REF NODE is neither.
    pub(super) fn reference(&self, deck: &Deck, mesh: &DeckMesh) -> Diagnosed<i64> {
        let text = self.card.parameter("REFNODE").unwrap_or_default();
        let set = || match mesh.set(text)?.as_slice() {
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
    pub(super) fn refuse<T>(&self, deck: &Deck, reference: i64, why: &str, help: &str) -> Diagnosed<T> {
        let message = format!(
            "*COUPLING, *KINEMATIC: the rows of the rotations of REF NODE {reference} cannot be identified: {why}"
        );
        Err(vec![deck.about(self.card, Code::DeckUnsupported, message).with_help(help)])
    }
}

//! Reference nodes of `*DISTRIBUTING COUPLING` of CalculiX.
//!
//! Such a coupling makes the displacement of its reference node the weighted mean of those of its nodes, and eliminates
//! the first of these nodes. CalculiX does not use the coordinates of the reference node. In a rigid motion it moves as
//! the mean of the node positions, so this mean is the position of its rows.

use super::Found;
use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_base::text::scanner::{excerpt, integer, real};
use flexbody_model::DofLabel;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const HELP: &str = "write *DISTRIBUTING COUPLING, ELSET=E with one element of type DCOUP3D in E and lines `node or set, weight`; or remove it from the deck and name its nodes as an averaging interface: --interface NAME=SET,averaging";

/// Returns the reference nodes of the couplings of a deck, each with the mean of the positions of its nodes.
///
/// # Errors
/// FB111 for a coupling whose reference node or nodes cannot be identified.
pub(super) fn reference_places(deck: &Deck, mesh: &DeckMesh) -> Found<BTreeMap<i64, [f64; 3]>> {
    let is_coupling = |card: &&Card| card.keyword == "DISTRIBUTINGCOUPLING";
    let mut sums: BTreeMap<i64, Sum<'_>> = BTreeMap::new();
    for card in deck.cards().iter().filter(is_coupling) {
        let node = reference_node(card, mesh).map_err(|why| refused(deck, card, &why))?;
        let sum = sums.entry(node).or_insert(Sum { card, moment: Vector3::zeros(), total: 0.0 });
        // Data that continue in another file have a separate card.
        for (line, text) in deck.data(card) {
            let (places, weight) = weighted(text, mesh).ok_or_else(|| {
                let text = excerpt(text);
                let message =
                    format!("*DISTRIBUTING COUPLING: `{text}` is not a node or node set and its weight");
                vec![deck.at(card, line, Code::DeckUnsupported, message).with_help(HELP)]
            })?;
            sum.moment += places.iter().map(|place| weight * Vector3::from(*place)).sum::<Vector3<f64>>();
            sum.total += weight * places.len() as f64;
        }
    }
    let mean = |(node, sum): (i64, Sum<'_>)| {
        let place = sum.moment / sum.total;
        let why = "the weights of its nodes add up to zero";
        let is_finite = place.iter().all(|x| x.is_finite());
        is_finite.then(|| (node, place.into())).ok_or_else(|| refused(deck, sum.card, why))
    };
    sums.into_iter().map(mean).collect()
}

/// Weighted sum of node positions.
struct Sum<'d> {
    card: &'d Card,
    moment: Vector3<f64>,
    total: f64,
}

fn refused(deck: &Deck, card: &Card, why: &str) -> Vec<Diagnostic> {
    let message = format!("*DISTRIBUTING COUPLING: {why}");
    vec![deck.about(card, Code::DeckUnsupported, message).with_help(HELP)]
}

/// Returns a note that names the reference nodes with rows, whose positions differ from those in the deck.
pub(super) fn placed_note(
    means: &BTreeMap<i64, [f64; 3]>,
    labels: &[DofLabel],
    path: &Path,
) -> Option<Diagnostic> {
    let with_rows: BTreeSet<i64> = labels.iter().map(|label| label.node).collect();
    let named: Vec<String> = means
        .iter()
        .filter(|(node, _)| with_rows.contains(node))
        .map(|(node, x)| format!("{node} at ({})", x.map(|x| significant(x, 6)).join(", ")))
        .collect();
    let message = format!(
        "reference nodes of distributing couplings lie at the weighted mean of their nodes, whatever their coordinates are: {}",
        named.join("; ")
    );
    (!named.is_empty()).then(|| Diagnostic::new(Code::DeckReference, message).in_file(path))
}

/// Returns the node of the only element of the set of a coupling.
///
/// # Errors
/// The set is missing, or has other elements than one DCOUP3D; the error is in words.
fn reference_node(card: &Card, mesh: &DeckMesh) -> Result<i64, String> {
    let set = card.name("ELSET").ok_or("ELSET is missing")?;
    let members = mesh.element_sets.get(&set).ok_or_else(|| format!("element set `{set}` is unknown"))?;
    let is_coupling = |kind: &str| kind == "DCOUP3D";
    let nodes: Vec<i64> = mesh
        .elements
        .iter()
        .filter(|elements| is_coupling(&elements.kind))
        .flat_map(|elements| &elements.members)
        .filter(|(id, _)| members.contains(id))
        .flat_map(|(_, nodes)| nodes.iter().copied())
        .collect();
    match (nodes.as_slice(), members.len()) {
        (&[node], 1) => Ok(node),
        _ => Err(format!("element set `{set}` is not one element of type DCOUP3D")),
    }
}

/// Returns the positions of the nodes that a line names by a number or a set, and the weight of each; `None` for a line
/// without a weight, or without a node or set of the deck.
fn weighted(line: &[u8], mesh: &DeckMesh) -> Option<(Vec<[f64; 3]>, f64)> {
    let mut given = fields(line);
    let (name, weight) = (given.next()?, given.next()?);
    let weight = real(weight).filter(|weight| weight.is_finite())?;
    let nodes: BTreeSet<i64> = match integer(name) {
        Some(node) => BTreeSet::from([node]),
        None => mesh.set(&String::from_utf8_lossy(name))?.iter().copied().collect(),
    };
    let places: Option<Vec<[f64; 3]>> = nodes.iter().map(|node| mesh.nodes.get(node).copied()).collect();
    Some((places?, weight))
}

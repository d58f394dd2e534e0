//! Elements of a deck that the manifest names: the matrices of its model have other files.

use super::deck::Deck;
use super::deck_mesh::DeckMesh;
use super::described::{DescribedRows, Program, Requested, described};
use crate::element_source::ElementSource;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::input_file::SeenFile;
use flexbody_base::text::scanner::integer;
use flexbody_base::text::{Compression, InputFile};
use flexbody_elements::DescribedElements;
use flexbody_model::DofLabel;
use std::collections::{HashMap, HashSet};

/// Number of bytes by which a deck is recognised.
const HEAD: usize = 4096;

/// Returns true if a file, compressed or not, is a keyword deck.
pub(crate) fn is_described_by_deck(file: &InputFile) -> bool {
    let head = Compression::of(file.bytes()).head(file, HEAD);
    begins_like_deck(&String::from_utf8_lossy(&head))
}

/// Returns true when a text begins like a keyword deck: its first line that is no comment is a keyword.
pub(crate) fn begins_like_deck(head: &str) -> bool {
    let first = head.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with("**"));
    first
        .is_some_and(|line| line.starts_with('*') && line[1..].starts_with(|c: char| c.is_ascii_alphabetic()))
}

/// Describes the elements of a deck by the rows of the matrices. Returns also the files that the deck includes.
///
/// # Errors
/// FB101 to FB106 for files that cannot be read, FB110 and FB111 for decks that cannot be read.
pub(crate) fn describe_deck(
    source: &ElementSource,
    labels: &[DofLabel],
) -> Diagnosed<(DescribedElements, Vec<SeenFile>)> {
    let deck = Deck::read(&source.path)?;
    let mesh = DeckMesh::read(&deck, true)?;
    let ElementSource { set, kind, elasticity, .. } = source.clone();
    let program = if mesh.scopes.len() > 1 { Program::Abaqus } else { Program::Calculix };
    let rotations = rotations(&deck, labels);
    let rows = DescribedRows::new(program, labels, &rotations);
    let described = described(&deck, &mesh, &rows, &Requested { set, kind, elasticity })?;
    let included = deck.seen()?.into_iter().skip(1).map(|(_, file)| file).collect();
    Ok((described, included))
}

/// Returns the reference nodes of the rotation nodes that *RIGID BODY names, if the labels have their rotations.
fn rotations(deck: &Deck, labels: &[DofLabel]) -> HashMap<i64, i64> {
    let turning: HashSet<i64> =
        labels.iter().filter(|label| label.direction > 3).map(|label| label.node).collect();
    let cards = deck.cards().iter().filter(|card| card.keyword == "RIGIDBODY");
    let nodes = cards.filter_map(|card| {
        let node = |name: &str| card.parameter(name).and_then(|text| integer(text.as_bytes()));
        Some((node("ROTNODE")?, node("REFNODE")?))
    });
    nodes.filter(|(_, reference)| turning.contains(reference)).collect()
}

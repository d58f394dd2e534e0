//! Decks with the elements of a model.

use super::arguments::ShapesArguments;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_input::{ElementDeck, ModelFiles, ModelSource};
use flexbody_model::{FeModel, extents};
use std::collections::HashMap;
use std::path::PathBuf;

/// Distance of a node of the deck from the node of the model, relative to the largest extent, above which the deck is
/// that of another model.
const MAX_DISTANCE: f64 = 1e-5;

/// Returns the elements and materials of the model.
///
/// # Errors
/// FB001 if the nodes have rotations or no deck is known, the errors of [`ElementDeck::read`], FB125 for the deck of
/// another model.
pub(super) fn deck_for(
    arguments: &ShapesArguments,
    files: &ModelFiles,
    model: &FeModel,
) -> Result<ElementDeck> {
    if !model.rows().rotations().is_empty() {
        let message = "nodes of the model have rotations, which CalculiX cannot be given";
        let help = "write the shapes with --to csv or --to npz for the FE program of the model";
        return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
    }
    let path = arguments.deck.clone().or_else(|| deck_of(files)).ok_or_else(|| {
        let message = "--to calculix needs the deck of the model, which its manifest does not name";
        Diagnostic::new(Code::Usage, message).with_help("name the deck with its elements: --deck DECK.inp")
    })?;
    let deck = ElementDeck::read(&path)?;
    if let Some(message) = stranger(&deck, model) {
        return Err(Diagnostic::new(Code::MeshForeign, message).in_file(path).into());
    }
    Ok(deck)
}

/// Returns the deck that a model was read from.
fn deck_of(files: &ModelFiles) -> Option<PathBuf> {
    let path = match &files.source {
        ModelSource::Job(job) => &job.path,
        ModelSource::Tables(tables) => &tables.nodes,
    };
    let mesh = files.mesh.as_ref();
    let is_deck = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "inp");
    [Some(path), mesh].into_iter().flatten().find(|path| is_deck(path)).cloned()
}

/// Returns a message about a node of the deck that is not the node of the model.
fn stranger(deck: &ElementDeck, model: &FeModel) -> Option<String> {
    let nodes = model.nodes();
    let place: HashMap<i64, &[f64; 3]> = nodes.ids.iter().copied().zip(&nodes.positions).collect();
    let allowed = MAX_DISTANCE * extents(&nodes.positions).into_iter().fold(0.0, f64::max);
    deck.element_nodes.iter().find_map(|id| {
        let (Some(own), Some(there)) = (place.get(id), deck.nodes.get(id)) else {
            return Some(format!("node {id} of the elements is not a node of the model"));
        };
        let apart = (0..3).map(|k| (own[k] - there[k]).powi(2)).sum::<f64>().sqrt();
        (apart > allowed)
            .then(|| format!("node {id} of the deck lies at {there:?}, the node of the model at {own:?}"))
    })
}

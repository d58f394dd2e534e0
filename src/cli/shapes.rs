//! Command `flexbody shapes`.

use super::arguments::{PlacesName, ShapeFormat, ShapesArguments};
use super::element_decks::deck_for;
use super::models::of_manifest_or_job;
use super::outcome::{Outcome, fill_by, size_of};
use super::run::{Printed, Run};
use super::stiffening;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::convert::{UNIFORM_STRAIN, recovery_shapes};
use flexbody_formats::shapes::{NodalShapes, StressDeck, StressPlaces};
use flexbody_input::{
    ElementDeck, ModelFiles, OperatorSource, RecoverySource, read_model, read_nodes_of_table,
};
use flexbody_model::{CheckedModel, FeModel};
use std::path::PathBuf;

pub(super) fn run(arguments: &ShapesArguments) -> Result<Outcome> {
    refuse_options_of_decks(arguments)?;
    if arguments.geometric_stiffness {
        return stiffening::run(arguments);
    }
    let archive = arguments.output.with_extension("npz");
    let is_npz = arguments.to == ShapeFormat::Npz;
    let outputs: Vec<PathBuf> =
        if is_npz { vec![arguments.output.clone()] } else { vec![arguments.output.clone(), archive] };
    let files = of_manifest_or_job(&arguments.model, &arguments.job)?;
    let of_shapes = |recovery: &RecoverySource| matches!(recovery.operator, OperatorSource::Shapes { .. });
    let deformed_inertia =
        files.recoveries.iter().any(|recovery| of_shapes(recovery) && recovery.deformed_inertia);
    // Recoveries of the manifest may name results that do not exist yet.
    let files = ModelFiles { recoveries: Vec::new(), ..files };
    let inputs = [&arguments.body, &arguments.model];
    let deck = arguments.deck.as_ref();
    let named = files.paths();
    let inputs = inputs.into_iter().chain(deck).chain(&named);
    let mut run = Run::begin(arguments.printing, inputs, &outputs, &[])?.with_progress();
    let slots = outputs.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let body = run.read_body(&arguments.body)?;
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(read_model(&files)?)?;
    run.note(diagnostics);
    let asked = match arguments.to {
        ShapeFormat::Calculix => Some(Asked::of(arguments, &files, &model)?),
        ShapeFormat::Csv | ShapeFormat::Npz => None,
    };
    run.refuse_read()?;
    let shapes = recovery_shapes(&body, &model, deformed_inertia, &run.context(false))
        .map_err(|error| error.in_file(&arguments.body))?;
    let shapes = if arguments.uniform_strains { shapes.with_uniform_strains(&model)? } else { shapes };
    let shapes = NodalShapes::new(&shapes, &model, &body);
    run.data()?;
    match (arguments.to, &asked) {
        (ShapeFormat::Calculix, Some(asked)) => asked.write(&shapes, &slots[0])?,
        (ShapeFormat::Csv, _) => slots[0].fill(shapes.csv().as_bytes())?,
        _ => {}
    }
    slots[slots.len() - 1].fill(&shapes.npz())?;
    let sizes: Vec<u64> = slots.iter().map(size_of).collect();
    let written: Vec<(&PathBuf, u64)> = outputs.iter().zip(sizes).collect();
    let printed = printed(arguments, &written, &shapes, asked.as_ref());
    run.end_with(slots, |_| String::new(), printed, true)
}

/// Refuses options that only a deck has.
fn refuse_options_of_decks(arguments: &ShapesArguments) -> Result<()> {
    let given = [
        ("--geometric-stiffness", arguments.geometric_stiffness),
        ("--deck", arguments.deck.is_some()),
        ("--nodes", arguments.nodes != "surface"),
        ("--at", arguments.at != PlacesName::Nodes),
    ];
    let extension = arguments.output.extension().is_some_and(|extension| extension == "npz");
    let message = match given.iter().find(|(_, given)| *given) {
        Some((option, _)) if arguments.to != ShapeFormat::Calculix => {
            format!("{option} applies to --to calculix")
        }
        _ if extension && arguments.to != ShapeFormat::Npz => {
            "the extension .npz is that of the archive beside the output".to_owned()
        }
        _ => return Ok(()),
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

/// Deck that asks CalculiX for stresses, without the shapes.
struct Asked {
    deck: ElementDeck,
    watched: Vec<i64>,
    places: StressPlaces,
}

impl Asked {
    fn of(arguments: &ShapesArguments, files: &ModelFiles, model: &FeModel) -> Result<Self> {
        let deck = deck_for(arguments, files, model)?;
        let watched = watched(arguments, &deck, model)?;
        let places = match arguments.at {
            PlacesName::Nodes => StressPlaces::Nodes,
            PlacesName::IntegrationPoints => StressPlaces::IntegrationPoints,
        };
        Ok(Self { deck, watched, places })
    }

    fn write(&self, shapes: &NodalShapes, slot: &OutputSlot) -> Result<()> {
        let Self { deck, watched, places } = self;
        let (elements, solids) = (deck.text.as_slice(), deck.solids.as_slice());
        let deck = StressDeck { shapes, elements, solids, watched, places: *places };
        fill_by(slot, |out| deck.write(out))
    }
}

/// Returns the nodes with stresses.
fn watched(arguments: &ShapesArguments, deck: &ElementDeck, model: &FeModel) -> Result<Vec<i64>> {
    let ids = &model.nodes().ids;
    match arguments.nodes.as_str() {
        "all" => Ok(ids.clone()),
        "surface" => Ok(deck.surface.clone()),
        path => {
            let listed = read_nodes_of_table(path.as_ref())?;
            match listed.iter().find(|node| !ids.contains(node)) {
                None => Ok(listed),
                Some(unknown) => {
                    let message = format!("node {unknown} is not a node of the model");
                    Err(Diagnostic::new(Code::NodeSetUnknown, message).in_file(path).into())
                }
            }
        }
    }
}

/// Returns the texts about the `written` files and their sizes.
fn printed(
    arguments: &ShapesArguments,
    written: &[(&PathBuf, u64)],
    shapes: &NodalShapes,
    asked: Option<&Asked>,
) -> Printed {
    let mut text = String::new();
    for (path, size) in written {
        text += &format!("{}, {size} bytes\n", path.display());
    }
    let all: Vec<(String, f64)> =
        shapes.columns().map(|(column, factor)| (column.to_string(), factor)).collect();
    let modes = all.iter().filter(|(name, _)| name.starts_with("mode ")).count();
    let strains = all.iter().filter(|(name, _)| name.starts_with(UNIFORM_STRAIN)).count();
    let columns = all.len() - modes - strains;
    let and_strains = if strains > 0 { format!(", and {strains} uniform strains") } else { String::new() };
    text += &format!("{} shapes: {modes} modes and {columns} static columns{and_strains}\n", all.len());
    if let Some(asked) = asked {
        let stem = arguments.output.with_extension("");
        let (ending, places) = match asked.places {
            StressPlaces::Nodes => ("frd", "nodes"),
            StressPlaces::IntegrationPoints => ("dat", "the integration points around nodes"),
        };
        text += &format!("stresses at {places}: {}\n", asked.watched.len());
        if !asked.deck.left_out.is_empty() {
            text += &format!("cards of the deck that are left out: *{}\n", asked.deck.left_out.join(", *"));
        }
        let answers = arguments.output.with_extension(ending);
        text += &format!(
            "next: ccx {}, then in the manifest\n  [[recovery]]\n  name = \"surface\"\n  shapes = \"{}\"\n",
            stem.display(),
            answers.display()
        );
    }
    let file = |(path, size): &(&PathBuf, u64)| serde_json::json!({ "path": path.display().to_string(), "bytes": size });
    let shape = |(name, factor): &(String, f64)| serde_json::json!({ "column": name, "factor": factor });
    let json = serde_json::json!({
        "files": written.iter().map(file).collect::<Vec<_>>(),
        "shapes": all.iter().map(shape).collect::<Vec<_>>(),
        "watched_nodes": asked.map(|asked| asked.watched.len()),
        "cards_left_out": asked.map(|asked| asked.deck.left_out.clone()),
    });
    Printed { text, json: format!("{json:#}") }
}

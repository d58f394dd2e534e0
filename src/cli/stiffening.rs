//! Command `flexbody shapes --geometric-stiffness`.

use super::arguments::ShapesArguments;
use super::element_decks::deck_for;
use super::models::of_manifest_or_job;
use super::outcome::{Outcome, fill_by, refuse_replacing, refuse_replacing_read, size_of};
use super::run::{Printed, Run};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::convert::load_shapes;
use flexbody_formats::shapes::{NodalShapes, StressDeck, StressPlaces};
use flexbody_formats::stiffening::{StepStresses, StiffeningDecks, stiffening_script};
use flexbody_input::{ElementDeck, ModelFiles, read_model, read_point_stresses};
use flexbody_model::{CheckedModel, FeModel};
use std::path::{Path, PathBuf};

pub(super) fn run(arguments: &ShapesArguments) -> Result<Outcome> {
    refuse_unused_options(arguments)?;
    // Geometric stiffness and recoveries of the manifest may name results that do not exist yet.
    let files = of_manifest_or_job(&arguments.model, &arguments.job)?;
    let files = ModelFiles { recoveries: Vec::new(), geometric_stiffness: Vec::new(), ..files };
    let named = files.paths();
    let inputs =
        [Some(&arguments.body), Some(&arguments.model), arguments.deck.as_ref(), arguments.stresses.as_ref()];
    let inputs: Vec<&PathBuf> = inputs.into_iter().flatten().chain(&named).collect();
    let (read, output) = (inputs.iter().copied(), [&arguments.output]);
    let mut run = Run::begin(arguments.printing, read, output, &[])?.with_progress();
    let body = run.read_body(&arguments.body)?;
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(read_model(&files)?)?;
    run.note(diagnostics);
    let deck = deck_for(arguments, &files, &model)?;
    let shapes =
        load_shapes(&body, &model, &run.context(false)).map_err(|error| error.in_file(&arguments.body))?;
    let shapes = NodalShapes::new(&shapes, &model, &body);
    run.data()?;
    let written = match &arguments.stresses {
        None => write_question(arguments, &shapes, &deck, &model, &inputs)?,
        Some(stresses) => write_decks(arguments, &shapes, &deck, stresses, &inputs)?,
    };
    let printed = printed(&written, &shapes, &deck);
    run.end_with(written.slots, |_| String::new(), printed, true)
}

/// Refuses options of the other shapes, and names of files that the outputs beside them have.
fn refuse_unused_options(arguments: &ShapesArguments) -> Result<()> {
    let wanted = if arguments.stresses.is_some() { "toml" } else { "inp" };
    let message = if arguments.nodes != "surface" {
        "--nodes does not apply to --geometric-stiffness, which needs the stresses of all elements".to_owned()
    } else if arguments.output.extension().is_none_or(|extension| extension != wanted) {
        let what = if wanted == "inp" { "the deck of the unit loads" } else { "the tables of the manifest" };
        format!("the output is {what}: give it the extension .{wanted}")
    } else {
        return Ok(());
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

/// Files that are written but not yet in their places, and the next step of the user.
struct Written {
    files: Vec<PathBuf>,
    slots: Vec<OutputSlot>,
    next: String,
}

/// Writes the deck whose stresses are needed, its shapes, and the script that continues from there.
fn write_question(
    arguments: &ShapesArguments,
    shapes: &NodalShapes,
    deck: &ElementDeck,
    model: &FeModel,
    inputs: &[&PathBuf],
) -> Result<Written> {
    let output = &arguments.output;
    let files = vec![output.clone(), output.with_extension("npz"), output.with_extension("sh")];
    let slots = reserve(&files, inputs)?;
    let (elements, solids, places) =
        (deck.text.as_slice(), deck.solids.as_slice(), StressPlaces::IntegrationPoints);
    let watched = &model.nodes().ids;
    let asking = StressDeck { shapes, elements, solids, watched, places };
    fill_by(&slots[0], |out| asking.write(out))?;
    slots[1].fill(&shapes.npz())?;
    let text = |path: &Path| path.display().to_string();
    let mut words: Vec<String> = vec!["flexbody".into(), "shapes".into(), text(&arguments.body)];
    words.extend(["--model".into(), text(&arguments.model)]);
    words.extend(arguments.job.words());
    words.extend(arguments.deck.iter().flat_map(|deck| ["--deck".into(), text(deck)]));
    words.extend(["--geometric-stiffness".into(), "--stresses".into(), text(&output.with_extension("dat"))]);
    words.extend(["-o".into(), text(&output.with_extension("toml"))]);
    let decks = decks_of(output, shapes.count());
    let stem = |path: &PathBuf| text(&path.with_extension(""));
    let script = stiffening_script(&stem(output), &words, &decks.iter().map(stem).collect::<Vec<_>>());
    slots[2].fill(script.as_bytes())?;
    let next = format!(
        "next: sh {}, then append {} to the manifest\n",
        files[2].display(),
        output.with_extension("toml").display()
    );
    Ok(Written { files, slots, next })
}

/// Writes the deck of each load with its stress, and the tables of the manifest.
fn write_decks(
    arguments: &ShapesArguments,
    shapes: &NodalShapes,
    deck: &ElementDeck,
    stresses: &Path,
    inputs: &[&PathBuf],
) -> Result<Written> {
    let answers = read_point_stresses(stresses)?;
    let stiffening = StiffeningDecks {
        shapes,
        elements: &deck.text,
        solids: &deck.solids,
        stresses: StepStresses { points: &answers.points, stresses: &answers.stresses },
    };
    let tolerance = 10f64.powi(1 - i32::from(answers.digits));
    if let Some(message) = stiffening.problem(&answers.nodes, &answers.displacements, tolerance) {
        let help = "run the deck that flexbody shapes --geometric-stiffness wrote for this body";
        return Err(Diagnostic::new(Code::RecoveryShapes, message).in_file(stresses).with_help(help).into());
    }
    let decks = decks_of(&arguments.output, shapes.count());
    let files: Vec<PathBuf> = std::iter::once(&arguments.output).chain(&decks).cloned().collect();
    let slots = reserve(&files, inputs)?;
    let folder = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
    let is_beside = folder(&arguments.output) == folder(&arguments.model);
    let named = |step: usize| {
        let matrix = decks[step].with_extension("sti");
        let name = matrix.file_name().map(PathBuf::from).filter(|_| is_beside);
        let path = name.unwrap_or_else(|| std::path::absolute(&matrix).unwrap_or(matrix));
        path.display().to_string()
    };
    slots[0].fill(stiffening.manifest(named).as_bytes())?;
    for (step, slot) in slots[1..].iter().enumerate() {
        fill_by(slot, |out| stiffening.write(step, out))?;
    }
    let next =
        format!("next: ccx on each deck, then append {} to the manifest\n", arguments.output.display());
    Ok(Written { files, slots, next })
}

/// Returns the decks with the stress of each load, numbered from 1 beside the output.
fn decks_of(output: &Path, count: usize) -> Vec<PathBuf> {
    let stem = output.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    (1..=count).map(|number| output.with_file_name(format!("{stem}_{number:02}.inp"))).collect()
}

/// Reserves outputs, none of which may be an input.
fn reserve(files: &[PathBuf], inputs: &[&PathBuf]) -> Result<Vec<OutputSlot>> {
    refuse_replacing(inputs.iter().copied(), files.iter())?;
    refuse_replacing_read(files.iter())?;
    files.iter().map(OutputSlot::prepare).collect()
}

/// Returns the texts about the written files.
fn printed(written: &Written, shapes: &NodalShapes, deck: &ElementDeck) -> Printed {
    let sizes = written.slots.iter().map(size_of);
    let files: Vec<(&PathBuf, u64)> = written.files.iter().zip(sizes).collect();
    let mut text = String::new();
    for (path, size) in &files {
        text += &format!("{}, {size} bytes\n", path.display());
    }
    text += &format!("{} unit loads\n", shapes.count());
    if !deck.left_out.is_empty() {
        text += &format!("cards of the deck that are left out: *{}\n", deck.left_out.join(", *"));
    }
    text += &written.next;
    let file = |(path, size): &(&PathBuf, u64)| serde_json::json!({ "path": path.display().to_string(), "bytes": size });
    let shape = |(name, factor): (String, f64)| serde_json::json!({ "column": name, "factor": factor });
    let columns = shapes.columns().map(|(column, factor)| shape((column.to_string(), factor)));
    let json = serde_json::json!({
        "files": files.iter().map(file).collect::<Vec<_>>(),
        "shapes": columns.collect::<Vec<_>>(),
        "watched_nodes": null,
        "cards_left_out": deck.left_out,
    });
    Printed { text, json: format!("{json:#}") }
}

//! Command `flexbody trade`.

use super::arguments::TradeArguments;
use super::models::{is_model, origin, read_checked};
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_replacing_read, refuse_warnings};
use super::resources::{context, use_threads};
use super::terminal::Watcher;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::basis::ModeSettings;
use flexbody_linalg::context::Event;
use flexbody_motion::scene::LoadCases;
use flexbody_report::{Format, RunData, TradeFacts, trade_csv};
use flexbody_study::recipe::Recipe;
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{
    ReferenceChoice, Source, Trade, TradeRow, TradeSettings, Varied, WantedBodies, conversions, reserved,
    trade,
};
use std::path::{Path, PathBuf};

pub(super) fn run(arguments: &TradeArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = || arguments.csv.iter().chain(&arguments.report);
    refuse_replacing([&arguments.body, &arguments.scene].into_iter(), outputs())?;
    let is_model = is_model(&arguments.body, &arguments.job)?;
    refuse_contradictions(arguments, is_model)?;
    let table = arguments.csv.as_ref().map(OutputSlot::prepare).transpose()?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    if let Some(folder) = &arguments.bodies {
        // A folder that cannot be written to is noticed before the study.
        flexbody_file::prepare_output(candidate_path(folder, 0))?;
    }
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let cases = LoadCases::read(&arguments.scene, arguments.case.as_deref())?;
    let series = cases.iter().flat_map(|scene| &scene.series);
    refuse_replacing(series.map(|file| &file.path), outputs())?;
    refuse_replacing_read(outputs())?;
    let watch = |event: Event<'_>| watcher.hear(event);
    // Created again for each part: the model and the bodies take memory too.
    let limits = || context(None, arguments.allow_long, &watch);
    let mut diagnostics = Vec::new();
    let (model, sources, reference_errors, varied) = if is_model {
        let (_, checked) = read_checked(&arguments.body, &arguments.job, outputs())?;
        diagnostics.extend(checked.diagnostics);
        let modes = arguments.modes.map_or(ModeSettings::DEFAULT_COUNT, |modes| modes as usize);
        let wanted = WantedBodies { modes, fine: arguments.reference == ReferenceChoice::Fine };
        let made = conversions(&checked.model, &cases, wanted, &limits())
            .map_err(|error| error.in_file(&arguments.scene))?;
        diagnostics.extend(made.diagnostics);
        diagnostics.extend(made.varied.diagnostics.iter().cloned());
        (Some(checked.model), made.sources, made.reference_errors, made.varied)
    } else {
        let (body, notes) = flexbody_file::read_with_notes(&arguments.body)?;
        diagnostics.extend(notes);
        let varied = Varied::of_body(&cases, body.dimension());
        (None, vec![Source::new("file", body, Recipe::File, None)?], Vec::new(), varied)
    };
    let nodal = model.as_ref().filter(|_| arguments.reference == ReferenceChoice::Nodal);
    let reserved = reserved(&reference_errors, nodal.is_some());
    let settings =
        TradeSettings { repeat: arguments.repeat.into(), reserved: &reserved, varied: Some(&varied) };
    let study = trade(&sources, &cases, nodal, &settings, &limits())
        .map_err(|error| error.in_file(&arguments.scene))?;
    diagnostics.extend(study.diagnostics.iter().cloned());
    let run = RunData { phases: watcher.finish(), diagnostics, threads, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let facts = TradeFacts::new(&study, &reference_errors, &run);
    let facts = match command_of(arguments, &study, &sources) {
        Some(command) => facts.with_command(command),
        None => facts,
    };

    if let Some(slot) = &table {
        slot.fill(trade_csv(&study).as_bytes())?;
    }
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    let bodies = match &arguments.bodies {
        Some(folder) => {
            let inputs: Vec<&PathBuf> = outputs().chain([&arguments.body, &arguments.scene]).collect();
            candidate_bodies(folder, &inputs, &study, &sources)?
        }
        None => Vec::new(),
    };
    // No file appears before everything is done.
    OutputSlot::commit_all(table.into_iter().chain(reports).chain(bodies))?;
    let holds = |rounds: &Vec<ReferenceError>| rounds.last().is_none_or(ReferenceError::is_reference);
    let is_reference = nodal.is_some() || reference_errors.iter().all(holds);
    let passed = study.recommended.row().is_some() && is_reference && study.holds_in_stated_variations();
    let (text, json) = (facts.render(Format::Terminal), facts.render(Format::Json));
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed })
}

/// Returns the command that makes the recommended body; `None` if nothing is recommended.
fn command_of(arguments: &TradeArguments, study: &Trade, sources: &[Source]) -> Option<String> {
    let candidate = &study.rows[study.recommended.row()?].candidate;
    let origin = origin(&arguments.body, &arguments.job, &arguments.scene, &arguments.case);
    sources[candidate.source].command(candidate, &origin)
}

/// Writes the bodies of the measured candidates to files of `folder` that are named by their numbers. Refuses to
/// replace a file in `taken`.
fn candidate_bodies(
    folder: &Path,
    taken: &[&PathBuf],
    study: &Trade,
    sources: &[Source],
) -> Result<Vec<OutputSlot>> {
    let measured = study.rows.iter().enumerate().filter(|(_, row)| row.outcome.is_ok());
    let named = measured.map(|(at, row)| (candidate_path(folder, at), row));
    let named: Vec<(PathBuf, &TradeRow)> = named.collect();
    refuse_replacing(taken.iter().copied(), named.iter().map(|(path, _)| path))?;
    let written = named.into_iter().map(|(path, row)| {
        let slot = flexbody_file::prepare_output(path)?;
        flexbody_file::fill_slot(&row.candidate.body(&sources[row.candidate.source])?, &slot)?;
        Ok(slot)
    });
    written.collect()
}

/// Returns the path of the body of a row (from 0).
fn candidate_path(folder: &Path, row: usize) -> PathBuf {
    folder.join(format!("candidate_{:03}.flex.h5", row + 1))
}

/// Refuses options that a flex-body file does not support.
fn refuse_contradictions(arguments: &TradeArguments, is_model: bool) -> Result<()> {
    let message = match arguments {
        _ if is_model => return Ok(()),
        TradeArguments { reference: ReferenceChoice::Nodal, .. } => {
            "--reference nodal needs the matrices: give the model"
        }
        TradeArguments { reference: ReferenceChoice::Fine, .. } => {
            "--reference fine needs the matrices: give the model"
        }
        TradeArguments { modes: Some(_), .. } => "--modes applies to a model: give the model",
        _ => return Ok(()),
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

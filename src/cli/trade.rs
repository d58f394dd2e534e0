//! Command `flexbody trade`.

use super::arguments::TradeArguments;
use super::models::{is_model, origin};
use super::outcome::{Outcome, refuse_replacing};
use super::run::Run;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_report::{TradeFacts, trade_csv};
use flexbody_study::trade::{TradeRequest, TradeRow, TradeStudy};
use std::path::{Path, PathBuf};

pub(super) fn run(arguments: &TradeArguments) -> Result<Outcome> {
    let TradeArguments { body, scene, csv, .. } = arguments;
    let request = TradeRequest {
        modes: arguments.modes.map(|modes| modes as usize),
        repeat: arguments.repeat.into(),
        reference: arguments.reference,
        scene_file: Some(scene.clone()),
    };
    let is_model = is_model(body, &arguments.job)?;
    if !is_model {
        request.check_for_body()?;
    }
    let mut run = Run::begin(arguments.printing, [body, scene], csv, &arguments.report)?.with_progress();
    let table = csv.as_ref().map(OutputSlot::prepare).transpose()?;
    if let Some(folder) = &arguments.bodies {
        // A folder that cannot be written to is noticed before the study.
        flexbody_file::prepare_output(candidate_path(folder, 0))?;
    }
    let cases = run.read_cases(scene, arguments.case.as_deref())?.robust_if(arguments.robust);
    let study = if is_model {
        let (_, model) = run.read_model(body, &arguments.job)?;
        request.for_model(&model, &cases, || run.context(arguments.allow_long))?
    } else {
        let body = run.read_body(body)?;
        request.for_body(body, &cases, &run.context(arguments.allow_long))?
    };
    run.note(study.diagnostics());
    let data = run.data()?;
    let facts = TradeFacts::new(&study.trade, &study.reference_errors, &data);
    let facts = match study.command(&origin(body, &arguments.job, scene, &arguments.case)) {
        Some(command) => facts.with_command(command),
        None => facts,
    };
    if let Some(slot) = &table {
        slot.fill(trade_csv(&study.trade).as_bytes())?;
    }
    let inputs: Vec<&PathBuf> = csv.iter().chain(&arguments.report).chain([body, scene]).collect();
    let bodies = arguments.bodies.as_ref().map(|folder| candidate_bodies(folder, &inputs, &study));
    let files = table.into_iter().chain(bodies.transpose()?.into_iter().flatten());
    run.end(files, |format| facts.render(format), study.holds())
}

/// Writes the bodies of the measured candidates to files of `folder` that are named by their numbers. Refuses to
/// replace a file in `taken`.
fn candidate_bodies(folder: &Path, taken: &[&PathBuf], study: &TradeStudy) -> Result<Vec<OutputSlot>> {
    let measured = study.trade.rows.iter().enumerate().filter(|(_, row)| row.outcome.is_ok());
    let named = measured.map(|(at, row)| (candidate_path(folder, at), row));
    let named: Vec<(PathBuf, &TradeRow)> = named.collect();
    refuse_replacing(taken.iter().copied(), named.iter().map(|(path, _)| path))?;
    let written = named.into_iter().map(|(path, row)| {
        let slot = flexbody_file::prepare_output(path)?;
        flexbody_file::fill_slot(&row.candidate.body(&study.sources[row.candidate.source])?, &slot)?;
        Ok(slot)
    });
    written.collect()
}

/// Returns the path of the body of a row (from 0).
fn candidate_path(folder: &Path, row: usize) -> PathBuf {
    folder.join(format!("candidate_{:03}.flex.h5", row + 1))
}

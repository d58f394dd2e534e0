//! `flexbody select`.

use super::arguments::SelectArguments;
use super::output::{Outcome, tell};
use super::places::{format_of, refuse_replacing};
use super::resources::memory_left;
use super::watcher::Watcher;
use crate::error::Result;
use crate::output::OutputSlot;
use crate::report::{Format, RunData, SelectionFacts};
use crate::scene::read_scene;
use crate::selection::select;
use crate::store;

pub(super) fn run(arguments: &SelectArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    refuse_replacing([&arguments.body, &arguments.scene].into_iter(), arguments.report.iter())?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let scene = read_scene(&arguments.scene)?;
    let body = store::read(&arguments.body)?;
    let mut selection = select(&body, &scene, memory_left(None), &|event| watcher.hear(event))
        .map_err(|error| error.in_file(&arguments.scene))?;
    let diagnostics = std::mem::take(&mut selection.diagnostics);
    let run = RunData { phases: watcher.finish(), diagnostics, ..RunData::default() };
    tell(arguments.printing, &run.diagnostics);
    let facts = SelectionFacts::new(&selection, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    reports.into_iter().try_for_each(OutputSlot::commit)?;
    Ok(Outcome { text: facts.render(Format::Text), json: facts.render(Format::Json), passed: true })
}

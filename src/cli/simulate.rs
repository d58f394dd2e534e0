//! `flexbody simulate`.

use super::arguments::SimulateArguments;
use super::outcome::{Outcome, refuse_warnings};
use super::places::{format_of, refuse_replacing};
use super::resources::{memory_left, use_threads};
use super::watcher::Watcher;
use crate::base::error::Result;
use crate::base::output::OutputSlot;
use crate::base::progress::Event;
use crate::formats::flex_body_file;
use crate::motion::scene::{read_scene, simulate};
use crate::report::{Format, RunData, SimulationFacts, simulation_csv};

pub(super) fn run(arguments: &SimulateArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = || arguments.output.iter().chain(&arguments.csv).chain(&arguments.report);
    refuse_replacing([&arguments.body, &arguments.scene].into_iter(), outputs())?;
    let motion = arguments.output.as_ref().map(flex_body_file::prepare_output).transpose()?;
    let table = arguments.csv.as_ref().map(OutputSlot::prepare).transpose()?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let scene = read_scene(&arguments.scene)?;
    refuse_replacing(scene.series.iter().map(|file| &file.path), outputs())?;
    let (body, mut diagnostics) = flex_body_file::read_with_notes(&arguments.body)?;
    watcher.hear(Event::Phase("simulation"));
    let (recording, found) =
        simulate(&body, &scene, memory_left(None), |part| watcher.hear(Event::Fraction(part)))
            .map_err(|error| error.in_file(&arguments.scene))?;
    diagnostics.extend(found);
    let run = RunData { phases: watcher.finish(), diagnostics, threads, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let facts = SimulationFacts::new(&recording, body.units(), &run);

    if let Some(slot) = &motion {
        flex_body_file::fill_simulation(&recording, body.units(), slot)?;
    }
    if let Some(slot) = &table {
        slot.fill(simulation_csv(&recording).as_bytes())?;
    }
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    // Nothing appears before everything is done.
    OutputSlot::commit_all(motion.into_iter().chain(table).chain(reports))?;
    let (text, json) = (facts.render(Format::Text), facts.render(Format::Json));
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: true })
}

//! `flexbody simulate`.

use super::arguments::SimulateArguments;
use super::output::{Outcome, tell};
use super::places::{format_of, refuse_replacing};
use super::resources::{memory_left, use_threads};
use super::watcher::Watcher;
use crate::error::Result;
use crate::output::OutputSlot;
use crate::progress::Event;
use crate::report::{Format, RunData, SimulationFacts, simulation_csv};
use crate::scene::{read_scene, simulate};
use crate::store;

pub(super) fn run(arguments: &SimulateArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = || arguments.output.iter().chain(&arguments.csv).chain(&arguments.report);
    refuse_replacing([&arguments.body, &arguments.scene].into_iter(), outputs())?;
    let motion = arguments.output.as_ref().map(store::prepare_output).transpose()?;
    let table = arguments.csv.as_ref().map(OutputSlot::prepare).transpose()?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let scene = read_scene(&arguments.scene)?;
    let body = store::read(&arguments.body)?;
    watcher.hear(Event::Phase("simulation"));
    let (recording, diagnostics) =
        simulate(&body, &scene, memory_left(None), |part| watcher.hear(Event::Fraction(part)))
            .map_err(|error| error.in_file(&arguments.scene))?;
    let run = RunData { phases: watcher.finish(), diagnostics, threads, ..RunData::default() };
    tell(arguments.printing, &run.diagnostics);
    let facts = SimulationFacts::new(&recording, body.units(), &run);

    if let Some(slot) = &motion {
        store::fill_simulation(&recording, body.units(), slot)?;
    }
    if let Some(slot) = &table {
        slot.fill(simulation_csv(&recording).as_bytes())?;
    }
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    // Nothing appears before everything is done.
    OutputSlot::commit_all(motion.into_iter().chain(table).chain(reports))?;
    Ok(Outcome { text: facts.render(Format::Text), json: facts.render(Format::Json), passed: true })
}

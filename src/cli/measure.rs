//! Command `flexbody measure`.

use super::arguments::{JobArguments, MeasureArguments};
use super::models::read_checked;
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_warnings};
use super::resources::context;
use super::terminal::Watcher;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_linalg::context::Event;
use flexbody_motion::scene::{LoadCases, MotionHistory};
use flexbody_report::{Format, MeasuredRunFacts, RunData};
use flexbody_study::measured_run::measured_run;

pub(super) fn run(arguments: &MeasureArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let read = [&arguments.body, &arguments.scene, &arguments.history].into_iter();
    refuse_replacing(read.chain(&arguments.reference).chain(&arguments.model), arguments.report.iter())?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let cases = LoadCases::read(&arguments.scene, arguments.case.as_deref())?;
    let scene = cases.single()?;
    let (body, mut diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let history = MotionHistory::read(&arguments.history, body.n_modes())?;
    let reference = match arguments.reference.as_ref().zip(arguments.model.as_ref()) {
        Some((reference, model)) => {
            let (whole, notes) = flexbody_file::read_with_notes(reference)?;
            let (_, checked) = read_checked(model, &JobArguments::default(), arguments.report.iter())?;
            diagnostics.extend(notes);
            diagnostics.extend(checked.diagnostics);
            Some((whole, checked.model))
        }
        None => None,
    };
    let watch = |event: Event<'_>| watcher.hear(event);
    let reference = reference.as_ref().map(|(whole, model)| (whole, model));
    let (measured, found) = measured_run(&body, history, scene, reference, &context(None, false, &watch))
        .map_err(|error| error.in_file(&arguments.scene))?;
    diagnostics.extend(found);
    let run = RunData { phases: watcher.finish(), diagnostics, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let history = arguments.history.display().to_string();
    let facts = MeasuredRunFacts::new(&measured, &body.source().name, history, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    OutputSlot::commit_all(reports)?;
    let (text, json) = (facts.render(Format::Terminal), facts.render(Format::Json));
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: measured.holds() })
}

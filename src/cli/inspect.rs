//! Command `flexbody inspect`.

use super::arguments::InspectArguments;
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_warnings};
use super::terminal::body_text;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_report::{Facts, Format, RunData, render};

pub(super) fn run(arguments: &InspectArguments) -> Result<Outcome> {
    if arguments.structure {
        let structure = format!("{:#}", flexbody_file::structure(&arguments.body)?);
        return Ok(Outcome {
            text: structure.clone(),
            json: structure,
            diagnostics: Vec::new(),
            passed: true,
        });
    }
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    refuse_replacing(std::iter::once(&arguments.body), arguments.report.iter())?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let (body, diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let facts = Facts::new(&body, &RunData::default());
    if !reports.is_empty() {
        refuse_warnings(arguments.printing, &diagnostics)?;
        // A report also contains the diagnostics of the file.
        let found = RunData { diagnostics: diagnostics.clone(), ..RunData::default() };
        let facts = Facts::new(&body, &found);
        for (slot, format) in reports.iter().zip(formats) {
            slot.fill(render(&facts, format).as_bytes())?;
        }
        OutputSlot::commit_all(reports)?;
    }
    let text = body_text(&facts, arguments.verbose, arguments.printing);
    let json = render(&facts, Format::Json);
    Ok(Outcome { text, json, diagnostics, passed: true })
}

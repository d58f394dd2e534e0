//! Command `flexbody inspect`.

use super::arguments::InspectArguments;
use super::outcome::Outcome;
use super::run::{Printed, Run};
use super::terminal::body_text;
use flexbody_base::error::Result;
use flexbody_report::{Facts, Format, RunData, render};

pub(super) fn run(arguments: &InspectArguments) -> Result<Outcome> {
    let InspectArguments { body, report, .. } = arguments;
    if arguments.structure {
        let structure = format!("{:#}", flexbody_file::structure(body)?);
        let (text, json) = (structure.clone(), structure);
        return Ok(Outcome { text, json, diagnostics: Vec::new(), passed: true });
    }
    let mut run = Run::begin(arguments.printing, [body], None, report)?;
    let body = run.read_body(body)?;
    let facts = Facts::new(&body, &RunData::default());
    // A report also contains the diagnostics of the file.
    let data = if report.is_empty() { RunData::default() } else { run.data()? };
    let text = body_text(&facts, arguments.verbose, arguments.printing);
    let printed = Printed { text, json: render(&facts, Format::Json) };
    run.end_with(None, |format| render(&Facts::new(&body, &data), format), printed, true)
}

//! Command `flexbody convert --from`: converts a body in a file of another program.

use super::arguments::ConvertArguments;
use super::outcome::{Outcome, refuse_warnings};
use super::places::{format_of, refuse_replacing};
use super::terminal::body_text;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_formats::{find_import_format, import_file};
use flexbody_input::parse_units;
use flexbody_report::{Facts, Format, RunData, render};

pub(super) fn run(arguments: &ConvertArguments, from: &str) -> Result<Outcome> {
    find_import_format(from)?;
    let Some(path) = &arguments.model else {
        let message = format!("--from {from} needs the path of the file to convert");
        return Err(Diagnostic::new(Code::Usage, message).into());
    };
    let units = arguments.job.units.as_deref().map(parse_units).transpose()?;
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = std::iter::once(&arguments.output).chain(&arguments.report);
    refuse_replacing(std::iter::once(path), outputs)?;
    let slot = flexbody_file::prepare_output(&arguments.output)?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;

    let imported = import_file(path, from, units, arguments.frame.as_ref(), arguments.storage)?;
    refuse_warnings(arguments.printing, &imported.diagnostics)?;
    flexbody_file::fill_slot(&imported.body, &slot)?;
    let run = RunData { diagnostics: imported.diagnostics, ..RunData::default() };
    let facts = Facts::new(&imported.body, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(render(&facts, format).as_bytes())?;
    }
    OutputSlot::commit_all(std::iter::once(slot).chain(reports))?;
    let text = body_text(&facts, arguments.verbose, arguments.printing);
    let json = render(&facts, Format::Json);
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: true })
}

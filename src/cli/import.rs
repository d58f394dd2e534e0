//! Command `flexbody convert --from`: converts a body in a file of another program.

use super::arguments::ConvertArguments;
use super::outcome::{Outcome, refuse_warnings};
use super::places::{format_of, refuse_replacing};
use super::terminal::body_text;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_body::flex_body::Storage;
use flexbody_formats::find_import_format;
use flexbody_formats::import::{accept_imported, import_body};
use flexbody_input::parse_units;
use flexbody_report::{Facts, Format, RunData, render};

pub(super) fn run(arguments: &ConvertArguments, from: &str) -> Result<Outcome> {
    let format = find_import_format(from)?;
    let Some(path) = &arguments.model else {
        let message = format!("--from {from} needs the path of the file to convert");
        return Err(Diagnostic::new(Code::Usage, message).into());
    };
    let units = arguments.job.units.as_deref().map(parse_units).transpose()?.unwrap_or_default();
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = std::iter::once(&arguments.output).chain(&arguments.report);
    refuse_replacing(std::iter::once(path), outputs)?;
    let slot = flexbody_file::prepare_output(&arguments.output)?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;

    let file = InputFile::open(path)?;
    let read = format.read(&file);
    file.refuse_changed()?;
    let source = SourceFile::new("body", path, file.sha256()?);
    let mut imported =
        import_body(&read?, source, units, arguments.frame.as_ref()).map_err(|error| error.in_file(path))?;
    if arguments.storage == Storage::F32 {
        imported.body = imported.body.rounded_to_f32()?;
    }
    accept_imported(&imported).map_err(|error| error.in_file(path))?;
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

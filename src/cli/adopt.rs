//! `flexbody convert --from`: a body of another program's file.

use super::arguments::{ConvertArguments, StorageName};
use super::output::{Outcome, tell};
use super::places::{format_of, refuse_replacing};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::foreign::{adopt, find_foreign};
use crate::input::{InputFile, parse_units};
use crate::output::OutputSlot;
use crate::provenance::SourceFile;
use crate::report::{Facts, Format, RunData, render};
use crate::store;

pub(super) fn run(arguments: &ConvertArguments, from: &str) -> Result<Outcome> {
    let format = find_foreign(from)?;
    let Some(path) = &arguments.model else {
        let message = format!("--from {from} needs the file to convert");
        return Err(Diagnostic::new(Code::Usage, message).into());
    };
    let units = arguments.units.as_deref().map(parse_units).transpose()?.unwrap_or_default();
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = std::iter::once(&arguments.output).chain(&arguments.report);
    refuse_replacing(std::iter::once(path), outputs)?;
    let slot = store::prepare_output(&arguments.output)?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;

    let file = InputFile::open(path)?;
    let source = SourceFile::new("body", path, file.sha256());
    let mut adopted = adopt(&format.read(&file)?, source, units).map_err(|error| error.in_file(path))?;
    if arguments.storage == StorageName::F32 {
        adopted.body = adopted.body.rounded_to_f32()?;
    }
    tell(arguments.printing, &adopted.diagnostics);
    store::fill_slot(&adopted.body, &slot)?;
    let run = RunData { diagnostics: adopted.diagnostics, ..RunData::default() };
    let facts = Facts::new(&adopted.body, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(render(&facts, format).as_bytes())?;
    }
    OutputSlot::commit_all(std::iter::once(slot).chain(reports))?;
    Ok(Outcome { text: render(&facts, Format::Text), json: render(&facts, Format::Json), passed: true })
}

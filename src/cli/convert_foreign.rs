//! Option `--from` of `flexbody convert`: converts a body in a file of another program.

use super::arguments::ConvertArguments;
use super::outcome::Outcome;
use super::run::{Printed, Run};
use super::terminal::body_text;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_formats::{find_import_format, import_file};
use flexbody_input::parse_units;
use flexbody_report::{Facts, Format, render};

pub(super) fn convert_foreign(arguments: &ConvertArguments, from: &str) -> Result<Outcome> {
    find_import_format(from)?;
    let Some(path) = &arguments.model else {
        let message = format!("--from {from} needs the path of the file to convert");
        return Err(Diagnostic::new(Code::Usage, message).into());
    };
    let units = arguments.job.units.as_deref().map(parse_units).transpose()?;
    let mut run = Run::begin(arguments.printing, [path], [&arguments.output], &arguments.report)?;
    let slot = flexbody_file::prepare_output(&arguments.output)?;
    let imported = import_file(path, from, units, arguments.frame.as_ref(), arguments.storage)?;
    run.note(imported.diagnostics);
    let data = run.data()?;
    flexbody_file::fill_slot(&imported.body, &slot)?;
    let facts = Facts::new(&imported.body, &data);
    let text = body_text(&facts, arguments.verbose, arguments.printing);
    let printed = Printed { text, json: render(&facts, Format::Json) };
    run.end_with([slot], |format| render(&facts, format), printed, true)
}

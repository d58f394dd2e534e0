//! `flexbody audit`.

use super::arguments::AuditArguments;
use super::outcome::Outcome;
use crate::base::error::Result;
use crate::formats::import::audit;
use crate::formats::{find_import_format, recognise};
use crate::input::InputFile;
use crate::report::{audit_json, audit_text};

pub(super) fn run(arguments: &AuditArguments) -> Result<Outcome> {
    let asked = arguments.from.as_deref().map(find_import_format).transpose()?;
    let file = InputFile::open(&arguments.file)?;
    let format = asked.map_or_else(|| recognise(&file), Ok)?;
    let found = audit(&format.read(&file)?, arguments.tolerance);
    let name = arguments.file.display().to_string();
    Ok(Outcome {
        text: audit_text(&name, &found),
        json: format!("{:#}", audit_json(&name, &found)),
        diagnostics: Vec::new(),
        passed: found.passed(),
    })
}

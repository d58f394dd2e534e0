//! Command `flexbody audit`.

use super::arguments::AuditArguments;
use super::outcome::Outcome;
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;
use flexbody_formats::import::audit;
use flexbody_formats::{find_import_format, recognise};
use flexbody_report::{audit_json, audit_text};

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

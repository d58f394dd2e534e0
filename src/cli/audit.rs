//! Command `flexbody audit`.

use super::arguments::AuditArguments;
use super::outcome::Outcome;
use flexbody_base::error::Result;
use flexbody_formats::audit_file;
use flexbody_report::{audit_json, audit_text};

pub(super) fn run(arguments: &AuditArguments) -> Result<Outcome> {
    let found = audit_file(&arguments.file, arguments.from.as_deref(), arguments.tolerance)?;
    let name = arguments.file.display().to_string();
    Ok(Outcome {
        text: audit_text(&name, &found),
        json: format!("{:#}", audit_json(&name, &found)),
        diagnostics: Vec::new(),
        passed: found.passed(),
    })
}

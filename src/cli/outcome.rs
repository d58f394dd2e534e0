//! Outcome of a command.

use super::arguments::Printing;
use flexbody_base::diagnostic::{Code, Diagnostic, Severity};
use flexbody_base::error::{Error, Result};

/// Outcome of a command: text for stdout, its content as JSON, warnings and notes, and whether its checks passed.
pub(super) struct Outcome {
    pub text: String,
    /// Member `results` of the object that `--json` prints.
    pub json: String,
    pub diagnostics: Vec<Diagnostic>,
    pub passed: bool,
}

/// Returns the warnings among diagnostics.
pub(super) fn warnings(diagnostics: &[Diagnostic]) -> impl Iterator<Item = &Diagnostic> {
    diagnostics.iter().filter(|diagnostic| diagnostic.severity() == Severity::Warning)
}

/// Ends a command before it writes, if `--deny-warnings` is set and there is a warning.
///
/// # Errors
/// All `diagnostics`, with [`WarningsDenied`](Code::WarningsDenied).
pub(super) fn refuse_warnings(printing: Printing, diagnostics: &[Diagnostic]) -> Result<()> {
    let mut codes: Vec<&str> = warnings(diagnostics).map(|warning| warning.code().id()).collect();
    if !printing.deny_warnings || codes.is_empty() {
        return Ok(());
    }
    codes.dedup();
    let message = format!("no file was written because of --deny-warnings and {}", codes.join(", "));
    Err(Error::from(Diagnostic::new(Code::WarningsDenied, message)).after(diagnostics.to_vec()))
}

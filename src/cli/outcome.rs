//! What a command comes back with.

use super::arguments::Printing;
use flexbody_base::diagnostic::{Code, Diagnostic, Severity};
use flexbody_base::error::{Error, Result};

/// What a command found: text for stdout, the same as JSON, warnings and notes, and whether its checks
/// passed.
pub(super) struct Outcome {
    pub text: String,
    /// The `results` of the object that `--json` prints.
    pub json: String,
    pub diagnostics: Vec<Diagnostic>,
    pub passed: bool,
}

/// The warnings among diagnostics.
pub(super) fn warnings(diagnostics: &[Diagnostic]) -> impl Iterator<Item = &Diagnostic> {
    diagnostics.iter().filter(|diagnostic| diagnostic.severity() == Severity::Warning)
}

/// Ends a command that is about to write, where a warning is to count as an error.
///
/// # Errors
/// All `diagnostics`, with [`WarningsDenied`](Code::WarningsDenied).
pub(super) fn refuse_warnings(printing: Printing, diagnostics: &[Diagnostic]) -> Result<()> {
    let mut codes: Vec<&str> = warnings(diagnostics).map(|warning| warning.code().id()).collect();
    if !printing.deny_warnings || codes.is_empty() {
        return Ok(());
    }
    codes.dedup();
    let message = format!("nothing is written: --deny-warnings, and there is {}", codes.join(", "));
    Err(Error::from(Diagnostic::new(Code::WarningsDenied, message)).after(diagnostics.to_vec()))
}

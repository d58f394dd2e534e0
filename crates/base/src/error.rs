//! The error type: one or more diagnostics, at least one of them an error, and the exit code they lead to.

use crate::diagnostic::{Code, Diagnostic, Severity};

pub use crate::exit_code::ExitCode;

/// A failed operation: every diagnostic collected until it had to stop.
#[derive(Debug, Clone, PartialEq)]
pub struct Error {
    diagnostics: Vec<Diagnostic>,
}

/// Result of every fallible function of this library.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error of all `diagnostics` (warnings among them are kept, in order).
    ///
    /// # Panics
    /// When none of them is an error: that is a bug of the caller.
    pub fn new(diagnostics: Vec<Diagnostic>) -> Self {
        assert!(
            diagnostics.iter().any(|d| d.severity() == Severity::Error),
            "an Error needs at least one diagnostic of severity error"
        );
        Self { diagnostics }
    }

    /// The diagnostics, in the order in which they were found.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Gives the diagnostics away.
    pub fn into_diagnostics(self) -> Vec<Diagnostic> {
        self.diagnostics
    }

    /// The same after what was found before it: warnings and notes that are told with it.
    pub fn after(self, earlier: Vec<Diagnostic>) -> Self {
        Self { diagnostics: earlier.into_iter().chain(self.diagnostics).collect() }
    }

    /// Puts what it is about in front of every message.
    pub fn about(self, what: impl std::fmt::Display) -> Self {
        Self { diagnostics: self.diagnostics.into_iter().map(|d| d.about(&what)).collect() }
    }

    /// Adds the file that every message is about.
    pub fn in_file(self, file: impl AsRef<std::path::Path>) -> Self {
        Self { diagnostics: self.diagnostics.into_iter().map(|d| d.in_file(&file)).collect() }
    }

    /// The exit code of the first error.
    pub fn exit_code(&self) -> ExitCode {
        self.first_error().code().exit_code()
    }

    /// Whether one of the diagnostics has this code.
    pub fn has(&self, code: Code) -> bool {
        self.diagnostics.iter().any(|d| d.code() == code)
    }

    /// The first diagnostic of severity error: the cause of the failure, whatever was noted before it.
    pub fn first_error(&self) -> &Diagnostic {
        self.diagnostics.iter().find(|d| d.severity() == Severity::Error).expect("checked at construction")
    }
}

impl From<Diagnostic> for Error {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::new(vec![diagnostic])
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, d) in self.diagnostics.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{d}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

/// Ends a stage of checks: an error of all that was found, when an error is among it.
///
/// # Errors
/// All diagnostics, taken out of `found`.
pub fn stop_on_error(found: &mut Vec<Diagnostic>) -> Result<()> {
    if found.iter().any(|d| d.severity() == Severity::Error) {
        return Err(Error::new(std::mem::take(found)));
    }
    Ok(())
}

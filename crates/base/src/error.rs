//! Error type: one or more diagnostics, at least one of severity error, and their exit code.

use crate::diagnostic::{Code, Diagnostic, Severity};

pub use crate::exit_code::ExitCode;

/// Failed operation, with all diagnostics collected until it stopped.
#[derive(Debug, Clone, PartialEq)]
pub struct Error {
    diagnostics: Vec<Diagnostic>,
}

/// Result of every fallible function of this library.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Creates an error from `diagnostics`. Warnings and notes among them are kept, in order.
    ///
    /// # Panics
    /// If none of the diagnostics is an error, which is a bug of the caller.
    pub fn new(diagnostics: Vec<Diagnostic>) -> Self {
        assert!(
            diagnostics.iter().any(|d| d.severity() == Severity::Error),
            "an Error needs at least one diagnostic of severity error"
        );
        Self { diagnostics }
    }

    /// Returns the diagnostics, in the order in which they were found.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Returns the diagnostics by value.
    pub fn into_diagnostics(self) -> Vec<Diagnostic> {
        self.diagnostics
    }

    /// Prepends warnings and notes that were found earlier.
    pub fn after(self, earlier: Vec<Diagnostic>) -> Self {
        Self { diagnostics: earlier.into_iter().chain(self.diagnostics).collect() }
    }

    /// Prefixes every message with its subject.
    pub fn about(self, what: impl std::fmt::Display) -> Self {
        Self { diagnostics: self.diagnostics.into_iter().map(|d| d.about(&what)).collect() }
    }

    /// Adds the file to every diagnostic that names none.
    pub fn in_file(self, file: impl AsRef<std::path::Path>) -> Self {
        let located = |d: Diagnostic| if d.file().is_none() { d.in_file(&file) } else { d };
        Self { diagnostics: self.diagnostics.into_iter().map(located).collect() }
    }

    /// Returns the exit code of the first error.
    pub fn exit_code(&self) -> ExitCode {
        self.first_error().code().exit_code()
    }

    /// Returns true if one of the diagnostics has this code.
    pub fn has(&self, code: Code) -> bool {
        self.diagnostics.iter().any(|d| d.code() == code)
    }

    /// Returns the first diagnostic of severity error, which is the cause of the failure.
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

/// Ends a stage of checks: returns an error with all diagnostics in `found` if one of them is an error.
///
/// # Errors
/// All diagnostics, which are removed from `found`.
pub fn stop_on_error(diagnostics: &mut Vec<Diagnostic>) -> Result<()> {
    if diagnostics.iter().any(|d| d.severity() == Severity::Error) {
        return Err(Error::new(std::mem::take(diagnostics)));
    }
    Ok(())
}

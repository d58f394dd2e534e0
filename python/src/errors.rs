//! Diagnostics of the library in Python: exceptions, warnings, and tuples of diagnostics.

use crate::types::Diagnostics;
use flexbody::{Code, Diagnostic, Error, Severity};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Module with the classes of exceptions and diagnostics.
const ERRORS: &str = "flexbody._errors";

/// Returns the exception for an error of the library. Its class follows from the exit code; it has all diagnostics.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let code = error.exit_code() as u8;
    let made = diagnostics(py, error.diagnostics())
        .and_then(|found| py.import(ERRORS)?.getattr("error_of")?.call1((code, found)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(failure) => failure,
    }
}

/// Returns the exception for an argument whose value is not possible: an InputError.
pub fn value_error(py: Python<'_>, message: impl Into<String>) -> PyErr {
    exception(py, &Diagnostic::new(Code::Argument, message).into())
}

/// Returns the exception for an argument of a wrong type: an ArgumentError, which is an InputError and a TypeError.
pub fn type_error(py: Python<'_>, message: impl Into<String>) -> PyErr {
    let made = diagnostics(py, &[Diagnostic::new(Code::Argument, message)])
        .and_then(|found| py.import(ERRORS)?.getattr("ArgumentError")?.call1((found, 2)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(failure) => failure,
    }
}

/// Returns a value, or the exception for an error of the library.
pub fn value<T>(py: Python<'_>, outcome: flexbody::Result<T>) -> PyResult<T> {
    outcome.map_err(|error| exception(py, &error))
}

/// Returns the exception for an internal error of the library.
pub fn bug(py: Python<'_>) -> PyErr {
    let message = "an internal check of the library failed";
    exception(py, &Diagnostic::new(Code::Internal, message).into())
}

/// Returns diagnostics as a tuple of `flexbody.Diagnostic`.
pub fn diagnostics<'py>(py: Python<'py>, found: &[Diagnostic]) -> PyResult<Diagnostics<'py>> {
    let class = py.import(ERRORS)?.getattr("Diagnostic")?;
    let one = |diagnostic: &Diagnostic| {
        class.call1((
            diagnostic.code().id(),
            diagnostic.severity().name(),
            diagnostic.message(),
            diagnostic.file().map(|file| file.display().to_string()),
            diagnostic.line(),
            diagnostic.help(),
        ))
    };
    PyTuple::new(py, found.iter().map(one).collect::<PyResult<Vec<_>>>()?)
}

/// Diagnostic as a pickle has it: code, severity, message, file, line, help.
pub type PickledDiagnostic = (String, String, String, Option<String>, Option<usize>, String);

/// Returns a diagnostic of a pickle; `None` for a code that this version does not know.
pub fn restored_diagnostic(found: PickledDiagnostic) -> Option<Diagnostic> {
    let (id, _, message, file, line, help) = found;
    let code = Code::ALL.iter().find(|code| code.id() == id)?;
    let mut made = Diagnostic::new(*code, message).with_help(help);
    if let Some(file) = file {
        made = made.in_file(file);
    }
    Some(match line {
        Some(line) => made.at_line(line),
        None => made,
    })
}

/// Issues the warnings among `found` on behalf of the calling Python code. Returns an error if the user has turned
/// warnings into errors.
pub fn warn(py: Python<'_>, found: &[Diagnostic]) -> PyResult<()> {
    let warnings: Vec<Diagnostic> =
        found.iter().filter(|one| one.severity() == Severity::Warning).cloned().collect();
    if warnings.is_empty() {
        return Ok(());
    }
    let class = py.import(ERRORS)?.getattr("FlexbodyWarning")?;
    let tell = py.import(ERRORS)?.getattr("warn")?;
    for diagnostic in diagnostics(py, &warnings)?.iter() {
        tell.call1((class.call1((diagnostic,))?,))?;
    }
    Ok(())
}

//! Diagnostics of the library as Python sees them: exceptions, warnings, and tuples of both.

use flexbody::{Diagnostic, Error, Severity};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Where the classes of exceptions and diagnostics are defined.
const ERRORS: &str = "flexbody._errors";

/// The exception for an error of the library: its class goes by the exit code, its diagnostics are all.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let code = error.exit_code() as u8;
    let made = diagnostics(py, error.diagnostics())
        .and_then(|found| py.import(ERRORS)?.getattr("error_of")?.call1((code, found)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(failure) => failure,
    }
}

/// The exception for a contradiction of the library's own.
pub fn bug(py: Python<'_>) -> PyErr {
    let message = "the library stopped at a contradiction of its own";
    exception(py, &Diagnostic::new(flexbody::Code::Internal, message).into())
}

/// Diagnostics as a tuple of `flexbody.Diagnostic`.
pub fn diagnostics<'py>(py: Python<'py>, found: &[Diagnostic]) -> PyResult<Bound<'py, PyTuple>> {
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

/// Warns of the warnings among `found`, in the name of the Python code that called. An error where the user
/// made warnings errors.
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

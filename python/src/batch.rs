//! Bodies of a list.

use crate::arguments::{Argument, count, path};
use crate::errors::diagnostics;
use crate::report::report;
use crate::types::{Diagnostics, JsonRows};
use crate::work::run;
use flexbody::BatchOptions;
use pyo3::prelude::*;
use std::ffi::OsString;

/// Bodies of a list, made by the command `flexbody`, each in a process of its own.
#[pyclass(frozen, module = "flexbody")]
pub struct Batch {
    inner: flexbody::Batch,
}

/// Makes the bodies of a list (docs/how_to/batch.md) that are missing or have changed inputs, as many in parallel as fit
/// into the memory, like `flexbody batch`. A failed body does not end the batch.
///
/// `memory_limit` limits the memory of all of them in bytes; without one it is the free memory. `allow_programs` lets the
/// options of the list name programs to start. Raises InputError for a list that cannot be read.
#[pyfunction]
#[pyo3(signature = (path: "_Path", *, memory_limit: "int | None" = None, allow_programs=false))]
pub fn batch(
    py: Python<'_>,
    path: &Bound<'_, PyAny>,
    memory_limit: Argument<'_, '_>,
    allow_programs: bool,
) -> PyResult<Batch> {
    let list = self::path(path, "path")?;
    let mut options = BatchOptions::default().program(words_of_the_command(py)?);
    if let Some(limit) = memory_limit {
        options = options.memory_limit(count(limit, "memory_limit")? as u64);
    }
    if allow_programs {
        options = options.allow_programs();
    }
    let inner = run(py, move |listener| flexbody::Batch::run(&list, &options, listener))?;
    Ok(Batch { inner })
}

/// Returns the words that start the command `flexbody` of this package in another process.
pub fn words_of_the_command(py: Python<'_>) -> PyResult<Vec<OsString>> {
    py.import("flexbody._command")?.getattr("words")?.call0()?.extract()
}

#[pymethods]
impl Batch {
    /// Bodies, each as a dict with the properties from `flexbody batch`: output, state ("done", "unchanged", "failed"),
    /// error, modes, frequencies_hz, seconds and others.
    #[getter]
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<JsonRows<'py>> {
        report(py, None, |format| self.inner.report(format))?.get_item("bodies")
    }

    /// Number of failed bodies.
    #[getter]
    fn failed(&self) -> usize {
        self.inner.failed()
    }

    /// The error about failed bodies (FB771), as a tuple of `Diagnostic`; empty if all were made.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, &self.inner.diagnostics())
    }

    /// Returns the report of `flexbody batch`: a dict with all numbers, or "json", "text", "html" as a str.
    #[pyo3(
        signature = (
            form: "Literal['dict']; Literal['json', 'text', 'html']" = None,
        ) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, form, |format| self.inner.report(format))
    }

    fn __repr__(&self) -> String {
        format!("<flexbody.Batch: {} of {} bodies failed>", self.inner.failed(), self.inner.bodies().len())
    }
}

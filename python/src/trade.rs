//! The cost of accuracy in a scene.

use crate::arguments::{Argument, count, path, positive};
use crate::body_class::Body;
use crate::choice::called;
use crate::errors::{diagnostics, value, warn};
use crate::report::report;
use crate::types::{Diagnostics, JsonRows};
use flexbody::{ReferenceChoice, TradeOptions};
use pyo3::prelude::*;

/// Candidate bodies for a scene, measured against a reference, and the best of them.
#[pyclass(frozen, module = "flexbody")]
pub struct Trade {
    inner: flexbody::Trade,
}

/// Returns the options of a study; `reference` is `full`, `fine` or `nodal`.
pub fn options(
    modes: Argument<'_, '_>,
    repeat: Argument<'_, '_>,
    reference: Argument<'_, '_>,
) -> PyResult<TradeOptions> {
    let mut options = TradeOptions::default();
    if let Some(given) = modes {
        options = options.modes(positive(given, "modes")?);
    }
    if let Some(given) = repeat {
        options = options.repeat(positive(given, "repeat")?);
    }
    if let Some(given) = reference {
        options = options.reference(called("reference", given, ReferenceChoice::ALL, ReferenceChoice::name)?);
    }
    Ok(options)
}

impl Trade {
    pub fn with_warnings(py: Python<'_>, inner: flexbody::Trade) -> PyResult<Self> {
        warn(py, inner.diagnostics())?;
        Ok(Self { inner })
    }
}

#[pymethods]
impl Trade {
    /// Candidates, each as a dict with the properties from `flexbody trade`: source, kind, modes, groups, errors, worst
    /// error over its tolerance, multiplications, bytes, seconds. The first candidate is the reference.
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<JsonRows<'py>> {
        report(py, None, |format| self.inner.report(format))?.get_item("rows")
    }

    /// Index of the recommended candidate, from 0; None if no candidate keeps the tolerances at an allowed cost.
    #[getter]
    fn recommended(&self) -> Option<usize> {
        self.inner.recommended()
    }

    /// Indices of the candidates, from 0, for which no other candidate is cheaper and as accurate, ascending in cost.
    #[getter]
    fn front(&self) -> Vec<usize> {
        self.inner.front().to_vec()
    }

    /// True if there is a recommended candidate and the reference can be trusted.
    #[getter]
    fn holds(&self) -> bool {
        self.inner.holds()
    }

    /// Warnings and notes, as a tuple of `Diagnostic`.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, self.inner.diagnostics())
    }

    /// Returns the body of a candidate, counted from 0.
    #[pyo3(signature = (candidate: "int"))]
    fn body(&self, py: Python<'_>, candidate: &Bound<'_, PyAny>) -> PyResult<Body> {
        let body = value(py, self.inner.body(count(candidate, "candidate")?))?;
        Ok(Body::new(body, Vec::new()))
    }

    /// Returns the command that makes exactly the recommended candidate from the files of the study: the model or the
    /// body, and the scene. None if no candidate is recommended.
    #[pyo3(signature = (input: "_Path", scene: "_Path"))]
    fn command(&self, input: &Bound<'_, PyAny>, scene: &Bound<'_, PyAny>) -> PyResult<Option<String>> {
        let [input, scene] =
            [path(input, "input")?, path(scene, "scene")?].map(|path| path.display().to_string());
        Ok(self.inner.command(&input, &scene))
    }

    /// Returns the report of `flexbody trade`: a dict with all numbers, or "json", "text", "html" as a str.
    #[pyo3(
        signature = (
            form: "Literal['dict']; Literal['json', 'text', 'html']" = None,
        ) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, form, |format| self.inner.report(format))
    }

    /// Returns the table of `flexbody trade --csv`, as a str.
    fn csv(&self) -> String {
        self.inner.csv()
    }

    fn __repr__(&self) -> String {
        let taken = self.inner.recommended().map_or_else(|| "none".to_owned(), |row| row.to_string());
        format!("<flexbody.Trade: {} candidates, recommended {taken}>", self.inner.candidates())
    }
}

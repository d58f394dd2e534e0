//! Reports in the forms that Python requests.

use crate::choice::called;
use flexbody::ReportFormat;
use pyo3::prelude::*;

/// Returns a report as a dict of its JSON, or as a text in one of its formats.
pub fn report<'py>(
    py: Python<'py>,
    form: &str,
    render: impl FnOnce(ReportFormat) -> String,
) -> PyResult<Bound<'py, PyAny>> {
    let forms = [
        ("dict", ReportFormat::Json),
        ("json", ReportFormat::Json),
        ("text", ReportFormat::Text),
        ("html", ReportFormat::Html),
    ];
    let text = render(called("form", form, forms, |(name, _)| name)?.1);
    if form == "dict" {
        return loads(py, &text);
    }
    Ok(text.into_pyobject(py)?.into_any())
}

/// Returns a JSON text as Python objects.
pub fn loads<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}

//! Reports in the forms that Python requests.

use crate::arguments::Argument;
use crate::choice::called;
use flexbody::ReportFormat;
use pyo3::prelude::*;

/// Forms of a report as the format that it is made of.
const FORMS: [(&str, ReportFormat); 4] = [
    ("dict", ReportFormat::Json),
    ("json", ReportFormat::Json),
    ("text", ReportFormat::Text),
    ("html", ReportFormat::Html),
];

/// Returns a report as a dict of its JSON, or as a text in one of its formats.
pub fn report<'py>(
    py: Python<'py>,
    form: Argument<'_, 'py>,
    render: impl FnOnce(ReportFormat) -> String,
) -> PyResult<Bound<'py, PyAny>> {
    report_in(py, form, &FORMS, render)
}

/// Returns a report in one of `forms`, the first of which is that of a dict of JSON and the default.
pub fn report_in<'py, F: Copy>(
    py: Python<'py>,
    form: Argument<'_, 'py>,
    forms: &[(&'static str, F)],
    render: impl FnOnce(F) -> String,
) -> PyResult<Bound<'py, PyAny>> {
    let (name, format) = match form {
        Some(form) => called("form", form, forms, |(name, _)| name)?,
        None => forms[0],
    };
    let text = render(format);
    if name == "dict" {
        return loads(py, &text);
    }
    Ok(text.into_pyobject(py)?.into_any())
}

/// Returns a JSON text as Python objects.
pub fn loads<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}

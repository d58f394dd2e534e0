//! Checks of bodies, comparisons, and audits of files of other programs.

use crate::arguments::{Argument, path, positive, real, text};
use crate::body_arguments::recorded;
use crate::errors::{diagnostics, exception, value, value_error};
use crate::report::report_in;
use crate::types::{ComparisonRowTuple, Diagnostics, IdentityTuple};
use crate::work::{alone, run};
use flexbody::{Code, ComparisonFormat, Diagnostic, FlexBody, Tolerances};
use pyo3::prelude::*;
use std::sync::Arc;

/// Forms of a report that has no page.
const WITHOUT_PAGE: [(&str, bool); 3] = [("dict", true), ("json", true), ("text", false)];

/// Checks of a body: every identity and, against its model, every invariant and every mode.
#[pyclass(frozen, module = "flexbody")]
pub struct Check {
    pub inner: flexbody::Check,
}

/// Returns identities as a list of `flexbody.Identity`.
pub fn identities<'py>(py: Python<'py>, all: &[flexbody::Identity]) -> PyResult<Vec<IdentityTuple<'py>>> {
    let class = py.import("flexbody._types")?.getattr("Identity")?;
    all.iter()
        .map(|variation| class.call1((variation.name, variation.value, variation.limit, variation.holds)))
        .collect()
}

#[pymethods]
impl Check {
    /// True if every check passed.
    #[getter]
    fn passed(&self) -> bool {
        self.inner.passed()
    }

    /// All checks: list of Identity (name, value, limit, holds).
    #[getter]
    fn identities<'py>(&self, py: Python<'py>) -> PyResult<Vec<IdentityTuple<'py>>> {
        identities(py, &self.inner.identities())
    }

    /// Warnings and notes, as a tuple of `Diagnostic`.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, self.inner.diagnostics())
    }

    /// Returns the report of `flexbody check`: a dict with all numbers, or "json", "text" as a str.
    #[pyo3(
        signature = (form: "Literal['dict']; Literal['json', 'text']" = None) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        report_in(py, form, &WITHOUT_PAGE, |is_json| match is_json {
            true => self.inner.json(),
            false => self.inner.text().to_owned(),
        })
    }

    fn __repr__(&self) -> String {
        let all = self.inner.identities();
        let failed = all.iter().filter(|variation| !variation.holds).count();
        format!("<flexbody.Check: {failed} of {} failed>", all.len())
    }
}

/// A comparison of two bodies, independent of the signs and bases of their modes.
#[pyclass(frozen, module = "flexbody")]
pub struct Comparison {
    pub inner: flexbody::Comparison,
}

/// Returns the tolerances of a comparison with those that a caller gives, by their names.
pub fn tolerances(given: [(&str, Argument<'_, '_>); 5]) -> PyResult<Tolerances> {
    let mut all = Tolerances::default();
    let places =
        [&mut all.frequency, &mut all.mass, &mut all.centre_of_mass, &mut all.inertia, &mut all.invariants];
    for ((name, own), place) in given.into_iter().zip(places) {
        if let Some(own) = own {
            *place = not_negative(own, name)?;
        }
    }
    Ok(all)
}

fn not_negative(given: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    let number = real(given, name)?;
    if number >= 0.0 {
        return Ok(number);
    }
    let message = format!("`{name}` is {number}, expected a number, 0 or larger");
    Err(value_error(given.py(), message))
}

#[pymethods]
impl Comparison {
    /// True if every quantity is within its tolerance.
    #[getter]
    fn passed(&self) -> bool {
        self.inner.passed()
    }

    /// Compared quantities: list of ComparisonRow (quantity, meaning, difference, tolerance, passed).
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Vec<ComparisonRowTuple<'py>>> {
        let class = py.import("flexbody._types")?.getattr("ComparisonRow")?;
        let row = |check: &flexbody::ComparisonRow| {
            class.call1((check.quantity, check.meaning, check.difference, check.tolerance, check.passed))
        };
        self.inner.rows().iter().map(row).collect()
    }

    /// Returns the report of `flexbody compare`: a dict with all numbers, or "json", "text", "html", "junit", "markdown"
    /// as a str.
    #[pyo3(
        signature = (
            form: "Literal['dict']; Literal['json', 'text', 'html', 'junit', 'markdown']" = None,
        ) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        const FORMS: [(&str, ComparisonFormat); 6] = [
            ("dict", ComparisonFormat::Json),
            ("json", ComparisonFormat::Json),
            ("text", ComparisonFormat::Text),
            ("html", ComparisonFormat::Html),
            ("junit", ComparisonFormat::JUnit),
            ("markdown", ComparisonFormat::Markdown),
        ];
        report_in(py, form, &FORMS, |format| self.inner.report(format))
    }

    fn __repr__(&self) -> String {
        let failed = self.inner.rows().iter().filter(|row| !row.passed).count();
        format!("<flexbody.Comparison: {failed} of {} quantities differ>", self.inner.rows().len())
    }
}

/// An audit of a file of another program: dialect, identities, digits, units.
#[pyclass(frozen, module = "flexbody")]
pub struct Audit {
    inner: flexbody::Audit,
}

#[pymethods]
impl Audit {
    /// True if every check passed.
    #[getter]
    fn passed(&self) -> bool {
        self.inner.passed()
    }

    /// Name of the format of the file.
    #[getter]
    fn format(&self) -> &str {
        self.inner.format()
    }

    /// Dialect of the format; empty for a format with a single form.
    #[getter]
    fn dialect(&self) -> &str {
        self.inner.dialect()
    }

    /// Failed checks, as a tuple of `Diagnostic`.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, &self.inner.findings())
    }

    /// Returns the report of `flexbody audit`: a dict with all numbers, or "json", "text" as a str.
    #[pyo3(
        signature = (form: "Literal['dict']; Literal['json', 'text']" = None) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        report_in(py, form, &WITHOUT_PAGE, |is_json| match is_json {
            true => self.inner.json(),
            false => self.inner.text(),
        })
    }

    fn __repr__(&self) -> String {
        let verdict = if self.inner.passed() { "passed" } else { "FAILED" };
        format!("<flexbody.Audit of {} file: {verdict}>", self.inner.format())
    }
}

/// Reads and checks a flexible body in a file of another program, like `flexbody audit`. Identities pass up to
/// `tolerance`, relative to the size of their terms.
///
/// Raises InputError if the file cannot be read or its format is not recognised.
#[pyfunction]
#[pyo3(
    signature = (path: "_Path", *, format: "_types.ImportFormat | None" = None, tolerance: "float" = None),
    text_signature = "(path, *, format=None, tolerance=1e-6)"
)]
pub fn audit(
    py: Python<'_>,
    path: &Bound<'_, PyAny>,
    format: Argument<'_, '_>,
    tolerance: Argument<'_, '_>,
) -> PyResult<Audit> {
    let file = self::path(path, "path")?;
    let format = format.map(|format| text(format, "format")).transpose()?;
    let tolerance = match tolerance {
        Some(given) => match real(given, "tolerance")? {
            tolerance if tolerance > 0.0 => tolerance,
            other => {
                let message = format!("`tolerance` is {other}, expected a positive number");
                return Err(value_error(py, message));
            }
        },
        None => flexbody::Audit::TOLERANCE,
    };
    let inner = run(py, move |_| flexbody::Audit::of(&file, format.as_deref(), tolerance))?;
    Ok(Audit { inner })
}

/// Returns how an FE program writes its matrices, like `flexbody recipe`: the lines of the deck, and the command that
/// continues from there.
#[pyfunction]
#[pyo3(signature = (program: "_types.RecipeProgram"))]
pub fn recipe(py: Python<'_>, program: &Bound<'_, PyAny>) -> PyResult<String> {
    let program = text(program, "program")?;
    value(py, flexbody::Recipe::of(&program)).map(|recipe| recipe.to_string())
}

/// Returns what a message means, why it arises and what to do, like `flexbody explain`: by its code (`"FB408"`,
/// `"408"`), or all codes in one line each without one. Errors and warnings of this package state their codes.
#[pyfunction]
#[pyo3(signature = (code: "str | None" = None))]
pub fn explain(py: Python<'_>, code: Option<&Bound<'_, PyAny>>) -> PyResult<String> {
    let code = code.map(|code| text(code, "code")).transpose()?;
    value(py, flexbody::Explanation::of(code.as_deref())).map(|explanation| explanation.to_string())
}

/// A page that shows a body in motion: one HTML file for any browser, which loads nothing from elsewhere. A notebook
/// shows it.
#[pyclass(frozen, module = "flexbody")]
pub struct View {
    inner: flexbody::View,
}

impl View {
    /// Returns the page of a body with the arguments of `Body.view`.
    pub fn of(
        py: Python<'_>,
        body: Arc<FlexBody>,
        motion: Argument<'_, '_>,
        recovery: Argument<'_, '_>,
        envelope: Argument<'_, '_>,
        triangles: Argument<'_, '_>,
    ) -> PyResult<Self> {
        let recovery = recovery.map(|given| text(given, "recovery")).transpose()?;
        let envelope = envelope.map(|given| path(given, "envelope")).transpose()?;
        let triangles = triangles.map(|given| positive(given, "triangles")).transpose()?;
        if recovery.is_some() && envelope.is_some() {
            return Err(value_error(py, "`recovery` and `envelope` are given, expected one of them"));
        }
        if let (Some(name), Some(_)) = (&recovery, motion) {
            let message = format!("recovery `{name}` colours modes, and a simulation has none");
            let help = "draw the largest stresses of the simulation: `envelope`, a table of Recovered.write_envelope";
            let refused = Diagnostic::new(Code::RecoveryUnknown, message).with_help(help);
            return Err(exception(py, &refused.into()));
        }
        let motion = motion.map(recorded).transpose()?;
        let inner = run(py, move |_| match (recovery, envelope) {
            (Some(name), _) => body.view_recovery(&name, triangles),
            (None, Some(table)) => body.view_envelope(&table, motion.as_ref(), triangles),
            (None, None) => body.view(motion.as_ref(), triangles),
        })?;
        Ok(Self { inner })
    }
}

#[pymethods]
impl View {
    /// HTML of the page.
    #[getter]
    fn html(&self) -> &str {
        self.inner.html()
    }

    /// Writes the page, which appears complete or not at all.
    #[pyo3(signature = (path: "_Path"))]
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        alone(py, || self.inner.write(&path))
    }

    /// Returns the facts that `flexbody view` prints: a dict, or "json", "text" as a str.
    #[pyo3(
        signature = (form: "Literal['dict']; Literal['json', 'text']" = None) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        use flexbody::ReportFormat::{Json, Text};
        report_in(py, form, &WITHOUT_PAGE, |is_json| self.inner.report(if is_json { Json } else { Text }))
    }

    fn _repr_html_(&self) -> String {
        let page = self.inner.html().replace('&', "&amp;").replace('"', "&quot;");
        format!("<iframe srcdoc=\"{page}\" style=\"width: 100%; height: 600px; border: 0\"></iframe>")
    }

    fn __repr__(&self) -> String {
        format!("<flexbody.View: {} bytes of HTML>", self.inner.html().len())
    }
}

//! Frequency responses.

use crate::arguments::{Argument, count, mistyped, path, real};
use crate::arrays::{sequence, vector};
use crate::errors::{diagnostics, value_error, warn};
use crate::report::report;
use crate::scene::Scene;
use crate::types::{Diagnostics, Floats, TransferFunctionTuple, ValuesByRecovery};
use flexbody::ResponseOptions;
use nalgebra::Complex;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyInt, PyString};

/// A frequency response between places of a body.
#[pyclass(frozen, module = "flexbody")]
pub struct Response {
    inner: flexbody::Response,
}

/// Arguments of a frequency response.
pub struct ResponseArguments<'a, 'py> {
    pub source: Argument<'a, 'py>,
    pub target: Argument<'a, 'py>,
    pub base: Argument<'a, 'py>,
    pub rows: Argument<'a, 'py>,
    pub psd: Argument<'a, 'py>,
    pub band: Argument<'a, 'py>,
    pub scene: Argument<'a, 'py>,
    pub damping: Argument<'a, 'py>,
    pub tolerance: Argument<'a, 'py>,
    pub points: Argument<'a, 'py>,
    pub solves: Argument<'a, 'py>,
}

impl ResponseArguments<'_, '_> {
    /// Returns the options of the library.
    pub fn options(&self, py: Python<'_>) -> PyResult<ResponseOptions> {
        let mut options = ResponseOptions::default();
        for place in places(self.source, "source")? {
            options = options.from(&place);
        }
        for place in places(self.target, "target")? {
            options = options.to(&place);
        }
        for place in places(self.base, "base")? {
            options = options.base(&place);
        }
        for rows in places(self.rows, "rows")? {
            options = options.rows(&rows);
        }
        if let Some(psd) = self.psd {
            options = options.densities(path(psd, "psd")?);
        }
        if let Some(band) = self.band {
            let ends = sequence(band, "band")?;
            let [low, high] = ends[..] else {
                return Err(value_error(py, format!("`band` has {} numbers, expected 2", ends.len())));
            };
            options = options.band_hz(low, high);
        }
        if let Some(scene) = self.scene {
            options = options.scene(&Scene::one(scene)?);
        }
        if let Some(ratio) = self.damping {
            options = options.damping_ratio(real(ratio, "damping")?);
        }
        if let Some(tolerance) = self.tolerance {
            options = options.tolerance(real(tolerance, "tolerance")?);
        }
        if let Some(points) = self.points {
            options = options.points(count(points, "points")?);
        }
        if let Some(solves) = self.solves {
            options = options.solves(count(solves, "solves")?);
        }
        Ok(options)
    }
}

/// Returns the places that a caller names: one, or a sequence of them, each a string or the number of a node.
fn places(given: Argument<'_, '_>, name: &str) -> PyResult<Vec<String>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    let expected = "an interface or a node number, or a sequence of these";
    let place = |item: &Bound<'_, PyAny>| -> PyResult<String> {
        if item.is_instance_of::<PyString>() || item.is_instance_of::<PyInt>() {
            return Ok(item.str()?.to_string());
        }
        let number = item.extract::<i64>().map_err(|_| mistyped(item, name, expected))?;
        Ok(number.to_string())
    };
    if given.is_instance_of::<PyString>() || given.extract::<i64>().is_ok() {
        return Ok(vec![place(given)?]);
    }
    let items = given.try_iter().map_err(|_| mistyped(given, name, expected))?;
    items.map(|item| place(&item?)).collect()
}

impl Response {
    pub fn with_warnings(py: Python<'_>, inner: flexbody::Response, given: usize) -> PyResult<Self> {
        // Warnings about the model were issued when it was made.
        warn(py, &inner.diagnostics()[given..])?;
        Ok(Self { inner })
    }
}

#[pymethods]
impl Response {
    /// Frequencies, ascending (n). Unit: Hz.
    #[getter]
    fn frequencies_hz<'py>(&self, py: Python<'py>) -> Floats<'py> {
        vector(py, self.inner.frequencies_hz())
    }

    /// Transfer functions: list of TransferFunction (source, source_direction, target, target_direction, reduced, full)
    /// with complex arrays (n); full is nan where the equations of all nodes were not solved.
    #[getter]
    fn functions<'py>(&self, py: Python<'py>) -> PyResult<Vec<TransferFunctionTuple<'py>>> {
        let class = py.import("flexbody._types")?.getattr("TransferFunction")?;
        let unsolved = Complex::new(f64::NAN, f64::NAN);
        let function = |one: flexbody::TransferFunction| {
            let full = one.full.into_iter().map(|value| value.unwrap_or(unsolved));
            class.call1((
                one.from,
                one.from_direction,
                one.to,
                one.to_direction,
                PyArray1::from_vec(py, one.reduced),
                PyArray1::from_iter(py, full),
            ))
        };
        self.inner.functions().into_iter().map(function).collect()
    }

    /// Root mean squares under random excitation: a dict with, for each recovery, a dict of `rows` and `points` (names), and
    /// of `rms` and `von_mises` (arrays, in the units of the rows); None without spectral densities.
    #[getter]
    fn random<'py>(&self, py: Python<'py>) -> PyResult<Option<ValuesByRecovery<'py>>> {
        let Some(random) = self.inner.random() else { return Ok(None) };
        let all = PyDict::new(py);
        for recovery in &random.recoveries {
            let values = PyDict::new(py);
            values.set_item("rows", recovery.rows.iter().map(|row| row.name.as_str()).collect::<Vec<_>>())?;
            values.set_item("rms", vector(py, &recovery.rms))?;
            values.set_item(
                "points",
                recovery.points.iter().map(|point| point.name.as_str()).collect::<Vec<_>>(),
            )?;
            values.set_item("von_mises", vector(py, &recovery.von_mises))?;
            all.set_item(&recovery.name, values)?;
        }
        Ok(Some(all))
    }

    /// True if no error exceeds the tolerance, or if no error is known.
    #[getter]
    fn holds(&self) -> bool {
        self.inner.holds()
    }

    /// Warnings and notes, as a tuple of `Diagnostic`.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, self.inner.diagnostics())
    }

    /// Returns the report of `flexbody response`: a dict with all numbers, or "json", "text", "html" as a str.
    #[pyo3(
        signature = (
            form: "Literal['dict']; Literal['json', 'text', 'html']" = None,
        ) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, form, |format| self.inner.report(format))
    }

    /// Returns the table of `flexbody response --csv`, as a str: one line per frequency.
    fn csv(&self) -> String {
        self.inner.csv()
    }

    fn __repr__(&self) -> String {
        let (functions, frequencies) = (self.inner.functions().len(), self.inner.frequencies_hz().len());
        format!("<flexbody.Response: {functions} functions at {frequencies} frequencies>")
    }
}

//! Factors of the steps of an FE program over a motion.

use crate::arguments::path;
use crate::arrays::{ArrayCache, matrix, vector};
use crate::recovered::history_of;
use crate::types::Floats;
use crate::work::{alone, brief, run};
use flexbody::FlexBody;
use pyo3::prelude::*;
use std::sync::Arc;

/// Factors of the steps of an FE program over a motion, for a program that superposes the results of the steps, such as a
/// fatigue program. The sum of the results of all steps times their channels is the row of a recovery.
#[pyclass(frozen, module = "flexbody")]
pub struct Channels {
    body: Arc<FlexBody>,
    inner: flexbody::Channels,
    cache: ArrayCache,
}

impl Channels {
    /// Computes the channels of the steps in an archive over the history that a caller gives.
    pub fn of(
        py: Python<'_>,
        body: Arc<FlexBody>,
        history: &Bound<'_, PyAny>,
        shapes: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (history, shapes) = (history_of(history, &body, None)?, path(shapes, "shapes")?);
        let own = Arc::clone(&body);
        let inner = run(py, move |_| own.channels(&history, &shapes))?;
        Ok(Self { body, inner, cache: ArrayCache::default() })
    }
}

#[pymethods]
impl Channels {
    /// Times (nt). Unit: time.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "time", || Ok(vector(py, self.inner.times())))
    }

    /// Names of the nc channels: those of the steps ("mode 1", "spin xy", "tip Fx"), and last "constant".
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.inner.names().iter().map(String::as_str).collect()
    }

    /// Factor of each step at each time (nt x nc): modal coordinate, product of angular velocities or load, over the factor
    /// with which the step was scaled; ones in the last column, for the results at rest. Unit: 1.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "values", || matrix(py, &self.inner.values()))
    }

    /// Returns the table of `flexbody recover --channels FILE.csv`, as a str: one line per instant.
    fn csv(&self, py: Python<'_>) -> PyResult<String> {
        alone(py, || Ok(self.inner.csv()))
    }

    /// Writes the HDF5 file of `flexbody recover --channels FILE.h5`, which appears complete or not at all.
    #[pyo3(signature = (path: "_Path"))]
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        brief(py, || self.inner.write(&self.body, &path))
    }

    fn __repr__(&self) -> String {
        let (steps, instants) = (self.inner.names().len() - 1, self.inner.times().len());
        format!("<flexbody.Channels: {steps} steps and a constant at {instants} instants>")
    }
}

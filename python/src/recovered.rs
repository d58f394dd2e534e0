//! Recoveries over a motion of any program.

use crate::arguments::{Argument, mistyped, path, texts};
use crate::arrays::{ArrayCache, Given, matrix, rows_of, rows_of_many, sequence, vector};
use crate::errors::{value, value_error};
use crate::report::report;
use crate::work::{brief, run};
use flexbody::{FlexBody, LoadedHistory, RecoveryRow, Result};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use std::path::PathBuf;
use std::sync::Arc;

/// Keys of a history of numbers.
const KEYS: [&str; 4] = ["time", "q", "angular_velocity", "loads"];

/// Recoveries of a body over a history: stresses, strains, forces.
#[pyclass(frozen, module = "flexbody")]
pub struct Recovered {
    body: Arc<FlexBody>,
    history: LoadedHistory,
    names: Vec<String>,
    time: Vec<f64>,
    rows: Vec<flexbody::RecoveredRows>,
    cache: ArrayCache,
}

/// Returns the history that a caller gives: the path of a table, or a dict of time, q, angular_velocity and loads.
fn history_of(given: &Bound<'_, PyAny>, body: &FlexBody) -> PyResult<LoadedHistory> {
    let py = given.py();
    let Ok(values) = given.cast::<PyMapping>() else {
        let expected = "the path of a table, or a dict of time, q, angular_velocity and loads";
        let path: PathBuf = given.extract().map_err(|_| mistyped(given, "history", expected))?;
        return value(py, LoadedHistory::read(&path, body));
    };
    for key in values.keys()? {
        let known = key.extract::<String>().is_ok_and(|key| KEYS.contains(&key.as_str()));
        if !known {
            let message = format!("`history` has the key {}, expected {}", key.repr()?, KEYS.join(", "));
            return Err(value_error(py, message));
        }
    }
    let entry = |key: &str| -> PyResult<Option<Bound<'_, PyAny>>> {
        Ok(if values.contains(key)? {
            Some(values.get_item(key)?).filter(|value| !value.is_none())
        } else {
            None
        })
    };
    let needed =
        |key: &str| entry(key)?.ok_or_else(|| value_error(py, format!("`history` has no key `{key}`")));
    let (time, q) = (sequence(&needed("time")?, "time")?, rows_of(&needed("q")?, "q")?);
    let mut history = value(py, LoadedHistory::new(time, q))?;
    if let Some(spin) = entry("angular_velocity")? {
        history = value(py, history.angular_velocity(&rows_of_many::<3>(&spin, "angular_velocity")?))?;
    }
    if let Some(loads) = entry("loads")? {
        history = with_loads(history, &loads)?;
    }
    Ok(history)
}

/// Returns the history with loads: a dict of the name of an interface to a tuple of forces and torques.
fn with_loads(mut history: LoadedHistory, loads: &Bound<'_, PyAny>) -> PyResult<LoadedHistory> {
    let expected = "a dict of interface to a tuple of forces and torques (nt x 3 each)";
    let loads = loads.cast::<PyMapping>().map_err(|_| mistyped(loads, "loads", expected))?;
    for item in loads.items()? {
        let (name, both): (String, Given<'_>) = item.extract()?;
        let (force, torque): (Given<'_>, Option<Given<'_>>) =
            both.extract().map_err(|_| mistyped(&both, &name, "a tuple of forces and torques"))?;
        let force = rows_of_many::<3>(&force, &format!("{name} force"))?;
        let torque = match torque {
            Some(torque) => rows_of_many::<3>(&torque, &format!("{name} torque"))?,
            None => vec![[0.0; 3]; force.len()],
        };
        history = value(loads.py(), history.load(name, &force, &torque))?;
    }
    Ok(history)
}

impl Recovered {
    /// Computes the recoveries of `body` over the history that a caller gives.
    pub fn of(
        py: Python<'_>,
        body: Arc<FlexBody>,
        history: &Bound<'_, PyAny>,
        only: Argument<'_, '_>,
    ) -> PyResult<Self> {
        let history = history_of(history, &body)?;
        let names = only.map_or_else(|| Ok(Vec::new()), |only| texts(only, "only"))?;
        run(py, move |_| {
            let (rows, time) = {
                let recovered = recovered(&body, &history, &names)?;
                (recovered.rows(), recovered.times().to_vec())
            };
            Ok(Self { body, history, names, time, rows, cache: ArrayCache::default() })
        })
    }
}

/// Returns the recoveries in the types of the library, which borrow the body.
fn recovered<'b>(
    body: &'b FlexBody,
    history: &LoadedHistory,
    names: &[String],
) -> Result<flexbody::Recovered<'b>> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    body.recover(history, &names)
}

#[pymethods]
impl Recovered {
    /// Times (nt). Unit: time.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "time", || Ok(vector(py, &self.time)))
    }

    /// Rows by recovery: dict of name to RecoveredRows (labels, values, points, von_mises) with the values of all rows
    /// (nt x rows) in the units of their labels, and the equivalent stress of von Mises (nt x points) at the points with
    /// all six stresses.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let types = py.import("flexbody._types")?;
        let (class, label) = (types.getattr("RecoveredRows")?, types.getattr("RowLabel")?);
        let all = PyDict::new(py);
        for one in &self.rows {
            let named = |row: &RecoveryRow| {
                let quantity = row.quantity.name();
                label.call1((&row.name, quantity, &row.component, &row.unit, row.node, row.element))
            };
            let labels = one.labels.iter().map(named).collect::<PyResult<Vec<_>>>()?;
            let (values, equivalent) = (matrix(py, &one.values)?, matrix(py, &one.von_mises)?);
            all.set_item(&one.name, class.call1((labels, values, &one.points, equivalent))?)?;
        }
        Ok(all)
    }

    /// Writes the HDF5 file of `flexbody recover -o FILE.h5`, which appears complete or not at all.
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        brief(py, || recovered(&self.body, &self.history, &self.names)?.write(&path))
    }

    /// Returns the table of `flexbody recover -o FILE.csv`, as a str: one line per instant.
    fn csv(&self, py: Python<'_>) -> PyResult<String> {
        brief(py, || Ok(recovered(&self.body, &self.history, &self.names)?.csv()))
    }

    /// Returns the report of `flexbody recover`: a dict with the largest values, or "json", "text", "html" as a str.
    #[pyo3(signature = (form=None), text_signature = "($self, form=\"dict\")")]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        let recovered = value(py, recovered(&self.body, &self.history, &self.names))?;
        report(py, form, |format| recovered.report(format))
    }

    fn __repr__(&self) -> String {
        let names: Vec<&str> = self.rows.iter().map(|one| one.name.as_str()).collect();
        format!("<flexbody.Recovered: {} at {} instants>", names.join(", "), self.time.len())
    }
}

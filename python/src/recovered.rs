//! Recoveries over a motion of any program.

use crate::arguments::{Argument, mistyped, path, text, texts};
use crate::arrays::{ArrayCache, matrix, rows_of, rows_of_many, sequence, vector};
use crate::errors::{value, value_error, warn};
use crate::report::report;
use crate::types::{Floats, Given, RowsByRecovery};
use crate::work::{brief, run};
use flexbody::{Code, Diagnostic, FlexBody, LoadedHistory, Matrix, RecoveryRow, ReportFormat};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use std::path::PathBuf;
use std::sync::Arc;

/// Keys of a history of numbers.
const KEYS: [&str; 8] =
    ["time", "q", "qd", "qdd", "angular_velocity", "angular_acceleration", "loads", "amplitudes"];

/// Recoveries of a body over a motion, of a run of any program or of a simulation: stresses, strains, forces.
#[pyclass(frozen, module = "flexbody")]
pub struct Recovered {
    body: Arc<FlexBody>,
    inner: flexbody::Recovered,
    cache: ArrayCache,
}

/// Returns the history that a caller gives: the path of a table, or a dict with the keys [`KEYS`].
///
/// * `carried_by`: interface or node that carries the body.
pub fn history_of(
    given: &Bound<'_, PyAny>,
    body: &FlexBody,
    carried_by: Option<&str>,
) -> PyResult<LoadedHistory> {
    let history = frame_history_of(given, body)?;
    Ok(match carried_by {
        Some(carrier) => history.carried_by(body, carrier),
        None => history,
    })
}

fn frame_history_of(given: &Bound<'_, PyAny>, body: &FlexBody) -> PyResult<LoadedHistory> {
    let py = given.py();
    let Ok(values) = given.cast::<PyMapping>() else {
        let expected = "the path of a table, or a dict of time, q, angular_velocity, loads and amplitudes";
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
    if let Some(rates) = entry("angular_acceleration")? {
        let rates = rows_of_many::<3>(&rates, "angular_acceleration")?;
        history = value(py, history.angular_acceleration(&rates))?;
    }
    let (first, second) = (entry("qd")?, entry("qdd")?);
    if first.is_none() && second.is_some() {
        return Err(value_error(py, "`history` has the key `qdd` without `qd`".to_owned()));
    }
    if let Some(first) = first {
        let second = second.map(|second| rows_of(&second, "qdd")).transpose()?;
        history = value(py, history.modal_rates(rows_of(&first, "qd")?, second))?;
    }
    if let Some(loads) = entry("loads")? {
        history = with_loads(history, &loads)?;
    }
    if let Some(amplitudes) = entry("amplitudes")? {
        history = with_amplitudes(history, &amplitudes)?;
    }
    Ok(history)
}

/// Returns the history with amplitudes: a dict of the name of a named load to its amplitudes.
fn with_amplitudes(mut history: LoadedHistory, amplitudes: &Bound<'_, PyAny>) -> PyResult<LoadedHistory> {
    let expected = "a dict of named load to its amplitudes (nt)";
    let amplitudes =
        amplitudes.cast::<PyMapping>().map_err(|_| mistyped(amplitudes, "amplitudes", expected))?;
    for item in amplitudes.items()? {
        let (name, values): (String, Given<'_>) = item.extract()?;
        let values = sequence(&values, &format!("amplitudes of {name}"))?;
        history = value(amplitudes.py(), history.amplitude(name, &values))?;
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
    /// Returns recoveries of `body`.
    pub fn new(body: Arc<FlexBody>, inner: flexbody::Recovered) -> Self {
        Self { body, inner, cache: ArrayCache::default() }
    }

    /// Computes the recoveries of `body` over the history that a caller gives.
    pub fn of(
        py: Python<'_>,
        body: Arc<FlexBody>,
        history: &Bound<'_, PyAny>,
        only: Argument<'_, '_>,
        carried_by: Option<&str>,
    ) -> PyResult<Self> {
        let history = history_of(history, &body, carried_by)?;
        let names = only.map_or_else(|| Ok(Vec::new()), |only| texts(only, "only"))?;
        let own = Arc::clone(&body);
        let inner = run(py, move |_| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            own.recover(&history, &names)
        })?;
        warn(py, inner.diagnostics())?;
        Ok(Self::new(body, inner))
    }
}

#[pymethods]
impl Recovered {
    /// Times (nt). Unit: time.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "time", || Ok(vector(py, self.inner.times())))
    }

    /// Rows by recovery: dict of name to RecoveredRows (labels, values, points, von_mises, signed_von_mises, principal)
    /// with the values of all rows (nt x rows) in the units of their labels, and the equivalent stresses of von Mises (nt x
    /// points) and the principal stresses (nt x points x 3) at the points with all six stresses.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<RowsByRecovery<'py>> {
        let types = py.import("flexbody._types")?;
        let (class, label) = (types.getattr("RecoveredRows")?, types.getattr("RowLabel")?);
        let all = PyDict::new(py);
        for one in &self.inner.rows() {
            let named = |row: &RecoveryRow| {
                let quantity = row.quantity.name();
                label.call1((&row.name, quantity, &row.component, &row.unit, row.node, row.element))
            };
            let labels = one.labels.iter().map(named).collect::<PyResult<Vec<_>>>()?;
            let (values, equivalent) = (matrix(py, &one.values)?, matrix(py, &one.von_mises)?);
            let signed = matrix(py, &one.signed_von_mises)?;
            let principal = principal(py, &one.principal)?;
            let rows = class.call1((labels, values, &one.points, equivalent, signed, principal))?;
            all.set_item(&one.name, rows)?;
        }
        Ok(all)
    }

    /// Writes the HDF5 file of `flexbody recover -o FILE.h5` and `flexbody simulate --rows FILE.h5`, which appears complete
    /// or not at all.
    #[pyo3(signature = (path: "_Path"))]
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        brief(py, || self.inner.write(&self.body, &path))
    }

    /// Writes the largest stresses of every point over the motion, like `--envelope`: a table (.csv), or the body with them
    /// at its nodes (.vtu). Those of a simulation need `Body.simulate(scene, envelope=True)`.
    #[pyo3(signature = (path: "_Path"))]
    fn write_envelope(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        brief(py, || self.inner.write_envelope(&self.body, &path))
    }

    /// Writes the largest stresses of every point over several load cases, like `--envelope` for a scene with several: a
    /// table (.csv), or the body with them at its nodes (.vtu), with the load case of each extreme. Of two equal extremes the
    /// first is taken.
    ///
    /// `cases` is a dict of the name of a load case to its Recovered, all of one body, with the same recoveries. Those of a
    /// simulation need `Body.simulate(scene, envelope=True)`. Raises InputError for recoveries of another body.
    #[staticmethod]
    #[pyo3(signature = (cases: "Mapping[str, Recovered]", path: "_Path"))]
    fn write_envelope_of_cases(
        py: Python<'_>,
        cases: &Bound<'_, PyAny>,
        path: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let path = self::path(path, "path")?;
        let expected = "a dict of load case to its Recovered";
        let given = cases.cast::<PyMapping>().map_err(|_| mistyped(cases, "cases", expected))?;
        let mut named: Vec<(String, Bound<'_, Self>)> = Vec::new();
        for item in given.items()? {
            let (name, rows): (Given<'_>, Given<'_>) = item.extract()?;
            let name = text(&name, "name of a load case")?;
            let rows =
                rows.cast_into().map_err(|error| mistyped(&error.into_inner(), &name, "a Recovered"))?;
            named.push((name, rows));
        }
        let cases: Vec<(&str, &Self)> =
            named.iter().map(|(name, rows)| (name.as_str(), rows.get())).collect();
        let Some((first, of_first)) = cases.first() else {
            return Err(value_error(py, "`cases` is empty, expected one load case or more"));
        };
        brief(py, || {
            let body = &of_first.body;
            let is_foreign = |own: &Self| !Arc::ptr_eq(&own.body, body) && own.body != *body;
            if let Some((name, _)) = cases.iter().find(|(_, own)| is_foreign(own)) {
                let message = format!("load case `{name}` is of another body than load case `{first}`");
                return Err(Diagnostic::new(Code::Argument, message).into());
            }
            let cases: Vec<_> = cases.iter().map(|(name, own)| (*name, &own.inner)).collect();
            flexbody::Recovered::write_envelope_of_cases(&cases, body, &path)
        })
    }

    /// Returns the table of `flexbody recover -o FILE.csv` and `flexbody simulate --rows FILE.csv`, as a str: one line per
    /// instant.
    fn csv(&self, py: Python<'_>) -> PyResult<String> {
        brief(py, || Ok(self.inner.csv()))
    }

    /// Returns the report of `flexbody recover`: a dict with the largest values, or "json", "text", "html" as a str.
    ///
    /// Raises InputError for rows of a simulation: `Motion.report` has their largest values.
    #[pyo3(
        signature = (
            form: "Literal['dict']; Literal['json', 'text', 'html']" = None,
        ) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        if self.inner.report(&self.body, ReportFormat::Json).is_none() {
            let message = "the largest values of a simulation are in the report of its motion";
            return Err(value_error(py, message));
        }
        report(py, form, |format| self.inner.report(&self.body, format).unwrap_or_default())
    }

    fn __repr__(&self) -> String {
        let rows = self.inner.rows();
        let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        format!("<flexbody.Recovered: {} at {} instants>", names.join(", "), self.inner.times().len())
    }
}

/// Returns three matrices as one array (rows x columns x 3).
fn principal<'py>(py: Python<'py>, of: &[Matrix; 3]) -> PyResult<Floats<'py>> {
    let (rows, columns) = (of[0].rows(), of[0].columns());
    let entry = |at: usize| of.each_ref().map(|one| one[(at / columns, at % columns)]);
    let values: Vec<f64> = (0..rows * columns).flat_map(entry).collect();
    Ok(PyArray1::from_vec(py, values).reshape([rows, columns, 3])?.into_any())
}

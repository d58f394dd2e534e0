//! Functions that read bodies.

use crate::arguments::{Argument, path, text};
use crate::body_class::Body;
use crate::errors::{PickledDiagnostic, restored_diagnostic, warn};
use crate::model::frame_choice;
use crate::work::{alone, run};
use flexbody::FlexBody;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Reads a flex-body file.
///
/// Raises InputError if it cannot be read or has a newer format, CheckError if it violates its schema or was changed
/// since it was written.
#[pyfunction]
#[pyo3(signature = (path: "_Path"))]
pub fn read(py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<Body> {
    let path = self::path(path, "path")?;
    Ok(Body::new(alone(py, || FlexBody::read(&path))?, Vec::new()))
}

/// Reads a body in a file of another program, like `flexbody convert --from`: SID_FEM, MBDyn, MBSim, Exudyn.
///
/// `units` are those of length, mass and time of the file, m, kg and s without; `frame` is a body frame as for `convert`,
/// that of the file without. Raises InputError if the file cannot be read, does not determine a body, or contradicts itself.
#[pyfunction]
#[pyo3(
    signature = (
        path: "_Path",
        format: "_types.ImportFormat",
        *,
        units: "_types.Units | None" = None,
        frame: "_types.Frame | None" = None,
    )
)]
pub fn import_body(
    py: Python<'_>,
    path: &Bound<'_, PyAny>,
    format: &Bound<'_, PyAny>,
    units: Argument<'_, '_>,
    frame: Argument<'_, '_>,
) -> PyResult<Body> {
    let (path, format) = (self::path(path, "path")?, text(format, "format")?);
    let units = units.map(|given| crate::arguments::units(given, "units")).transpose()?;
    let frame = frame.map(frame_choice).transpose()?;
    let made = run(py, move |_| FlexBody::import(&path, &format, units.as_deref(), frame.as_ref()))?;
    warn(py, &made.diagnostics)?;
    Ok(Body::new(made.body, made.diagnostics))
}

/// Makes a body of the bytes and the diagnostics of a pickle.
#[pyfunction]
#[pyo3(signature = (bytes: "bytes", found: "Sequence[tuple[object, ...]]"))]
pub fn _restored(py: Python<'_>, bytes: Vec<u8>, found: Vec<PickledDiagnostic>) -> PyResult<Body> {
    let body = alone(py, || FlexBody::from_bytes(&bytes))?;
    Ok(Body::new(body, found.into_iter().filter_map(restored_diagnostic).collect()))
}

/// Returns the formats that `Body.export` writes: dict of name to the programs that read it.
#[pyfunction]
#[pyo3(signature = () -> "dict[str, str]")]
pub fn export_formats(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    FlexBody::export_formats().into_iter().try_for_each(|(name, reader)| all.set_item(name, reader))?;
    Ok(all)
}

//! Scenes, the motion of bodies in them, and the selection of terms and modes.

use crate::arguments::{Argument, mistyped, path, text};
use crate::arrays::{ArrayCache, shaped, triples, vector};
use crate::errors::{diagnostics, value, value_error, warn};
use crate::recovered::Recovered;
use crate::report::report;
use crate::types::{Diagnostics, Floats, PathsByName};
use crate::work::{alone, brief};
use flexbody::FlexBody;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use std::path::PathBuf;
use std::sync::Arc;

/// A scene for a body: gravity, loads, prescribed motion, duration, tolerances (docs/reference/scenes.md).
///
/// Scene(source, case=None, folder=None) makes one of the path of a scene file, of its text (a str with line breaks), or
/// of a dict with its keys: {"run": {"duration": 0.1}, "load": [{"interface": "tip", "force": [0, 0, 1]}]}. `case` names
/// the load case of a scene that has several. Files of histories are found in the folder of the scene file; for a text
/// and a dict in `folder`, by default the current one.
#[pyclass(frozen, module = "flexbody")]
pub struct Scene {
    inner: flexbody::Scene,
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (source: "_Source", case: "str | None" = None, folder: "_Path | None" = None))]
    fn new(
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        case: Argument<'_, '_>,
        folder: Argument<'_, '_>,
    ) -> PyResult<Self> {
        let case = case.map(|case| text(case, "case")).transpose()?;
        match read(source, folder, "source")? {
            Source::File(path) => {
                let inner = alone(py, || flexbody::Scene::read_case(&path, case.as_deref()))?;
                Ok(Self { inner })
            }
            Source::Made(all) => value(py, all.case(case.as_deref())).map(|inner| Self { inner }),
        }
    }

    /// Returns all load cases of a scene (the path of its file, its text, or a dict), in its order; the single scene if
    /// it has no cases.
    #[staticmethod]
    #[pyo3(signature = (source: "_Source", folder: "_Path | None" = None))]
    fn cases(py: Python<'_>, source: &Bound<'_, PyAny>, folder: Argument<'_, '_>) -> PyResult<Vec<Scene>> {
        let all = read(source, folder, "source")?.whole(py)?;
        Ok(all.cases().into_iter().map(|inner| Self { inner }).collect())
    }

    /// Name of the scene; for a load case the name of the scene, a colon and the name of the case.
    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn __repr__(&self) -> String {
        format!("<flexbody.Scene {:?}>", self.inner.name())
    }
}

/// Source of a scene.
enum Source {
    /// Path of a scene file.
    File(PathBuf),
    /// Scene of a text or of values, with all its load cases.
    Made(flexbody::Scene),
}

impl Source {
    /// Returns the scene with all its load cases.
    fn whole(self, py: Python<'_>) -> PyResult<flexbody::Scene> {
        match self {
            Self::File(path) => alone(py, || flexbody::Scene::read(&path)),
            Self::Made(all) => Ok(all),
        }
    }
}

/// Returns the source that a caller gives: a path, a text with line breaks, or a dict.
fn read(given: &Bound<'_, PyAny>, folder: Argument<'_, '_>, name: &str) -> PyResult<Source> {
    let py = given.py();
    let beside = folder.map_or_else(|| Ok(PathBuf::new()), |folder| path(folder, "folder"))?;
    if given.cast::<PyMapping>().is_ok() {
        let json = py.import("flexbody._inputs")?.getattr("json_of_scene")?.call1((given,))?;
        let json: String = json.extract()?;
        let values: serde_json::Value = serde_json::from_str(&json)
            .map_err(|error| value_error(py, format!("`{name}` cannot be read as values: {error}")))?;
        return Ok(Source::Made(alone(py, || flexbody::Scene::from_values(&values, beside))?));
    }
    if let Ok(text) = given.extract::<String>()
        && text.contains('\n')
    {
        return Ok(Source::Made(alone(py, || flexbody::Scene::parse(&text, beside))?));
    }
    let expected = "a Scene, a dict, the text of a scene, or the path of its file";
    let path: PathBuf = given.extract().map_err(|_| mistyped(given, name, expected))?;
    if folder.is_some() {
        let message = "`folder` is given together with a scene file, whose folder counts: leave it out";
        return Err(value_error(py, message));
    }
    Ok(Source::File(path))
}

impl Scene {
    /// Returns the single scene that a caller gives: a `Scene`, or the source of one without load cases.
    pub fn one(given: &Bound<'_, PyAny>) -> PyResult<flexbody::Scene> {
        let py = given.py();
        if let Ok(scene) = given.cast::<Self>() {
            return Ok(scene.get().inner.clone());
        }
        match read(given, None, "scene")? {
            Source::File(path) => alone(py, || flexbody::Scene::read_case(&path, None)),
            Source::Made(all) => value(py, all.case(None)),
        }
    }

    /// Returns the scene with all load cases that a caller gives: a `Scene`, a list of them, or the source of one.
    pub fn whole(given: &Bound<'_, PyAny>) -> PyResult<flexbody::Scene> {
        let py = given.py();
        if let Ok(scene) = given.cast::<Self>() {
            return Ok(scene.get().inner.clone());
        }
        if let Ok(scenes) = given.extract::<Vec<Bound<'_, Self>>>() {
            let cases = scenes.iter().map(|scene| scene.get().inner.clone());
            let none = || value_error(py, "`scene` is an empty list, expected one or more load cases");
            return flexbody::Scene::of_cases(cases).ok_or_else(none);
        }
        read(given, None, "scene")?.whole(py)
    }
}

/// The terms and modes that a body needs in a scene.
#[pyclass(frozen, module = "flexbody")]
pub struct Selection {
    inner: flexbody::Selection,
}

impl Selection {
    pub fn with_warnings(py: Python<'_>, inner: flexbody::Selection) -> PyResult<Self> {
        warn(py, inner.diagnostics())?;
        Ok(Self { inner })
    }
}

#[pymethods]
impl Selection {
    /// Indices of the kept modes, from 0.
    #[getter]
    fn modes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.inner.modes().iter().map(|&mode| mode as i64))
    }

    /// Groups of terms of the kinetic energy: list of (name, true if it is kept, reason).
    #[getter]
    fn groups(&self) -> Vec<(&str, bool, &str)> {
        self.inner.groups()
    }

    /// True if the tolerances of the scene hold, as far as they were measured.
    #[getter]
    fn holds(&self) -> bool {
        self.inner.holds()
    }

    /// Warnings and notes, as a tuple of `Diagnostic`.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, self.inner.diagnostics())
    }

    /// Returns the command that makes exactly the selected body from the flex-body file that was judged. None if the body
    /// was made with the selection.
    #[pyo3(signature = (body: "_Path"))]
    fn command(&self, body: &Bound<'_, PyAny>) -> PyResult<Option<String>> {
        Ok(self.inner.command(&path(body, "body")?.display().to_string()))
    }

    /// Returns the report of `flexbody select`: a dict with all numbers, or "json", "text", "html" as a str.
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
        let cache: Vec<&str> =
            self.inner.groups().iter().filter(|group| group.1).map(|group| group.0).collect();
        format!("<flexbody.Selection: {} modes, groups {}>", self.inner.modes().len(), cache.join(", "))
    }
}

/// Motion of a body in a scene, at nt instants, in the units of the body.
///
/// The motion is that of a frame with its origin at the centre of mass of the undeformed body, or at the reference
/// point of its carrier, and with the axes of the model, which turn with the body.
#[pyclass(frozen, module = "flexbody")]
pub struct Motion {
    inner: flexbody::Motion,
    body: Arc<FlexBody>,
    cache: ArrayCache,
}

impl Motion {
    /// Returns a motion of `body`, whose warnings are issued.
    pub fn with_warnings(py: Python<'_>, inner: flexbody::Motion, body: Arc<FlexBody>) -> PyResult<Self> {
        warn(py, inner.diagnostics())?;
        Ok(Self { inner, body, cache: ArrayCache::default() })
    }

    /// Returns the motion of the library.
    pub fn inner(&self) -> &flexbody::Motion {
        &self.inner
    }

    /// Returns an array with a row for each instant.
    fn rows<'py, R: AsRef<[f64]>>(
        &self,
        py: Python<'py>,
        name: &'static str,
        row: impl Fn(usize) -> R,
    ) -> PyResult<Floats<'py>> {
        self.cache.get(py, name, || {
            let instants = self.inner.times().len();
            let all: Vec<f64> = (0..instants).flat_map(|instant| row(instant).as_ref().to_vec()).collect();
            let width = all.len() / instants.max(1);
            shaped(py, all, [instants, width])
        })
    }

    /// Returns an array with a number for each instant.
    fn numbers<'py>(
        &self,
        py: Python<'py>,
        name: &'static str,
        number: impl Fn(usize) -> f64,
    ) -> PyResult<Floats<'py>> {
        self.cache.get(py, name, || {
            let all: Vec<f64> = (0..self.inner.times().len()).map(number).collect();
            Ok(vector(py, &all))
        })
    }
}

#[pymethods]
impl Motion {
    /// Instants (nt). Unit: time.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "time", || Ok(vector(py, self.inner.times())))
    }

    /// Modal coordinates q (nt x nf). Unit: sqrt(mass) length.
    #[getter]
    fn modal_coordinates<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "modal_coordinates", |instant| self.inner.modal_coordinates(instant).to_vec())
    }

    /// Rates dq/dt of the modal coordinates (nt x nf). Unit: sqrt(mass) length/time.
    #[getter]
    fn modal_velocities<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "modal_velocities", |instant| self.inner.modal_velocities(instant).to_vec())
    }

    /// Position of the origin of the frame, in world axes (nt x 3). Unit: length.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "origin", |instant| <[f64; 3]>::from(self.inner.origin(instant)))
    }

    /// Velocity of the origin, in world axes (nt x 3). Unit: length/time.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "velocity", |instant| <[f64; 3]>::from(self.inner.velocity(instant)))
    }

    /// Attitude of the frame (nt x 4): Euler parameters of unit length, the cosine of half the angle first.
    #[getter]
    fn attitude<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "attitude", |instant| self.inner.attitude(instant))
    }

    /// Angular velocity of the frame along its axes (nt x 3). Unit: 1/time.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "angular_velocity", |instant| <[f64; 3]>::from(self.inner.angular_velocity(instant)))
    }

    /// Kinetic energy (nt). Unit: mass length^2/time^2.
    #[getter]
    fn kinetic_energy<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "kinetic_energy", |instant| self.inner.kinetic_energy(instant))
    }

    /// Elastic energy (nt). Unit: mass length^2/time^2.
    #[getter]
    fn elastic_energy<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "elastic_energy", |instant| self.inner.elastic_energy(instant))
    }

    /// Work of forces, damping and prescribed motion since the start (nt). Unit: mass length^2/time^2.
    #[getter]
    fn work<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "work", |instant| self.inner.work(instant))
    }

    /// Linear momentum, in world axes (nt x 3). Unit: mass length/time.
    #[getter]
    fn linear_momentum<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "linear_momentum", |instant| <[f64; 3]>::from(self.inner.linear_momentum(instant)))
    }

    /// Angular momentum about the initial position of the origin, in world axes (nt x 3). Unit: mass length^2/time.
    #[getter]
    fn angular_momentum<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.rows(py, "angular_momentum", |instant| <[f64; 3]>::from(self.inner.angular_momentum(instant)))
    }

    /// Force, and torque about the origin, of the prescribed motion, along the axes of the frame (nt x 6); None if no
    /// motion is prescribed.
    #[getter]
    fn reactions<'py>(&self, py: Python<'py>) -> PyResult<Option<Floats<'py>>> {
        if self.inner.times().is_empty() || self.inner.reaction(0).is_none() {
            return Ok(None);
        }
        let row = |instant| {
            let (force, torque) = self.inner.reaction(instant).unwrap_or_default();
            [force.x, force.y, force.z, torque.x, torque.y, torque.z]
        };
        self.rows(py, "reactions", row).map(Some)
    }

    /// Paths of the watched points: dict of name to PointPath, with arrays (nt x 3) of position, deflection, velocity
    /// and acceleration.
    #[getter]
    fn paths<'py>(&self, py: Python<'py>) -> PyResult<PathsByName<'py>> {
        let (class, all) = (py.import("flexbody._types")?.getattr("PointPath")?, PyDict::new(py));
        for path in self.inner.paths() {
            let [place, deflection, velocity, acceleration] =
                [&path.place, &path.deflection, &path.velocity, &path.acceleration]
                    .map(|rows| triples(py, rows));
            all.set_item(path.name, class.call1((place?, deflection?, velocity?, acceleration?))?)?;
        }
        Ok(all)
    }

    /// Recoveries of the body over this motion, at its instants; None if the body has none.
    #[getter]
    fn recovered(&self) -> Option<Recovered> {
        self.inner.recovered().map(|rows| Recovered::new(Arc::clone(&self.body), rows))
    }

    /// Largest deflection of any node, also between the instants. Unit: length.
    #[getter]
    fn largest_deflection(&self) -> f64 {
        self.inner.largest_deflection()
    }

    /// Drift of energy less work, and of linear and angular momentum less their impulses, relative to the largest of
    /// the motion: (energy, linear, angular).
    #[getter]
    fn drift(&self) -> (f64, f64, f64) {
        let [energy, linear, angular] = self.inner.drift();
        (energy, linear, angular)
    }

    /// Number of steps of the integration.
    #[getter]
    fn steps(&self) -> u64 {
        self.inner.steps()
    }

    /// Warnings and notes, as a tuple of `Diagnostic`.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, self.inner.diagnostics())
    }

    /// Writes the motion to an HDF5 file, like `flexbody simulate -o`. The file appears complete or not at all.
    #[pyo3(signature = (path: "_Path"))]
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        brief(py, || self.inner.write(&path))
    }

    /// Returns the report of `flexbody simulate`: a dict with all numbers, or "json", "text", "html" as a str.
    #[pyo3(
        signature = (
            form: "Literal['dict']; Literal['json', 'text', 'html']" = None,
        ) -> "dict[str, Any]; str",
        text_signature = "($self, form=\"dict\")"
    )]
    fn report<'py>(&self, py: Python<'py>, form: Argument<'_, 'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, form, |format| self.inner.report(format))
    }

    /// Returns the table of `flexbody simulate --csv`, as a str.
    fn csv(&self) -> String {
        self.inner.csv()
    }

    fn __repr__(&self) -> String {
        format!("<flexbody.Motion: {} instants, {} steps>", self.inner.times().len(), self.inner.steps())
    }
}

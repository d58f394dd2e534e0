//! Methods of flexible bodies, and functions that read and list them.

use crate::arrays::{Given, by_node, matrix, matrix3, triples, vector};
use crate::body_class::Body;
use crate::equations::EquationsOfMotion;
use crate::errors::{diagnostics, exception, warn};
use crate::model::Model;
use crate::report::{loads, report};
use crate::scene::{Motion, Scene, Selection};
use crate::trade::{Trade, options as trade_options};
use crate::work::{alone, brief, run};
use flexbody::{FlexBody, Matrix, MotionHistory};
use numpy::{AllowTypeChange, PyArray1, PyArrayLike2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::path::PathBuf;
use std::sync::Arc;

#[pymethods]
impl Body {
    /// Name of the model.
    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    /// Units of length, mass and time as stated: ("mm", "t", "s"), or factors to SI.
    #[getter]
    fn units(&self) -> (&str, &str, &str) {
        let [length, mass, time] = self.inner.units();
        (length, mass, time)
    }

    /// Number of dimensions: 3, or 2 for a body that moves only in its plane z = 0.
    #[getter]
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    /// Number of nodes n.
    #[getter]
    fn n_nodes(&self) -> usize {
        self.inner.node_ids().len()
    }

    /// Number of modes nf.
    #[getter]
    fn n_modes(&self) -> usize {
        self.inner.n_modes()
    }

    /// Number of rows of the matrices; 0 if it is not known.
    #[getter]
    fn n_dofs(&self) -> usize {
        self.inner.n_dofs()
    }

    /// Structure of the mass matrix: "rotation-invariant", "diagonal" or "general".
    #[getter]
    fn mass_structure(&self) -> &str {
        self.inner.mass_structure()
    }

    /// Settings of the conversion that can change the result, as a dict.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        loads(py, &self.inner.settings_json())
    }

    /// Files that the body was made from: list of (role, name, SHA-256). Empty for matrices in memory.
    #[getter]
    fn sources(&self) -> Vec<(String, String, String)> {
        let files = self.inner.source_files().into_iter();
        files.map(|file| (file.role, file.name, file.sha256)).collect()
    }

    /// Warnings and notes of the conversion, as a tuple of `Diagnostic`; empty for a body that was read.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        diagnostics(py, &self.diagnostics)
    }

    /// Node numbers (n), int64.
    #[getter]
    fn node_ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "node_ids", || Ok(PyArray1::from_slice(py, self.inner.node_ids()).into_any()))
    }

    /// Positions of the nodes in the body frame (n x 3). Unit: length.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "positions", || triples(py, self.inner.positions()))
    }

    /// Origin of the body frame in model coordinates (3). Unit: length.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, "origin", self.inner.frame().0.as_slice())
    }

    /// Axes of the body frame as columns, in model axes (3 x 3): x_model = origin + axes @ x_body.
    #[getter]
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "axes", || matrix3(py, &self.inner.frame().1))
    }

    /// Frequencies of the modes, ascending (nf). Unit: Hz.
    #[getter]
    fn frequencies_hz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, "frequencies_hz", &self.inner.frequencies_hz())
    }

    /// Eigenvalues of the modes, omega^2 (nf). Unit: 1/time^2.
    #[getter]
    fn eigenvalues<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, "eigenvalues", self.inner.eigenvalues())
    }

    /// K-residuals |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) of the modes (nf).
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, "residuals", self.inner.residuals())
    }

    /// Damping ratios of the modes (nf).
    #[getter]
    fn damping_ratios<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, "damping_ratios", self.inner.damping_ratios())
    }

    /// Origin of each mode: "free mode", "imported shape", ...; empty if it is not known.
    #[getter]
    fn mode_origins(&self) -> Vec<String> {
        self.inner.mode_origins().to_vec()
    }

    /// Number of lowest modes among which no mode is missing, by proof; None without a proof.
    #[getter]
    fn proved_complete(&self) -> Option<usize> {
        self.inner.proved_complete()
    }

    /// Psi (nf x n x 3): displacements of the nodes in each mode, shapes[j] for mode j. Unit: 1/sqrt(mass).
    #[getter]
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "shapes", || by_node(py, &self.inner.shapes()))
    }

    /// Rotations of the nodes in each mode (nf x n x 3), zero at nodes without rotations; None for models with
    /// displacements only. Unit: 1/(length sqrt(mass)).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "rotations", || match self.inner.rotations() {
            Some(rotations) => by_node(py, &rotations),
            None => Ok(py.None().into_bound(py)),
        })
    }

    /// Mass m. Unit: mass.
    #[getter]
    fn mass(&self) -> f64 {
        self.inner.mass()
    }

    /// First moment c = sum m x (3). Unit: mass length.
    #[getter]
    fn first_moment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.numbers(py, "first_moment", self.inner.first_moment().as_slice())
    }

    /// Second moment J = sum m x x' (3 x 3). Unit: mass length^2.
    #[getter]
    fn second_moment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "second_moment", || matrix3(py, &self.inner.second_moment()))
    }

    /// I0 (3 x 3): inertia of the undeformed body. Unit: mass length^2.
    #[getter(I0)]
    fn i0<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cache.get(py, "I0", || matrix3(py, &self.inner.inertia()))
    }

    /// W0 (3 x 3nf): linear momentum of rotation, linear in the modal coordinates. Unit: sqrt(mass).
    #[getter(W0)]
    fn w0<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "W0", |body| Some(body.w0()))
    }

    /// W1 (3 x 3nf): inertia linear in q, I(q) = I0 + W1 Q + Q'W2 Q with Q = kron(eye(3), q). None for a body made for
    /// a scene that does not need it. Unit: sqrt(mass) length.
    #[getter(W1)]
    fn w1<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "W1", FlexBody::w1)
    }

    /// W2 (3nf x 3nf): inertia quadratic in q. None for a body made for a scene that does not need it. Unit: 1.
    #[getter(W2)]
    fn w2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "W2", FlexBody::w2)
    }

    /// W3 (3nf x nf): coupling of rotation and modes through q. None for a body made for a scene that does not need it.
    /// Unit: 1.
    #[getter(W3)]
    fn w3<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "W3", FlexBody::w3)
    }

    /// C1 (3 x nf): coupling of translation and modes; zero for free modes. Unit: sqrt(mass).
    #[getter(C1)]
    fn c1<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "C1", |body| Some(body.c1()))
    }

    /// C2 (3 x nf): coupling of rotation and modes in the undeformed body; zero for free modes. Unit: sqrt(mass)
    /// length.
    #[getter(C2)]
    fn c2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "C2", |body| Some(body.c2()))
    }

    /// Modal mass m_ff = Psi' M Psi (nf x nf). Unit: 1.
    #[getter]
    fn modal_mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "modal_mass", |body| Some(body.modal_mass()))
    }

    /// Modal stiffness K_ff = Psi' K Psi (nf x nf). Unit: 1/time^2.
    #[getter]
    fn modal_stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "modal_stiffness", |body| Some(body.modal_stiffness()))
    }

    /// D (nf x nf): modal damping; diag(2 zeta_j omega_j) if only ratios are known. Unit: 1/time.
    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrix(py, "damping", |body| Some(body.damping()))
    }

    /// Geometric stiffness Psi' K_geo Psi (nf x nf) of unit loads: dict of load ("spin_xx", "force_z_tip", ...) to
    /// array. Unit: 1/time^2 per unit of the load.
    #[getter]
    fn geometric_stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for one in self.inner.geometric_stiffness() {
            all.set_item(one.load, matrix(py, &one.matrix)?)?;
        }
        Ok(all)
    }

    /// Stiffness of inertia (nf x nf) of nodes whose rotations carry mass, for unit loads: dict of load
    /// ("acceleration_x", "angular_acceleration_x", "spin_xx", ...) to array; empty if no rotation carries mass. It is
    /// added to K_ff like geometric stiffness. Unit: 1/time^2 per unit of the load.
    #[getter]
    fn inertia_stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for one in self.inner.inertia_stiffness() {
            all.set_item(one.load, matrix(py, &one.matrix)?)?;
        }
        Ok(all)
    }

    /// Interfaces: dict of name to Interface (node_ids, coupling, reference, translation, rotation).
    #[getter]
    fn interfaces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (class, all) = (py.import("flexbody._types")?.getattr("Interface")?, PyDict::new(py));
        let rows = |rows: Option<Matrix>| rows.map(|rows| matrix(py, &rows)).transpose();
        for one in self.inner.interfaces() {
            let interface = class.call1((
                PyArray1::from_vec(py, one.node_ids),
                one.coupling.map(|coupling| coupling.name()),
                one.reference.map(|reference| vector(py, &reference)),
                rows(one.translation)?,
                rows(one.rotation)?,
            ))?;
            all.set_item(one.name, interface)?;
        }
        Ok(all)
    }

    /// K and M in the nc interface coordinates of a Craig-Bampton body: InterfaceCoordinates (names, stiffness, mass,
    /// of_modes); None for other bodies.
    #[getter]
    fn interface_coordinates<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(coordinates) = self.inner.interface_coordinates() else { return Ok(None) };
        let class = py.import("flexbody._types")?.getattr("InterfaceCoordinates")?;
        let (stiffness, mass) = (matrix(py, &coordinates.stiffness)?, matrix(py, &coordinates.mass)?);
        class.call1((coordinates.names, stiffness, mass, matrix(py, &coordinates.of_modes)?)).map(Some)
    }

    /// Decisions about the groups of the kinetic energy: list of (name, true if it is kept, reason). Empty if no
    /// decision was made; all groups are then kept.
    #[getter]
    fn terms(&self) -> Vec<(&str, bool, &str)> {
        self.inner.terms()
    }

    /// Errors of lumped masses: dict of scheme to a dict of error norm to relative error.
    #[getter]
    fn lumped_errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (scheme, errors) in self.inner.lumped_errors() {
            let of_scheme = PyDict::new(py);
            errors.iter().try_for_each(|(name, value)| of_scheme.set_item(name, value))?;
            all.set_item(scheme, of_scheme)?;
        }
        Ok(all)
    }

    /// Checks all identities of the numbers of the body: list of Identity (name, value, limit, holds).
    fn identities<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let class = py.import("flexbody._types")?.getattr("Identity")?;
        let all = brief(py, || Ok(self.inner.identities()))?;
        all.iter().map(|one| class.call1((one.name, one.value, one.limit, one.holds))).collect()
    }

    /// Returns the equations of motion of the body, with all terms that it holds.
    fn equations_of_motion(&self) -> EquationsOfMotion {
        EquationsOfMotion::new(Arc::clone(&self.inner))
    }

    /// Writes a flex-body file (HDF5, docs/reference/file_format.md), which appears complete or not at all. The bytes
    /// are those of `flexbody convert` for the same model and settings.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        brief(py, || self.inner.write(&path))
    }

    /// Writes the body in a format of another program, by its name on the command line (docs/reference/exports.md):
    /// the file, and further files beside it. Properties that the format cannot hold cause warnings. Returns these
    /// warnings and notes.
    fn export<'py>(&self, py: Python<'py>, format: &str, path: PathBuf) -> PyResult<Bound<'py, PyTuple>> {
        let said = brief(py, || self.inner.export(format, &path))?;
        warn(py, &said)?;
        diagnostics(py, &said)
    }

    /// Writes a picture of the body in the motion of its simulation: "vtk" for ParaView (a .pvd file with a .vtu file
    /// for each instant beside it), "gltf" for viewers and web pages (a .glb file). Properties that the picture leaves
    /// out cause warnings. Returns these warnings and notes.
    ///
    /// Raises InputError for a format without motion, and for the motion of another body.
    fn export_motion<'py>(
        &self,
        py: Python<'py>,
        format: &str,
        motion: &Motion,
        path: PathBuf,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let said = brief(py, || self.inner.export_motion(format, motion.inner(), &path))?;
        warn(py, &said)?;
        diagnostics(py, &said)
    }

    /// Decides which terms and modes the body needs in a scene: a Scene, a list of load cases, or the path of a scene
    /// file.
    fn select(&self, py: Python<'_>, scene: &Bound<'_, PyAny>) -> PyResult<Selection> {
        let (scene, body) = (Scene::whole(py, scene)?, Arc::clone(&self.inner));
        Selection::with_warnings(py, run(py, move |listener| body.select_with_progress(&scene, listener))?)
    }

    /// Returns the body with some of its modes (numbers from 1, ascending; all by default) and groups of terms: "W1", "W2",
    /// "W3" with commas, "none", "all", or those of a guideline: "I", "II", "III", "IV".
    #[pyo3(signature = (modes=None, terms="all"))]
    fn subset(&self, py: Python<'_>, modes: Option<Vec<usize>>, terms: &str) -> PyResult<Self> {
        let body = self.inner.subset(modes.as_deref(), terms).map_err(|error| exception(py, &error))?;
        Ok(Body::new(body, Vec::new()))
    }

    /// Simulates the body in a scene: a Scene, or the path of a scene file without load cases.
    fn simulate(&self, py: Python<'_>, scene: &Bound<'_, PyAny>) -> PyResult<Motion> {
        let (scene, body) = (Scene::one(py, scene)?, Arc::clone(&self.inner));
        Motion::with_warnings(py, run(py, move |listener| body.simulate_with_progress(&scene, listener))?)
    }

    /// Measures the errors of a run of this body in a scene by another program. `history` is the path of a table with the
    /// columns time, q_1 to q_n and attitude_0 to attitude_3, or a tuple of time (nt), q (nt x nf) and attitude (nt x 4, or
    /// None). The reference is the motion of `reference`, a body with more modes of `model`, or of this body itself.
    ///
    /// Returns the report of `flexbody measure` as a dict.
    #[pyo3(signature = (scene, history, *, reference=None, model=None))]
    fn measure<'py>(
        &self,
        py: Python<'py>,
        scene: &Bound<'py, PyAny>,
        history: &Bound<'py, PyAny>,
        reference: Option<&Bound<'py, Self>>,
        model: Option<&Bound<'py, Model>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (scene, body) = (Scene::one(py, scene)?, Arc::clone(&self.inner));
        let history = motion_history(py, history, self.inner.n_modes())?;
        let reference = match (reference, model) {
            (Some(reference), Some(model)) => {
                Some((Arc::clone(&reference.get().inner), model.get().shared()))
            }
            (None, None) => None,
            _ => return Err(PyValueError::new_err("`reference` and `model` belong together")),
        };
        let run = run(py, move |listener| {
            let reference = reference.as_ref().map(|(body, model)| (&**body, &**model));
            body.measure(&scene, &history, reference, listener)
        })?;
        warn(py, run.diagnostics())?;
        report(py, "dict", |format| run.report(format))
    }

    /// Measures accuracy against cost in a scene for reduced versions of this body. `Model.trade` compares conversions.
    #[pyo3(signature = (scene, *, repeat=3))]
    fn trade(&self, py: Python<'_>, scene: &Bound<'_, PyAny>, repeat: usize) -> PyResult<Trade> {
        let (scene, body) = (Scene::whole(py, scene)?, Arc::clone(&self.inner));
        let options = trade_options(self.inner.n_modes(), repeat, "full")?;
        Trade::with_warnings(py, run(py, move |listener| body.trade(&scene, &options, listener))?)
    }

    /// Returns the report of `flexbody inspect`: a dict with all numbers, or "json", "text", "html" as a str.
    #[pyo3(signature = (form="dict"))]
    fn report<'py>(&self, py: Python<'py>, form: &str) -> PyResult<Bound<'py, PyAny>> {
        report(py, form, |format| self.inner.report(format))
    }

    fn __repr__(&self) -> String {
        let (nodes, modes) = (self.inner.node_ids().len(), self.inner.n_modes());
        let hertz = self.inner.frequencies_hz();
        let (first, last) = (hertz.first().copied().unwrap_or(0.0), hertz.last().copied().unwrap_or(0.0));
        let name = self.inner.name();
        format!("<flexbody.Body {name:?}: {nodes} nodes, {modes} modes, {first:.6} to {last:.6} Hz>")
    }
}

/// Returns the history that a caller gives: the path of a table, or a tuple of time, q and attitude or None.
fn motion_history(py: Python<'_>, given: &Bound<'_, PyAny>, n_modes: usize) -> PyResult<MotionHistory> {
    type Rows<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;
    let history = match given.extract::<(Given<'_>, Rows<'_>, Option<Rows<'_>>)>() {
        Ok((time, q, attitude)) => {
            let rows = |rows: &Rows<'_>| -> Vec<Vec<f64>> {
                rows.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
            };
            let four = |row: Vec<f64>| {
                <[f64; 4]>::try_from(row)
                    .map_err(|_| PyValueError::new_err("`attitude` does not have four columns"))
            };
            let attitude = attitude.map(|all| rows(&all).into_iter().map(four).collect()).transpose()?;
            MotionHistory::new(time.as_array().to_vec(), rows(&q), attitude)
        }
        Err(_) => MotionHistory::read(given.extract::<PathBuf>()?, n_modes),
    };
    history.map_err(|error| exception(py, &error))
}

/// Reads a flex-body file.
///
/// Raises InputError if it cannot be read or has a newer format, CheckError if it violates its schema or was changed
/// since it was written.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Body> {
    Ok(Body::new(alone(py, || FlexBody::read(&path))?, Vec::new()))
}

/// Returns the formats that `Body.export` writes: dict of name to the programs that read it.
#[pyfunction]
pub fn export_formats(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    FlexBody::export_formats().into_iter().try_for_each(|(name, reader)| all.set_item(name, reader))?;
    Ok(all)
}

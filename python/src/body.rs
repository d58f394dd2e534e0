//! Methods of flexible bodies, and functions that read and list them.

use crate::arguments::{Argument, counts, path, positive, real, text, texts, units};
use crate::arrays::{by_node, matrix, matrix3, triples, vector};
use crate::body_arguments::{attached_mass, motion_history, points_of, recorded};
use crate::body_class::Body;
use crate::channels::Channels;
use crate::checks::{Check, Comparison, View, identities, tolerances};
use crate::choice::called;
use crate::equations::EquationsOfMotion;
use crate::errors::{diagnostics, value, value_error, warn};
use crate::model::model_for;
use crate::recovered::Recovered;
use crate::report::{loads, report};
use crate::response::{Response, ResponseArguments};
use crate::scene::{Motion, Scene, Selection};
use crate::trade::{Trade, options as trade_options};
use crate::types::{
    Diagnostics, ErrorsByScheme, Floats, FloatsByName, FloatsOrNone, IdentityTuple, Integers,
    InterfaceCoordinatesTuple, InterfacesByName, Json,
};
use crate::work::{brief, run};
use flexbody::{ExportOptions, FlexBody, Matrix, Ranges};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyTuple};
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
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Json<'py>> {
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
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, &self.diagnostics)
    }

    /// Node numbers (n), int64.
    #[getter]
    fn node_ids<'py>(&self, py: Python<'py>) -> PyResult<Integers<'py>> {
        self.cache.get(py, "node_ids", || Ok(PyArray1::from_slice(py, self.inner.node_ids()).into_any()))
    }

    /// Positions of the nodes in the body frame (n x 3). Unit: length.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "positions", || triples(py, self.inner.positions()))
    }

    /// Origin of the body frame in model coordinates (3). Unit: length.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "origin", self.inner.frame().0.as_slice())
    }

    /// Axes of the body frame as columns, in model axes (3 x 3): x_model = origin + axes @ x_body.
    #[getter]
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "axes", || matrix3(py, &self.inner.frame().1))
    }

    /// Frequencies of the modes, ascending (nf). Unit: Hz.
    #[getter]
    fn frequencies_hz<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "frequencies_hz", &self.inner.frequencies_hz())
    }

    /// Eigenvalues of the modes, omega^2 (nf). Unit: 1/time^2.
    #[getter]
    fn eigenvalues<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "eigenvalues", self.inner.eigenvalues())
    }

    /// K-residuals |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|) of the modes (nf).
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "residuals", self.inner.residuals())
    }

    /// Damping ratios of the modes (nf).
    #[getter]
    fn damping_ratios<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
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
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "shapes", || by_node(py, &self.inner.shapes()))
    }

    /// Rotations of the nodes in each mode (nf x n x 3), zero at nodes without rotations; None for models with
    /// displacements only. Unit: 1/(length sqrt(mass)).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<FloatsOrNone<'py>> {
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
    fn first_moment<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.numbers(py, "first_moment", self.inner.first_moment().as_slice())
    }

    /// Second moment J = sum m x x' (3 x 3). Unit: mass length^2.
    #[getter]
    fn second_moment<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "second_moment", || matrix3(py, &self.inner.second_moment()))
    }

    /// I0 (3 x 3): inertia of the undeformed body. Unit: mass length^2.
    #[getter(I0)]
    fn i0<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.cache.get(py, "I0", || matrix3(py, &self.inner.inertia()))
    }

    /// W0 (3 x 3nf): linear momentum of rotation, linear in the modal coordinates. Unit: sqrt(mass).
    #[getter(W0)]
    fn w0<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.matrix(py, "W0", |body| Some(body.w0()))
    }

    /// W1 (3 x 3nf): inertia linear in q, I(q) = I0 + W1 Q + Q'W2 Q with Q = kron(eye(3), q). None for a body made for
    /// a scene that does not need it. Unit: sqrt(mass) length.
    #[getter(W1)]
    fn w1<'py>(&self, py: Python<'py>) -> PyResult<FloatsOrNone<'py>> {
        self.matrix(py, "W1", FlexBody::w1)
    }

    /// W2 (3nf x 3nf): inertia quadratic in q. None for a body made for a scene that does not need it. Unit: 1.
    #[getter(W2)]
    fn w2<'py>(&self, py: Python<'py>) -> PyResult<FloatsOrNone<'py>> {
        self.matrix(py, "W2", FlexBody::w2)
    }

    /// W3 (3nf x nf): coupling of rotation and modes through q. None for a body made for a scene that does not need it.
    /// Unit: 1.
    #[getter(W3)]
    fn w3<'py>(&self, py: Python<'py>) -> PyResult<FloatsOrNone<'py>> {
        self.matrix(py, "W3", FlexBody::w3)
    }

    /// C1 (3 x nf): coupling of translation and modes; zero for free modes. Unit: sqrt(mass).
    #[getter(C1)]
    fn c1<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.matrix(py, "C1", |body| Some(body.c1()))
    }

    /// C2 (3 x nf): coupling of rotation and modes in the undeformed body; zero for free modes. Unit: sqrt(mass)
    /// length.
    #[getter(C2)]
    fn c2<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.matrix(py, "C2", |body| Some(body.c2()))
    }

    /// Modal mass m_ff = Psi' M Psi (nf x nf). Unit: 1.
    #[getter]
    fn modal_mass<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.matrix(py, "modal_mass", |body| Some(body.modal_mass()))
    }

    /// Modal stiffness K_ff = Psi' K Psi (nf x nf). Unit: 1/time^2.
    #[getter]
    fn modal_stiffness<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.matrix(py, "modal_stiffness", |body| Some(body.modal_stiffness()))
    }

    /// D (nf x nf): modal damping; diag(2 zeta_j omega_j) if only ratios are known. Unit: 1/time.
    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        self.matrix(py, "damping", |body| Some(body.damping()))
    }

    /// Geometric stiffness Psi' K_geo Psi (nf x nf) of unit loads: dict of load ("spin_xx", "force_z_tip", ...) to
    /// array. Unit: 1/time^2 per unit of the load.
    #[getter]
    fn geometric_stiffness<'py>(&self, py: Python<'py>) -> PyResult<FloatsByName<'py>> {
        let all = PyDict::new(py);
        for stiffness in self.inner.geometric_stiffness() {
            all.set_item(stiffness.load, matrix(py, &stiffness.matrix)?)?;
        }
        Ok(all)
    }

    /// Stiffness of inertia (nf x nf) of nodes whose rotations carry mass, for unit loads: dict of load
    /// ("acceleration_x", "angular_acceleration_x", "spin_xx", ...) to array; empty if no rotation carries mass. It is
    /// added to K_ff like geometric stiffness. Unit: 1/time^2 per unit of the load.
    #[getter]
    fn inertia_stiffness<'py>(&self, py: Python<'py>) -> PyResult<FloatsByName<'py>> {
        let all = PyDict::new(py);
        for stiffness in self.inner.inertia_stiffness() {
            all.set_item(stiffness.load, matrix(py, &stiffness.matrix)?)?;
        }
        Ok(all)
    }

    /// Interfaces: dict of name to Interface (node_ids, coupling, reference, translation, rotation).
    #[getter]
    fn interfaces<'py>(&self, py: Python<'py>) -> PyResult<InterfacesByName<'py>> {
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
    fn interface_coordinates<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<InterfaceCoordinatesTuple<'py>>> {
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
    fn lumped_errors<'py>(&self, py: Python<'py>) -> PyResult<ErrorsByScheme<'py>> {
        let all = PyDict::new(py);
        for (scheme, errors) in self.inner.lumped_errors() {
            let of_scheme = PyDict::new(py);
            errors.iter().try_for_each(|(name, value)| of_scheme.set_item(name, value))?;
            all.set_item(scheme, of_scheme)?;
        }
        Ok(all)
    }

    /// Checks all identities of the numbers of the body: list of Identity (name, value, limit, holds).
    fn identities<'py>(&self, py: Python<'py>) -> PyResult<Vec<IdentityTuple<'py>>> {
        identities(py, &brief(py, || Ok(self.inner.identities()))?)
    }

    /// Returns the equations of motion of the body, with all terms that it holds.
    fn equations_of_motion(&self) -> EquationsOfMotion {
        EquationsOfMotion::new(Arc::clone(&self.inner))
    }

    /// Writes a flex-body file (HDF5, docs/reference/file_format.md), which appears complete or not at all. The bytes
    /// are those of `flexbody convert` for the same model and settings.
    #[pyo3(signature = (path: "_Path"))]
    fn write(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = self::path(path, "path")?;
        brief(py, || self.inner.write(&path))
    }

    /// Writes the body in a format of another program, by its name on the command line (docs/reference/exports.md):
    /// the file, and further files beside it. Returns warnings and notes; warnings are issued as well.
    ///
    /// `points` are the places of the body in the file: "nodes", "interfaces", numbers of nodes, or both as in
    /// "interfaces,17,23". `dialect` is one of the format, `to_units` the units of the file. A picture ("vtk", "gltf")
    /// shows the first `modes`, or a `motion` (a Motion, or the path of its file). `scene` is one for which the errors
    /// of losses are stated that grow with the motion. With `allow_loss` the file is written even if the format cannot hold
    /// all of the body; with names of properties ("damping", or a list), only these may be lost. Losses are then warnings,
    /// as losses are without it that change deflections of the scene by less than 5 %, or that only a motion causes.
    ///
    /// Raises InputError for properties that the format cannot hold (FB720), options that it does not have, and the motion
    /// of another body.
    #[pyo3(
        signature = (
            format: "_types.ExportFormat",
            path: "_Path",
            *,
            points: "_types.Points | None" = None,
            dialect: "_types.Dialect | None" = None,
            to_units: "_types.Units | None" = None,
            modes: "int | None" = None,
            motion: "Motion | _Path | None" = None,
            scene: "_Cases | None" = None,
            allow_loss: "bool | str | Sequence[str]" = None,
        ),
        text_signature = "($self, format, path, *, points=None, dialect=None, to_units=None, modes=None, motion=None, scene=None, allow_loss=False)"
    )]
    #[allow(clippy::too_many_arguments)] // the keywords of a Python function
    fn export<'py>(
        &self,
        py: Python<'py>,
        format: &Bound<'py, PyAny>,
        path: &Bound<'py, PyAny>,
        points: Argument<'_, 'py>,
        dialect: Argument<'_, 'py>,
        to_units: Argument<'_, 'py>,
        modes: Argument<'_, 'py>,
        motion: Argument<'_, 'py>,
        scene: Argument<'_, 'py>,
        allow_loss: Argument<'_, 'py>,
    ) -> PyResult<Diagnostics<'py>> {
        let (format, path) = (text(format, "format")?, self::path(path, "path")?);
        let mut options = ExportOptions::default();
        if let Some(points) = points {
            options = options.points(points_of(points)?);
        }
        if let Some(dialect) = dialect {
            options = options.dialect(text(dialect, "dialect")?);
        }
        if let Some(given) = to_units {
            options = options.to_units(units(given, "to_units")?);
        }
        if let Some(modes) = modes {
            options = options.modes(positive(modes, "modes")?);
        }
        if let Some(motion) = motion {
            options = options.recorded_motion(recorded(motion)?);
        }
        if let Some(scene) = scene {
            options = options.scene(&Scene::whole(scene)?);
        }
        if let Some(allowed) = allow_loss.filter(|allowed| !allowed.is_instance_of::<PyBool>()) {
            options = value(py, options.allow_losses_of(texts(allowed, "allow_loss")?))?;
        } else if allow_loss.map(|any| any.extract()).transpose()?.unwrap_or(false) {
            options = options.allow_loss();
        }
        let body = Arc::clone(&self.inner);
        let said = run(py, move |_| body.export(&format, &path, &options))?;
        warn(py, &said)?;
        diagnostics(py, &said)
    }

    /// Checks every identity of the body and, `against` the model that it was made of (a Model, or the path of its
    /// manifest or job), every invariant and every mode, like `flexbody check`.
    #[pyo3(signature = (against: "Model | _Path | None" = None))]
    fn check(&self, py: Python<'_>, against: Argument<'_, '_>) -> PyResult<Check> {
        let body = Arc::clone(&self.inner);
        let model = against.map(|given| model_for(given, "against", Arc::clone(&body))).transpose()?;
        let inner = run(py, move |_| body.check(model.as_deref()))?;
        warn(py, inner.diagnostics())?;
        Ok(Check { inner })
    }

    /// Compares another body (a Body, or the path of its file) with this one, like `flexbody compare`. With `common` only
    /// the modes and the groups of the kinetic energy that both have are compared. The tolerances are relative; 1e-9 without, 1e-8 for `invariants`.
    #[pyo3(
        signature = (
            other: "Body | _Path",
            *,
            common=false,
            frequency: "float | None" = None,
            mass: "float | None" = None,
            centre_of_mass: "float | None" = None,
            inertia: "float | None" = None,
            invariants: "float | None" = None,
        )
    )]
    #[allow(clippy::too_many_arguments)] // the keywords of a Python function
    fn compare(
        &self,
        py: Python<'_>,
        other: &Bound<'_, PyAny>,
        common: bool,
        frequency: Argument<'_, '_>,
        mass: Argument<'_, '_>,
        centre_of_mass: Argument<'_, '_>,
        inertia: Argument<'_, '_>,
        invariants: Argument<'_, '_>,
    ) -> PyResult<Comparison> {
        let tolerances = tolerances([
            ("frequency", frequency),
            ("mass", mass),
            ("centre_of_mass", centre_of_mass),
            ("inertia", inertia),
            ("invariants", invariants),
        ])?;
        let (body, other) = (Arc::clone(&self.inner), Body::given(other, "other")?);
        let compare = if common { FlexBody::compare_common } else { FlexBody::compare };
        let inner = run(py, move |_| compare(&body, &other, &tolerances))?;
        Ok(Comparison { inner })
    }

    /// Computes the frequency response between places, like `flexbody response` without a model: its errors are unknown.
    /// `Model.response` computes them, and describes the arguments.
    #[pyo3(
        signature = (
            source: "_types.Places | None" = None,
            target: "_types.Places | None" = None,
            *,
            base: "str | None" = None,
            rows: "str | Sequence[str] | None" = None,
            psd: "_Path | None" = None,
            band: "tuple[float, float] | None" = None,
            scene: "_Scene | None" = None,
            damping: "float | None" = None,
            points: "int" = None,
        ),
        text_signature = "($self, source=None, target=None, *, base=None, rows=None, psd=None, band=None, scene=None, damping=None, points=400)"
    )]
    #[allow(clippy::too_many_arguments)] // the keywords of a Python function
    fn response(
        &self,
        py: Python<'_>,
        source: Argument<'_, '_>,
        target: Argument<'_, '_>,
        base: Argument<'_, '_>,
        rows: Argument<'_, '_>,
        psd: Argument<'_, '_>,
        band: Argument<'_, '_>,
        scene: Argument<'_, '_>,
        damping: Argument<'_, '_>,
        points: Argument<'_, '_>,
    ) -> PyResult<Response> {
        let (tolerance, solves) = (None, None);
        let stated = ResponseArguments {
            source,
            target,
            base,
            rows,
            psd,
            band,
            scene,
            damping,
            tolerance,
            points,
            solves,
        };
        let (options, body) = (stated.options(py)?, Arc::clone(&self.inner));
        Response::with_warnings(py, run(py, move |listener| body.response(&options, listener))?, 0)
    }

    /// Names of the recoveries of the body: stresses, strains and forces that `recover` computes.
    #[getter]
    fn recoveries(&self) -> Vec<&str> {
        self.inner.recoveries()
    }

    /// Names of the named loads of the body, preloads included.
    #[getter]
    fn named_loads(&self) -> Vec<&str> {
        self.inner.named_loads()
    }

    /// Computes the recoveries of the body over a motion of any program, like `flexbody recover`: all, or `only` those
    /// with these names.
    ///
    /// `history` is the path of a table (docs/reference/recovery.md), or a dict of "time" (nt), "q" (nt x nf),
    /// "angular_velocity" (nt x 3), if the body has columns of forces of motion "qd", "qdd" (nt x nf) and
    /// "angular_acceleration" (nt x 3), "loads", a dict of interface to a tuple of forces and torques (nt x 3 each) at its
    /// reference point, and "amplitudes", a dict of named load to its amplitudes (nt). Vectors are along the axes of the
    /// model, which turn with the body. Interfaces without loads count as unloaded, named loads without amplitudes as zero;
    /// preloads act always and take none. `carried_by` names the interface (or the number of the node) in whose frame the
    /// motion is, that of a body carried by it.
    #[pyo3(
        signature = (
            history: "_types.History",
            only: "str | Sequence[str] | None" = None,
            carried_by: "str | None" = None,
        )
    )]
    fn recover(
        &self,
        py: Python<'_>,
        history: &Bound<'_, PyAny>,
        only: Argument<'_, '_>,
        carried_by: Argument<'_, '_>,
    ) -> PyResult<Recovered> {
        let carrier = carried_by.map(|carrier| text(carrier, "carried_by")).transpose()?;
        Recovered::of(py, Arc::clone(&self.inner), history, only, carrier.as_deref())
    }

    /// Returns the factor of each FE step over a motion of any program, like `flexbody recover --channels`, for a program
    /// that superposes the results of the steps: Channels with names (nc) and values (nt x nc).
    ///
    /// `history` is one as for `recover`, `shapes` the archive (.npz) that `flexbody shapes` wrote with the steps. Raises
    /// InputError for steps of another body, of other modes or terms (FB326).
    #[pyo3(signature = (history: "_types.History", shapes: "_Path"))]
    fn channels(
        &self,
        py: Python<'_>,
        history: &Bound<'_, PyAny>,
        shapes: &Bound<'_, PyAny>,
    ) -> PyResult<Channels> {
        Channels::of(py, Arc::clone(&self.inner), history, shapes)
    }

    /// Returns the page of `flexbody view`: of the modes of the body, or of a motion (a Motion, or the path of its file).
    /// `triangles` limits the surface; without it the page stays below 10 MB.
    ///
    /// With `recovery`, the name of a recovery, the modes have the colours of its equivalent stress of von Mises, per unit of
    /// the largest displacement. With `envelope`, the path of a table (.csv) of `Recovered.write_envelope` or
    /// `write_envelope_of_cases`, the body, at rest or in the motion, has the colours of the largest equivalent stresses.
    /// Raises InputError for stresses that cannot be drawn (FB221).
    #[pyo3(
        signature = (
            motion: "Motion | _Path | None; None" = None,
            *,
            recovery: "None; str" = None,
            envelope: "_Path | None; None" = None,
            triangles: "int | None" = None,
        )
    )]
    fn view(
        &self,
        py: Python<'_>,
        motion: Argument<'_, '_>,
        recovery: Argument<'_, '_>,
        envelope: Argument<'_, '_>,
        triangles: Argument<'_, '_>,
    ) -> PyResult<View> {
        View::of(py, Arc::clone(&self.inner), motion, recovery, envelope, triangles)
    }

    /// Returns which terms of the equations of motion a body needs for ranges of its motion, like `flexbody advise`, as a
    /// dict: the largest rotation rate `spin` in Hz, the largest `deflection` of a node (that which the rotation causes without),
    /// the `duration` of the motions (five revolutions without), and the mass `attached` to it, or a tuple of the mass and the
    /// interface that carries it.
    #[pyo3(
        signature = (
            *,
            spin: "float" = None,
            deflection: "float | None" = None,
            duration: "float | None" = None,
            attached: "_types.Attached | None" = None,
            rotation_given=false,
            limit: "float" = None,
        ),
        text_signature = "($self, *, spin=0.0, deflection=None, duration=None, attached=None, rotation_given=False, limit=0.05)"
    )]
    fn advise<'py>(
        &self,
        py: Python<'py>,
        spin: Argument<'_, 'py>,
        deflection: Argument<'_, 'py>,
        duration: Argument<'_, 'py>,
        attached: Argument<'_, 'py>,
        rotation_given: bool,
        limit: Argument<'_, 'py>,
    ) -> PyResult<Json<'py>> {
        let or = |given: Argument<'_, 'py>, name: &str, default: f64| {
            given.map_or(Ok(default), |given| real(given, name))
        };
        let ranges = Ranges {
            spin_hz: or(spin, "spin", 0.0)?,
            deflection: deflection.map(|given| real(given, "deflection")).transpose()?,
            duration: duration.map(|given| real(given, "duration")).transpose()?,
            attached: attached.map(attached_mass).transpose()?,
            is_rotation_given: rotation_given,
            limit: or(limit, "limit", 0.05)?,
        };
        let advice = value(py, self.inner.advise(ranges))?;
        report(py, None, |format| advice.report(self.inner.name(), format))
    }

    /// Decides which terms and modes the body needs in a scene: a Scene, a list of load cases, or the path of a scene
    /// file.
    #[pyo3(signature = (scene: "_Cases"))]
    fn select(&self, py: Python<'_>, scene: &Bound<'_, PyAny>) -> PyResult<Selection> {
        let (scene, body) = (Scene::whole(scene)?, Arc::clone(&self.inner));
        Selection::with_warnings(py, run(py, move |listener| body.select_with_progress(&scene, listener))?)
    }

    /// Returns the body with some of its modes (numbers from 1, ascending; all by default) and groups of terms: "W1", "W2",
    /// "W3" with commas, "none", "all", or those of a guideline: "I", "II", "III", "IV". `fixed_interface_modes` are the numbers
    /// of those that a Craig-Bampton body keeps beside all motions of its interfaces; `modes` refers to the modes of the body
    /// that this leaves. With `storage` "f32" its shapes and the inertia of its modes are rounded to 32-bit floats. Like
    /// `flexbody reduce`.
    #[pyo3(
        signature = (
            modes: "Sequence[int] | None" = None,
            terms: "str" = None,
            *,
            fixed_interface_modes: "Sequence[int] | None" = None,
            storage: "Literal['f32'] | None" = None,
        ),
        text_signature = "($self, modes=None, terms=\"all\", *, fixed_interface_modes=None, storage=None)"
    )]
    fn subset(
        &self,
        py: Python<'_>,
        modes: Argument<'_, '_>,
        terms: Argument<'_, '_>,
        fixed_interface_modes: Argument<'_, '_>,
        storage: Argument<'_, '_>,
    ) -> PyResult<Self> {
        let modes = modes.map(|given| counts(given, "modes")).transpose()?;
        let fixed = fixed_interface_modes.map(|given| counts(given, "fixed_interface_modes")).transpose()?;
        let terms = terms.map_or_else(|| Ok("all".to_owned()), |terms| text(terms, "terms"))?;
        let whole = match fixed {
            Some(numbers) => &value(py, self.inner.with_fixed_interface_modes(&numbers))?,
            None => &self.inner,
        };
        let mut body = value(py, whole.subset(modes.as_deref(), &terms))?;
        if let Some(storage) = storage {
            called("storage", storage, &["f32"], |name| name)?;
            body = value(py, body.rounded_to_f32())?;
        }
        Ok(Body::new(body, Vec::new()))
    }

    /// Simulates the body in a scene: a Scene, or a scene as it takes one (a path, a text, a dict) without load cases. With
    /// `envelope` the largest stresses of every point of the recoveries over the continuous motion are found for
    /// `Motion.recovered.write_envelope`.
    #[pyo3(signature = (scene: "_Scene", *, envelope=false))]
    fn simulate(&self, py: Python<'_>, scene: &Bound<'_, PyAny>, envelope: bool) -> PyResult<Motion> {
        let (scene, body) = (Scene::one(scene)?, Arc::clone(&self.inner));
        let motion = run(py, move |listener| match envelope {
            true => body.simulate_with_envelope(&scene, listener),
            false => body.simulate_with_progress(&scene, listener),
        })?;
        Motion::with_warnings(py, motion, Arc::clone(&self.inner))
    }

    /// Measures the errors of a run of this body in a scene by another program. `history` is the path of a table with the
    /// columns time, q_1 to q_n and attitude_0 to attitude_3, or a tuple of time (nt), q (nt x nf) and attitude (nt x 4, or
    /// None). The reference is the motion of `reference`, a body with more modes of `model`, or of this body itself.
    ///
    /// Returns the report of `flexbody measure` as a dict.
    #[pyo3(
        signature = (
            scene: "_Scene",
            history: "_Path | tuple[ArrayLike, ArrayLike, ArrayLike | None]",
            *,
            reference: "Body | _Path | None" = None,
            model: "Model | _Path | None" = None,
        )
    )]
    fn measure<'py>(
        &self,
        py: Python<'py>,
        scene: &Bound<'py, PyAny>,
        history: &Bound<'py, PyAny>,
        reference: Argument<'_, 'py>,
        model: Argument<'_, 'py>,
    ) -> PyResult<Json<'py>> {
        let (scene, body) = (Scene::one(scene)?, Arc::clone(&self.inner));
        let history = motion_history(history, self.inner.n_modes())?;
        let reference = match (reference, model) {
            (Some(reference), Some(model)) => {
                let reference = Body::given(reference, "reference")?;
                let model = model_for(model, "model", Arc::clone(&reference))?;
                Some((reference, model))
            }
            (None, None) => None,
            _ => {
                return Err(value_error(
                    py,
                    "one of `reference` and `model` is given, expected both or none",
                ));
            }
        };
        let run = run(py, move |listener| {
            let reference = reference.as_ref().map(|(body, model)| (&**body, &**model));
            body.measure(&scene, &history, reference, listener)
        })?;
        warn(py, run.diagnostics())?;
        report(py, None, |format| run.report(format))
    }

    /// Measures accuracy against cost in a scene for reduced versions of this body. `Model.trade` compares conversions.
    #[pyo3(
        signature = (scene: "_Cases", *, repeat: "int" = None),
        text_signature = "($self, scene, *, repeat=3)"
    )]
    fn trade(&self, py: Python<'_>, scene: &Bound<'_, PyAny>, repeat: Argument<'_, '_>) -> PyResult<Trade> {
        let (scene, body) = (Scene::whole(scene)?, Arc::clone(&self.inner));
        let options = trade_options(None, repeat, None)?;
        Trade::with_warnings(py, run(py, move |listener| body.trade(&scene, &options, listener))?)
    }

    /// Returns the report of `flexbody inspect`: a dict with all numbers, or "json", "text", "html" as a str.
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
        let (nodes, modes) = (self.inner.node_ids().len(), self.inner.n_modes());
        let hertz = self.inner.frequencies_hz();
        let (first, last) = (hertz.first().copied().unwrap_or(0.0), hertz.last().copied().unwrap_or(0.0));
        let name = self.inner.name();
        format!("<flexbody.Body {name:?}: {nodes} nodes, {modes} modes, {first:.6} to {last:.6} Hz>")
    }

    /// Returns the body itself: it cannot be changed.
    fn __copy__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (_memo: "object"))]
    fn __deepcopy__(this: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        this
    }

    #[pyo3(signature = () -> "tuple[Any, ...]")]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let bytes = brief(py, || self.inner.to_bytes())?;
        let restore = py.import("flexbody._flexbody")?.getattr("_restored")?;
        let found = diagnostics(py, &self.diagnostics)?;
        (restore, (PyBytes::new(py, &bytes), found)).into_pyobject(py)
    }

    fn _repr_html_(&self) -> String {
        self.inner.summary_html()
    }
}

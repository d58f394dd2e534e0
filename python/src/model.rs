//! Models, and their conversion.

use crate::arguments::{Argument, count, mistyped, path, positive, real, text};
use crate::arrays::rows_of_three;
use crate::body_class::Body;
use crate::choice::called;
use crate::errors::{diagnostics, value, value_error, warn};
use crate::response::{Response, ResponseArguments};
use crate::scene::{Scene, Selection};
use crate::trade::{Trade, options as trade_options};
use crate::types::{Diagnostics, Floats};
use crate::work::run;
use flexbody::{
    Accuracy, Basis, ConvertOptions, Coupling, Diagnostic, FlexBody, FrameChoice, ModelBuilder, SparseMatrix,
    StressLoads, StressNodes,
};
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A finite element model that passed every check: K and M are symmetric, K has the rigid motions and no other
/// zero-energy motion, M is positive semidefinite and fits the nodes.
///
/// `flexbody.model` makes one from matrices, `flexbody.read_model` from files.
#[pyclass(frozen, module = "flexbody")]
pub struct Model {
    inner: Arc<flexbody::Model>,
}

/// Square matrix in compressed columns: number of rows, pointers, rows, values.
#[derive(FromPyObject)]
pub struct Compressed<'py>(
    usize,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, f64>,
);

impl Compressed<'_> {
    fn matrix(&self, py: Python<'_>) -> PyResult<SparseMatrix> {
        let index = |array: &PyReadonlyArray1<'_, i64>| -> PyResult<Vec<usize>> {
            let negative = |_| value_error(py, "a sparse matrix has a negative index");
            array.as_array().iter().map(|&i| usize::try_from(i).map_err(negative)).collect()
        };
        let values: Vec<f64> = self.3.as_array().to_vec();
        value(py, SparseMatrix::from_csc(self.0, &index(&self.1)?, &index(&self.2)?, &values))
    }
}

/// Nodes of an interface: numbers, or the text of a region.
#[derive(FromPyObject)]
pub enum GivenNodes {
    /// Node numbers.
    Listed(Vec<i64>),
    /// Region, as `--interface` of the command line has it.
    Region(String),
}

/// Interface from `flexbody.model`: name, nodes, coupling, reference point.
type GivenInterface<'py> = (String, GivenNodes, Option<Bound<'py, PyAny>>, Option<[f64; 3]>);

/// Returns the coupling of this name.
fn coupling(name: Argument<'_, '_>) -> PyResult<Option<Coupling>> {
    name.map(|name| called("coupling", name, Coupling::ALL, Coupling::name)).transpose()
}

/// Checks whose findings are accepted, from `flexbody.model`.
#[derive(FromPyObject)]
pub enum AcceptedChecks {
    /// FB433, FB437 and FB460, or none.
    All(bool),
    /// Codes of the checks.
    Codes(Vec<String>),
}

/// Damping from `flexbody.model`.
#[derive(FromPyObject)]
pub enum Damping<'py> {
    /// One ratio for every mode.
    Ratio(f64),
    /// Factors alpha and beta of D = alpha M + beta K.
    Rayleigh(f64, f64),
    /// Ends of frequency bands in hertz, the last one infinite, each with its ratio.
    Bands(Vec<(f64, f64)>),
    /// Damping matrix D.
    Matrix(Compressed<'py>),
}

fn damped(py: Python<'_>, builder: ModelBuilder, damping: &Damping<'_>) -> PyResult<ModelBuilder> {
    Ok(match damping {
        Damping::Ratio(ratio) => builder.damping_ratio(*ratio),
        Damping::Rayleigh(alpha, beta) => builder.rayleigh_damping(*alpha, *beta),
        Damping::Bands(bands) => builder.damping_bands(bands),
        Damping::Matrix(matrix) => builder.damping_matrix(matrix.matrix(py)?),
    })
}

/// Returns the bases that are computed of a model. Imported shapes are read from a file, which is an option of the program
/// only.
pub fn computed_bases() -> Vec<Basis> {
    Basis::ALL.iter().copied().filter(|basis| *basis != Basis::Imported).collect()
}

/// Returns the basis of this name; the default without a name.
pub fn basis(name: Argument<'_, '_>) -> PyResult<Basis> {
    name.map_or(Ok(Basis::default()), |name| called("basis", name, &computed_bases(), Basis::name))
}

/// Returns the options of a conversion from names.
fn convert_options(
    modes: Argument<'_, '_>,
    max_frequency: Argument<'_, '_>,
    names: [Argument<'_, '_>; 3],
    comparators: bool,
) -> PyResult<ConvertOptions> {
    let [basis, accuracy, frame] = names;
    let mut options = ConvertOptions::default().basis(self::basis(basis)?);
    if let (Some(given), Some(_)) = (modes, max_frequency) {
        return Err(value_error(given.py(), "`modes` and `max_frequency` are given, expected one of them"));
    }
    if let Some(given) = modes {
        options = options.modes(count(given, "modes")?);
    }
    if let Some(given) = max_frequency {
        let hertz = real(given, "max_frequency")?;
        if hertz <= 0.0 {
            let message = format!("`max_frequency` is {hertz}, expected a positive number");
            return Err(value_error(given.py(), message));
        }
        options = options.below_hz(hertz);
    }
    if !comparators {
        options = options.without_comparators();
    }
    if let Some(given) = accuracy {
        options = options.accuracy(called("accuracy", given, Accuracy::ALL, Accuracy::name)?);
    }
    if let Some(given) = frame {
        options = options.frame(frame_choice(given)?);
    }
    Ok(options)
}

/// Returns the loads with these names, separated by commas.
fn stress_loads(given: &Bound<'_, PyAny>) -> PyResult<StressLoads> {
    let names = text(given, "geometric_stiffness")?;
    StressLoads::parse(&names).map_err(|name| {
        let message =
            format!("`geometric_stiffness` names {name:?}, expected spin, interfaces, loads or none");
        value_error(given.py(), message)
    })
}

/// Returns the nodes that a caller means: `nodes`, `surface`, or their numbers.
fn stress_nodes(given: &Bound<'_, PyAny>) -> PyResult<StressNodes> {
    if let Ok(name) = given.extract::<String>() {
        return match name.as_str() {
            "nodes" => Ok(StressNodes::All),
            "surface" => Ok(StressNodes::Surface),
            _ => Err(value_error(
                given.py(),
                format!("`nodes` is {name:?}, expected \"nodes\", \"surface\" or numbers"),
            )),
        };
    }
    let numbers = given
        .extract()
        .map_err(|_| mistyped(given, "nodes", "\"nodes\", \"surface\" or numbers of nodes"))?;
    Ok(StressNodes::These(numbers))
}

/// Returns the frame of this name.
pub fn frame_choice(given: &Bound<'_, PyAny>) -> PyResult<FrameChoice> {
    let name = text(given, "frame")?;
    let unknown = |expected| value_error(given.py(), format!("`frame` is {name:?}, {expected}"));
    name.parse().map_err(unknown)
}

/// Returns the model that a caller gives: a `Model`, or the path of a manifest or a job.
pub fn model_for(
    given: &Bound<'_, PyAny>,
    name: &str,
    body: Arc<FlexBody>,
) -> PyResult<Arc<flexbody::Model>> {
    if let Ok(model) = given.cast::<Model>() {
        return Ok(model.get().shared());
    }
    let path: PathBuf =
        given.extract().map_err(|_| mistyped(given, name, "a Model, or the path of a manifest or a job"))?;
    let read = run(given.py(), move |_| flexbody::Model::read_for(&body, path))?;
    Ok(Arc::new(read))
}

impl Model {
    /// Returns the model for work on another thread.
    pub fn shared(&self) -> Arc<flexbody::Model> {
        Arc::clone(&self.inner)
    }

    fn with_warnings(py: Python<'_>, inner: flexbody::Model) -> PyResult<Self> {
        warn(py, inner.diagnostics())?;
        Ok(Self { inner: Arc::new(inner) })
    }
}

#[pymethods]
impl Model {
    /// Makes a model from arrays, which `flexbody.model` prepares.
    #[staticmethod]
    #[pyo3(name = "_assembled")]
    #[pyo3(
        signature = (
            name,
            stiffness: "_Compressed",
            mass: "_Compressed",
            node_ids: "NDArray[np.int64]",
            positions: "_Floats",
            *,
            plane,
            dofs: "NDArray[np.int64] | None",
            interfaces: "Sequence[tuple[str, list[int] | str, str | None, tuple[float, float, float] | None]]",
            units: "tuple[str, str, str] | None",
            damping: "float | tuple[float, float] | list[tuple[float, float]] | _Compressed | None",
            residual_vectors: "tuple[bool, bool]",
            allow_implausible: "bool | list[str]",
            keep_soft_rotations,
        )
    )]
    #[allow(clippy::too_many_arguments)] // the keywords of a Python function
    fn assembled<'py>(
        py: Python<'py>,
        name: String,
        stiffness: Compressed<'py>,
        mass: Compressed<'py>,
        node_ids: PyReadonlyArray1<'py, i64>,
        positions: Bound<'py, PyArray2<f64>>,
        plane: bool,
        dofs: Option<PyReadonlyArray2<'py, i64>>,
        interfaces: Vec<GivenInterface<'py>>,
        units: Option<[String; 3]>,
        damping: Option<Damping<'py>>,
        residual_vectors: (bool, bool),
        allow_implausible: AcceptedChecks,
        keep_soft_rotations: bool,
    ) -> PyResult<Self> {
        let (stiffness, mass) = (stiffness.matrix(py)?, mass.matrix(py)?);
        let positions = rows_of_three(&positions, "nodes")?;
        let mut builder = flexbody::Model::builder(name, stiffness, mass)
            .nodes(node_ids.as_array().to_vec(), positions)
            .residual_vectors(residual_vectors.0, residual_vectors.1);
        if plane {
            builder = builder.plane();
        }
        if let Some(labels) = dofs {
            // The caller has checked the directions. Invalid ones are refused with the model.
            let label = |row: ArrayView1<'_, i64>| (row[0], u8::try_from(row[1]).unwrap_or(u8::MAX));
            builder = builder.dofs(labels.as_array().rows().into_iter().map(label).collect::<Vec<_>>());
        }
        for (name, nodes, how, reference) in interfaces {
            builder = match (nodes, coupling(how.as_ref())?, reference) {
                (GivenNodes::Region(region), how, reference) => {
                    let how = how.or(reference.and(Some(Coupling::Averaging)));
                    builder.interface_in(name, region, how, reference)
                }
                (GivenNodes::Listed(nodes), None, None) => builder.interface(name, nodes),
                (GivenNodes::Listed(nodes), how, reference) => {
                    builder.coupled_interface(name, nodes, how.unwrap_or(Coupling::Averaging), reference)
                }
            };
        }
        if let Some([length, mass, time]) = &units {
            builder = value(py, builder.units(length, mass, time))?;
        }
        if let Some(damping) = &damping {
            builder = damped(py, builder, damping)?;
        }
        builder = match allow_implausible {
            AcceptedChecks::All(false) => builder,
            AcceptedChecks::All(true) => builder.allow_implausible(),
            AcceptedChecks::Codes(codes) if codes.is_empty() => builder,
            AcceptedChecks::Codes(codes) => value(py, builder.accept(&codes.join(",")))?,
        };
        if keep_soft_rotations {
            builder = builder.keep_soft_rotations();
        }
        Self::with_warnings(py, run(py, move |_| builder.build())?)
    }

    /// Reads the model of a manifest, or of the job of an FE program, for `flexbody.read_model`.
    #[staticmethod]
    #[pyo3(name = "_read")]
    #[pyo3(
        signature = (
            path: "_Path",
            program: "str | None",
            units: "tuple[str, str, str] | None",
            sets: "Sequence[tuple[str, str, str | None]]",
            damping,
        )
    )]
    fn read<'py>(
        py: Python<'py>,
        path: &Bound<'py, PyAny>,
        program: Argument<'_, 'py>,
        units: Option<[String; 3]>,
        sets: Vec<(String, String, Option<Bound<'py, PyAny>>)>,
        damping: Option<String>,
    ) -> PyResult<Self> {
        let path = self::path(path, "path")?;
        let program = program.map(|program| text(program, "program")).transpose()?;
        if path.extension().is_some_and(|extension| extension == "toml") {
            if program.is_some() || units.is_some() || !sets.is_empty() || damping.is_some() {
                let message = "`program`, `units`, `interfaces` or `damping` is given together with a manifest (.toml), which states them itself: leave it out";
                return Err(value_error(py, message));
            }
            return Self::with_warnings(py, run(py, move |_| flexbody::Model::read(path))?);
        }
        let named = |(name, set, how): (String, String, Option<Bound<'py, PyAny>>)| {
            Ok((name, set, coupling(how.as_ref())?))
        };
        let sets: Vec<_> = sets.into_iter().map(named).collect::<PyResult<_>>()?;
        let read = run(py, move |_| {
            let sets: Vec<_> =
                sets.iter().map(|(name, set, how)| (name.as_str(), set.as_str(), *how)).collect();
            let units = units.as_ref().map(|units| units.each_ref().map(String::as_str));
            flexbody::Model::read_job(path, program.as_deref(), units, &sets, damping.as_deref())
        })?;
        Self::with_warnings(py, read)
    }

    /// Name of the model.
    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    /// Number of degrees of freedom N: rows of K and M.
    #[getter]
    fn n_dofs(&self) -> usize {
        self.inner.n_dofs()
    }

    /// Node numbers (n).
    #[getter]
    fn node_ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_slice(py, self.inner.node_ids())
    }

    /// Positions of the nodes in model axes (n x 3). Unit: length.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Floats<'py>> {
        crate::arrays::triples(py, self.inner.positions())
    }

    /// Warnings and notes of reading and checking, as a tuple of `Diagnostic`.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Diagnostics<'py>> {
        diagnostics(py, self.inner.diagnostics())
    }

    /// Model with stresses at nodes as a recovery, from the elements of its deck: `nodes` is "surface", "nodes" (all), or a
    /// sequence of node numbers. The assembled stiffness of the elements has to be K.
    ///
    /// Raises InputError.
    #[pyo3(
        signature = (nodes: "str | Sequence[int]", *, name: "str" = None),
        text_signature = "($self, nodes, *, name=\"stress\")"
    )]
    fn with_stresses(
        &self,
        py: Python<'_>,
        nodes: &Bound<'_, PyAny>,
        name: Option<String>,
    ) -> PyResult<Self> {
        let (nodes, name) = (stress_nodes(nodes)?, name.unwrap_or_else(|| "stress".to_owned()));
        let model = Arc::clone(&self.inner);
        let inner = run(py, move |_| model.with_stresses(name, nodes))?;
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Computes modes and invariants, like `flexbody.convert`.
    ///
    /// `geometric_stiffness` names loads whose stress stiffness is computed from the elements of the deck, separated by
    /// commas: "spin", "interfaces", "loads"; the assembled stiffness of the elements has to be K.
    ///
    /// With a `scene` (a `Scene`, the path of a scene file, or a list of load cases) the body has only the terms and
    /// modes that the scene needs; `Body.terms` gives the reasons. A selection that does not hold, or cannot be judged, is
    /// an error (FB557) unless `allow_unjudged` is true.
    ///
    /// Raises InputError, NumericalError or ResourceError.
    #[pyo3(
        signature = (
            *,
            modes: "int | None" = None,
            max_frequency: "float | None" = None,
            basis: "_types.Basis" = None,
            accuracy: "_types.Accuracy" = None,
            frame: "_types.Frame" = None,
            comparators=true,
            geometric_stiffness: "_types.StressLoads" = None,
            scene: "_Cases | None" = None,
            allow_unjudged=false,
        ),
        text_signature = "($self, *, modes=None, max_frequency=None, basis=\"free\", accuracy=\"standard\", frame=\"com\", comparators=True, geometric_stiffness=\"none\", scene=None, allow_unjudged=False)"
    )]
    #[allow(clippy::too_many_arguments)] // the keywords of a Python function
    fn convert(
        &self,
        py: Python<'_>,
        modes: Argument<'_, '_>,
        max_frequency: Argument<'_, '_>,
        basis: Argument<'_, '_>,
        accuracy: Argument<'_, '_>,
        frame: Argument<'_, '_>,
        comparators: bool,
        geometric_stiffness: Argument<'_, '_>,
        scene: Argument<'_, '_>,
        allow_unjudged: bool,
    ) -> PyResult<Body> {
        let mut options = convert_options(modes, max_frequency, [basis, accuracy, frame], comparators)?;
        if let Some(given) = geometric_stiffness {
            options = options.geometric_stiffness(stress_loads(given)?);
        }
        if allow_unjudged {
            if scene.is_none() {
                return Err(value_error(py, "`allow_unjudged` is given without a `scene`"));
            }
            options = options.allow_unjudged();
        }
        let model = Arc::clone(&self.inner);
        let (body, mut found): (flexbody::FlexBody, Vec<Diagnostic>) = match scene {
            None => {
                let made = run(py, move |listener| model.convert_with_progress(&options, listener))?;
                (made.body, made.diagnostics)
            }
            Some(scene) => {
                let scene = Scene::whole(scene)?;
                let (made, selection) =
                    run(py, move |listener| model.convert_for_with_progress(&scene, &options, listener))?;
                (made.body, [made.diagnostics, selection.diagnostics().to_vec()].concat())
            }
        };
        warn(py, &found)?;
        // Warnings about the model were issued when it was made.
        found.splice(0..0, self.inner.diagnostics().iter().cloned());
        Ok(Body::new(body, found))
    }

    /// Decides which terms and modes a body of the model needs in a scene, like `flexbody select model.toml`: a body with
    /// `modes` free modes (by default those of the band of the scene, or 20) and residual vectors is made and judged.
    #[pyo3(signature = (scene: "_Cases", *, modes: "int | None" = None))]
    fn select(
        &self,
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        modes: Argument<'_, '_>,
    ) -> PyResult<Selection> {
        let modes = modes.map(|given| count(given, "modes")).transpose()?;
        let (scene, model) = (Scene::whole(scene)?, Arc::clone(&self.inner));
        let selected = run(py, move |listener| model.select_with_progress(&scene, modes, listener))?;
        Selection::with_warnings(py, selected)
    }

    /// Measures accuracy against cost in a scene: candidate bodies against a reference, like `flexbody.trade`. With
    /// several load cases every candidate is measured in each of them and judged by the worst.
    #[pyo3(
        signature = (
            scene: "_Cases",
            *,
            modes: "int" = None,
            repeat: "int" = None,
            reference: "_types.Reference" = None,
        ),
        text_signature = "($self, scene, *, modes=20, repeat=3, reference=\"full\")"
    )]
    fn trade(
        &self,
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        modes: Argument<'_, '_>,
        repeat: Argument<'_, '_>,
        reference: Argument<'_, '_>,
    ) -> PyResult<Trade> {
        let (scene, options) = (Scene::whole(scene)?, trade_options(modes, repeat, reference)?);
        let model = Arc::clone(&self.inner);
        Trade::with_warnings(py, run(py, move |listener| model.trade(&scene, &options, listener))?)
    }

    /// Computes the frequency response between places, and its difference from the response of all nodes, like `flexbody
    /// response`: of `body`, which was made of this model, or of a body that is made now.
    ///
    /// `source` and `target` are the places of unit forces and of measured displacements: an interface or a node number,
    /// optionally with a colon and directions ("big_end:z", "17:x,rz"), or a list of these. `band` is (low, high) in Hz. A
    /// `scene` supplies what is not stated: the places of its loads, its watched points, band and damping. `damping` is a
    /// ratio, for a body without damping. `points` and `solves` are the approximate numbers of frequencies of the curves,
    /// and of those at which the equations of all nodes are solved. `base` is an interface whose acceleration excites the
    /// body in place of forces, `rows` are recoveries whose rows are read ("gauges", or "gauges:ROW" for one), `psd` is the
    /// file of the spectral densities of a random excitation. `modes` and `basis` are those of a body that is made.
    #[pyo3(
        signature = (
            source: "_types.Places | None" = None,
            target: "_types.Places | None" = None,
            *,
            base: "str | None" = None,
            rows: "str | Sequence[str] | None" = None,
            psd: "_Path | None" = None,
            body: "Body | _Path | None" = None,
            band: "tuple[float, float] | None" = None,
            scene: "_Scene | None" = None,
            damping: "float | None" = None,
            tolerance: "float" = None,
            points: "int" = None,
            solves: "int" = None,
            modes: "int" = None,
            basis: "_types.Basis" = None,
        ),
        text_signature = "($self, source=None, target=None, *, base=None, rows=None, psd=None, body=None, band=None, scene=None, damping=None, tolerance=0.05, points=400, solves=80, modes=20, basis=\"free\")"
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
        body: Argument<'_, '_>,
        band: Argument<'_, '_>,
        scene: Argument<'_, '_>,
        damping: Argument<'_, '_>,
        tolerance: Argument<'_, '_>,
        points: Argument<'_, '_>,
        solves: Argument<'_, '_>,
        modes: Argument<'_, '_>,
        basis: Argument<'_, '_>,
    ) -> PyResult<Response> {
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
        let mut options = stated.options(py)?;
        if basis.is_some() {
            options = options.basis(self::basis(basis)?);
        }
        if let Some(modes) = modes {
            options = options.modes(positive(modes, "modes")?);
        }
        if let (Some(_), Some(given)) = (body, modes.or(basis)) {
            let message = "`modes` and `basis` are those of a body that is made, and `body` is given";
            return Err(value_error(given.py(), message));
        }
        let body = body.map(|body| Body::given(body, "body")).transpose()?;
        let (model, known) = (Arc::clone(&self.inner), self.inner.diagnostics().len());
        let work =
            move |listener: flexbody::Listener<'_>| model.response(body.as_deref(), &options, listener);
        Response::with_warnings(py, run(py, work)?, known)
    }

    fn __repr__(&self) -> String {
        let (nodes, rows) = (self.inner.node_ids().len(), self.inner.n_dofs());
        format!("<flexbody.Model {:?}: {nodes} nodes, {rows} degrees of freedom>", self.inner.name())
    }
}

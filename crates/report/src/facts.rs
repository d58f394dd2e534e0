//! The facts of a body and of the run that made it, computed once; every format renders these.

use super::completeness::Completeness;
use super::craig_bampton::CraigBamptonFacts;
use super::geometric_stiffness::{GeometricStiffnessFacts, InertiaStiffnessFacts, softening_hz};
use super::guarantee::GuaranteeFacts;
use super::lumped::{LumpedFacts, LumpedModesFacts};
use super::mass_properties::MassProperties;
use super::numbers::{coordinates, counted, percent, significant};
use super::run_data::{Phase, RunData, SearchAttempt};
use super::term_facts::TermFacts;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::{self, SourceFile};
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    Coupling, FlexBody, Interface, MassStructure, Storage, Truncation, is_static,
};
use serde::{Serialize, Serializer};

/// Version of the JSON report: a newer major breaks readers, a newer minor only adds keys.
const MAJOR: u32 = 1;
const MINOR: u32 = 7;

/// Everything that a report says. Its JSON form is the contract `schemas/report.schema.json`.
///
/// Numbers are in the units of the model, frequencies in hertz, times in seconds. A number that is not finite
/// is `null` in JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts<'b> {
    /// The body itself: its picture is computed if a page needs it.
    #[serde(skip)]
    pub(super) flex_body: &'b FlexBody,
    format: &'static str,
    format_major: u32,
    format_minor: u32,
    pub(super) generator: String,
    pub(super) model: ModelFacts,
    pub(super) body: MassProperties,
    pub(super) modes: ModeFacts,
    /// For each group of the kinetic energy.
    pub(super) terms: Vec<TermFacts>,
    pub(super) completeness: Completeness,
    /// At accuracy `certified`.
    pub(super) guarantee: Option<GuaranteeFacts>,
    pub(super) lumped: Vec<LumpedFacts>,
    pub(super) lumped_modes: Vec<LumpedModesFacts>,
    /// `None` for a body read from a file.
    pub(super) run: Option<RunFacts>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ModelFacts {
    pub name: String,
    pub dimension: usize,
    /// Of several bodies in the same matrices.
    pub body: Option<BodyFacts>,
    pub n_nodes: usize,
    pub n_dofs: usize,
    pub mass_structure: &'static str,
    /// Precision of shapes and of the inertia of the modes: `f64` or `f32`.
    pub storage: &'static str,
    /// Part of the mass that the invariants take as approximate.
    pub approximation: Option<String>,
    pub units: UnitFacts,
    pub files: Vec<SourceFile>,
    pub interfaces: Vec<InterfaceFacts>,
    /// `None`: no surface is known.
    pub mesh: Option<MeshFacts>,
    pub settings: serde_json::Value,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct BodyFacts {
    pub number: usize,
    pub of: usize,
}

/// The surface that the body is drawn by.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MeshFacts {
    pub triangles: usize,
    pub edges: usize,
    /// Nodes that it is drawn on.
    pub nodes: usize,
}

impl MeshFacts {
    fn of(body: &FlexBody) -> Option<Self> {
        let mesh = body.mesh()?;
        Some(Self {
            triangles: mesh.triangles().len(),
            edges: mesh.edges().len(),
            nodes: mesh.drawn_nodes().len(),
        })
    }

    /// `1200 triangles and 80 edges on 602 nodes`.
    pub(crate) fn in_words(&self) -> String {
        let (triangles, edges) = (counted(self.triangles, "triangle"), counted(self.edges, "edge"));
        format!("{triangles} and {edges} on {}", counted(self.nodes, "node"))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct UnitFacts {
    pub length: String,
    pub mass: String,
    pub time: String,
    pub stated: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct InterfaceFacts {
    pub name: String,
    pub n_nodes: usize,
    /// `None`: not stated.
    pub coupling: Option<&'static str>,
    /// Body frame; `None`: no reference point.
    pub reference: Option<[f64; 3]>,
    /// Reference point in model axes.
    pub reference_model: Option<[f64; 3]>,
    /// Largest deformation of the interface in a mode, relative to its largest motion in any; `None`: no
    /// reference point.
    pub deformation: Option<f64>,
}

impl InterfaceFacts {
    fn of(interface: &Interface, body: &FlexBody) -> Self {
        let rotation = body.modes().rotation.as_ref().map(|rotation| rotation.as_ref());
        let rows = interface.rows(body.nodes(), body.modes().shape.as_ref(), rotation, body.dimension());
        Self {
            name: interface.name.clone(),
            n_nodes: interface.nodes.len(),
            coupling: interface.coupling.map(|coupling| coupling.name()),
            reference: interface.reference,
            reference_model: interface.reference.map(|x| body.frame().to_model(x)),
            deformation: rows.map(|rows| rows.deformation().1),
        }
    }

    /// Returns true if the interface deforms although it was declared rigid.
    pub(crate) fn breaks_its_word(&self) -> bool {
        self.coupling == Some(Coupling::Rigid.name()) && self.deformation.is_some_and(|part| part > RIGID)
    }

    /// `, at 0, 0, 12.5 mm`: the reference point in model axes; empty without one. Coordinates that are rounding beside
    /// `size` are zero.
    pub(crate) fn place_in_words(&self, size: f64, unit: &str) -> String {
        let place = |x: [f64; 3]| format!(", at {}", coordinates(&x, size, unit));
        self.reference_model.map_or_else(String::new, place)
    }

    /// `80 nodes, rigid, at 0, 0, 12.5 mm`, `3 nodes, averaging, at 1, 0, 0 mm, deforms by up to 12 %`; `size` and `unit`
    /// as of [`Self::place_in_words`].
    pub(crate) fn in_words(&self, size: f64, unit: &str) -> String {
        let place = self.place_in_words(size, unit);
        let coupling = self.coupling.map_or(String::new(), |name| format!(", {name}"));
        let deforms = match self.deformation {
            Some(part) if part > RIGID => format!(", deforms by up to {} of its motion", percent(part)),
            Some(_) => ", moves as a rigid body".to_owned(),
            None => String::new(),
        };
        format!("{}{coupling}{place}{deforms}", counted(self.n_nodes, "node"))
    }
}

/// Deformation of an interface up to this is rounding.
const RIGID: f64 = 1e-8;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ModeFacts {
    pub count: usize,
    pub frequency_hz: Vec<f64>,
    /// Unit: 1/time^2.
    pub eigenvalue: Vec<f64>,
    pub residual: Vec<f64>,
    /// Origin of each mode; empty if it is not known.
    pub provenance: Vec<String>,
    /// Errors of the static responses of the modes, for the loads of residual vectors.
    pub truncation: Vec<Truncation>,
    pub damping_ratio: Vec<f64>,
    /// Of the modes that are to be eigenvectors: static shapes are none; of a Craig-Bampton body that of its
    /// fixed-interface modes.
    pub worst_residual: f64,
    /// Of a Craig-Bampton body: its coordinates, and its frequencies beside those of the free body.
    pub craig_bampton: Option<CraigBamptonFacts>,
    /// Damping of the modes, if it was given.
    pub damping: Option<DampingFacts>,
    /// For each unit load.
    pub geometric_stiffness: Vec<GeometricStiffnessFacts>,
    /// Of nodes whose rotations carry mass.
    pub inertia_stiffness: Option<InertiaStiffnessFacts>,
    /// Spin about each axis of the model that takes 1 % of the stiffness of a motion, where W2 is held without
    /// geometric stiffness for spin.
    pub softening_hz: Option<[Option<f64>; 3]>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DampingFacts {
    pub lowest_ratio: f64,
    pub highest_ratio: f64,
    /// Largest |D_ij| / sqrt(D_ii D_jj) of two modes.
    pub coupling: f64,
}

impl DampingFacts {
    fn of(body: &FlexBody) -> Option<Self> {
        let (d, ratio) = (body.modes().modal_damping.as_ref()?, &body.modes().damping_ratio);
        let pairs = (0..d.ncols()).flat_map(|j| (0..j).map(move |i| (i, j)));
        let coupled = |(i, j): (usize, usize)| {
            let size = d[(i, i)].max(0.0).sqrt() * d[(j, j)].max(0.0).sqrt();
            if size > 0.0 { d[(i, j)].abs() / size } else { 0.0 }
        };
        Some(Self {
            lowest_ratio: ratio.iter().copied().fold(f64::INFINITY, f64::min),
            highest_ratio: ratio.iter().copied().fold(0.0, f64::max),
            coupling: pairs.map(coupled).fold(0.0, f64::max),
        })
    }

    /// `ratios from 0.01 to 0.03, modes coupled by up to 4.2 %`.
    pub(crate) fn in_words(&self) -> String {
        let (lowest, highest) = (significant(self.lowest_ratio, 4), significant(self.highest_ratio, 4));
        let ratios = if lowest == highest {
            format!("ratio {lowest} of every mode")
        } else {
            format!("ratios from {lowest} to {highest}")
        };
        if self.coupling > UNCOUPLED {
            format!("{ratios}, modes coupled by up to {}", percent(self.coupling))
        } else {
            ratios
        }
    }
}

/// Coupling of modes by damping up to this is rounding.
const UNCOUPLED: f64 = 1e-6;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RunFacts {
    pub accuracy: String,
    pub threads: usize,
    pub wall_seconds: f64,
    pub cpu_seconds: f64,
    pub phases: Vec<Phase>,
    pub peak_memory_bytes: Option<u64>,
    pub memory_estimate_bytes: Option<u64>,
    #[serde(serialize_with = "as_map")]
    pub counters: Vec<(String, u64)>,
    pub attempts: Vec<SearchAttempt>,
    pub output: Option<OutputFacts>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct OutputFacts {
    pub name: String,
    pub bytes: u64,
}

fn as_map<S: Serializer>(pairs: &[(String, u64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}

impl<'b> Facts<'b> {
    /// Collects the facts of `body` and of the `run` that made it; [`RunData::default`] for a body whose run
    /// is not known (read from a file).
    pub fn new(body: &'b FlexBody, run: &RunData) -> Self {
        let frequency_hz = body.frequencies_hz();
        let lumped_modes = run.lumped_modes.iter().map(|l| LumpedModesFacts::of(l, &frequency_hz)).collect();
        let known = RunData { diagnostics: Vec::new(), lumped_modes: Vec::new(), ..run.clone() };
        Self {
            flex_body: body,
            format: "flexbody-report",
            format_major: MAJOR,
            format_minor: MINOR,
            generator: provenance::generator(),
            model: ModelFacts::of(body),
            body: MassProperties::of(body),
            modes: ModeFacts {
                count: body.n_modes(),
                frequency_hz,
                eigenvalue: body.modes().eigenvalue.clone(),
                residual: body.modes().residual.clone(),
                provenance: body.modes().provenance.clone(),
                truncation: body.modes().truncation.clone(),
                damping_ratio: body.modes().damping_ratio.clone(),
                damping: DampingFacts::of(body),
                geometric_stiffness: GeometricStiffnessFacts::of(body),
                inertia_stiffness: InertiaStiffnessFacts::of(body),
                softening_hz: softening_hz(body),
                worst_residual: worst_residual(body),
                craig_bampton: CraigBamptonFacts::of(body),
            },
            terms: TermFacts::of(body),
            completeness: Completeness::of(body),
            guarantee: GuaranteeFacts::of(body),
            lumped: body.lumped().iter().map(|lumped| LumpedFacts::of(lumped, body.invariants())).collect(),
            lumped_modes,
            run: (known != RunData::default()).then(|| RunFacts::of(&known)),
            diagnostics: run.diagnostics.clone(),
        }
    }
}

/// Largest residual of the modes that are meant to be eigenvectors.
fn worst_residual(body: &FlexBody) -> f64 {
    if let Some(fixed) = &body.certificate().fixed_interface {
        return fixed.residual;
    }
    let modes = body.modes();
    let claimed = |j: &usize| !modes.provenance.get(*j).is_some_and(|origin| is_static(origin));
    (0..body.n_modes()).filter(claimed).map(|j| modes.residual[j]).fold(0.0, f64::max)
}

impl ModelFacts {
    fn of(body: &FlexBody) -> Self {
        let (source, units) = (body.source(), body.units());
        Self {
            name: source.name.clone(),
            dimension: body.dimension(),
            body: source.number.map(|n| BodyFacts { number: n.number, of: n.of }),
            n_nodes: body.n_nodes(),
            n_dofs: source.n_dofs,
            mass_structure: source.mass_structure.name(),
            storage: body.storage().name(),
            approximation: source.approximation.clone(),
            units: UnitFacts::new(units),
            files: source.files.clone(),
            interfaces: body
                .interfaces()
                .iter()
                .map(|interface| InterfaceFacts::of(interface, body))
                .collect(),
            mesh: MeshFacts::of(body),
            settings: source.settings.clone(),
        }
    }

    /// Rounding of the storage; `None` for 64-bit floats.
    pub(crate) fn storage_in_words(&self) -> Option<&'static str> {
        (self.storage == Storage::F32.name())
            .then_some("shapes and inertia of the modes rounded to 32-bit floats")
    }

    /// `21 nodes, 63 degrees of freedom, consistent mass`.
    pub(crate) fn size_in_words(&self) -> String {
        match self.n_dofs {
            0 => self.nodes_in_words(),
            _ => format!("{}, {}", self.nodes_in_words(), self.mass_in_words()),
        }
    }

    /// `21 nodes, 63 degrees of freedom`.
    pub(crate) fn nodes_in_words(&self) -> String {
        match self.n_dofs {
            0 => format!("{} nodes or frames; mass as another program condensed it", self.n_nodes),
            n_dofs => format!("{} nodes, {n_dofs} degrees of freedom", self.n_nodes),
        }
    }

    /// Structure of the mass matrix in words.
    fn mass_in_words(&self) -> &'static str {
        match MassStructure::from_name(self.mass_structure) {
            Some(MassStructure::RotationInvariant) => "consistent mass",
            Some(MassStructure::Diagonal) => "DIAGONAL mass: lumped before it came here, exact for that only",
            Some(MassStructure::General) | None => "mass on rotations of nodes or different by direction",
        }
    }
}

impl ModeFacts {
    /// The residual of a mode; a static shape is no eigenvector and has none.
    pub(crate) fn residual_in_words(&self, j: usize) -> String {
        if self.provenance.get(j).is_some_and(|origin| is_static(origin)) {
            "static shape".to_owned()
        } else {
            significant(self.residual[j], 2)
        }
    }

    /// Kind of modes that the worst residual is of; empty for all modes.
    pub(crate) fn whose_residual(&self) -> &'static str {
        if self.craig_bampton.is_some() {
            " of the fixed-interface modes"
        } else if self.provenance.iter().any(|origin| is_static(origin)) {
            " of the free modes"
        } else {
            ""
        }
    }

    /// Kinds of shapes with the number of modes that come from them, in the order of their first modes; empty if all are
    /// free modes.
    pub(crate) fn origins(&self) -> Vec<(&str, usize)> {
        let mut origins: Vec<(&str, usize)> = Vec::new();
        for origin in &self.provenance {
            let origin = origin.split_once(": ").map_or(origin.as_str(), |(kind, _)| kind);
            match origins.iter_mut().find(|(known, _)| *known == origin) {
                Some((_, count)) => *count += 1,
                None => origins.push((origin, 1)),
            }
        }
        if matches!(origins.as_slice(), [("free mode", _)]) { Vec::new() } else { origins }
    }
}

impl UnitFacts {
    pub(crate) fn new(units: &UnitSystem) -> Self {
        Self {
            length: units.length.name().to_owned(),
            mass: units.mass.name().to_owned(),
            time: units.time.name().to_owned(),
            stated: units.stated,
        }
    }

    pub(crate) fn mass(&self) -> String {
        if self.mass == "tonne" { "t".to_owned() } else { named(&self.mass, "kg") }
    }

    pub(crate) fn length(&self) -> String {
        named(&self.length, "m")
    }

    pub(crate) fn time(&self) -> String {
        named(&self.time, "s")
    }

    pub(crate) fn inertia(&self) -> String {
        format!("{} {}^2", self.mass(), self.length())
    }

    /// All three, and whether they are a guess.
    pub(crate) fn in_words(&self) -> String {
        let assumed = if self.stated { "" } else { " assumed, none stated" };
        format!("{}, {}, {}{assumed}", self.length(), self.mass(), self.time())
    }
}

/// A unit given by its size is written as that size.
fn named(unit: &str, si: &str) -> String {
    if unit.parse::<f64>().is_ok() { format!("[{unit} {si}]") } else { unit.to_owned() }
}

impl RunFacts {
    fn of(run: &RunData) -> Self {
        Self {
            accuracy: run.accuracy.clone(),
            threads: run.threads,
            wall_seconds: run.wall_seconds(),
            cpu_seconds: run.cpu_seconds(),
            phases: run.phases.clone(),
            peak_memory_bytes: run.peak_memory_bytes,
            memory_estimate_bytes: run.memory_estimate_bytes,
            counters: run.counters.clone(),
            attempts: run.attempts.clone(),
            output: run
                .output
                .as_ref()
                .map(|(name, bytes)| OutputFacts { name: name.clone(), bytes: *bytes }),
        }
    }
}

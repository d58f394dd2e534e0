//! Facts of a body and of the run that made it, computed once and rendered in every format.

use super::completeness::{Completeness, GuaranteeFacts, TermFacts};
use super::craig_bampton::CraigBamptonFacts;
use super::geometric_stiffness::{
    GeometricStiffnessFacts, InertiaStiffnessFacts, missing_stiffness_in_words, softening_hz, stress_hz,
    stress_stiffness_in_words,
};
use super::held::HeldFacts;
use super::lumped::{LumpedFacts, LumpedModesFacts};
use super::named_loads::NamedLoadFacts;
use crate::mass_properties::MassProperties;
use crate::notation::numbers::{coordinates, counted, percent, significant};
use crate::notation::units::UnitFacts;
use crate::run_data::{Phase, RunData, SearchAttempt};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::{self, SourceFile};
use flexbody_body::basis::FREE_MODE;
use flexbody_body::flex_body::{
    Coupling, FlexBody, Interface, MassStructure, Quantity, Recovery, Storage, Truncation, is_static,
};
use serde::{Serialize, Serializer};

/// Version of the JSON report: a newer major version breaks readers, a newer minor version only adds keys.
const MAJOR: u32 = 1;
const MINOR: u32 = 13;

/// All facts of a report. The JSON form follows the schema `schemas/report.schema.json`.
///
/// Numbers are in the units of the model, frequencies in hertz, times in seconds. A number that is not finite
/// is `null` in JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts<'b> {
    /// Body of the report; its picture is computed only if a page needs it.
    #[serde(skip)]
    pub(super) flex_body: &'b FlexBody,
    format: &'static str,
    format_major: u32,
    format_minor: u32,
    pub(super) generator: String,
    pub(super) model: ModelFacts,
    pub(super) body: MassProperties,
    pub(super) modes: ModeFacts,
    /// Decision about each group of the kinetic energy.
    pub(super) terms: Vec<TermFacts>,
    pub(super) completeness: Completeness,
    /// Guarantees; `None` unless the accuracy was `certified`.
    pub(super) guarantee: Option<GuaranteeFacts>,
    pub(super) lumped: Vec<LumpedFacts>,
    pub(super) lumped_modes: Vec<LumpedModesFacts>,
    /// Facts of the run; `None` for a body read from a file.
    pub(super) run: Option<RunFacts>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ModelFacts {
    pub name: String,
    pub dimension: usize,
    /// Number and nodes of the body if the matrices hold several bodies.
    pub body: Option<BodyFacts>,
    pub n_nodes: usize,
    pub n_dofs: usize,
    pub mass_structure: &'static str,
    /// Precision of stored shapes and of the inertia of the modes: `f64` or `f32`.
    pub storage: &'static str,
    /// Description of the approximate part of the mass in the invariants.
    pub approximation: Option<String>,
    pub units: UnitFacts,
    pub files: Vec<SourceFile>,
    pub interfaces: Vec<InterfaceFacts>,
    /// Rows to read off the deformed body.
    pub recoveries: Vec<RecoveryFacts>,
    /// Nodal forces with a name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub named_loads: Vec<NamedLoadFacts>,
    /// Size of the surface; `None` if no surface is known.
    pub mesh: Option<MeshFacts>,
    pub settings: serde_json::Value,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct BodyFacts {
    pub number: usize,
    pub of: usize,
}

/// Size of the surface that the body is drawn by.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct MeshFacts {
    pub triangles: usize,
    pub edges: usize,
    /// Number of nodes on the surface.
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

    /// Returns the size of the surface: `1200 triangles and 80 edges on 602 nodes`.
    pub(crate) fn in_words(&self) -> String {
        let (triangles, edges) = (counted(self.triangles, "triangle"), counted(self.edges, "edge"));
        format!("{triangles} and {edges} on {}", counted(self.nodes, "node"))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct InterfaceFacts {
    pub name: String,
    pub n_nodes: usize,
    /// Name of the coupling; `None` if it was not stated.
    pub coupling: Option<&'static str>,
    /// Reference point in the body frame; `None` if there is none. Unit: length.
    pub reference: Option<[f64; 3]>,
    /// Reference point in model axes. Unit: length.
    pub reference_model: Option<[f64; 3]>,
    /// Largest deformation of the interface in a mode, relative to its largest motion in any mode; `None`
    /// without a reference point.
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
    pub(crate) fn deforms_although_rigid(&self) -> bool {
        self.coupling == Some(Coupling::Rigid.name()) && self.deformation.is_some_and(|part| part > RIGID)
    }

    /// Returns `, at 0, 0, 12.5 mm`: the reference point in model axes; empty without a reference point.
    /// Coordinates that are rounding relative to `size` are written as zero.
    pub(crate) fn place_in_words(&self, size: f64, unit: &str) -> String {
        let place = |x: [f64; 3]| format!(", at {}", coordinates(&x, size, unit));
        self.reference_model.map_or_else(String::new, place)
    }

    /// Returns `80 nodes, rigid, at 0, 0, 12.5 mm` or `3 nodes, averaging, at 1, 0, 0 mm, up to 12 % of its
    /// motion in a mode is deformation`. Coordinates that are rounding relative to `size` are written as zero; `unit` is the unit of
    /// length.
    pub(crate) fn in_words(&self, size: f64, unit: &str) -> String {
        let place = self.place_in_words(size, unit);
        let coupling = self.coupling.map_or(String::new(), |name| format!(", {name}"));
        let motion = self.motion_in_words().map_or_else(String::new, |motion| format!(", {motion}"));
        format!("{}{coupling}{place}{motion}", counted(self.n_nodes, "node"))
    }

    /// Returns the motion of the interface in the modes: `up to 12 % of its motion in a mode is deformation`, or
    /// `moves as a rigid body`; `None` without a reference point.
    pub(crate) fn motion_in_words(&self) -> Option<String> {
        Some(match self.deformation? {
            part if part > RIGID => format!("up to {} of its motion in a mode is deformation", percent(part)),
            _ => "moves as a rigid body".to_owned(),
        })
    }
}

/// Rows to read off the deformed body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RecoveryFacts {
    pub name: String,
    pub rows: usize,
    /// Quantities of the rows.
    pub quantities: Vec<QuantityFacts>,
    /// Interfaces whose loads the rows follow.
    pub loads: Vec<String>,
}

/// Number of rows of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct QuantityFacts {
    pub quantity: &'static str,
    pub rows: usize,
}

impl RecoveryFacts {
    fn of(recovery: &Recovery) -> Self {
        let of = |&quantity: &Quantity| QuantityFacts {
            quantity: quantity.name(),
            rows: recovery.rows.iter().filter(|row| row.quantity == quantity).count(),
        };
        let quantities = Quantity::ALL.iter().map(of);
        Self {
            name: recovery.name.clone(),
            rows: recovery.rows.len(),
            quantities: quantities.filter(|quantity| quantity.rows > 0).collect(),
            loads: recovery.loads.iter().map(|load| load.interface.clone()).collect(),
        }
    }

    /// Returns `gauges: 12 x stress, 3 x force`.
    pub(crate) fn in_words(&self) -> String {
        let quantities: Vec<String> = self
            .quantities
            .iter()
            .map(|quantity| format!("{} x {}", quantity.rows, quantity.quantity))
            .collect();
        format!("{}: {}", self.name, quantities.join(", "))
    }
}

/// Largest relative deformation of an interface that counts as rounding of a rigid motion. A smaller value
/// reports rounding as deformation.
const RIGID: f64 = 1e-8;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ModeFacts {
    pub count: usize,
    pub frequency_hz: Vec<f64>,
    /// Eigenvalue of each mode. Unit: 1/time^2.
    pub eigenvalue: Vec<f64>,
    /// Residual of each mode; `None` for shapes that are no eigenvectors.
    pub residual: Vec<Option<f64>>,
    /// Origin of each mode; empty if unknown.
    pub provenance: Vec<String>,
    /// Truncation errors of the static responses to the loads of the residual vectors.
    pub truncation: Vec<Truncation>,
    pub damping_ratio: Vec<f64>,
    /// Largest residual of the modes that should be eigenvectors; static shapes are excluded. For a
    /// Craig-Bampton body that of its fixed-interface modes.
    pub worst_residual: f64,
    /// Coordinates of a Craig-Bampton body, and its frequencies compared with the free body; `None` for other
    /// bodies.
    pub craig_bampton: Option<CraigBamptonFacts>,
    /// Modes of the body held at each interface that can carry it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<HeldFacts>,
    /// Damping of the modes; `None` if none was given.
    pub damping: Option<DampingFacts>,
    /// Geometric stiffness for each unit load.
    pub geometric_stiffness: Vec<GeometricStiffnessFacts>,
    /// Stiffness of inertia; `None` unless rotations of nodes carry mass.
    pub inertia_stiffness: Option<InertiaStiffnessFacts>,
    /// Spin about each axis of the model at which the centrifugal term takes 1 % of the stiffness of a
    /// motion; `None` without W2 or with geometric stiffness for spin. Unit: Hz.
    pub softening_hz: Option<[Option<f64>; 3]>,
    /// Origin of stress stiffness that was computed from elements, in words; `None` without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stress_stiffness: Option<String>,
    /// Spin about each axis of the model at which the stress stiffness that the body does not have changes 1 % of the
    /// stiffness of a motion, by its estimate; `None` if nothing is missing. Unit: Hz.
    pub stress_hz: Option<[Option<f64>; 3]>,
    /// Missing stress stiffness in words, and the option that computes it; `None` if nothing is missing.
    #[serde(skip)]
    pub missing_stiffness: Option<String>,
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

    /// Returns the damping in words: `ratios from 0.01 to 0.03, modes coupled by up to 4.2 %`.
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

/// Largest coupling of modes by damping that counts as rounding. A smaller value reports rounding as
/// coupling.
const UNCOUPLED: f64 = 1e-6;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RunFacts {
    pub accuracy: String,
    pub threads: usize,
    pub instructions: String,
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
    /// Collects the facts of `body` and of the `run` that made it. Pass [`RunData::default`] for a body whose
    /// run is unknown (read from a file).
    pub fn new(body: &'b FlexBody, run: &RunData) -> Self {
        let frequency_hz = body.frequencies_hz();
        let lumped_modes = run.lumped_modes.iter().map(|l| LumpedModesFacts::of(l, &frequency_hz)).collect();
        let (softening, stress) = (softening_hz(body), stress_hz(body));
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
                residual: (0..body.n_modes()).map(|j| residual(body, j)).collect(),
                provenance: body.modes().provenance.clone(),
                truncation: body.modes().truncation.clone(),
                damping_ratio: body.modes().damping_ratio.clone(),
                damping: DampingFacts::of(body),
                geometric_stiffness: GeometricStiffnessFacts::of(body),
                inertia_stiffness: InertiaStiffnessFacts::of(body),
                softening_hz: softening,
                stress_stiffness: stress_stiffness_in_words(body),
                stress_hz: stress,
                missing_stiffness: missing_stiffness_in_words(
                    softening.as_ref(),
                    stress.as_ref(),
                    body.has_spin_stiffness(),
                    &run.offered_stiffness,
                ),
                worst_residual: worst_residual(body),
                craig_bampton: CraigBamptonFacts::of(body),
                held: HeldFacts::of(body),
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

/// Returns the largest residual of the modes that should be eigenvectors.
fn worst_residual(body: &FlexBody) -> f64 {
    if let Some(fixed) = &body.certificate().fixed_interface {
        return fixed.residual;
    }
    (0..body.n_modes()).filter_map(|j| residual(body, j)).fold(0.0, f64::max)
}

/// Returns the residual of a mode; `None` for shapes that are no eigenvectors: static shapes, and all modes of a
/// Craig-Bampton body.
fn residual(body: &FlexBody, j: usize) -> Option<f64> {
    let modes = body.modes();
    let is_shape = body.certificate().fixed_interface.is_some()
        || modes.provenance.get(j).is_some_and(|origin| is_static(origin));
    (!is_shape).then(|| modes.residual[j])
}

impl ModelFacts {
    fn of(body: &FlexBody) -> Self {
        let (description, source) = (body.description(), body.source());
        Self {
            name: description.name.clone(),
            dimension: body.dimension(),
            body: description.number.map(|n| BodyFacts { number: n.number, of: n.of }),
            n_nodes: body.n_nodes(),
            n_dofs: source.n_dofs,
            mass_structure: source.mass_structure.name(),
            storage: body.storage().name(),
            approximation: source.approximation.clone(),
            units: UnitFacts::new(&description.units),
            files: source.files.clone(),
            interfaces: body
                .interfaces()
                .iter()
                .map(|interface| InterfaceFacts::of(interface, body))
                .collect(),
            recoveries: body.recoveries().iter().map(RecoveryFacts::of).collect(),
            named_loads: NamedLoadFacts::of(body),
            mesh: MeshFacts::of(body),
            settings: source.settings.clone(),
        }
    }

    /// Returns the rounding of the storage in words; `None` for 64-bit floats.
    pub(crate) fn storage_in_words(&self) -> Option<&'static str> {
        (self.storage == Storage::F32.name())
            .then_some("shapes and inertia of the modes rounded to 32-bit floats")
    }

    /// Returns the size of the model: `21 nodes, 63 degrees of freedom, consistent mass`.
    pub(crate) fn size_in_words(&self) -> String {
        match self.n_dofs {
            0 => self.nodes_in_words(),
            _ => format!("{}, {}", self.nodes_in_words(), self.mass_in_words()),
        }
    }

    /// Returns the number of nodes and rows: `21 nodes, 63 degrees of freedom`.
    pub(crate) fn nodes_in_words(&self) -> String {
        match self.n_dofs {
            0 => format!("{} nodes or frames; mass condensed by another program", self.n_nodes),
            n_dofs => format!("{} nodes, {n_dofs} degrees of freedom", self.n_nodes),
        }
    }

    /// Returns the structure of the mass matrix in words.
    fn mass_in_words(&self) -> &'static str {
        match MassStructure::from_name(self.mass_structure) {
            Some(MassStructure::RotationInvariant) => "consistent mass",
            Some(MassStructure::Diagonal) => "DIAGONAL (lumped) mass: results are exact for this mass only",
            Some(MassStructure::General) | None => "mass on nodal rotations or different along the axes",
        }
    }
}

impl ModeFacts {
    /// Returns the residual of a mode, or `static shape` for a static shape, which is no eigenvector.
    pub(crate) fn residual_in_words(&self, j: usize) -> String {
        self.residual[j].map_or_else(|| "static shape".to_owned(), |value| significant(value, 2))
    }

    /// Returns the kind of modes that the worst residual refers to; empty for all modes.
    pub(crate) fn residual_remark(&self) -> &'static str {
        if self.craig_bampton.is_some() {
            " of the fixed-interface modes"
        } else if self.provenance.iter().any(|origin| is_static(origin)) {
            " of the free modes"
        } else {
            ""
        }
    }

    /// Returns the kinds of shapes with their numbers of modes, in the order of their first modes; empty if
    /// all modes are free modes.
    pub(crate) fn origins(&self) -> Vec<(&str, usize)> {
        let mut origins: Vec<(&str, usize)> = Vec::new();
        for origin in &self.provenance {
            let origin = origin.split_once(": ").map_or(origin.as_str(), |(kind, _)| kind);
            match origins.iter_mut().find(|(known, _)| *known == origin) {
                Some((_, count)) => *count += 1,
                None => origins.push((origin, 1)),
            }
        }
        if matches!(origins.as_slice(), [(FREE_MODE, _)]) { Vec::new() } else { origins }
    }
}

impl RunFacts {
    fn of(run: &RunData) -> Self {
        Self {
            accuracy: run.accuracy.clone(),
            threads: run.threads,
            instructions: run.instructions.clone(),
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

//! What a flexible body is made of: plain data, not yet checked.

use super::{Interface, ReferenceConditions, Storage, TermDecision};
use crate::basis::{FixedInterface, InterfaceCoordinates, Truncation};
use crate::invariants::{DIGITS, Frame, InertiaStiffness, Invariants};
use faer::Mat;
use flexbody_base::provenance::SourceFile;
use flexbody_base::units::UnitSystem;
use flexbody_model::{BodyNumber, GeometricStiffness, Nodes, SurfaceMesh};

/// Where a body came from.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Model name.
    pub name: String,
    /// Files and fingerprints.
    pub files: Vec<SourceFile>,
    /// Which body of several in the same matrices it is, where these were split.
    pub number: Option<BodyNumber>,
    /// Number of matrix rows of the FE model; 0 where these are not known, and the nodes may be some of many.
    pub n_dofs: usize,
    /// `rotation-invariant`: M = Ms kron I3; `diagonal`: the same and diagonal; `general`: neither.
    pub mass_structure: MassStructure,
    /// Part of the mass that the invariants take as approximate; `None`: they are those of the matrices.
    pub approximation: Option<String>,
    /// Settings of the run that can change the result, as JSON.
    pub settings: serde_json::Value,
}

/// Structure of the FE mass matrix, as tested block by block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassStructure {
    /// Every 3x3 node block is a multiple of the identity: M = Ms kron I3.
    RotationInvariant,
    /// Rotation invariant and diagonal: lumped by the FE program.
    Diagonal,
    /// Neither.
    General,
}

impl MassStructure {
    /// Every structure, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::RotationInvariant, Self::Diagonal, Self::General];

    /// Name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::RotationInvariant => "rotation-invariant",
            Self::Diagonal => "diagonal",
            Self::General => "general",
        }
    }

    /// Returns the structure of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }
}

/// Mode shapes and what is known of each mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// lambda, ascending. Unit: 1/time^2.
    pub eigenvalue: Vec<f64>,
    /// |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|), 2-norms.
    pub residual: Vec<f64>,
    /// Where each mode comes from: `free mode`, `imported shape`, ...; empty when it is not known.
    pub provenance: Vec<String>,
    /// Part of the static response that the modes lack, for each load of residual vectors and of the interfaces.
    pub truncation: Vec<Truncation>,
    /// Modal damping ratios, 0 when none was given.
    pub damping_ratio: Vec<f64>,
    /// Psi' D Psi (nf x nf), where damping was given. Unit: 1/time.
    pub modal_damping: Option<Mat<f64>>,
    /// Shapes (3n x nf), row 3 i + k: component k of node i, body axes, mass-normalised.
    pub shape: Mat<f64>,
    /// Rotations of the nodes (3n x nf) in the same way, zero where the model has none; `None` for models of
    /// displacements.
    pub rotation: Option<Mat<f64>>,
    /// Rows without a place.
    pub internal: Option<InternalRows>,
}

/// Kinds of shapes that are no modes of the free body and do not claim to be.
const STATIC: [&str; 4] = ["residual vector", "attachment mode", "constraint mode", "fixed-interface mode"];

/// Whether a mode of this origin ([`Modes::provenance`]) is a static shape.
pub fn is_static(origin: &str) -> bool {
    STATIC.contains(&origin.split_once(':').map_or(origin, |(kind, _)| kind))
}

/// Rows of the modes that belong to no node.
#[derive(Debug, Clone, PartialEq)]
pub struct InternalRows {
    /// Number and direction that the label of each row has (m).
    pub dofs: Vec<[i64; 2]>,
    /// Their values (m x nf); vectors, three rows each, in body axes.
    pub shape: Mat<f64>,
}

/// What was proved about the modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Number of flexible modes below `shift` that the inertia count proves; `None`: not proved.
    pub proved_modes: Option<usize>,
    /// Shift sigma of the count. Unit: 1/time^2.
    pub shift: f64,
    /// Negative pivots of K - sigma M: rigid and flexible modes below sigma.
    pub negative_pivots: Option<usize>,
    /// Number of rigid modes.
    pub rigid_modes: usize,
    /// Why the proof is missing, or what limits it; empty when nothing does.
    pub remark: String,
    /// Largest |lambda| of the exact rigid modes relative to the first flexible lambda: the input's noise
    /// floor.
    pub rigid_noise: f64,
    /// max |K R| / (|K| |R|) over the rows: digits of the stiffness matrix.
    pub rigid_residual: f64,
    /// What rounding of products with K may leave in any entry of Psi' K Psi, relative to sqrt(lambda_p
    /// lambda_q); 0 when not known.
    pub eigenvalue_rounding: f64,
    /// To what part of their Cauchy-Schwarz bounds the inertia data were known: the digits of a file of
    /// another program; 0: to rounding.
    pub inertia_rounding: f64,
    /// What accuracy `certified` adds.
    pub guarantee: Option<Guarantee>,
    /// Of a Craig-Bampton basis, whose modes are none of the free body: what it is made of and how far it
    /// goes.
    pub fixed_interface: Option<FixedInterface>,
}

/// Guaranteed bounds, about K, M, nodes and modes as they are stored (theory section 8, "Certified").
#[derive(Debug, Clone, PartialEq)]
pub struct Guarantee {
    /// Shift between the rigid modes and the first flexible one. Unit: 1/time^2.
    pub shift_below: f64,
    /// Negative pivots of K - shift_below M: the number of rigid modes.
    pub pivots_below: usize,
    /// Lower bounds of the eigenvalues. Unit: 1/time^2.
    pub eigenvalue_lower: Vec<f64>,
    /// Upper bounds of the eigenvalues. Unit: 1/time^2.
    pub eigenvalue_upper: Vec<f64>,
    /// Upper bounds of the distance of each mode to the exact eigenspace of its cluster, in the norm of M.
    pub shape_error: Vec<f64>,
    /// Guaranteed digits of each invariant of [`DIGITS`], of its worst entry relative to its Cauchy-Schwarz
    /// bound.
    pub digits: [f64; DIGITS.len()],
}

/// Invariants that lumped masses would have given, with the same modes.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedBody {
    /// `row-sum`, `diagonal-scaling`, `user`.
    pub scheme: String,
    /// The same data from the lumped mass.
    pub invariants: Invariants,
    /// Number of negative nodal masses.
    pub negative_masses: usize,
    /// Error norms against the exact invariants, by name (`I0_frobenius`, `W2_spectral`, ...), in table
    /// order.
    pub comparison: Vec<(String, f64)>,
}

/// The parts of a [`FlexBody`](super::FlexBody), public so that makers (pipeline, reader) can fill them.
///
/// [`FlexBody::new`](super::FlexBody::new) says what must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Provenance.
    pub source: Source,
    /// 3, or 2 for a body that moves in its plane z = 0 only.
    pub dimension: usize,
    /// Units of all numbers.
    pub units: UnitSystem,
    /// Body frame.
    pub frame: Frame,
    /// Reference conditions that tie the body frame to the deformed body.
    pub conditions: ReferenceConditions,
    /// Node numbers and positions in the BODY frame.
    pub nodes: Nodes,
    /// The surface to draw the body by, on some of the nodes; nothing is computed from it.
    pub mesh: Option<SurfaceMesh>,
    /// Modes.
    pub modes: Modes,
    /// Exact invariants about the frame origin, body axes.
    pub invariants: Invariants,
    /// Psi' K_geo Psi (nf x nf) of unit loads along body axes: the stressed body has the stiffness K_ff plus
    /// the sum of these times their loads. What is not here is zero or not known. Unit: 1/time^2 over that of
    /// the load.
    pub geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    /// Stiffness of inertia of nodes whose rotations carry mass; `None` where none do, or where it is not known
    /// (files of format versions before 1.6, files of other programs).
    pub inertia_stiffness: Option<InertiaStiffness>,
    /// Lumped comparators.
    pub lumped: Vec<LumpedBody>,
    /// Proof of completeness and noise floor.
    pub certificate: Certificate,
    /// Interfaces.
    pub interfaces: Vec<Interface>,
    /// K and M in interface coordinates, of a basis that has them (Craig-Bampton).
    pub coordinates: Option<InterfaceCoordinates>,
    /// What was decided about the groups of the kinetic energy; empty where nobody asked, and then all are
    /// held.
    pub terms: Vec<TermDecision>,
    /// Precision of shapes and of the inertia of the modes.
    pub storage: Storage,
}

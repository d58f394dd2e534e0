//! Plain data of a flexible body, not yet checked.

use super::{Interface, NamedLoad, Recovery, ReferenceConditions, RotatedStiffness, Storage, TermDecision};
use crate::basis::{FixedInterface, InterfaceCoordinates, Truncation};
use crate::invariants::{DIGITS, Frame, InertiaStiffness, Invariants};
use faer::Mat;
use flexbody_base::provenance::SourceFile;
use flexbody_model::{Description, GeometricStiffness, Nodes, SurfaceMesh};

/// Provenance of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Files and fingerprints.
    pub files: Vec<SourceFile>,
    /// Number of matrix rows of the FE model; 0 if unknown, and then the nodes may be a subset of the
    /// model's nodes.
    pub n_dofs: usize,
    /// Structure of the mass matrix. `rotation-invariant`: M = Ms kron I3; `diagonal`: rotation-invariant
    /// and diagonal; `general`: neither.
    pub mass_structure: MassStructure,
    /// Description of the part of the mass that the invariants approximate; `None` if they are exact for
    /// the matrices.
    pub approximation: Option<String>,
    /// Settings of the run that can change the result, as JSON.
    pub settings: serde_json::Value,
}

impl Source {
    /// Returns true if the body was read from a file of another program, whose format is the setting `from`.
    pub fn is_foreign(&self) -> bool {
        self.settings["from"].is_string()
    }
}

/// Structure of the FE mass matrix, as tested block by block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum MassStructure {
    /// Every 3x3 node block is a multiple of the identity: M = Ms kron I3.
    RotationInvariant,
    /// Rotation invariant and diagonal: lumped by the FE program.
    Diagonal,
    /// Neither rotation invariant nor diagonal.
    General,
}

impl MassStructure {
    /// All structures, in the order of the documentation.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Returns the name used in files and reports.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the structure with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }
}

/// Mode shapes and the data of each mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// lambda, ascending. Unit: 1/time^2.
    pub eigenvalue: Vec<f64>,
    /// |K psi - lambda M psi| / (|K psi| + |lambda| |M psi|), 2-norms.
    pub residual: Vec<f64>,
    /// Origin of each mode: `free mode`, `imported shape`, ...; empty if unknown.
    pub provenance: Vec<String>,
    /// Truncation error of the static response to each load of residual vectors and of the interfaces.
    pub truncation: Vec<Truncation>,
    /// Modal damping ratios; 0 if none was given.
    pub damping_ratio: Vec<f64>,
    /// Psi' D Psi (nf x nf), if damping was given. Unit: 1/time.
    pub modal_damping: Option<Mat<f64>>,
    /// Mass-normalised shapes (3n x nf), row 3 i + k: component k of node i along the body axes.
    pub shape: Mat<f64>,
    /// Rotations of the nodes (3n x nf) with the row order of `shape`, zero at nodes without rotations;
    /// `None` for models that have displacements only.
    pub rotation: Option<Mat<f64>>,
    /// Rows that belong to no node.
    pub internal: Option<InternalRows>,
}

/// Origins of modes that are static shapes and not modes of the free body.
const STATIC_ORIGINS: [&str; 4] =
    ["residual vector", "attachment mode", "constraint mode", "fixed-interface mode"];

/// Returns true if a mode of this origin ([`Modes::provenance`]) is a static shape.
pub fn is_static(origin: &str) -> bool {
    STATIC_ORIGINS.contains(&origin.split_once(':').map_or(origin, |(kind, _)| kind))
}

/// Rows of the modes that belong to no node.
#[derive(Debug, Clone, PartialEq)]
pub struct InternalRows {
    /// Number and direction in the label of each row (m).
    pub dofs: Vec<[i64; 2]>,
    /// Values of the rows (m x nf). Vectors take three rows each, along the body axes.
    pub shape: Mat<f64>,
}

/// Evidence for the completeness and accuracy of the modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Number of flexible modes below `shift`, proved by the inertia count; `None` if not proved.
    pub proved_modes: Option<usize>,
    /// Shift sigma of the count. Unit: 1/time^2.
    pub shift: f64,
    /// Number of negative pivots of K - sigma M: rigid and flexible modes below sigma.
    pub negative_pivots: Option<usize>,
    /// Number of rigid modes.
    pub rigid_modes: usize,
    /// Reason for a missing or limited proof; empty for a full proof.
    pub remark: String,
    /// Largest |lambda| of the exact rigid modes relative to the first flexible lambda: the noise floor of
    /// the input.
    pub rigid_noise: f64,
    /// max |K R| / (|K| |R|) over the rows for the rigid modes R; measures the digits of the stiffness
    /// matrix.
    pub rigid_residual: f64,
    /// Bound of the rounding errors of products with K in any entry of Psi' K Psi, relative to
    /// sqrt(lambda_p lambda_q); 0 if unknown.
    pub eigenvalue_rounding: f64,
    /// Accuracy of the inertia data as part of their Cauchy-Schwarz bounds, given by the digits of a file
    /// of another program; 0: accurate to rounding.
    pub inertia_rounding: f64,
    /// Guaranteed bounds of accuracy `certified`.
    pub guarantee: Option<Guarantee>,
    /// Composition and frequency limit of a Craig-Bampton basis, whose modes are not modes of the free
    /// body.
    pub fixed_interface: Option<FixedInterface>,
}

/// Guaranteed bounds for K, M, nodes and modes exactly as stored (theory section 8, "Certified").
#[derive(Debug, Clone, PartialEq)]
pub struct Guarantee {
    /// Shift between the rigid modes and the first flexible mode. Unit: 1/time^2.
    pub shift_below: f64,
    /// Number of negative pivots of K - shift_below M, equal to the number of rigid modes.
    pub pivots_below: usize,
    /// Lower bounds of the eigenvalues. Unit: 1/time^2.
    pub eigenvalue_lower: Vec<f64>,
    /// Upper bounds of the eigenvalues. Unit: 1/time^2.
    pub eigenvalue_upper: Vec<f64>,
    /// Upper bounds of the distance of each mode to the exact eigenspace of its cluster, in the M-norm.
    pub shape_error: Vec<f64>,
    /// Guaranteed digits of each invariant of [`DIGITS`]: those of the worst entry relative to its
    /// Cauchy-Schwarz bound.
    pub digits: [f64; DIGITS.len()],
}

/// Invariants of a lumped mass on the same modes.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedBody {
    /// Lumping scheme: `row-sum`, `diagonal-scaling` or `user`.
    pub scheme: String,
    /// Invariants computed with the lumped mass.
    pub invariants: Invariants,
    /// Number of negative nodal masses.
    pub negative_masses: usize,
    /// Error norms against the exact invariants, by name (`I0_frobenius`, `W2_spectral`, ...), in the order
    /// of the table.
    pub comparison: Vec<(String, f64)>,
}

/// Parts of a [`FlexBody`](super::FlexBody), public so that the pipeline and the reader can fill them.
///
/// [`FlexBody::new`](super::FlexBody::new) states the conditions that the parts must fulfil.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Name of the model and units of all numbers.
    pub description: Description,
    /// Provenance.
    pub source: Source,
    /// Dimension: 3, or 2 for a body that moves in its plane z = 0 only.
    pub dimension: usize,
    /// Body frame.
    pub frame: Frame,
    /// Reference conditions that tie the body frame to the deformed body.
    pub conditions: ReferenceConditions,
    /// Node numbers and positions in the body frame.
    pub nodes: Nodes,
    /// Surface on some of the nodes, for drawing only; nothing is computed from it.
    pub mesh: Option<SurfaceMesh>,
    /// Modes.
    pub modes: Modes,
    /// Exact invariants about the frame origin, body axes.
    pub invariants: Invariants,
    /// Psi' K_geo Psi (nf x nf) of unit loads along body axes. The stressed body has the stiffness K_ff
    /// plus the sum of these matrices times their loads. Missing loads are zero or unknown. Unit: 1/time^2
    /// over the unit of the load.
    pub geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    /// Geometric stiffness of unit rotations for the same loads, in the same order. Empty if unknown (files of format
    /// versions before 1.10, files of other programs); a body whose carrier moves in its modes then loses its
    /// geometric stiffness while it is carried.
    pub rotated_stiffness: Vec<RotatedStiffness>,
    /// Estimate of Psi' K_geo Psi for the components of spin, about the centre of mass and along body axes, that the model gives
    /// no geometric stiffness for. It judges results and never enters a motion or an export. Empty if nothing is missing
    /// or no estimate is known (files of format versions before 1.13, files of other programs, frames on an interface).
    pub estimated_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    /// Stiffness of inertia of nodes whose rotations carry mass; `None` if no rotation carries mass, or if
    /// the stiffness is unknown (files of format versions before 1.6, files of other programs).
    pub inertia_stiffness: Option<InertiaStiffness>,
    /// Lumped comparators.
    pub lumped: Vec<LumpedBody>,
    /// Proof of completeness and noise floor.
    pub certificate: Certificate,
    /// Interfaces.
    pub interfaces: Vec<Interface>,
    /// K and M in interface coordinates, for a basis that has them (Craig-Bampton).
    pub coordinates: Option<InterfaceCoordinates>,
    /// Rows to read off the deformed body: stresses, strains, forces, displacements.
    pub recoveries: Vec<Recovery>,
    /// Nodal forces with a name.
    pub named_loads: Vec<NamedLoad>,
    /// Decisions about the groups of the kinetic energy; empty if no selection was made, and then all
    /// groups are held.
    pub terms: Vec<TermDecision>,
    /// Precision of shapes and of the inertia of the modes.
    pub storage: Storage,
}

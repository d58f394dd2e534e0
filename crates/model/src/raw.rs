//! A model as the readers deliver it: parsed, but not yet checked as a mechanical body.

use super::{Damping, DofLabel, GeometricStiffness, GivenRows, NodeSet, Nodes, SurfaceMesh};
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::{SourceFile, Sources};
use flexbody_base::units::UnitSystem;
use flexbody_linalg::CscMatrix;
use std::path::PathBuf;

/// A matrix with what its file says about it.
#[derive(Debug, Clone, PartialEq)]
pub struct RawMatrix {
    /// The matrix, both triangles (a reader expands a stored triangle), zeros dropped, duplicates summed.
    pub matrix: CscMatrix,
    /// Significant decimal digits that its values really carry, 1 to 17, however many were written; 17 for
    /// short exact numbers. Thresholds of the model checks follow it.
    pub digits: u8,
    /// Where it came from; empty for matrices handed over in memory.
    pub path: PathBuf,
}

/// Shapes or loads as a reader delivers them: one column each.
#[derive(Debug, Clone, PartialEq)]
pub struct RawShapes {
    /// N x k, by matrix rows.
    pub matrix: Mat<f64>,
    /// Significant decimal digits that the values carry at the most: 7 for single precision.
    pub digits: u8,
    /// Where they came from; empty when handed over in memory.
    pub path: PathBuf,
    /// The same with its fingerprint; none when handed over in memory.
    pub source: Option<SourceFile>,
}

/// Modes as an FE program has written them: by nodes, with the eigenvalues that it found.
#[derive(Debug, Clone, PartialEq)]
pub struct RawModes {
    /// Node and direction of every row of `matrix`, each once.
    pub labels: Vec<DofLabel>,
    /// One column for every mode.
    pub matrix: Mat<f64>,
    /// True if the values stand along the axes of the rows of their nodes, false if along those of the model.
    pub along_nodes: bool,
    /// Eigenvalue of every mode in radians^2/time^2; `None` where the file states none.
    pub eigenvalues: Vec<Option<f64>>,
    /// Significant decimal digits of the eigenvalues.
    pub eigenvalue_digits: u8,
    /// Significant decimal digits that the values of the shapes carry at the most.
    pub digits: u8,
    /// Where they came from.
    pub path: PathBuf,
    /// The same with its fingerprint.
    pub source: SourceFile,
}

/// Everything that describes one model, before the checks.
#[derive(Debug, Clone, PartialEq)]
pub struct RawModel {
    /// Name of the model.
    pub name: String,
    /// 3 or 2.
    pub dimension: u8,
    /// Units of the numbers.
    pub units: UnitSystem,
    /// Stiffness matrix K.
    pub stiffness: RawMatrix,
    /// Mass matrix M.
    pub mass: RawMatrix,
    /// Node table.
    pub nodes: Nodes,
    /// Where the node table came from; empty when handed over in memory.
    pub nodes_path: PathBuf,
    /// The surface, by indices of `nodes`, where elements are known.
    pub mesh: Option<SurfaceMesh>,
    /// Label of each matrix row; `None`: node-major x, y, z in the order of the node table.
    pub dofs: Option<Vec<DofLabel>>,
    /// Where the labels came from; empty when handed over in memory.
    pub dofs_path: PathBuf,
    /// Maps for shapes and loads from the rows of the files to the rows of K and M here.
    pub given_rows: GivenRows,
    /// Named node sets.
    pub interfaces: Vec<NodeSet>,
    /// Damping, where it is given; a matrix has the rows of K and M.
    pub damping: Option<Damping<RawMatrix>>,
    /// Geometric stiffness of unit loads, with the rows of K and M.
    pub geometric_stiffness: Vec<GeometricStiffness<RawMatrix>>,
    /// Whether findings that a person has looked at are warnings: densities that no matter has, mass between
    /// nodes that no stiffness joins.
    pub allow_implausible: bool,
    /// Role (`stiffness`, `mass`, `nodes`, `dofs`, `damping`, `geometric_stiffness`, `mesh`, `manifest`), file name
    /// and SHA-256 (hex) of every file read.
    pub sources: Sources,
    /// Warnings and notes of the readers; never an error.
    pub diagnostics: Vec<Diagnostic>,
}

impl RawModel {
    /// True if the numbers can be held to matter: units are stated, or the model comes from files, whose numbers are
    /// taken for m, kg, s where nothing states their units. Matrices in memory without units may have no dimension.
    pub fn has_units(&self) -> bool {
        self.units.stated || !self.stiffness.path.as_os_str().is_empty()
    }

    /// A model from matrices in memory: rows node by node, x, y, z in the order of `nodes`, all digits valid,
    /// units m, kg, s not stated. Whatever else is known about it is set in the fields.
    /// `examples/from_memory.rs` goes on from here to a written file.
    pub fn in_memory(name: impl Into<String>, stiffness: CscMatrix, mass: CscMatrix, nodes: Nodes) -> Self {
        let matrix = |matrix| RawMatrix { matrix, digits: 17, path: PathBuf::new() };
        Self {
            name: name.into(),
            dimension: 3,
            units: UnitSystem::default(),
            stiffness: matrix(stiffness),
            mass: matrix(mass),
            nodes,
            nodes_path: PathBuf::new(),
            mesh: None,
            dofs: None,
            dofs_path: PathBuf::new(),
            given_rows: GivenRows::default(),
            interfaces: Vec::new(),
            damping: None,
            geometric_stiffness: Vec::new(),
            allow_implausible: false,
            sources: Sources::default(),
            diagnostics: Vec::new(),
        }
    }
}

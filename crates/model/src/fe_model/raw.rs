//! A model as delivered by the readers: parsed, but not yet checked as a mechanical body.

use crate::raw_matrix::RawMatrix;
use crate::{Accepted, Description, DofLabel, GivenRows, ModelData, Nodes, RawFollowers};
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::SourceFile;
use flexbody_base::units::UnitSystem;
use flexbody_linalg::CscMatrix;
use std::path::PathBuf;

/// Shapes or loads as delivered by a reader: one column each.
#[derive(Debug, Clone, PartialEq)]
pub struct RawShapes {
    /// Columns by matrix rows (N x k).
    pub matrix: Mat<f64>,
    /// Upper limit of the significant decimal digits of the values: 7 for single precision.
    pub digits: u8,
    /// Path of the file; empty for data in memory.
    pub path: PathBuf,
    /// Name and fingerprint of the file; `None` for data in memory.
    pub source: Option<SourceFile>,
}

/// Modes as written by an FE program: by nodes, with their eigenvalues.
#[derive(Debug, Clone, PartialEq)]
pub struct RawModes {
    /// Node and direction of every row of `matrix`, each once.
    pub labels: Vec<DofLabel>,
    /// Mode shapes, one column per mode.
    pub matrix: Mat<f64>,
    /// True if the values are along the axes of the rows of their nodes, false if along those of the model.
    pub along_nodes: bool,
    /// Eigenvalue of every mode in radians^2/time^2; `None` if the file states none.
    pub eigenvalues: Vec<Option<f64>>,
    /// Significant decimal digits of the eigenvalues.
    pub eigenvalue_digits: u8,
    /// Upper limit of the significant decimal digits of the shapes.
    pub digits: u8,
    /// Path of the file.
    pub path: PathBuf,
    /// Name and fingerprint of the file.
    pub source: SourceFile,
}

/// Complete description of one model before the checks.
#[derive(Debug, Clone, PartialEq)]
pub struct RawModel {
    /// Data other than matrices, nodes and rows.
    pub data: ModelData<RawMatrix>,
    /// Dimension, 3 or 2.
    pub dimension: u8,
    /// Stiffness matrix K.
    pub stiffness: RawMatrix,
    /// Mass matrix M.
    pub mass: RawMatrix,
    /// Node table.
    pub nodes: Nodes,
    /// Path of the file of the node table; empty for data in memory.
    pub nodes_path: PathBuf,
    /// Label of each matrix row; `None`: node-major x, y, z in the order of the node table.
    pub dofs: Option<Vec<DofLabel>>,
    /// Path of the file of the labels; empty for data in memory.
    pub dofs_path: PathBuf,
    /// Maps for shapes and loads from the rows of the files to the rows of K and M here.
    pub given_rows: GivenRows,
    /// Points with mass that follow several nodes by constraints which the reader eliminated.
    pub followers: Option<RawFollowers>,
    /// Checks whose findings are warnings instead of errors because the user accepted them.
    pub allow_implausible: Accepted,
    /// True if soft rotations, to which only elements that are not quite coplanar give a stiffness, stay as K
    /// has them instead of following their elements.
    pub keep_soft_rotations: bool,
    /// Warnings and notes of the readers; no errors.
    pub diagnostics: Vec<Diagnostic>,
}

impl RawModel {
    /// Creates a model from matrices in memory: rows node by node, x, y, z in the order of `nodes`, all
    /// digits valid, units m, kg, s not stated. Set the fields for further data. `examples/from_memory.rs`
    /// continues from here to a written file.
    pub fn in_memory(name: impl Into<String>, stiffness: CscMatrix, mass: CscMatrix, nodes: Nodes) -> Self {
        let matrix = |matrix| RawMatrix { matrix, digits: 17, path: PathBuf::new() };
        Self {
            data: ModelData::new(Description::new(name, UnitSystem::default())),
            dimension: 3,
            stiffness: matrix(stiffness),
            mass: matrix(mass),
            nodes,
            nodes_path: PathBuf::new(),
            dofs: None,
            dofs_path: PathBuf::new(),
            given_rows: GivenRows::default(),
            followers: None,
            allow_implausible: Accepted::default(),
            keep_soft_rotations: false,
            diagnostics: Vec::new(),
        }
    }

    /// Returns the model with its data changed by `change`, which is called once.
    pub fn with(mut self, change: impl FnOnce(&mut ModelData<RawMatrix>)) -> Self {
        change(&mut self.data);
        self
    }
}

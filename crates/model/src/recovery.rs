//! Recovery: rows that read stresses, strains, forces or displacements off the deformed body (theory section 12).

use super::DofLabel;
use faer::Mat;
use flexbody_linalg::CscMatrix;
use std::path::PathBuf;

/// Physical quantity of a row of a recovery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Component of the stress.
    Stress,
    /// Component of the strain.
    Strain,
    /// Force, such as a member end force or a section force.
    Force,
    /// Moment.
    Moment,
    /// Displacement or rotation, relative to the frame of the body.
    Displacement,
    /// Any other linear combination of the displacements.
    Other,
}

impl Quantity {
    /// All quantities, in the order of the documentation.
    pub const ALL: [Self; 6] =
        [Self::Stress, Self::Strain, Self::Force, Self::Moment, Self::Displacement, Self::Other];

    /// Returns the name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stress => "stress",
            Self::Strain => "strain",
            Self::Force => "force",
            Self::Moment => "moment",
            Self::Displacement => "displacement",
            Self::Other => "other",
        }
    }

    /// Returns the quantity with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// Returns true if a rigid motion of the body leaves the quantity at zero.
    pub fn ignores_rigid_motion(self) -> bool {
        !matches!(self, Self::Displacement | Self::Other)
    }

    /// Returns true if the quantity has a unit of measure.
    pub fn has_unit(self) -> bool {
        !matches!(self, Self::Strain | Self::Other)
    }
}

/// Label of a row of a recovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecoveryRow {
    /// Name, unique within the recovery.
    pub name: String,
    /// Physical quantity.
    pub quantity: Quantity,
    /// Component: `xx`, `yy`, `zz`, `xy`, `yz`, `xz`, a number, or any other text.
    pub component: String,
    /// Unit of the value of the row; empty for a pure number.
    pub unit: String,
    /// Number of the node that the row belongs to.
    pub node: Option<i64>,
    /// Number of the element that the row belongs to.
    pub element: Option<i64>,
}

/// Shapes whose stresses an FE program has computed.
#[derive(Debug, Clone, PartialEq)]
pub struct AnsweredShapes {
    /// Node and direction of every row of `displacements`, along the axes of the model, each once.
    pub dofs: Vec<DofLabel>,
    /// Displacements of the shapes, one column per shape.
    pub displacements: Mat<f64>,
    /// Significant decimal digits of the displacements.
    pub digits: u8,
    /// Values of the rows of the recovery under each shape (rows x shapes).
    pub answers: Mat<f64>,
    /// Significant decimal digits of the answers.
    pub answer_digits: u8,
    /// Strain energy of each shape as computed by the FE program, if it was read.
    pub energies: Option<Vec<f64>>,
}

/// Linear map from the displacements of the body to the rows of a recovery.
#[derive(Debug, Clone, PartialEq)]
pub enum RecoveryOperator {
    /// Rows of a matrix R: y = R u.
    Rows {
        /// R', one column per row of the recovery. A reader delivers the rows of the files, a checked model
        /// has its internal rows.
        transposed: CscMatrix,
        /// Label of every row.
        labels: Vec<RecoveryRow>,
        /// Values y0 of the undeformed body, one per row; `None` for zero.
        offset: Option<Vec<f64>>,
    },
    /// Rows known by their values under shapes: R u = S x for u = U x with the displacements U and the values S.
    Shapes {
        /// The shapes with their values.
        shapes: AnsweredShapes,
        /// Label of every row.
        labels: Vec<RecoveryRow>,
    },
    /// Section forces: resultant force and moment that the nodes of one side of a cut exert on the rest of
    /// the body, along the axes of the model.
    Cut {
        /// Numbers of the nodes on this side of the cut.
        nodes: Vec<i64>,
        /// Point that the moment is about, in the coordinates of the model.
        about: [f64; 3],
    },
}

/// Recovery that a model asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRecovery {
    /// Name, unique in the model.
    pub name: String,
    /// Map from the displacements.
    pub operator: RecoveryOperator,
    /// File of the operator or of the nodes, for messages; empty for data in memory.
    pub path: PathBuf,
}

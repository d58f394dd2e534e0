//! Properties of the files of a model that its checks use.

use crate::{Accepted, GeometricStiffness, RawMatrix, RawModel};
use std::path::PathBuf;

/// Files of a model, for messages, with the digits of their numbers, for tolerances.
#[derive(Debug, Clone)]
pub(crate) struct Origin {
    /// Properties of K.
    pub stiffness: MatrixOrigin,
    /// Properties of M.
    pub mass: MatrixOrigin,
    /// Properties of the geometric stiffness of each load.
    pub geometric_stiffness: Vec<GeometricStiffness<MatrixOrigin>>,
    /// Path of the file of the node table; empty for data in memory.
    pub nodes_path: PathBuf,
    /// Checks whose findings are warnings: see [`RawModel`].
    pub allow_implausible: Accepted,
}

/// File of a matrix.
#[derive(Debug, Clone)]
pub(crate) struct MatrixOrigin {
    /// Significant decimal digits of the values.
    pub digits: u8,
    /// Path of the file; empty for matrices in memory.
    pub path: PathBuf,
}

impl From<RawMatrix> for MatrixOrigin {
    fn from(raw: RawMatrix) -> Self {
        Self { digits: raw.digits, path: raw.path }
    }
}

impl From<RawModel> for Origin {
    fn from(raw: RawModel) -> Self {
        let of_load = |stiffness: GeometricStiffness<RawMatrix>| GeometricStiffness {
            load: stiffness.load,
            matrix: stiffness.matrix.into(),
        };
        Self {
            stiffness: raw.stiffness.into(),
            mass: raw.mass.into(),
            geometric_stiffness: raw.data.geometric_stiffness.into_iter().map(of_load).collect(),
            nodes_path: raw.nodes_path,
            allow_implausible: raw.allow_implausible,
        }
    }
}

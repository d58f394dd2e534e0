//! Description of the files that `flexbody prepare` writes: `prepared.jsonl`.

use super::sealed;
use flexbody_base::error::Result;
use flexbody_eigen::{Accuracy, Wanted};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Format name of the file.
pub(super) const FORMAT: &str = "flexbody-prepared";

/// Names of the files in the folder.
pub(super) const PREPARED: &str = "prepared.jsonl";
pub(super) const STIFFNESS: &str = "stiffness.petsc";
pub(super) const MASS: &str = "mass.petsc";
pub(super) const RIGID: &str = "rigid.petsc";
pub(super) const DRIVER: &str = "driver.py";

/// Returns the name of the file of the matrix that turns displacements about an axis.
pub(super) fn turn_file(axis: usize) -> String {
    format!("turn-{}.petsc", ["x", "y", "z"][axis])
}

/// Source from which a model is read again when its body is made.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ModelReference {
    /// Manifest or job; `None` for matrices that were named one by one.
    pub path: Option<PathBuf>,
    /// FE program of the job.
    pub format: Option<String>,
    /// Units of the job.
    pub units: Option<String>,
    /// Names of the matrices of the job.
    #[serde(default)]
    pub matrices: Option<String>,
    /// Dimension of the job.
    #[serde(default)]
    pub dimension: Option<u8>,
    /// Interfaces of the job.
    pub interfaces: Vec<String>,
    /// True if implausible findings were treated as warnings.
    pub allow_implausible: bool,
}

/// Requested modes: a number, or all below an eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WantedModes {
    /// Number of the lowest modes.
    pub modes: Option<u64>,
    /// Eigenvalue below which all modes are requested. Unit: 1/time^2.
    pub below: Option<f64>,
}

impl From<Wanted> for WantedModes {
    fn from(wanted: Wanted) -> Self {
        match wanted {
            Wanted::Lowest(count) => Self { modes: Some(count as u64), below: None },
            Wanted::Below(lambda) => Self { modes: None, below: Some(lambda) },
        }
    }
}

impl WantedModes {
    /// Returns the request in the form of the settings.
    pub fn wanted(self) -> Wanted {
        match (self.modes, self.below) {
            (_, Some(lambda)) => Wanted::Below(lambda),
            (modes, None) => Wanted::Lowest(modes.and_then(|count| usize::try_from(count).ok()).unwrap_or(0)),
        }
    }
}

/// Content of `prepared.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prepared {
    /// Program that wrote the file.
    pub generator: String,
    /// Name of the model.
    pub name: String,
    /// Source from which the model is read again.
    pub model: ModelReference,
    /// Names of the units of length, mass and time.
    pub units: [String; 3],
    /// One cycle per unit of time, in hertz.
    pub hertz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Number of rigid modes.
    pub rigid: usize,
    /// Number of rows of every node, if it is equal for all nodes; else 1.
    pub block_size: usize,
    /// Description of the row order.
    pub row_order: String,
    /// Bytes of the integers in the files for PETSc.
    pub index_bytes: u64,
    /// Numbers of entries of K and of M.
    pub entries: [u64; 2],
    /// Requested modes.
    pub wanted: WantedModes,
    /// Name of the accuracy.
    pub accuracy: String,
    /// Guaranteed K-residual.
    pub residual: f64,
    /// Relative distance of eigenvalues that belong to one cluster.
    pub cluster_gap: f64,
    /// Shift tau of K + tau M, positive.
    pub shift: f64,
    /// Files of the matrices T_b that turn displacements about the axes b; empty in folders of earlier versions.
    #[serde(default)]
    pub turns: Vec<String>,
    /// SHA-256 of each file.
    pub files: BTreeMap<String, String>,
    /// Fingerprint of K and M together.
    pub matrices: String,
}

impl Prepared {
    /// Returns the requested accuracy; standard if its name is unknown.
    pub fn accuracy(&self) -> Accuracy {
        Accuracy::from_name(&self.accuracy).unwrap_or_default()
    }
}

/// Reads the description of a prepared folder.
///
/// [`ClusterUnreadable`](flexbody_base::diagnostic::Code::ClusterUnreadable) if the file cannot be read, or
/// [`ClusterChanged`](flexbody_base::diagnostic::Code::ClusterChanged) if it was altered.
pub fn read_prepared(folder: &Path) -> Result<Prepared> {
    sealed::open(&folder.join(PREPARED), FORMAT)
}

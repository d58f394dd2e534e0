//! What `flexbody prepare` says of the files that it writes: `prepared.jsonl`.

use super::sealed;
use flexbody_base::error::Result;
use flexbody_eigen::{Accuracy, Wanted};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Format of the file.
pub(super) const FORMAT: &str = "flexbody-prepared";

/// Names of the files of a folder.
pub(super) const PREPARED: &str = "prepared.jsonl";
pub(super) const STIFFNESS: &str = "stiffness.petsc";
pub(super) const MASS: &str = "mass.petsc";
pub(super) const RIGID: &str = "rigid.petsc";
pub(super) const DRIVER: &str = "driver.py";

/// Name of the file of the matrix that turns displacements about an axis.
pub(super) fn turn_file(axis: usize) -> String {
    format!("turn-{}.petsc", ["x", "y", "z"][axis])
}

/// Where a model is read from again, when its body is made.
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
    /// Whether implausible findings were taken as warnings.
    pub allow_implausible: bool,
}

/// Which modes are wanted: so many, or all below an eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WantedModes {
    /// The lowest so many.
    pub modes: Option<u64>,
    /// All below. Unit: 1/time^2.
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
    /// As settings have it.
    pub fn wanted(self) -> Wanted {
        match (self.modes, self.below) {
            (_, Some(lambda)) => Wanted::Below(lambda),
            (modes, None) => Wanted::Lowest(modes.and_then(|count| usize::try_from(count).ok()).unwrap_or(0)),
        }
    }
}

/// The content of `prepared.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prepared {
    /// Program that wrote it.
    pub generator: String,
    /// Name of the model.
    pub name: String,
    /// Where the model is read from again.
    pub model: ModelReference,
    /// Names of the units of length, mass and time.
    pub units: [String; 3],
    /// One cycle per unit of time in hertz.
    pub hertz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Number of rigid modes.
    pub rigid: usize,
    /// Rows of every node, where all have as many; else 1.
    pub block_size: usize,
    /// What the rows are.
    pub row_order: String,
    /// Bytes of the whole numbers in PETSc's files.
    pub index_bytes: u64,
    /// Entries of K and of M.
    pub entries: [u64; 2],
    /// Which modes are wanted.
    pub wanted: WantedModes,
    /// Name of the accuracy.
    pub accuracy: String,
    /// K-residual that is promised.
    pub residual: f64,
    /// Relative distance of eigenvalues that belong to one cluster.
    pub cluster_gap: f64,
    /// tau of K + tau M, positive.
    pub shift: f64,
    /// Files of the matrices T_b that turn displacements about the axes b; none in folders of earlier programs.
    #[serde(default)]
    pub turns: Vec<String>,
    /// SHA-256 of each file.
    pub files: BTreeMap<String, String>,
    /// Fingerprint of K and M together.
    pub matrices: String,
}

impl Prepared {
    /// The accuracy that was asked for; standard where its name is not known.
    pub fn accuracy(&self) -> Accuracy {
        Accuracy::from_name(&self.accuracy).unwrap_or_default()
    }
}

/// Reads what a folder was prepared for.
///
/// # Errors
/// [`ClusterUnreadable`](flexbody_base::diagnostic::Code::ClusterUnreadable) or
/// [`ClusterChanged`](flexbody_base::diagnostic::Code::ClusterChanged).
pub fn read_prepared(folder: &Path) -> Result<Prepared> {
    sealed::open(&folder.join(PREPARED), FORMAT)
}

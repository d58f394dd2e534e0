//! Preparation of a folder for a cluster: K, M, rigid modes, matrices that turn displacements, the requested modes and
//! the driver.

use super::petsc::{IndexBytes, RowOrder, Rows, TurnedRows, WrittenRows, write_matrix, write_vectors};
use super::sealed::{self, seal};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::{generator, sha256_hex};
use flexbody_body::basis::{first_eigenvalue_estimate, rigid_modes};
use flexbody_eigen::{Accuracy, CLUSTER_GAP, FIRST_SHIFT, Wanted};
use flexbody_model::{Accepted, FeModel};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

/// Source of the program for the cluster.
pub(super) const DRIVER_SOURCE: &str = include_str!("driver.py");

/// Settings of a preparation.
#[derive(Debug, Clone, PartialEq)]
pub struct PrepareSettings {
    /// Requested modes.
    pub wanted: Wanted,
    /// Accuracy of the modes.
    pub accuracy: Accuracy,
    /// Bytes of the integers of the PETSc that will read the files: 4 or 8.
    pub index_bytes: u64,
    /// Source from which the model is read again.
    pub model: ModelReference,
}

/// Files that are written, but not yet in their places.
pub struct Preparation {
    /// Content of `prepared.jsonl`.
    pub prepared: Prepared,
    /// Size of all files in bytes.
    pub bytes: u64,
    slots: Vec<OutputSlot>,
}

impl Preparation {
    /// Puts all files in place.
    ///
    /// # Errors
    /// The errors of [`OutputSlot::commit_all`].
    pub fn commit(self) -> Result<Prepared> {
        OutputSlot::commit_all(self.slots)?;
        Ok(self.prepared)
    }

    /// Puts all files in place in a folder that remains if the run fails: another run continues from it.
    ///
    /// # Errors
    /// The errors of [`OutputSlot::keep_all`].
    pub fn keep(self) -> Result<Prepared> {
        OutputSlot::keep_all(self.slots)?;
        Ok(self.prepared)
    }
}

/// Writes the files that a cluster needs to find the modes of `model` into the existing `folder`. K and M are written
/// row by row, so that no additional memory of their size is needed.
///
/// # Errors
/// [`Usage`](Code::Usage) if the numbers of entries need 64-bit integers; the errors of [`rigid_modes`] and of
/// [`OutputSlot`].
pub fn prepare(model: &FeModel, settings: &PrepareSettings, folder: &Path) -> Result<Preparation> {
    let index = index_bytes(settings.index_bytes)?;
    let pencil = model.pencil();
    let order = RowOrder::of(model);
    // Matrices in the row order of the files; their numbers of entries must fit the integers.
    let stiffness = WrittenRows { matrix: pencil.stiffness(), block: 1, order: &order };
    let mass = WrittenRows { matrix: pencil.mass(), block: pencil.block(), order: &order };
    let entries = [stiffness.entries(), mass.entries()];
    if let Some(most) = entries.into_iter().max().filter(|most| *most > index.largest()) {
        let message = format!("a matrix has {most} entries, too many for indices of 32 bits");
        return Err(Diagnostic::new(Code::Usage, message)
            .with_help("use --indices 64, and a PETSc that is configured with 64-bit indices")
            .into());
    }
    let rigid = rigid_modes(model, &pencil)?;
    let shift = FIRST_SHIFT * first_eigenvalue_estimate(model, rigid.as_ref());
    // Write matrices, rigid modes, turning matrices and the driver, then the description with all digests.
    let mut writing = Writing { folder, slots: Vec::new(), files: BTreeMap::new(), bytes: 0 };
    writing.file(STIFFNESS, |file| write_matrix(file, &stiffness, index))?;
    writing.file(MASS, |file| write_matrix(file, &mass, index))?;
    writing.file(RIGID, |file| write_vectors(file, order.to_written(rigid.as_ref()).as_ref(), index))?;
    let turned = TurnedRows::of(model, &order);
    for rows in &turned {
        writing.file(&turn_file(rows.axis), |file| write_matrix(file, rows, index))?;
    }
    writing.text(DRIVER, DRIVER_SOURCE)?;
    let units = model.units();
    let prepared = Prepared {
        generator: generator(),
        name: model.name().to_owned(),
        model: settings.model.clone(),
        units: [&units.length, &units.mass, &units.time].map(|unit| unit.name().to_owned()),
        hertz: units.hertz(),
        rows: pencil.n(),
        rigid: rigid.ncols(),
        block_size: order.block_size,
        row_order: "node by node: displacements, then rotations; then rows without a place".to_owned(),
        index_bytes: index.bytes(),
        entries,
        wanted: WantedModes::from(settings.wanted),
        accuracy: settings.accuracy.name().to_owned(),
        residual: settings.accuracy.residual(),
        cluster_gap: CLUSTER_GAP,
        shift,
        turns: turned.iter().map(|rows| turn_file(rows.axis)).collect(),
        matrices: matrices(&writing.files[STIFFNESS], &writing.files[MASS]),
        files: writing.files.clone(),
    };
    writing.text(PREPARED, &seal(FORMAT, &prepared))?;
    Ok(Preparation { prepared, bytes: writing.bytes, slots: writing.slots })
}

/// Returns the fingerprint of the matrices of a model, as [`prepare`] would write them. Nothing is written.
pub(super) fn matrices_of(model: &FeModel, order: &RowOrder, index: IndexBytes) -> String {
    let pencil = model.pencil();
    let digest = |matrix, block| {
        let rows = WrittenRows { matrix, block, order };
        write_matrix(std::io::sink(), &rows, index).expect("nothing that is not written fails")
    };
    matrices(&digest(pencil.stiffness(), 1), &digest(pencil.mass(), pencil.block()))
}

/// Returns the fingerprint of both matrices, from the digests of their files.
fn matrices(stiffness: &str, mass: &str) -> String {
    sha256_hex(format!("{stiffness}\n{mass}\n").as_bytes())
}

/// Returns the integer size with this number of bytes.
pub(super) fn index_bytes(bytes: u64) -> Result<IndexBytes> {
    IndexBytes::of(bytes).ok_or_else(|| {
        let message = format!("indices of PETSc have {bytes} bytes, expected 4 or 8");
        Diagnostic::new(Code::ClusterUnreadable, message).into()
    })
}

/// Files that are being written to a folder.
struct Writing<'a> {
    folder: &'a Path,
    slots: Vec<OutputSlot>,
    /// SHA-256 of each file.
    files: BTreeMap<String, String>,
    bytes: u64,
}

impl Writing<'_> {
    fn file(&mut self, name: &str, write: impl FnOnce(File) -> std::io::Result<String>) -> Result<()> {
        let slot = OutputSlot::prepare(self.folder.join(name))?;
        let opened = OpenOptions::new().write(true).truncate(true).open(slot.temporary());
        let digest = opened.and_then(write).map_err(|e| slot.failure(&e))?;
        self.add(name, slot, digest);
        Ok(())
    }

    fn text(&mut self, name: &str, text: &str) -> Result<()> {
        let slot = OutputSlot::prepare(self.folder.join(name))?;
        slot.fill(text.as_bytes())?;
        self.add(name, slot, sha256_hex(text.as_bytes()));
        Ok(())
    }

    fn add(&mut self, name: &str, slot: OutputSlot, digest: String) {
        self.bytes += std::fs::metadata(slot.temporary()).map_or(0, |meta| meta.len());
        self.files.insert(name.to_owned(), digest);
        self.slots.push(slot);
    }
}

// Description of the files that `flexbody prepare` writes: `prepared.jsonl`.

/// Format name of the file.
const FORMAT: &str = "flexbody-prepared";

/// Names of the files in the folder.
const PREPARED: &str = "prepared.jsonl";
const STIFFNESS: &str = "stiffness.petsc";
const MASS: &str = "mass.petsc";
const RIGID: &str = "rigid.petsc";
pub(super) const DRIVER: &str = "driver.py";

/// Returns the name of the file of the matrix that turns displacements about an axis.
fn turn_file(axis: usize) -> String {
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
    /// Damping of the job.
    #[serde(default)]
    pub damping: Option<String>,
    /// Checks whose findings were treated as warnings.
    pub allow_implausible: AcceptedChecks,
    /// True if soft rotations stayed as K has them.
    #[serde(default)]
    pub keep_soft_rotations: bool,
}

/// Checks whose findings were treated as warnings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum AcceptedChecks {
    /// Their codes.
    Codes(Vec<String>),
    /// All checks that `true` accepts, or none: folders of former versions.
    All(bool),
}

impl AcceptedChecks {
    /// Returns the checks; unknown codes, of later versions, are left out.
    pub fn accepted(&self) -> Accepted {
        match self {
            Self::All(all) => Accepted::from(*all),
            Self::Codes(codes) => codes
                .iter()
                .flat_map(|code| Accepted::from_codes(code))
                .fold(Accepted::default(), Accepted::and),
        }
    }
}

impl Default for AcceptedChecks {
    fn default() -> Self {
        Self::Codes(Vec::new())
    }
}

impl From<Vec<&str>> for AcceptedChecks {
    fn from(codes: Vec<&str>) -> Self {
        Self::Codes(codes.into_iter().map(str::to_owned).collect())
    }
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

//! Preparation of a folder for a cluster: K, M, rigid modes, matrices that turn displacements, the requested modes and
//! the driver.

use super::petsc::{IndexBytes, Rows, write_matrix, write_vectors};
use super::prepared::{
    DRIVER, FORMAT, MASS, ModelReference, PREPARED, Prepared, RIGID, STIFFNESS, WantedModes, turn_file,
};
use super::row_order::{RowOrder, TurnedRows, WrittenRows};
use super::sealed::seal;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::{generator, sha256_hex};
use flexbody_body::basis::{first_eigenvalue_estimate, rigid_modes};
use flexbody_eigen::{Accuracy, CLUSTER_GAP, FIRST_SHIFT, Wanted};
use flexbody_model::FeModel;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::path::Path;

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

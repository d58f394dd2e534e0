//! The checkpoint of a search for modes: a small HDF5 file of its own format, described in
//! `docs/checkpoint.md`.

use super::extents::{Sizes, dataset};
use super::item::Extent;
use super::write::system_error;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::{self as hdf5_file, Stored, create, open_kept, put_text};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::{Fingerprint, generator};
use flexbody_eigen::Snapshot;
use hdf5::{Hyperslab, SliceOrIndex};
use hdf5_metno as hdf5;
use std::path::Path;

const FORMAT: &str = "flexbody-checkpoint";
const VERSION: i64 = 1;

/// A search as it was stored, and the model it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// What tells one model from another: a line for each input that the modes depend on.
    pub model: String,
    /// The search.
    pub snapshot: Snapshot,
}

/// Writes the state of a search on `model` to a place reserved by [`prepare_output`](super::prepare_output).
///
/// # Errors
/// [`DiskShort`](Code::DiskShort) or [`OutputUnwritable`](Code::OutputUnwritable); an existing file is then
/// as it was.
pub fn write_checkpoint(snapshot: &Snapshot, model: &str, slot: OutputSlot) -> Result<()> {
    fill(snapshot, model, slot.temporary()).map_err(|e| slot.failure(&system_error(&e.to_string())))?;
    OutputSlot::keep_all([slot])
}

fn fill(snapshot: &Snapshot, model: &str, path: &Path) -> hdf5::Result<()> {
    let Snapshot { shift, eigenvalues, basis, coupling, converged } = snapshot;
    let file = create(path)?;
    put_text(&file, "format", FORMAT)?;
    put_text(&file, "generator", &generator())?;
    put_text(&file, "model", model)?;
    put_text(&file, "sha256", &digest(snapshot, model))?;
    let sizes = [
        ("format_version", VERSION),
        ("rows", basis.nrows() as i64),
        ("vectors", eigenvalues.len() as i64),
        ("block", coupling.nrows() as i64),
        ("converged", *converged as i64),
    ];
    for (name, value) in sizes {
        file.new_attr::<i64>().create(name)?.write_scalar(&value)?;
    }
    file.new_attr::<f64>().create("shift")?.write_scalar(shift)?;
    let values = file.new_dataset::<f64>().obj_track_times(false).shape(eigenvalues.len());
    values.create("eigenvalue")?.write_raw(eigenvalues)?;
    put_columns(&file, "basis", basis.as_ref())?;
    if coupling.nrows() > 0 {
        put_columns(&file, "coupling", coupling.as_ref())?;
    }
    file.flush()?;
    file.close()
}

/// Writes a matrix column by column, without another copy of it: each column is a row of the dataset.
fn put_columns(file: &hdf5::File, name: &str, matrix: MatRef<'_, f64>) -> hdf5::Result<()> {
    let shape = [matrix.ncols(), matrix.nrows()];
    let dataset = file.new_dataset::<f64>().obj_track_times(false).shape(shape).create(name)?;
    for (j, column) in columns(matrix).enumerate() {
        let all = SliceOrIndex::Unlimited { start: 0, step: 1, block: 1 };
        dataset.write_slice(column, Hyperslab::from(vec![SliceOrIndex::Index(j), all]))?;
    }
    Ok(())
}

fn columns(matrix: MatRef<'_, f64>) -> impl Iterator<Item = &[f64]> {
    let column = move |j| matrix.col(j).try_as_col_major().expect("blocks are column-major").as_slice();
    (0..matrix.ncols()).map(column)
}

/// SHA-256 of all that is stored: HDF5 does not notice when data are damaged.
fn digest(snapshot: &Snapshot, model: &str) -> String {
    let Snapshot { shift, eigenvalues, basis, coupling, converged } = snapshot;
    let mut fingerprint = Fingerprint::default();
    fingerprint.update(model.as_bytes());
    fingerprint.update(&(*converged as u64).to_le_bytes());
    fingerprint.update(&shift.to_le_bytes());
    let mut bytes = Vec::new();
    for values in
        [eigenvalues.as_slice()].into_iter().chain(columns(basis.as_ref())).chain(columns(coupling.as_ref()))
    {
        bytes.clear();
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        fingerprint.update(&bytes);
    }
    fingerprint.hex()
}

/// Reads a checkpoint.
///
/// # Errors
/// [`FileUnreadable`](Code::FileUnreadable); [`CheckpointUnreadable`](Code::CheckpointUnreadable): not one,
/// or damaged; [`CheckpointVersion`](Code::CheckpointVersion): of another format version.
pub fn read_checkpoint(path: impl AsRef<Path>) -> Result<Checkpoint> {
    let path = path.as_ref();
    let (file, bytes) = open_kept(path, "checkpoint", Code::CheckpointUnreadable)?;
    let fail = |code, message: String| Diagnostic::new(code, message).in_file(path);
    let damaged =
        |what: String| fail(Code::CheckpointUnreadable, format!("cannot read the checkpoint: {what}"));
    if hdf5_file::text(&file, "format").ok().flatten().as_deref() != Some(FORMAT) {
        return Err(damaged(format!("it has no attribute `format` = `{FORMAT}`")).into());
    }
    let version = int(&file, "format_version").map_err(damaged)?;
    if version != VERSION {
        let writer = text(&file, "generator").unwrap_or_else(|_| "an unnamed program".to_owned());
        let message = format!(
            "checkpoint of format version {version}, written by {writer}; this version reads {VERSION}"
        );
        return Err(fail(Code::CheckpointVersion, message).into());
    }
    let checkpoint = load(&file, bytes).map_err(damaged)?;
    Ok(checkpoint)
}

fn load(file: &hdf5::File, bytes: u64) -> std::result::Result<Checkpoint, String> {
    let [rows, vectors, block, converged] =
        [size(file, "rows")?, size(file, "vectors")?, size(file, "block")?, size(file, "converged")?];
    let (model, stated) = (text(file, "model")?, text(file, "sha256")?);
    let shift = required("shift", hdf5_file::float(file, "shift"))?;
    let mut stored = Stored::new(bytes);
    let mut floats = |name: &str, shape: &[usize]| {
        let extents: Vec<Extent> = shape.iter().map(|&size| Extent::Fixed(size)).collect();
        let group = file.as_group().map_err(|e| e.to_string())?;
        let found = dataset::<f64>(&group, name, &extents, &mut Sizes::default(), &mut stored);
        required(name, found).map(|(values, _)| values)
    };
    let eigenvalues = floats("eigenvalue", &[vectors])?;
    let basis = floats("basis", &[vectors.saturating_add(block), rows])?;
    let coupling = if block > 0 { floats("coupling", &[vectors, block])? } else { Vec::new() };
    let snapshot = Snapshot {
        shift,
        eigenvalues,
        basis: MatRef::from_column_major_slice(&basis, rows, vectors + block).to_owned(),
        coupling: if block > 0 {
            MatRef::from_column_major_slice(&coupling, block, vectors).to_owned()
        } else {
            Mat::zeros(0, vectors)
        },
        converged,
    };
    if digest(&snapshot, &model) != stated {
        return Err("the data do not have the SHA-256 that the file states".to_owned());
    }
    Ok(Checkpoint { model, snapshot })
}

/// A size that fits into a file: sums of two of them do not overflow.
fn size(file: &hdf5::File, name: &str) -> std::result::Result<usize, String> {
    let value = int(file, name)?;
    u32::try_from(value).map(|v| v as usize).map_err(|_| format!("`{name}`: expected a size, found {value}"))
}

fn int(file: &hdf5::File, name: &str) -> std::result::Result<i64, String> {
    required(name, hdf5_file::int(file, name))
}

fn text(file: &hdf5::File, name: &str) -> std::result::Result<String, String> {
    required(name, hdf5_file::text(file, name))
}

fn required<T>(name: &str, value: std::result::Result<Option<T>, String>) -> std::result::Result<T, String> {
    match value {
        Ok(Some(value)) => Ok(value),
        Ok(None) => Err(format!("`{name}` is missing")),
        Err(problem) => Err(format!("`{name}`: {problem}")),
    }
}

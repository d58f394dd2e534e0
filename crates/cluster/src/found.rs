//! Result of a cluster: `result.jsonl`, `modes.petsc` and `condensed.petsc`, compared with the model and the prepared
//! files.

use super::petsc::{IndexBytes, RowOrder, TurnedRows, read_vector};
use super::prepare::{Prepared, index_bytes, matrices_of};
use super::sealed;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::{SourceFile, sha256_of_file};
use flexbody_base::read_files::{note_read, open_regular};
use flexbody_body::basis::{CountElsewhere, SolvedModes, rigid_modes};
use flexbody_linalg::{combine, gram, larger, uniform};
use flexbody_model::FeModel;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::path::Path;

const RESULT: &str = "result.jsonl";
const CHECKPOINT: &str = "checkpoint.jsonl";
const MODES: &str = "modes.petsc";
const CONDENSED: &str = "condensed.petsc";

/// Content of the result file of the driver.
#[derive(Debug, Clone, Deserialize)]
struct ResultFile {
    matrices: String,
    modes: usize,
    index_bytes: u64,
    modes_sha256: String,
    /// Digest of the condensation products; missing in results of earlier versions.
    condensed_sha256: Option<String>,
    eigenvalues: Vec<f64>,
    next_eigenvalue: Option<f64>,
    count: Option<CountFile>,
    solver: String,
    slepc: String,
    petsc: String,
    ranks: u64,
    #[serde(default)]
    seconds: BTreeMap<String, f64>,
    #[serde(default)]
    factor: BTreeMap<String, f64>,
}

#[derive(Debug, Clone, Deserialize)]
struct CountFile {
    negative: usize,
    zero: usize,
    shift: f64,
    by: String,
}

/// Content of the checkpoint of the driver.
#[derive(Debug, Clone, Deserialize)]
struct CheckpointFile {
    matrices: String,
    parts: Vec<SavedModes>,
}

#[derive(Debug, Clone, Deserialize)]
struct SavedModes {
    vectors: usize,
}

/// Modes that a cluster found, with information about the computation.
#[derive(Debug, Clone)]
pub struct ClusterModes {
    /// Modes, in the rows of the model.
    pub modes: SolvedModes,
    /// Description of the computation.
    pub solver_description: String,
    /// Seconds of each phase on the cluster.
    pub seconds: BTreeMap<String, f64>,
    /// Size and work of the factor of the count.
    pub factor: BTreeMap<String, f64>,
}

/// Reads the result of a cluster for `model`. If `prove` is set, the built-in inertia count is made as well.
///
/// # Errors
/// [`ClusterForeign`](Code::ClusterForeign) if the matrices differ, [`ClusterUnfinished`](Code::ClusterUnfinished) if
/// there is no result, [`ClusterChanged`](Code::ClusterChanged) and [`ClusterUnreadable`](Code::ClusterUnreadable) for
/// altered or damaged files, [`ClusterInaccurate`](Code::ClusterInaccurate) if the condensation products are not those
/// of M.
pub fn read_found(folder: &Path, prepared: &Prepared, model: &FeModel, prove: bool) -> Result<ClusterModes> {
    let order = RowOrder::of(model);
    let matrices = matrices_of(model, &order, index_bytes(prepared.index_bytes)?);
    if matrices != prepared.matrices {
        let message = format!(
            "K and M of `{}` differ from those that the folder was prepared with, of `{}`",
            model.name(),
            prepared.name
        );
        return Err(Diagnostic::new(Code::ClusterForeign, message).in_file(folder).into());
    }
    // The result must belong to these matrices, and have one eigenvalue per mode.
    let path = folder.join(RESULT);
    if !path.exists() {
        return Err(unfinished(folder, prepared));
    }
    let result: ResultFile = sealed::open(&path, "flexbody-result")?;
    if result.matrices != matrices {
        let message = "the result was computed with other matrices than those of the prepared folder";
        return Err(Diagnostic::new(Code::ClusterForeign, message).in_file(path).into());
    }
    let damaged = |why: &str| Error::from(Diagnostic::new(Code::ClusterUnreadable, why).in_file(&path));
    if result.modes == 0 || result.eigenvalues.len() != result.modes {
        return Err(damaged("the numbers of eigenvalues and modes of the result differ"));
    }
    let count = result.count.clone().map(|CountFile { negative, zero, shift, by }| {
        let by = format!("{by} ({} ranks)", result.ranks);
        CountElsewhere { negative, zero, shift, by }
    });
    // Modes in the rows of the model, then the check of the condensation products.
    let n = model.stiffness().n();
    let file = Vectors { path: &folder.join(MODES), digest: &result.modes_sha256, of: "modes" };
    let index = index_bytes(result.index_bytes)?;
    let vectors = file.read(n, result.modes, index, |row| order.internal(row))?;
    if let Some(digest) = &result.condensed_sha256 {
        check_condensation(&folder.join(CONDENSED), digest, &result, model, &order, vectors.as_ref())?;
    }
    let solver_description = format!(
        "SLEPc {}, PETSc {}, solver `{}` on {} ranks",
        result.slepc, result.petsc, result.solver, result.ranks
    );
    let modes = SolvedModes {
        vectors,
        eigenvalues: result.eigenvalues,
        next_eigenvalue: result.next_eigenvalue,
        count,
        engine: "slepc".to_owned(),
        prove,
        source: SourceFile::new("modes", Path::new(MODES), result.modes_sha256),
    };
    Ok(ClusterModes { modes, solver_description, seconds: result.seconds, factor: result.factor })
}

/// Returns the error for a missing result, with the number of modes found so far.
fn unfinished(folder: &Path, prepared: &Prepared) -> Error {
    let checkpoint = sealed::open::<CheckpointFile>(&folder.join(CHECKPOINT), "flexbody-kept").ok();
    let checkpoint = checkpoint.filter(|checkpoint| checkpoint.matrices == prepared.matrices);
    let checkpoint =
        checkpoint.map_or(0, |checkpoint| checkpoint.parts.iter().map(|part| part.vectors).sum());
    let message = match checkpoint {
        0 => "there is no result, and no mode is saved yet".to_owned(),
        saved => format!("there is no result yet; {saved} modes are saved"),
    };
    Diagnostic::new(Code::ClusterUnfinished, message).in_file(folder).into()
}

/// Refuses condensation products that are not those of M.
fn check_condensation(
    path: &Path,
    digest: &str,
    result: &ResultFile,
    model: &FeModel,
    order: &RowOrder,
    modes: MatRef<'_, f64>,
) -> Result<()> {
    let rigid = rigid_modes(model, &model.pencil())?;
    let condensed = Condensed::new(model, order, rigid.as_ref(), modes);
    let (columns, file) = (condensed.columns(), Vectors { path, digest, of: "products of condensation" });
    let products = file.read(columns, columns, index_bytes(result.index_bytes)?, |row| row)?;
    let difference = condensed.difference(products.as_ref());
    if difference <= MAX_CONDENSED_DIFFERENCE {
        return Ok(());
    }
    let message = format!(
        "the products of condensation differ from those of the mass matrix by {difference:.0e}, rounding explains at most {MAX_CONDENSED_DIFFERENCE:.0e}"
    );
    Err(Diagnostic::new(Code::ClusterInaccurate, message).in_file(path).into())
}

/// File of vectors whose bytes must be those that the driver wrote.
struct Vectors<'a> {
    path: &'a Path,
    digest: &'a str,
    /// Description of the vectors in messages.
    of: &'static str,
}

impl Vectors<'_> {
    /// Reads `count` columns of `n` rows. `place` returns the target row of each row.
    fn read(
        &self,
        n: usize,
        count: usize,
        index: IndexBytes,
        place: impl Fn(usize) -> usize,
    ) -> Result<Mat<f64>> {
        let unreadable =
            |why: String| Error::from(Diagnostic::new(Code::ClusterUnreadable, why).in_file(self.path));
        let failed = |e: std::io::Error| unreadable(format!("file cannot be read: {e}"));
        if sha256_of_file(self.path).map_err(failed)? != self.digest {
            let message = format!("the {} changed since the result was written", self.of);
            return Err(Diagnostic::new(Code::ClusterChanged, message).in_file(self.path).into());
        }
        note_read(self.path);
        let file = open_regular(self.path).map_err(failed)?;
        columns(BufReader::with_capacity(1 << 20, file), n, count, index, place)
            .map_err(failed)?
            .ok_or_else(|| unreadable(format!("file does not hold {count} vectors of {n} finite numbers")))
    }
}

fn columns(
    mut file: impl Read,
    n: usize,
    count: usize,
    index: IndexBytes,
    place: impl Fn(usize) -> usize,
) -> std::io::Result<Option<Mat<f64>>> {
    let mut all = Mat::zeros(n, count);
    for j in 0..count {
        let Some(column) = read_vector(&mut file, n, index)? else { return Ok(None) };
        if column.iter().any(|value| !value.is_finite()) {
            return Ok(None);
        }
        column.iter().enumerate().for_each(|(i, value)| all[(place(i), j)] = *value);
    }
    Ok(Some(all))
}

// Condensation products of a cluster: G = X' M X of X = [Phi, T_b Psi for each axis b, Psi], with the rigid modes Phi,
// the modes Psi and the matrix T_b that turns displacements about the axis b. G holds every integral of positions and
// shapes that the invariants consist of. The invariants are computed from M on this machine; G is compared with M, so
// that wrong products of a cluster are detected.

/// Number of random columns for the check of G.
const RANDOM_COLUMNS: usize = 2;
/// Seed of the random columns.
const SEED: u64 = 21;

/// Largest difference of G v and X' M X v that rounding explains, in the measure of [`Condensed::difference`].
const MAX_CONDENSED_DIFFERENCE: f64 = 1e-11;

/// Operator X, without stored columns.
struct Condensed<'a> {
    model: &'a FeModel,
    turns: Vec<TurnedRows<'a>>,
    rigid: MatRef<'a, f64>,
    modes: MatRef<'a, f64>,
}

impl<'a> Condensed<'a> {
    pub(crate) fn new(
        model: &'a FeModel,
        order: &'a RowOrder,
        rigid: MatRef<'a, f64>,
        modes: MatRef<'a, f64>,
    ) -> Self {
        Self { model, turns: TurnedRows::of(model, order), rigid, modes }
    }

    /// Returns the number of columns of X.
    pub(crate) fn columns(&self) -> usize {
        self.block(self.turns.len() + 1)
    }

    /// Returns the largest difference of G v and X' M X v for random columns v, relative to sqrt(max G_ii) sqrt(v' G
    /// v): by the Cauchy-Schwarz inequality, the largest possible entry of G v.
    fn difference(&self, g: MatRef<'_, f64>) -> f64 {
        let v = Mat::from_fn(self.columns(), RANDOM_COLUMNS, |i, j| uniform(SEED, i as u64, j as u64));
        let momentum = self.model.pencil().apply_mass(self.combined(v.as_ref()).as_ref());
        let (computed, given) = (self.projected(momentum.as_ref()), g * &v);
        let largest = (0..g.nrows()).map(|i| g[(i, i)]).fold(0.0, f64::max);
        let relative = |j: usize| {
            let size = (largest * (v.col(j).transpose() * computed.col(j))).sqrt();
            (given.col(j) - computed.col(j)).norm_max() / size
        };
        (0..RANDOM_COLUMNS).map(relative).fold(0.0, larger)
    }

    /// Returns the first column of a block of X: turned modes for each axis, then the modes, after the rigid modes.
    fn block(&self, of: usize) -> usize {
        self.rigid.ncols() + of * self.modes.ncols()
    }

    /// Returns X v.
    fn combined(&self, v: MatRef<'_, f64>) -> Mat<f64> {
        let part = |of: usize| combine(self.modes, v.subrows(self.block(of), self.modes.ncols()));
        let mut sum = combine(self.rigid, v.subrows(0, self.rigid.ncols())) + part(self.turns.len());
        for (of, turned) in self.turns.iter().enumerate() {
            let shapes = part(of);
            for row in 0..sum.nrows() {
                let Some((from, sign)) = turned.source(row) else { continue };
                (0..v.ncols()).for_each(|j| sum[(row, j)] += sign * shapes[(from, j)]);
            }
        }
        sum
    }

    /// Returns X' w.
    fn projected(&self, w: MatRef<'_, f64>) -> Mat<f64> {
        let count = self.modes.ncols();
        let mut all = Mat::zeros(self.columns(), w.ncols());
        all.subrows_mut(0, self.rigid.ncols()).copy_from(gram(self.rigid, w));
        for (of, turned) in self.turns.iter().enumerate() {
            // The transpose of T_b is -T_b.
            let back = Mat::from_fn(w.nrows(), w.ncols(), |row, j| {
                turned.source(row).map_or(0.0, |(from, sign)| -sign * w[(from, j)])
            });
            all.subrows_mut(self.block(of), count).copy_from(gram(self.modes, back.as_ref()));
        }
        all.subrows_mut(self.block(self.turns.len()), count).copy_from(gram(self.modes, w));
        all
    }
}

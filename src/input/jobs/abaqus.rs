//! Jobs of Abaqus: `*MATRIX GENERATE, STIFFNESS, MASS` and `*MATRIX OUTPUT` write `job_STIF1.mtx` and
//! `job_MASS1.mtx` beside the deck `job.inp`, as `row column value` (FORMAT=COORDINATE) or with the node and
//! the direction of row and column (FORMAT=MATRIX INPUT, LABELS).

use super::abaqus_rows::{labels, other_rows};
use super::coordinate_files::CoordinateFile;
use super::deck::Deck;
use super::deck_mesh::DeckMesh;
use super::labelled_lines::{has_labels, labelled};
use super::{Found, JobModel, JobReader, both, is_deck, missing, siblings};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::input::reader::MatrixRole;
use crate::model::{DofLabel, Nodes, RawMatrix};
use std::path::{Path, PathBuf};

/// The reader of Abaqus jobs.
pub(super) struct Abaqus;

const HELP: &str =
    "write them with *MATRIX GENERATE, STIFFNESS, MASS and *MATRIX OUTPUT, STIFFNESS, MASS in a step";

impl JobReader for Abaqus {
    fn name(&self) -> &'static str {
        "abaqus"
    }

    fn needs(&self) -> &'static str {
        "job.inp with job_STIF1.mtx and job_MASS1.mtx beside it"
    }

    fn recognises(&self, path: &Path) -> bool {
        is_deck(path) && Matrices::beside(path).is_ok()
    }

    fn read(&self, path: &Path) -> Found<JobModel> {
        let Matrices { stiffness, mass, note } = Matrices::beside(path)?;
        let deck = Deck::read(path)?;
        let mesh = DeckMesh::of(&deck)?;
        let (dofs, matrices) = if has_labels(&stiffness)? {
            labelled([&stiffness, &mass])?
        } else {
            numbered(&mesh, path, [&stiffness, &mass])?
        };
        let [stiffness_matrix, mass_matrix] = matrices;
        let (ids, positions) = mesh.nodes.iter().map(|(id, x)| (*id, *x)).unzip();
        let mut files: Vec<(&'static str, PathBuf)> =
            deck.paths().map(|path| ("deck", path.to_path_buf())).collect();
        files.extend([("stiffness", stiffness), ("mass", mass)]);
        Ok(JobModel {
            stiffness: stiffness_matrix,
            mass: mass_matrix,
            nodes: Nodes { ids, positions },
            dofs,
            elements: mesh.drawn(),
            sets: mesh.sets,
            files,
            diagnostics: mesh.notes.into_iter().chain(note).collect(),
        })
    }
}

/// The files of the two matrices.
struct Matrices {
    stiffness: PathBuf,
    mass: PathBuf,
    /// Which of several were taken.
    note: Option<Diagnostic>,
}

impl Matrices {
    /// Files whose names are that of the deck with STIF and MASS and the same number; those with the highest
    /// number.
    fn beside(deck: &Path) -> Found<Self> {
        let mut found: [Vec<(u32, PathBuf)>; 2] = [Vec::new(), Vec::new()];
        for (rest, path) in siblings(deck) {
            let rest = rest.trim_start_matches('_');
            let number = |kind: &str| rest.strip_prefix(kind)?.strip_suffix(".mtx")?.parse::<u32>().ok();
            for (k, kind) in ["stif", "mass"].iter().enumerate() {
                found[k].extend(number(kind).map(|number| (number, path.clone())));
            }
        }
        found.iter_mut().for_each(|files| files.sort());
        let [stiffness, mass] = &found;
        let shared = stiffness.iter().rev().find(|(number, _)| mass.iter().any(|(own, _)| own == number));
        let Some((number, stiffness_path)) = shared else {
            let what = match (stiffness.is_empty(), mass.is_empty()) {
                (false, true) => "the mass matrix (job_MASS1.mtx)",
                (true, false) => "the stiffness matrix (job_STIF1.mtx)",
                _ => "a pair of matrices (job_STIF1.mtx, job_MASS1.mtx)",
            };
            return Err(vec![missing(deck, &format!("beside the deck {what}"), HELP)]);
        };
        let mass_path = mass.iter().find(|(own, _)| own == number).map(|(_, path)| path.clone());
        let note = (stiffness.len() > 1).then(|| {
            let message =
                format!("of {} steps with matrices the last one, {number}, is taken", stiffness.len());
            Diagnostic::new(Code::JobStep, message).in_file(stiffness_path)
        });
        Ok(Self { stiffness: stiffness_path.clone(), mass: mass_path.expect("found above"), note })
    }
}

/// Matrices whose rows are numbered, with the labels that the deck gives them.
fn numbered(
    mesh: &DeckMesh,
    deck: &Path,
    [stiffness, mass]: [&PathBuf; 2],
) -> Found<(Vec<DofLabel>, [RawMatrix; 2])> {
    let labels = labels(mesh, deck)?;
    let n = labels.len();
    let read = |path: &Path, role| {
        let file = CoordinateFile::read(path, role, u32::MAX)?;
        // Rows without mass at the end of the matrix are not written.
        let fits = if role == MatrixRole::Mass { file.rows() <= n } else { file.rows() == n };
        if fits { file.into_matrix(n) } else { Err(vec![other_rows(n, file.rows(), path)]) }
    };
    // One after the other: each is read by all threads, and the entries of only one are held.
    let k = read(stiffness, MatrixRole::Stiffness);
    let (k, m) = both(k, read(mass, MatrixRole::Mass))?;
    Ok((labels, [k, m]))
}

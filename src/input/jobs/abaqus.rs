//! Jobs of Abaqus: `*MATRIX GENERATE, STIFFNESS, MASS` and `*MATRIX OUTPUT` write `job_STIF1.mtx` and
//! `job_MASS1.mtx` beside the deck `job.inp`, as `row column value` (FORMAT=COORDINATE) or with the node and
//! the direction of row and column (FORMAT=MATRIX INPUT, LABELS).

use super::abaqus_rows::{labels, refuse_other};
use super::coordinate_files::CoordinateFile;
use super::deck::{Deck, fields};
use super::deck_mesh::DeckMesh;
use super::{Found, JobModel, JobReader, both, is_deck, missing, siblings};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::input::assemble::{Entry, Storage, assemble, check_size, push};
use crate::input::bytes::InputFile;
use crate::input::coordinates::{excerpt, real};
use crate::input::digits::written_digits;
use crate::input::reader::MatrixRole;
use crate::input::table::integer;
use crate::model::{DofLabel, Nodes, RawMatrix};
use std::collections::BTreeSet;
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

/// Whether the lines of a matrix name nodes and directions: five fields with commas.
fn has_labels(path: &Path) -> Found<bool> {
    let file = InputFile::open(path).map_err(|diagnostic| vec![diagnostic])?;
    let mut lines = file.bytes().split(|&b| b == b'\n').map(<[u8]>::trim_ascii);
    Ok(lines.find(|line| is_data(line)).is_some_and(|line| line.contains(&b',')))
}

fn is_data(line: &[u8]) -> bool {
    !line.is_empty() && !line.starts_with(b"*")
}

/// Matrices whose rows are numbered, with the labels that the deck gives them.
fn numbered(
    mesh: &DeckMesh,
    deck: &Path,
    [stiffness, mass]: [&PathBuf; 2],
) -> Found<(Vec<DofLabel>, [RawMatrix; 2])> {
    let labels = labels(mesh, deck)?;
    let read = |path: &PathBuf, role| CoordinateFile::read(path, role, u32::MAX);
    let (k, m) = rayon::join(|| read(stiffness, MatrixRole::Stiffness), || read(mass, MatrixRole::Mass));
    let (k, m) = both(k, m)?;
    if let Some(other) = refuse_other(labels.len(), k.rows(), stiffness) {
        return Err(vec![other]);
    }
    // Rows without mass at the end of the matrix are not written.
    if m.rows() > labels.len() {
        return Err(refuse_other(labels.len(), m.rows(), mass).into_iter().collect());
    }
    let n = labels.len();
    let (k, m) = rayon::join(|| k.into_matrix(n), || m.into_matrix(n));
    let (k, m) = both(k, m)?;
    Ok((labels, [k, m]))
}

/// Matrices whose lines name the degrees of freedom: rows in ascending order of node and direction.
fn labelled(paths: [&PathBuf; 2]) -> Found<(Vec<DofLabel>, [RawMatrix; 2])> {
    let (k, m) = rayon::join(|| LabelledLines::read(paths[0]), || LabelledLines::read(paths[1]));
    let (k, m) = both(k, m)?;
    let all = [&k, &m].into_iter().flat_map(|own| &own.lines).flat_map(|line| [line.row, line.column]);
    let labels: Vec<DofLabel> = all.collect::<BTreeSet<_>>().into_iter().collect();
    let (k, m) = both(k.into_matrix(&labels, paths[0]), m.into_matrix(&labels, paths[1]))?;
    Ok((labels, [k, m]))
}

struct LabelledLine {
    row: DofLabel,
    column: DofLabel,
    value: f64,
}

/// Lines `node, direction, node, direction, value`.
struct LabelledLines {
    lines: Vec<LabelledLine>,
    written: u8,
}

impl LabelledLines {
    fn read(path: &Path) -> Found<Self> {
        const SHOWN: usize = 5;
        let file = InputFile::open(path).map_err(|diagnostic| vec![diagnostic])?;
        let (mut lines, mut written, mut bad) = (Vec::new(), 0, Vec::new());
        for (k, text) in file.bytes().split(|&b| b == b'\n').enumerate() {
            let text = text.trim_ascii();
            if !is_data(text) {
                continue;
            }
            match labelled_line(text) {
                Some((line, digits)) => {
                    written = written.max(digits);
                    lines.push(line);
                }
                None if bad.len() < SHOWN => {
                    let message = format!(
                        "expected node, direction, node, direction, value, found `{}`",
                        excerpt(text)
                    );
                    bad.push(Diagnostic::new(Code::MatrixSyntax, message).in_file(path).at_line(k + 1));
                }
                None => {}
            }
        }
        if bad.is_empty() { Ok(Self { lines, written }) } else { Err(bad) }
    }

    fn into_matrix(self, labels: &[DofLabel], path: &Path) -> Found<RawMatrix> {
        let at = |label: &DofLabel| labels.binary_search(label).expect("every label is listed") as u32;
        let mut pieces = Vec::new();
        let (mut lower, mut upper) = (false, false);
        let count = self.lines.len() as u64;
        for line in &self.lines {
            let entry = Entry { row: at(&line.row), col: at(&line.column), value: line.value };
            lower |= entry.row > entry.col && entry.value != 0.0;
            upper |= entry.row < entry.col && entry.value != 0.0;
            push(&mut pieces, entry);
        }
        let n = labels.len();
        check_size(n as u64, n as u64, count).map_err(|diagnostic| vec![diagnostic.in_file(path)])?;
        let storage = if lower && upper { Storage::Full } else { Storage::Triangle };
        assemble(n, pieces, storage, self.written, path).map_err(|diagnostic| vec![diagnostic])
    }
}

fn labelled_line(text: &[u8]) -> Option<(LabelledLine, u8)> {
    let parts: Vec<&[u8]> = fields(text).collect();
    let &[row, row_direction, column, column_direction, number] = parts.as_slice() else { return None };
    let label = |node: &[u8], direction: &[u8]| {
        let direction = integer(direction).filter(|direction| (1..=6).contains(direction))?;
        Some(DofLabel { node: integer(node)?, direction: direction as u8 })
    };
    let value = real(number).filter(|value| value.is_finite())?;
    let (row, column) = (label(row, row_direction)?, label(column, column_direction)?);
    Some((LabelledLine { row, column, value }, written_digits(number)))
}

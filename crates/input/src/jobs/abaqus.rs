//! Jobs of Abaqus: `*MATRIX GENERATE, STIFFNESS, MASS` and `*MATRIX OUTPUT` write `job_STIF1.mtx` and `job_MASS1.mtx`
//! into the folder of the deck `job.inp`, as `row column value` (FORMAT=COORDINATE) or with the node and the direction
//! of row and column (FORMAT=MATRIX INPUT, LABELS). The matrices may instead be those of a substructure.

use super::abaqus_substructure::{self, Substructure};
use super::deck::Deck;
use super::deck_mesh::DeckMesh;
use super::element_kinds::{family, has_internal_nodes};
use super::matrix_files::{CoordinateFile, has_labels, labelled};
use super::{Found, FromFile, JobFile, JobModel, JobReader, both, condensed, is_deck, missing, siblings};
use crate::reader::MatrixRole;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::SeenFile;
use flexbody_base::text::scanner::integer;
use flexbody_model::{DofLabel, Elements, GivenRows, Nodes, RawMatrix};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Reader of Abaqus jobs.
pub(super) struct Abaqus;

const HELP: &str =
    "write them with *MATRIX GENERATE, STIFFNESS, MASS and *MATRIX OUTPUT, STIFFNESS, MASS in a step";

impl JobReader for Abaqus {
    fn name(&self) -> &'static str {
        "abaqus"
    }

    fn needs(&self) -> &'static str {
        "job.inp with job_STIF1.mtx and job_MASS1.mtx beside it, or with the file of its substructure"
    }

    fn recognises(&self, path: &Path) -> bool {
        is_deck(path) && (Matrices::beside(path).is_ok() || substructure_of(path).is_some())
    }

    fn read(&self, job: &JobFile) -> Found<JobModel> {
        let path = job.path.as_path();
        let matrices = Matrices::beside(path);
        let deck = Deck::read(path)?;
        let mesh = DeckMesh::of(&deck)?;
        let (rows, note) = match (matrices, abaqus_substructure::file_of(&deck, path)) {
            (Ok(matrices), _) => (Rows::of_model(&matrices, &mesh, path)?, matrices.note),
            (Err(_), Some((file, note))) => (Rows::of_substructure(&file, &deck, &mesh)?, note),
            (Err(missing), None) => return Err(missing),
        };
        let (ids, positions) = mesh.nodes.iter().map(|(id, x)| (*id, *x)).unzip();
        let deck_files = deck.seen()?.into_iter();
        Ok(JobModel {
            stiffness: rows.stiffness,
            mass: rows.mass,
            nodes: Nodes { ids, positions },
            dofs: rows.labels,
            given_rows: GivenRows::default(),
            // With condensed matrices no element has all of its nodes.
            elements: if rows.condensed.is_some() { Elements::default() } else { mesh.drawn() },
            sets: mesh.sets,
            unresolved: mesh.unresolved,
            files: deck_files.chain(rows.files).collect(),
            diagnostics: mesh.notes.into_iter().chain(note).chain(rows.condensed).collect(),
        })
    }
}

/// Returns the file of the substructure that a deck names, which is read if the matrices of the whole model are
/// missing.
pub(super) fn substructure_of(path: &Path) -> Option<PathBuf> {
    if !is_deck(path) || Matrices::beside(path).is_ok() {
        return None;
    }
    let deck = Deck::read(path).ok()?;
    abaqus_substructure::file_of(&deck, path).map(|(file, _)| file)
}

/// Matrices with the labels of their rows.
struct Rows {
    labels: Vec<DofLabel>,
    stiffness: RawMatrix,
    mass: RawMatrix,
    /// Files with their roles.
    files: Vec<(&'static str, SeenFile)>,
    /// FB119, for condensed matrices.
    condensed: Option<Diagnostic>,
}

impl Rows {
    fn of_model(files: &Matrices, mesh: &DeckMesh, deck: &Path) -> Found<Self> {
        let Matrices { stiffness, mass, .. } = files;
        let (labels, matrices) = if has_labels(stiffness)? {
            labelled([stiffness, mass])?
        } else {
            numbered(mesh, deck, [stiffness, mass])?
        };
        let [(stiffness, stiffness_file), (mass, mass_file)] = matrices;
        let files = vec![("stiffness", stiffness_file), ("mass", mass_file)];
        Ok(Self { labels, stiffness, mass, files, condensed: None })
    }

    /// Reads the matrices of a substructure.
    ///
    /// # Errors
    /// FB111 for rows whose nodes are not in the deck, or along the axes of a `*TRANSFORM`.
    fn of_substructure(file: &Path, deck: &Deck, mesh: &DeckMesh) -> Found<Self> {
        let Substructure { labels, stiffness, mass, seen } = Substructure::read(file)?;
        let nodes: BTreeSet<i64> = labels.iter().map(|label| label.node).collect();
        if let Some(node) = nodes.iter().find(|node| !mesh.nodes.contains_key(node)) {
            let message = format!(
                "node {node} of the substructure is not in the deck: the shape of a retained mode is not in the matrices"
            );
            let help = "remove *SELECT EIGENMODES, or give K and M of all nodes with --basis craig-bampton";
            let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(file);
            return Err(vec![diagnostic.with_help(help)]);
        }
        if let Some(refused) = turned(deck, mesh, &nodes) {
            return Err(vec![refused]);
        }
        let condensed = Some(condensed(nodes.len(), file));
        Ok(Self { labels, stiffness, mass, files: vec![("matrices", seen)], condensed })
    }
}

/// Returns FB111 for retained nodes whose rows are along other axes.
fn turned(deck: &Deck, mesh: &DeckMesh, retained: &BTreeSet<i64>) -> Option<Diagnostic> {
    let members = |name: &str| -> Vec<i64> {
        mesh.set(name).map_or_else(|| integer(name.as_bytes()).into_iter().collect(), <[i64]>::to_vec)
    };
    let transforms = deck.cards().iter().filter(|card| card.keyword == "TRANSFORM");
    transforms.filter_map(|card| Some((card, card.parameter("NSET")?))).find_map(|(card, set)| {
        let node = members(set).into_iter().find(|node| retained.contains(node))?;
        let message = format!("*TRANSFORM rotates the rows of node {node}, which is retained");
        let help = "remove *TRANSFORM from the retained nodes";
        Some(deck.about(card, Code::DeckUnsupported, message).with_help(help))
    })
}

/// Files of the two matrices.
struct Matrices {
    stiffness: PathBuf,
    mass: PathBuf,
    /// Note about the choice among several files.
    note: Option<Diagnostic>,
}

impl Matrices {
    /// Finds the files with the name of the deck, STIF or MASS, and the number of a step: those of the last step that
    /// has both; else the last file of each.
    fn beside(deck: &Path) -> Found<Self> {
        let mut found: [BTreeMap<u32, PathBuf>; 2] = Default::default();
        for (rest, path) in siblings(deck) {
            let rest = rest.trim_start_matches('_');
            let number = |kind: &str| rest.strip_prefix(kind)?.strip_suffix(".mtx")?.parse::<u32>().ok();
            for (k, kind) in ["stif", "mass"].iter().enumerate() {
                found[k].extend(number(kind).map(|number| (number, path.clone())));
            }
        }
        let [stiffness, mass] = &found;
        let shared = stiffness.keys().rev().find(|number| mass.contains_key(number));
        let last = || stiffness.keys().next_back().zip(mass.keys().next_back());
        let Some((k, m)) = shared.map(|number| (number, number)).or_else(last) else {
            let what = match (stiffness.is_empty(), mass.is_empty()) {
                (false, true) => "the mass matrix (job_MASS1.mtx)",
                (true, false) => "the stiffness matrix (job_STIF1.mtx)",
                _ => "a pair of matrices (job_STIF1.mtx, job_MASS1.mtx)",
            };
            return Err(vec![missing(deck, &format!("beside the deck, {what}"), HELP)]);
        };
        let message = match (k == m, stiffness.len()) {
            (true, 1) => None,
            (true, steps) => {
                Some(format!("{steps} steps have matrices: those of the last one, {k}, are used"))
            }
            (false, _) => Some(format!(
                "no step has both matrices: the stiffness of step {k} and the mass of step {m} are used"
            )),
        };
        let note = message.map(|message| Diagnostic::new(Code::JobStep, message).in_file(&stiffness[k]));
        Ok(Self { stiffness: stiffness[k].clone(), mass: mass[m].clone(), note })
    }
}

/// Reads matrices with numbered rows, and assigns the labels that follow from the deck.
fn numbered(
    mesh: &DeckMesh,
    deck: &Path,
    [stiffness, mass]: [&PathBuf; 2],
) -> Found<(Vec<DofLabel>, [FromFile; 2])> {
    let labels = labels(mesh, deck)?;
    let n = labels.len();
    let read = |path: &Path, role| {
        let file = CoordinateFile::read(path, u32::MAX)?;
        // Rows without mass at the end of the matrix are not written.
        let fits = if role == MatrixRole::Mass { file.rows() <= n } else { file.rows() == n };
        if fits { file.into_matrix(n) } else { Err(vec![other_rows(mesh, n, file.rows(), path)]) }
    };
    // The files are read one after the other: each uses all threads, and the entries of only one are in memory.
    let k = read(stiffness, MatrixRole::Stiffness);
    let (k, m) = both(k, read(mass, MatrixRole::Mass))?;
    Ok((labels, [k, m]))
}

// The labels of matrix rows that Abaqus writes without labels: nodes in ascending order, each with the directions that
// its elements give it.

const ROWS_HELP: &str = "write *MATRIX OUTPUT with FORMAT=MATRIX INPUT, whose lines name node and direction";

/// Returns the labels of the rows of a model with the elements of `mesh`.
///
/// # Errors
/// FB111 for elements whose directions are unknown.
fn labels(mesh: &DeckMesh, deck: &Path) -> Found<Vec<DofLabel>> {
    let mut directions: BTreeMap<i64, u8> = BTreeMap::new();
    let mut unknown: Vec<&str> = Vec::new();
    for elements in &mesh.elements {
        let Some(family) = family(&elements.kind) else {
            unknown.push(&elements.kind);
            continue;
        };
        let bits = family.directions().iter().fold(0u8, |bits, direction| bits | 1 << direction);
        for node in elements.members.iter().flat_map(|(_, nodes)| nodes) {
            *directions.entry(*node).or_default() |= bits;
        }
    }
    if !unknown.is_empty() {
        unknown.sort_unstable();
        unknown.dedup();
        let message = format!(
            "the degrees of freedom of the nodes of {} are not known, and the matrices do not name them",
            unknown.join(", ")
        );
        return Err(vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(deck).with_help(ROWS_HELP)]);
    }
    let label = |(node, bits): (&i64, &u8)| {
        let (node, bits) = (*node, *bits);
        (1..=6u8)
            .filter(move |direction| bits & 1 << direction != 0)
            .map(move |direction| DofLabel { node, direction })
    };
    Ok(directions.iter().flat_map(label).collect())
}

/// Returns FB112: the matrix has other rows than the deck.
fn other_rows(mesh: &DeckMesh, labels: usize, rows: usize, matrix: &Path) -> Diagnostic {
    let mut internal: Vec<&str> = mesh
        .elements
        .iter()
        .map(|elements| elements.kind.as_str())
        .filter(|kind| has_internal_nodes(kind))
        .collect();
    internal.sort_unstable();
    internal.dedup();
    let mut message = format!(
        "matrix has {rows} rows, but the elements of the deck give their nodes {labels} degrees of freedom"
    );
    if !internal.is_empty() {
        let kinds = internal.join(", ");
        message +=
            &format!("; elements {kinds} have internal nodes as well, whose rows only labels identify");
    }
    Diagnostic::new(Code::DeckRows, message).in_file(matrix).with_help(ROWS_HELP)
}

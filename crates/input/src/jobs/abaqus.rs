//! Jobs of Abaqus: `*MATRIX GENERATE, STIFFNESS, MASS` and `*MATRIX OUTPUT` write `job_STIF1.mtx` and `job_MASS1.mtx`
//! into the folder of the deck `job.inp`, as `row column value` (FORMAT=COORDINATE) or with the node and the direction
//! of row and column (FORMAT=MATRIX INPUT, LABELS). The matrices may instead be those of a substructure.

use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use super::described::{DescribedRows, Program, described_of_job, nothing};
use super::element_kinds::{family, has_internal_nodes};
use super::job::{FromFile, JobFile, JobModel, JobReader, both, condensed, missing};
use super::matrix_files::{CoordinateFile, has_labels, labelled};
use super::not_taken::{dashpots_left_out, refuse_axisymmetric};
use super::siblings::{is_deck, siblings};
use crate::digits::{COUNTED, written_digits};
use crate::matrices::MatrixRole;
use crate::matrices::assemble::{Entry, StoredEntries, assemble, check_size};
use crate::matrices::coordinates::{cut_off, line_aligned};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::input_file::SeenFile;
use flexbody_base::text::scanner::{Line, Lines, excerpt, integer, real};
use flexbody_linalg::parallel;
use flexbody_model::{DofLabel, Elements, GivenRows, Nodes, RawMatrix};
use std::collections::{BTreeMap, BTreeSet, HashMap};
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
        is_deck(path)
            && (Matrices::beside(path).is_ok()
                || substructure_of(path).is_some()
                || !Matrices::of_other_jobs(path).is_empty())
    }

    fn names_matrices(&self) -> bool {
        true
    }

    fn read(&self, job: &JobFile, describe: bool) -> Diagnosed<JobModel> {
        let path = job.path.as_path();
        let matrices = match &job.matrices {
            Some(names) => Ok(Matrices::named(path, names)?),
            None => Matrices::beside(path),
        };
        let deck = Deck::read(path)?;
        let mesh = DeckMesh::read(&deck, describe)?;
        refuse_axisymmetric(&mesh, path)?;
        let (rows, note) = match (matrices, file_of(&deck, path)) {
            (Ok(matrices), _) => (Rows::of_model(&matrices, &mesh, path)?, matrices.note),
            (Err(_), Some((file, note))) => (Rows::of_substructure(&file, &deck, &mesh)?, note),
            (Err(missing), None) => {
                let matrices = Matrices::fitting(&mesh, path)?.ok_or(missing)?;
                (Rows::of_model(&matrices, &mesh, path)?, matrices.note)
            }
        };
        let (ids, positions) = mesh.nodes.iter().map(|(id, x)| (*id, *x)).unzip();
        let described = if !describe {
            None
        } else if rows.condensed.is_some() {
            Some(nothing(&deck, "the matrices are condensed"))
        } else {
            let no_rotations = HashMap::new();
            let labels = DescribedRows::new(Program::Abaqus, &rows.labels, &no_rotations);
            Some(described_of_job(&deck, &mesh, &labels))
        };
        let dashpots = dashpots_left_out(&mesh, path);
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
            files: deck_files.chain(rows.files).collect(),
            diagnostics: mesh.notes.into_iter().chain(note).chain(rows.condensed).chain(dashpots).collect(),
            followers: None,
            described,
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
    file_of(&deck, path).map(|(file, _)| file)
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
    fn of_model(files: &Matrices, mesh: &DeckMesh, deck: &Path) -> Diagnosed<Self> {
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
    fn of_substructure(file: &Path, deck: &Deck, mesh: &DeckMesh) -> Diagnosed<Self> {
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
    let transforms = deck.cards().iter().filter(|card| card.keyword == "TRANSFORM");
    let named: Vec<(&Card, &str)> =
        transforms.filter_map(|card| Some((card, card.parameter("NSET")?))).collect();
    // Nodes that an earlier card has are not retained, or that card was refused.
    let members = mesh.sets.union(named.iter().map(|(_, set)| *set));
    named.into_iter().zip(members).find_map(|((card, set), members)| {
        let members = members.unwrap_or_else(|| integer(set.as_bytes()).into_iter().collect());
        let node = members.into_iter().find(|node| retained.contains(node))?;
        let message = format!("*TRANSFORM rotates the rows of node {node}, which is retained");
        let help = "remove *TRANSFORM from the retained nodes";
        Some(deck.about(card, Code::DeckUnsupported, message).with_help(help))
    })
}

/// Stiffness and mass files of a job by their steps.
type StepFiles = [BTreeMap<u32, PathBuf>; 2];

/// Returns the kind (0: stiffness, 1: mass) and the step of a file by the end of its name in lower case: `stif1.mtx`.
fn kind_and_step(end: &str) -> Option<(usize, u32)> {
    let number = |kind: &str| end.strip_prefix(kind)?.strip_suffix(".mtx")?.parse::<u32>().ok();
    ["stif", "mass"].iter().enumerate().find_map(|(k, kind)| Some((k, number(kind)?)))
}

/// Files of the two matrices.
#[derive(Clone)]
struct Matrices {
    stiffness: PathBuf,
    mass: PathBuf,
    /// Note about the choice among several files.
    note: Option<Diagnostic>,
}

impl Matrices {
    /// Finds the files with the name of the deck, STIF or MASS, and the number of a step: those of the last step that
    /// has both; else the last file of each.
    fn beside(deck: &Path) -> Diagnosed<Self> {
        let mut found: StepFiles = Default::default();
        for (rest, path) in siblings(deck) {
            if let Some((k, number)) = kind_and_step(rest.trim_start_matches('_')) {
                found[k].insert(number, path);
            }
        }
        Self::of_last_step(&found, deck)
    }

    /// Chooses the files of the last step that has both matrices; else the last file of each.
    fn of_last_step([stiffness, mass]: &StepFiles, deck: &Path) -> Diagnosed<Self> {
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

// Matrices of a job with another name than its deck: `abaqus job=A input=B.inp` writes A_STIF1.mtx beside B.inp.

impl Matrices {
    /// Returns the files that the user names, with or without the extension.
    ///
    /// # Errors
    /// FB109 for a file that does not exist.
    fn named(deck: &Path, names: &[String; 2]) -> Diagnosed<Self> {
        let file = |name: &String| {
            let path = deck.with_file_name(name);
            let with_extension = deck.with_file_name(format!("{name}.mtx"));
            let existing = [path, with_extension].into_iter().find(|path| path.is_file());
            let help = "name the files of the matrices: --matrices A_STIF1.mtx,A_MASS1.mtx";
            existing.ok_or_else(|| vec![missing(deck, &format!("beside the deck, the file {name}"), help)])
        };
        let (stiffness, mass) = both(file(&names[0]), file(&names[1]))?;
        Ok(Self { stiffness, mass, note: None })
    }

    /// Returns the pairs of matrices in the folder of a deck that are named like no deck in it.
    fn of_other_jobs(deck: &Path) -> Vec<Self> {
        let folder = deck.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let listed = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut names: Vec<_> = listed.map(|file| file.file_name()).collect();
        names.sort();
        let lower = |name: &std::ffi::OsString| name.to_string_lossy().to_lowercase();
        let decks: BTreeSet<String> =
            names.iter().filter_map(|name| Some(lower(name).strip_suffix(".inp")?.to_owned())).collect();
        let mut jobs: BTreeMap<String, StepFiles> = BTreeMap::new();
        for name in &names {
            let lower = lower(name);
            let Some((job, rest)) = lower.rsplit_once('_') else { continue };
            if let Some((k, number)) = kind_and_step(rest).filter(|_| !decks.contains(job)) {
                jobs.entry(job.to_owned()).or_default()[k].insert(number, deck.with_file_name(name));
            }
        }
        let is_pair = |files: &&StepFiles| files.iter().all(|of_kind| !of_kind.is_empty());
        jobs.values().filter(is_pair).filter_map(|files| Self::of_last_step(files, deck).ok()).collect()
    }

    /// Returns the only pair of matrices of another job whose rows are those of the deck, with a note; `None` if there is
    /// none.
    ///
    /// # Errors
    /// FB111 if several pairs fit.
    fn fitting(mesh: &DeckMesh, deck: &Path) -> Diagnosed<Option<Self>> {
        let all = Self::of_other_jobs(deck);
        let mut fitting: Vec<Self> = all.iter().filter(|pair| pair.fits(mesh, deck)).cloned().collect();
        if fitting.is_empty() && all.len() == 1 {
            // The errors of the only pair say why it does not fit.
            fitting = all;
        }
        let name = |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let names = |pair: &Self| [&pair.stiffness, &pair.mass].map(|path| name(path).unwrap_or_default());
        match fitting.as_slice() {
            [] => Ok(None),
            [pair] => {
                let [k, m] = names(pair);
                let steps = pair.note.as_ref().map_or(String::new(), |note| format!(" ({})", note.message()));
                let message =
                    format!("the matrices are those of a job with another name: {k} and {m}{steps}");
                let note = Diagnostic::new(Code::JobStep, message).in_file(deck);
                let help = format!(
                    "nothing to do if the job was run with this deck; else name the files: --matrices {k},{m}"
                );
                Ok(Some(Self { note: Some(note.with_help(help)), ..pair.clone() }))
            }
            several => {
                let all: Vec<String> = several.iter().map(|pair| names(pair).join(" and ")).collect();
                let [k, m] = names(&several[0]);
                let message = format!("matrices of {} jobs fit the deck: {}", several.len(), all.join("; "));
                let help = format!(
                    "name the files: --matrices {k},{m}, or matrices = [\"{k}\", \"{m}\"] in [files] of a manifest"
                );
                Err(vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(deck).with_help(help)])
            }
        }
    }

    /// Returns true if the rows of the stiffness are those of the deck: nodes by their labels, else their number.
    fn fits(&self, mesh: &DeckMesh, deck: &Path) -> bool {
        let fits = || -> Diagnosed<bool> {
            if has_labels(&self.stiffness)? {
                let (labels, _) = labelled([&self.stiffness, &self.mass])?;
                return Ok(labels.iter().all(|label| mesh.nodes.contains_key(&label.node)));
            }
            Ok(CoordinateFile::read(&self.stiffness, u32::MAX)?.rows() == labels(mesh, deck)?.len())
        };
        fits().unwrap_or(false)
    }
}

/// Reads matrices with numbered rows, and assigns the labels that follow from the deck.
fn numbered(
    mesh: &DeckMesh,
    deck: &Path,
    [stiffness, mass]: [&PathBuf; 2],
) -> Diagnosed<(Vec<DofLabel>, [FromFile; 2])> {
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
fn labels(mesh: &DeckMesh, deck: &Path) -> Diagnosed<Vec<DofLabel>> {
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

// Substructures of Abaqus. `*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED, FILE NAME=part` writes
// `part.mtx` in the form of a linear `*USER ELEMENT`: the retained nodes in comments, their directions, and the
// lower triangles of the condensed matrices, row by row.

const SUBSTRUCTURE_HELP: &str = "write it with *SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, MASS=YES, OUTPUT FILE=USER DEFINED, FILE NAME=part (without .mtx)";

/// Model condensed to some of its nodes.
struct Substructure {
    pub labels: Vec<DofLabel>,
    pub stiffness: RawMatrix,
    pub mass: RawMatrix,
    /// File of the substructure.
    pub seen: SeenFile,
}

/// Returns the file named by the last request of a deck for the matrices of a substructure, with a note if there are
/// several.
fn file_of(deck: &Deck, path: &Path) -> Option<(PathBuf, Option<Diagnostic>)> {
    let requests = || {
        deck.cards()
            .iter()
            .filter(|card| card.keyword == "SUBSTRUCTUREMATRIXOUTPUT")
            .filter_map(|card| card.parameter("FILENAME"))
    };
    let name = requests().next_back()?;
    let file = path.with_file_name(format!("{name}.mtx"));
    let note = (requests().count() > 1).then(|| {
        let message =
            format!("the file has {} substructures: the last one, {name}, is used", requests().count());
        Diagnostic::new(Code::JobStep, message).in_file(&file)
    });
    Some((file, note))
}

impl Substructure {
    /// Reads the file of a substructure.
    ///
    /// # Errors
    /// FB101, FB106; FB109 if a matrix is missing; FB110 for lines that cannot be read; FB111 for degrees of freedom
    /// other than displacements and rotations; FB301, FB303, FB312.
    pub(super) fn read(path: &Path) -> Diagnosed<Self> {
        let deck = Deck::read(path)?;
        let mut elements = deck.cards().iter().filter(|card| card.keyword == "USERELEMENT");
        let (Some(element), None) = (elements.next(), elements.next()) else {
            let message = "expected one *USER ELEMENT, as a substructure is written";
            return Err(vec![
                Diagnostic::new(Code::DeckSyntax, message).in_file(path).with_help(SUBSTRUCTURE_HELP),
            ]);
        };
        let file = SubstructureFile { deck: &deck, element, path };
        let labels = file.labels().map_err(|diagnostic| vec![diagnostic])?;
        let stored =
            if element.parameter("UNSYM").is_some() { StoredEntries::Full } else { StoredEntries::Triangle };
        let stiffness = file.matrix("STIFFNESS", labels.len(), stored);
        let (stiffness, mass) = both(stiffness, file.matrix("MASS", labels.len(), StoredEntries::Triangle))?;
        let (_, seen) = deck.seen()?.swap_remove(0);
        Ok(Self { labels, stiffness, mass, seen })
    }
}

struct SubstructureFile<'d> {
    deck: &'d Deck,
    element: &'d Card,
    path: &'d Path,
}

impl SubstructureFile<'_> {
    /// Returns node and direction of every row.
    fn labels(&self) -> Result<Vec<DofLabel>, Diagnostic> {
        let nodes = self.nodes()?;
        let changes = self.changes(nodes.len())?;
        let directions_at = |position: usize| {
            let known = changes.partition_point(|(from, _)| *from <= position);
            &changes[known - 1].1
        };
        let of_node = |(k, &node): (usize, &i64)| {
            directions_at(k + 1).iter().map(move |&direction| DofLabel { node, direction })
        };
        Ok(nodes.iter().enumerate().flat_map(of_node).collect())
    }

    /// Returns the retained nodes, which are listed in comments.
    fn nodes(&self) -> Result<Vec<i64>, Diagnostic> {
        let count = self.element.parameter("NODES").and_then(|count| count.parse::<usize>().ok());
        let (_, text) = self.deck.text(self.element);
        let lines = Lines::of(text).map(|line| line.text.trim_ascii_start());
        let listed = lines.skip_while(|line| !line.ends_with(b"ELEMENT NODES")).skip(1);
        let listed = listed.map_while(|line| line.strip_prefix(b"**")).map(<[u8]>::trim_ascii);
        let nodes: Option<Vec<i64>> = listed.flat_map(fields).map(integer).collect();
        match nodes {
            Some(nodes) if !nodes.is_empty() && Some(nodes.len()) == count => Ok(nodes),
            _ => {
                let message = "*USER ELEMENT: expected NODES=n and below `** ELEMENT NODES` so many node numbers in comments";
                Err(self.deck.about(self.element, Code::DeckSyntax, message).with_help(SUBSTRUCTURE_HELP))
            }
        }
    }

    /// Returns the positions (from 1) at which the directions of the nodes change, each with the directions from there
    /// on.
    fn changes(&self, nodes: usize) -> Result<Vec<(usize, Vec<u8>)>, Diagnostic> {
        let mut changes: Vec<(usize, Vec<u8>)> = Vec::new();
        for (line, text) in self.deck.data(self.element) {
            let numbers: Option<Vec<i64>> = fields(text).map(integer).collect();
            let numbers = numbers.filter(|numbers| numbers.len() > usize::from(!changes.is_empty()));
            let (position, directions) = match (&numbers, changes.last()) {
                (Some(numbers), None) => (Some(1), numbers.as_slice()),
                (Some(numbers), Some((before, _))) => {
                    let position = usize::try_from(numbers[0]).ok();
                    (position.filter(|at| (before + 1..=nodes).contains(at)), &numbers[1..])
                }
                (None, _) => (None, [].as_slice()),
            };
            let Some(position) = position else {
                let message = format!(
                    "expected the directions of the first node, or the position of a later node and its directions, found `{}`",
                    excerpt(text)
                );
                return Err(self
                    .deck
                    .at(self.element, line, Code::DeckSyntax, message)
                    .with_help(SUBSTRUCTURE_HELP));
            };
            changes.push((position, self.directions(line, directions)?));
        }
        if changes.is_empty() {
            let message = "*USER ELEMENT: the directions of its nodes are missing";
            return Err(self
                .deck
                .about(self.element, Code::DeckSyntax, message)
                .with_help(SUBSTRUCTURE_HELP));
        }
        Ok(changes)
    }

    fn directions(&self, line: usize, numbers: &[i64]) -> Result<Vec<u8>, Diagnostic> {
        let direction = |&number: &i64| match number {
            1..=6 => Ok(number as u8),
            other => {
                let message = format!("degree of freedom {other} is not a displacement or rotation");
                let help = "retain displacements and rotations alone (*RETAINED NODAL DOFS, 1 to 6)";
                Err(self.deck.at(self.element, line, Code::DeckUnsupported, message).with_help(help))
            }
        };
        numbers.iter().map(direction).collect()
    }

    /// Returns the matrix of a type with `n` rows.
    fn matrix(&self, kind: &str, n: usize, stored: StoredEntries) -> Diagnosed<RawMatrix> {
        let is_meant =
            |card: &&Card| card.keyword == "MATRIX" && card.name("TYPE").is_some_and(|stated| stated == kind);
        let Some(card) = self.deck.cards().iter().find(is_meant) else {
            return Err(vec![missing(self.path, &format!("*MATRIX, TYPE={kind}"), SUBSTRUCTURE_HELP)]);
        };
        let in_file = |diagnostic: Diagnostic| vec![diagnostic.in_file(self.path)];
        let pieces = self.values(card)?;
        let count: usize = pieces.iter().map(|piece| piece.values.len()).sum();
        let expected = match stored {
            StoredEntries::Full => n * n,
            StoredEntries::Triangle => n * (n + 1) / 2,
        };
        if count != expected {
            let message =
                format!("*MATRIX, TYPE={kind}: expected {expected} values for {n} rows, found {count}");
            let help = "write the file again; it may be cut off";
            return Err(vec![self.deck.about(card, Code::DeckSyntax, message).with_help(help)]);
        }
        check_size(n as u64, n as u64, count as u64).map_err(in_file)?;
        let written = pieces.iter().map(|piece| piece.written).max().unwrap_or(0);
        // Number of values before each piece, from which its positions follow.
        let mut end = 0;
        let starts: Vec<usize> = pieces
            .iter()
            .map(|piece| {
                end += piece.values.len();
                end - piece.values.len()
            })
            .collect();
        let entries = parallel::map(pieces.into_iter().zip(starts), |(piece, start)| {
            in_rows(&piece.values, start, n, stored)
        });
        assemble(n, entries, stored, written, self.path).map_err(|diagnostic| vec![diagnostic])
    }

    /// Returns the numbers below a card.
    fn values(&self, card: &Card) -> Diagnosed<Vec<NumberLines>> {
        let (first, text) = self.deck.text(card);
        let pieces = parallel::map(line_aligned(text), NumberLines::parse);
        let mut above = first;
        for piece in &pieces {
            if let Some((line, text)) = &piece.bad {
                let message = format!("expected numbers, found `{text}`");
                return Err(vec![
                    self.deck.at(card, above + line, Code::DeckSyntax, message).with_help(SUBSTRUCTURE_HELP),
                ]);
            }
            above += piece.lines;
        }
        if text.last().is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.') {
            return Err(vec![cut_off(above).in_file(self.path)]);
        }
        Ok(pieces)
    }
}

/// Numbers of some lines.
#[derive(Default)]
struct NumberLines {
    values: Vec<f64>,
    written: u8,
    lines: usize,
    /// First line with other text: its number within the piece, from 0, and the text.
    bad: Option<(usize, String)>,
}

impl NumberLines {
    fn parse(text: &[u8]) -> Self {
        let mut piece = Self { values: Vec::with_capacity(text.len() / 20), ..Self::default() };
        for Line { number, text } in Lines::of(text) {
            let line = text.trim_ascii_start();
            if !(line.is_empty() || line.starts_with(b"**")) {
                let before = piece.values.len();
                for field in fields(line) {
                    match real(field).filter(|value| value.is_finite()) {
                        Some(value) => piece.values.push(value),
                        None => _ = piece.bad.get_or_insert_with(|| (number - 1, excerpt(line))),
                    }
                }
                if before < COUNTED {
                    piece.written = fields(line).map(written_digits).fold(piece.written, u8::max);
                }
            }
            piece.lines = number;
        }
        piece
    }
}

/// Returns entries for values that begin at position `start`, counted row by row.
fn in_rows(values: &[f64], start: usize, n: usize, stored: StoredEntries) -> Vec<Entry> {
    let length = |row: usize| if stored == StoredEntries::Full { n } else { row + 1 };
    let (mut row, mut col) = (0, start);
    while col >= length(row) {
        col -= length(row);
        row += 1;
    }
    let next = |&value: &f64| {
        let entry = Entry { row: row as u32, col: col as u32, value };
        col += 1;
        if col == length(row) {
            (row, col) = (row + 1, 0);
        }
        entry
    };
    values.iter().map(next).collect()
}

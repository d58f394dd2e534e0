//! Models as FE programs write them: one file identifies the job, its other files are in the same folder. Each program
//! has one file behind [`JobReader`] and [`JOBS`].

mod abaqus;
mod calculix;
mod deck;
mod deck_mesh;
mod deck_of_elements;
mod deck_sets;
mod element_kinds;
mod expanded;
mod knots;
mod matrix_files;
mod nastran;

use super::node_files::NodeFile;
use super::sets::NodeSets;
use abaqus::Abaqus;
use calculix::Calculix;
pub(super) use calculix::read_stiffness as read_calculix_stiffness;
use deck::Deck;
use deck_mesh::DeckMesh;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::compression::refuse_packed;
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_model::{DofLabel, Elements, GivenRows, Nodes, RawFollowers, RawMatrix};
use nastran::Nastran;
use std::path::{Path, PathBuf};

pub use deck_of_elements::ElementDeck;
pub(super) use nastran::nodes_of_bulk;

/// Job of an FE program: its main file, and the program if the user named it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobFile {
    /// Input deck of the job, or the file that the reader of the program expects.
    pub path: PathBuf,
    /// Name of the program; `None` if it follows from the content of the file and the files in its folder.
    pub program: Option<String>,
    /// Names of the stiffness and the mass matrix, if the user chose among several pairs.
    pub matrices: Option<[String; 2]>,
}

impl JobFile {
    /// Returns the files that a run must not replace: the main file, the matrix files with its name, and the file of
    /// the substructure that it names.
    pub(super) fn family(&self) -> Vec<PathBuf> {
        const MATRICES: &[&str] = &[".sti", ".mas", ".dof", ".mtx", ".pch", ".op4"];
        let is_matrix = |rest: &str| MATRICES.iter().any(|extension| rest.ends_with(extension));
        let matrices = siblings(&self.path).filter(|(rest, _)| is_matrix(rest)).map(|(_, path)| path);
        let is_complete = Calculix.recognises(&self.path);
        let substructure = if is_complete { None } else { abaqus::substructure_of(&self.path) };
        let others = matrices.chain(substructure);
        let mut family: Vec<PathBuf> = std::iter::once(self.path.clone()).chain(others).collect();
        family.sort();
        family
    }
}

/// Model of a job as read from its files.
pub(super) struct JobModel {
    pub stiffness: RawMatrix,
    pub mass: RawMatrix,
    pub nodes: Nodes,
    /// Label of every matrix row.
    pub dofs: Vec<DofLabel>,
    /// Maps from the rows of the files to the rows of this model.
    pub given_rows: GivenRows,
    /// Points with mass that follow several nodes by constraints which the reader eliminated.
    pub followers: Option<RawFollowers>,
    /// Node sets; their names are compared without regard to case.
    pub sets: NodeSets,
    /// Elements by which the part is drawn.
    pub elements: Elements,
    /// Every file that was read, with its role.
    pub files: Vec<(&'static str, SeenFile)>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// A matrix and the file that it was read from.
type FromFile = (RawMatrix, SeenFile);

/// Result of reading a job; the error lists all problems.
pub(super) type Found<T> = Result<T, Vec<Diagnostic>>;

/// Reader of the jobs of one FE program.
pub(super) trait JobReader: Sync {
    /// Returns the name of the program for `--format` and the manifest.
    fn name(&self) -> &'static str;

    /// Returns the files that the reader needs, in words: the main file and those in its folder.
    fn needs(&self) -> &'static str;

    /// Returns true when the file at `path` is the main file of such a job.
    fn recognises(&self, path: &Path) -> bool;

    /// Reads matrices, nodes, labels and sets.
    ///
    /// # Errors
    /// FB101 to FB112 for files and decks, FB2xx for tables and nodes, FB3xx for matrices, all that are found.
    fn read(&self, job: &JobFile) -> Found<JobModel>;

    /// Returns true when the matrices of a job have names by which a user may choose.
    fn names_matrices(&self) -> bool {
        false
    }
}

/// Every FE program whose jobs are read. The first that recognises a file reads it.
const JOBS: &[&dyn JobReader] = &[&Calculix, &Abaqus, &Nastran];

/// Returns the names of the FE programs whose jobs are read.
pub fn job_programs() -> impl Iterator<Item = &'static str> {
    JOBS.iter().map(|reader| reader.name())
}

/// Returns true when a path is that of a job: a keyword deck by its name, or a file that a reader recognises.
pub fn is_job(path: &Path) -> bool {
    is_deck(path) || JOBS.iter().any(|reader| reader.recognises(path))
}

/// Reads a job.
///
/// # Errors
/// FB102 for a compressed file, FB108 if no reader recognises the file, and the errors of [`JobReader::read`].
pub(super) fn read_job(job: &JobFile) -> Found<JobModel> {
    let reader = match &job.program {
        Some(program) => JOBS.iter().find(|reader| reader.name() == program.as_str()),
        None => {
            let file = InputFile::open(&job.path);
            file.and_then(|file| refuse_packed(&file, "file")).map_err(|diagnostic| vec![diagnostic])?;
            JOBS.iter().find(|reader| reader.recognises(&job.path))
        }
    };
    match reader {
        Some(reader) if job.matrices.is_some() && !reader.names_matrices() => {
            let message =
                format!("matrices are chosen by name, but those of a job of {} have no names", reader.name());
            Err(vec![
                Diagnostic::new(Code::Usage, message)
                    .in_file(&job.path)
                    .with_help("leave the names of the matrices out"),
            ])
        }
        Some(reader) => reader.read(job),
        None => Err(vec![unknown(job)]),
    }
}

fn unknown(job: &JobFile) -> Diagnostic {
    let needed: Vec<String> =
        JOBS.iter().map(|reader| format!("{}: {}", reader.name(), reader.needs())).collect();
    let message = match &job.program {
        Some(program) => format!("jobs of `{program}` are not supported"),
        None => {
            "file is neither a manifest nor the job of an FE program with its matrices beside it".to_owned()
        }
    };
    Diagnostic::new(Code::JobUnknown, message).in_file(&job.path).with_help(needed.join("; "))
}

/// Returns the nodes, node sets and elements of a keyword deck.
///
/// # Errors
/// FB101, FB106 for files that cannot be read; FB110, FB111 for decks that cannot be read.
pub(super) fn nodes_of_deck(file: &InputFile) -> Found<NodeFile> {
    let mesh = DeckMesh::of(&Deck::read(file.path())?)?;
    let elements = mesh.drawn();
    let (ids, positions) = mesh.nodes.into_iter().unzip();
    Ok(NodeFile { nodes: Nodes { ids, positions }, sets: mesh.sets, elements, ..NodeFile::default() })
}

/// Returns true when a path is that of a keyword deck, by its name.
fn is_deck(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("inp"))
}

/// Returns the files in the folder of the main file of a job that are named like it, in any case: its stem, then a dot,
/// an underscore or the like, or a matrix name of Abaqus. Each comes as the rest of its name after the stem, in lower
/// case, and the path.
fn siblings(main: &Path) -> impl Iterator<Item = (String, PathBuf)> {
    let siblings = beginning_alike(main).into_iter().filter(|file| file.is_of_job);
    siblings.map(|JobSibling { rest, path, .. }| (rest, path))
}

/// File in the folder of the main file of a job whose name begins with the stem of the job.
struct JobSibling {
    /// Rest of the name, in lower case.
    rest: String,
    path: PathBuf,
    /// False for files of other decks, whose names continue the stem (`job_2.op4` beside `job_2.bdf`), and for files
    /// that a letter or a number distinguishes from the job (`job2.op4`, `job_2.op4`, `job_v2.op4`).
    is_of_job: bool,
}

/// Returns the files in the folder of the main file of a job whose names begin with its stem, in any case.
fn beginning_alike(main: &Path) -> Vec<JobSibling> {
    let Some(stem) = main.file_stem().map(|stem| stem.to_string_lossy().to_lowercase()) else {
        return Vec::new();
    };
    let folder = match main.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let listed = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let rest_of = |name: std::ffi::OsString| {
        let lower = name.to_string_lossy().to_lowercase();
        Some((lower.strip_prefix(&stem)?.to_owned(), main.with_file_name(name)))
    };
    let all: Vec<(String, PathBuf)> = listed.filter_map(|file| rest_of(file.file_name())).collect();
    let decks: Vec<String> = all.iter().filter_map(|(rest, _)| stem_of_deck(rest)).collect();
    // A file belongs to another deck if its name continues the stem of that deck.
    let continues = |rest: &str, deck: &String| {
        rest.strip_prefix(deck.as_str()).is_some_and(|more| !more.starts_with(char::is_alphanumeric))
    };
    // A name that continues the stem by a letter or a version number belongs to another job, except for the matrices of
    // Abaqus.
    let is_of_job = |rest: &str| {
        let name = rest.trim_start_matches(|c: char| !c.is_alphanumeric());
        let version = name.strip_prefix('v').unwrap_or(name);
        let is_of_abaqus = ["stif", "mass"].iter().any(|kind| rest.starts_with(kind));
        (is_of_abaqus || !rest.starts_with(char::is_alphanumeric))
            && !version.starts_with(|c: char| c.is_ascii_digit())
            && !decks.iter().any(|deck| continues(rest, deck))
    };
    let beside = |(rest, path): (String, PathBuf)| JobSibling { is_of_job: is_of_job(&rest), rest, path };
    all.into_iter().map(beside).collect()
}

/// Returns the part of the stem of another deck after the stem of the job; `rest` is that part of its file name.
fn stem_of_deck(rest: &str) -> Option<String> {
    const DECKS: &[&str] = &[".inp", ".bdf", ".dat", ".nas"];
    let stem = DECKS.iter().find_map(|extension| rest.strip_suffix(extension))?;
    (!stem.is_empty()).then(|| stem.to_owned())
}

/// Returns both values, or the errors of both.
fn both<A, B>(a: Found<A>, b: Found<B>) -> Found<(A, B)> {
    match (a, b) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (a, b) => Err([a.err(), b.err()].into_iter().flatten().flatten().collect()),
    }
}

/// Returns FB119: the quantities that are exact for a body whose matrices are condensed to some of its nodes.
fn condensed(nodes: usize, stiffness: &Path) -> Diagnostic {
    let message = format!(
        "the matrices are condensed to {nodes} nodes: mass, I0, C1, C2 and frequencies are those of the condensed model, W0 to W3 know only how these nodes move"
    );
    Diagnostic::new(Code::JobCondensed, message).in_file(stiffness)
}

/// Returns FB109: a part of a job is missing.
fn missing(path: &Path, what: &str, help: &str) -> Diagnostic {
    Diagnostic::new(Code::JobIncomplete, format!("{what} is missing")).in_file(path).with_help(help)
}

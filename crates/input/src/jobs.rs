//! Models as FE programs write them: one file identifies the job, its other files are in the same folder. Each program
//! has one file behind [`JobReader`] and [`JOBS`].

mod abaqus;
mod calculix;
mod couplings;
mod deck;
mod deck_mesh;
mod deck_of_elements;
mod deck_scope;
mod deck_surfaces;
mod dependent_rows;
mod described;
mod described_file;
mod element_kinds;
mod expanded;
mod job;
mod knots;
mod matrix_files;
mod nastran;
mod not_taken;
mod siblings;
mod transformed;

use super::node_file::NodeFile;
use abaqus::Abaqus;
use calculix::Calculix;
use deck::Deck;
use deck_mesh::DeckMesh;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::compression::refuse_packed;
use flexbody_model::Nodes;
use job::JobReader;
use nastran::Nastran;
use siblings::{is_deck, siblings};
use std::path::{Path, PathBuf};

pub(super) use calculix::read_stiffness as read_calculix_stiffness;
pub use deck_of_elements::ElementDeck;
pub(super) use described_file::{begins_like_deck, describe_deck, is_described_by_deck};
pub use job::JobFile;
pub(super) use job::JobModel;
pub(super) use nastran::{elements_of_bulk, nodes_of_bulk};

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

/// Returns the files that a run must not replace: the main file of a job, the matrix files with its name, and the file of
/// the substructure that it names.
pub(super) fn family(job: &JobFile) -> Vec<PathBuf> {
    const MATRICES: &[&str] = &[".sti", ".mas", ".dof", ".mtx", ".pch", ".op4"];
    let is_matrix = |rest: &str| MATRICES.iter().any(|extension| rest.ends_with(extension));
    let matrices = siblings(&job.path).filter(|(rest, _)| is_matrix(rest)).map(|(_, path)| path);
    let is_complete = Calculix.recognises(&job.path);
    let substructure = if is_complete { None } else { abaqus::substructure_of(&job.path) };
    let others = matrices.chain(substructure);
    let mut family: Vec<PathBuf> = std::iter::once(job.path.clone()).chain(others).collect();
    family.sort();
    family
}

/// Reads a job, with the description of its elements if `describe` is true.
///
/// # Errors
/// FB102 for a compressed file, FB108 if no reader recognises the file, and the errors of [`JobReader::read`].
pub(super) fn read_job(job: &JobFile, describe: bool) -> Diagnosed<JobModel> {
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
        Some(reader) => reader.read(job, describe),
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
pub(super) fn nodes_of_deck(file: &InputFile) -> Diagnosed<NodeFile> {
    let mesh = DeckMesh::of(&Deck::read(file.path())?)?;
    let elements = mesh.drawn();
    let (ids, positions) = mesh.nodes.into_iter().unzip();
    Ok(NodeFile { nodes: Nodes { ids, positions }, sets: mesh.sets, elements, ..NodeFile::default() })
}

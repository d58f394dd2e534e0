//! The job of an FE program: its main file, the model that is read from it, and the interface of its readers.

use crate::sets::NodeSets;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::input_file::SeenFile;
use flexbody_elements::DescribedElements;
use flexbody_model::{DofLabel, Elements, GivenRows, Nodes, RawFollowers, RawMatrix};
use std::path::{Path, PathBuf};

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

/// Model of a job as read from its files.
pub(crate) struct JobModel {
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
    /// Elements, materials and constraints of the deck, if they were requested.
    pub described: Option<DescribedElements>,
    /// Every file that was read, with its role.
    pub files: Vec<(&'static str, SeenFile)>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// A matrix and the file that it was read from.
pub(super) type FromFile = (RawMatrix, SeenFile);

/// Reader of the jobs of one FE program.
pub(super) trait JobReader: Sync {
    /// Returns the name of the program for `--format` and the manifest.
    fn name(&self) -> &'static str;

    /// Returns the files that the reader needs, in words: the main file and those in its folder.
    fn needs(&self) -> &'static str;

    /// Returns true when the file at `path` is the main file of such a job.
    fn recognises(&self, path: &Path) -> bool;

    /// Reads matrices, nodes, labels and sets, and the description of the elements if `describe` is true.
    ///
    /// # Errors
    /// FB101 to FB112 for files and decks, FB2xx for tables and nodes, FB3xx for matrices, all that are found.
    fn read(&self, job: &JobFile, describe: bool) -> Diagnosed<JobModel>;

    /// Returns true when the matrices of a job have names by which a user may choose.
    fn names_matrices(&self) -> bool {
        false
    }
}

/// Returns both values, or the errors of both.
pub(super) fn both<A, B>(a: Diagnosed<A>, b: Diagnosed<B>) -> Diagnosed<(A, B)> {
    match (a, b) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (a, b) => Err([a.err(), b.err()].into_iter().flatten().flatten().collect()),
    }
}

/// Returns FB119: the quantities that are exact for a body whose matrices are condensed to some of its nodes.
pub(super) fn condensed(nodes: usize, stiffness: &Path) -> Diagnostic {
    let message = format!(
        "the matrices are condensed to {nodes} nodes: mass, I0, C1, C2 and frequencies are those of the condensed model, W0 to W3 know only how these nodes move"
    );
    Diagnostic::new(Code::JobCondensed, message).in_file(stiffness)
}

/// Returns FB133 for a deck with `count` damping elements, whose damping is not in its stiffness and mass matrices.
pub(super) fn damping_left_out(count: usize, what: &str, deck: &Path) -> Option<Diagnostic> {
    let message = format!(
        "the deck has {count} {what}, whose damping is neither in K nor in M: the body does not have it"
    );
    (count > 0).then(|| Diagnostic::new(Code::DeckDamping, message).in_file(deck))
}

/// Returns FB109: a part of a job is missing.
pub(super) fn missing(path: &Path, what: &str, help: &str) -> Diagnostic {
    Diagnostic::new(Code::JobIncomplete, format!("{what} is missing")).in_file(path).with_help(help)
}

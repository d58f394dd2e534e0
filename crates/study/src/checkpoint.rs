//! `--checkpoint FILE`: the search for modes starts where the file stands, and the file follows it.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_eigen::{Resume, Snapshot};
use flexbody_file::Checkpoint;
use flexbody_input::ModelFiles;
use flexbody_model::FeModel;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The file of a run, and what it held before.
pub struct CheckpointFile {
    path: PathBuf,
    found: Option<Checkpoint>,
}

impl CheckpointFile {
    /// Reads the file if there is one, and makes sure before the work that it can be written.
    pub fn open(path: &Path) -> Result<Self> {
        drop(flexbody_file::prepare_output(path)?);
        let found = if path.exists() { Some(flexbody_file::read_checkpoint(path)?) } else { None };
        Ok(Self { path: path.to_path_buf(), found })
    }

    /// Refuses a checkpoint of another model than the one that was read from `files`.
    pub fn for_model(self, files: &ModelFiles, model: &FeModel) -> Result<ModelCheckpoint> {
        let own = identity(files, model);
        if let Some(found) = &self.found
            && found.model != own
        {
            let differs = |line: &&str| !found.model.lines().any(|other| other == *line);
            let roles: Vec<&str> =
                own.lines().filter(differs).filter_map(|line| line.split(' ').next()).collect();
            let what =
                if roles.is_empty() { "it has other files".to_owned() } else { roles.join(", ") + " differ" };
            let message = format!("the checkpoint belongs to another model: {what}");
            return Err(Diagnostic::new(Code::CheckpointForeign, message).in_file(&self.path).into());
        }
        Ok(ModelCheckpoint {
            path: self.path,
            model: own,
            start: self.found.map(|found| found.snapshot),
            failure: Mutex::new(None),
        })
    }
}

/// The checkpoint of the model in work.
pub struct ModelCheckpoint {
    path: PathBuf,
    model: String,
    start: Option<Snapshot>,
    failure: Mutex<Option<Diagnostic>>,
}

impl ModelCheckpoint {
    /// Where the search starts.
    pub(crate) fn start(&self) -> Option<&Snapshot> {
        self.start.as_ref()
    }

    /// Replaces the file. A run that took long is not ended by a checkpoint that cannot be written.
    pub fn save(&self, snapshot: &Snapshot) {
        let written = flexbody_file::prepare_output(&self.path)
            .and_then(|slot| flexbody_file::write_checkpoint(snapshot, &self.model, slot));
        let failure = written.err().map(|error| {
            let message = error.first_error().message();
            Diagnostic::new(Code::CheckpointUnwritten, format!("the checkpoint is not up to date: {message}"))
        });
        *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = failure;
    }

    /// What there is to say about it after the work, which took so many vectors from it.
    pub fn diagnostics(self, taken_up: u64) -> Vec<Diagnostic> {
        let taken_up = self.start.filter(|_| taken_up > 0).map(|start| {
            let message = format!("the search started from a checkpoint with {} modes", start.converged);
            Diagnostic::new(Code::CheckpointTakenUp, message).in_file(&self.path)
        });
        let failure = self.failure.into_inner().unwrap_or_else(PoisonError::into_inner);
        taken_up.into_iter().chain(failure).collect()
    }
}

/// What modes depend on: a line with role and SHA-256 of each file but the manifest, the damping and the
/// interfaces, the groups of HDF5 files that hold several matrices, and which of several bodies it is.
fn identity(files: &ModelFiles, model: &FeModel) -> String {
    let relevant = model
        .sources()
        .iter()
        .filter(|s| !["manifest", "interface", "damping", "mesh"].contains(&s.role.as_str()));
    let group = |role: &str| {
        let location = match (role, files.tables()) {
            ("stiffness", Some(tables)) => &tables.stiffness,
            ("mass", Some(tables)) => &tables.mass,
            _ => return String::new(),
        };
        location.group.as_ref().map(|group| format!(" {group}")).unwrap_or_default()
    };
    let files = relevant.map(|s| format!("{} {}{}\n", s.role, s.sha256, group(&s.role)));
    files.chain(model.number().map(|number| format!("{number}\n"))).collect()
}

/// The start and the keeper of a search, for a run with or without a checkpoint.
pub fn resume<'a>(
    checkpoint: Option<&'a ModelCheckpoint>,
    save: &'a (dyn Fn(&Snapshot) + Sync),
) -> Resume<'a> {
    Resume { start: checkpoint.and_then(ModelCheckpoint::start), save: checkpoint.map(|_| save) }
}

//! Folders of computations on a cluster.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::{Error, Result};
use flexbody_base::output::code_of;
use std::path::{Path, PathBuf};

/// Returns the path itself if it is a folder, else its first existing parent folder.
pub(super) fn folder_around(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    whole.ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new(".")).to_owned()
}

/// Runs work in a folder, which is created if it does not exist, and removed if the work fails.
pub(super) fn in_made_folder<T>(folder: &Path, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let is_new = !folder.exists();
    std::fs::create_dir_all(folder).map_err(|e| {
        let message = format!("cannot make the folder {}: {e}", folder.display());
        Error::from(Diagnostic::new(code_of(&e), message))
    })?;
    let done = work();
    if done.is_err() && is_new {
        // Remove the folder only if it is empty: other content does not belong to this run.
        let _ = std::fs::remove_dir(folder);
    }
    done
}

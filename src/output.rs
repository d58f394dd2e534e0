//! Output files that appear whole or not at all: a temporary file in the same folder, synced, then renamed.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// A place for one output file, reserved before the work starts.
///
/// Making a slot proves that the folder exists and can be written. The target is touched only by
/// [`OutputSlot::commit`]; dropping the slot removes the temporary file and leaves an existing target as it is.
#[derive(Debug)]
pub struct OutputSlot {
    asked: PathBuf,
    target: PathBuf,
    temporary: TempPath,
}

impl OutputSlot {
    /// Reserves `path`. A symbolic link is followed, so that the file it points to is replaced, not the link.
    ///
    /// # Errors
    /// [`OutputFolderMissing`](Code::OutputFolderMissing) when the folder does not exist;
    /// [`OutputUnwritable`](Code::OutputUnwritable) when `path` is a folder, a device or a write-protected file,
    /// or no file can be made in the folder.
    pub fn prepare(path: impl AsRef<Path>) -> Result<Self> {
        let asked = path.as_ref().to_path_buf();
        let unwritable = |why: String| fail(Code::OutputUnwritable, &asked, why);
        if asked.file_name().is_none() {
            return Err(unwritable("the path does not end in a file name".to_owned()));
        }
        let target = match std::fs::metadata(&asked) {
            Ok(meta) if meta.is_dir() => return Err(unwritable("it is a folder".to_owned())),
            Ok(meta) if !meta.is_file() => return Err(unwritable("it is not a regular file".to_owned())),
            Ok(meta) if meta.permissions().readonly() => {
                return Err(unwritable("the existing file is write-protected".to_owned()));
            }
            Ok(_) => std::fs::canonicalize(&asked).map_err(|e| unwritable(e.to_string()))?,
            Err(_) => asked.clone(),
        };
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        match std::fs::metadata(folder) {
            Ok(meta) if meta.is_dir() => {}
            Ok(_) => {
                let why = format!("{} is not a folder", folder.display());
                return Err(fail(Code::OutputFolderMissing, &asked, why));
            }
            Err(e) if e.kind() == ErrorKind::NotFound => {
                let why = format!("folder {} does not exist", folder.display());
                return Err(fail(Code::OutputFolderMissing, &asked, why));
            }
            Err(e) => return Err(unwritable(format!("folder {}: {e}", folder.display()))),
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".flexbody-").suffix(".tmp");
        // Temporary files are private by default; this one becomes the output: mode 666 less the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let temporary = builder.tempfile_in(folder).map_err(|e| io(&asked, &e))?.into_temp_path();
        Ok(Self { asked, target, temporary })
    }

    /// The path as the user gave it.
    pub fn path(&self) -> &Path {
        &self.asked
    }

    /// The temporary file, for writers that need a path of their own.
    pub fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// The error for a write to [`OutputSlot::temporary`] that failed in somebody else's hands.
    pub(crate) fn failure(&self, error: &std::io::Error) -> Error {
        io(&self.asked, error)
    }

    /// Writes `bytes` and commits.
    ///
    /// # Errors
    /// [`DiskShort`](Code::DiskShort) or [`OutputUnwritable`](Code::OutputUnwritable).
    pub fn write(self, bytes: &[u8]) -> Result<()> {
        let written = OpenOptions::new()
            .write(true)
            .truncate(true)
            .open(&self.temporary)
            .and_then(|mut file| file.write_all(bytes));
        written.map_err(|e| self.failure(&e))?;
        self.commit()
    }

    /// Makes the temporary file the output: flushes it to the disk, then renames it over the target.
    ///
    /// # Errors
    /// As [`OutputSlot::write`].
    pub fn commit(self) -> Result<()> {
        let Self { asked, target, temporary } = self;
        OpenOptions::new()
            .write(true)
            .open(&temporary)
            .and_then(|file| file.sync_all())
            .map_err(|e| io(&asked, &e))?;
        let folder = temporary.parent().map(Path::to_path_buf);
        temporary.persist(&target).map_err(|e| io(&asked, &e.error))?;
        // The rename itself is durable once the folder is synced; where folders cannot be opened it is so already
        // or cannot be made so, and the file is in place either way.
        if let Some(folder) = folder.and_then(|f| File::open(f).ok()) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

fn fail(code: Code, path: &Path, why: String) -> Error {
    Diagnostic::new(code, format!("cannot write {}: {why}", path.display())).into()
}

fn io(path: &Path, error: &std::io::Error) -> Error {
    let code = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => Code::DiskShort,
        _ => Code::OutputUnwritable,
    };
    fail(code, path, error.to_string())
}

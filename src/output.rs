//! Output files that appear whole or not at all: a temporary file in the same folder, synced, then renamed.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempPath;

/// A place for one output file, reserved before the work starts.
///
/// Making a slot proves that the folder exists and can be written. The target is touched only by
/// [`OutputSlot::commit`]; dropping the slot removes the temporary file and leaves an existing target as it is.
#[derive(Debug)]
pub struct OutputSlot {
    asked: PathBuf,
    target: PathBuf,
    temporary: Temporary,
}

/// The temporary files of this process, for the case that it is interrupted.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary file of every slot, for a process that ends at once: from here on it can neither reserve nor
/// finish an output file, and a thread that tries to waits for the end.
pub fn abandon_unfinished() {
    let files = unfinished();
    for file in files.iter() {
        // Nothing is left to do about a file that cannot be removed.
        let _ = std::fs::remove_file(file);
    }
    std::mem::forget(files);
}

/// A temporary file that [`UNFINISHED`] knows as long as it exists.
#[derive(Debug)]
struct Temporary(Option<TempPath>);

impl Temporary {
    fn make(builder: &tempfile::Builder<'_, '_>, folder: &Path) -> std::io::Result<Self> {
        let mut known = unfinished();
        let path = builder.tempfile_in(folder)?.into_temp_path();
        known.push(path.to_path_buf());
        Ok(Self(Some(path)))
    }

    fn path(&self) -> &Path {
        self.0.as_ref().expect("there until it is finished")
    }

    fn finish(mut self, target: &Path) -> std::io::Result<()> {
        let mut known = unfinished();
        let path = self.0.take().expect("there until it is finished");
        known.retain(|other| *other != *path);
        path.persist(target).map_err(|e| e.error)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = self.0.take() {
            let mut known = unfinished();
            known.retain(|other| *other != *path);
            drop(path); // removes the file, while nobody abandons
        }
    }
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
        let temporary = Temporary::make(&builder, folder).map_err(|e| io(&asked, &e))?;
        Ok(Self { asked, target, temporary })
    }

    /// The path as the user gave it.
    pub fn path(&self) -> &Path {
        &self.asked
    }

    /// The temporary file, for writers that need a path of their own.
    pub fn temporary(&self) -> &Path {
        self.temporary.path()
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
        self.fill(bytes)?;
        self.commit()
    }

    /// Writes `bytes` to the temporary file; they appear with [`OutputSlot::commit`].
    ///
    /// # Errors
    /// As [`OutputSlot::write`].
    pub fn fill(&self, bytes: &[u8]) -> Result<()> {
        let written = OpenOptions::new()
            .write(true)
            .truncate(true)
            .open(self.temporary())
            .and_then(|mut file| file.write_all(bytes));
        written.map_err(|e| self.failure(&e))
    }

    /// Makes the temporary file the output: flushes it to the disk, then renames it over the target.
    ///
    /// # Errors
    /// As [`OutputSlot::write`].
    pub fn commit(self) -> Result<()> {
        let Self { asked, target, temporary } = self;
        OpenOptions::new()
            .write(true)
            .open(temporary.path())
            .and_then(|file| file.sync_all())
            .map_err(|e| io(&asked, &e))?;
        let folder = temporary.path().parent().map(Path::to_path_buf);
        temporary.finish(&target).map_err(|e| io(&asked, &e))?;
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

//! Files that a run has read. An output must not replace one of them, under whatever name it is given.
//!
//! Whoever opens a file of an input notes it here ([`note_read`]); before the outputs of a run get their names, each is
//! held to what was read. Files that a run keeps for itself and reads again (the ledger of a batch) are
//! opened without a note.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Most symbolic links that one path may lead through, as on Linux.
const MOST_LINKS: usize = 40;

/// Files read since the run began; `None` outside of a run of the program, where a file may be read and replaced.
static READ: Mutex<Option<Vec<FileIdentity>>> = Mutex::new(None);

fn read() -> MutexGuard<'static, Option<Vec<FileIdentity>>> {
    READ.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins a run of the program: from here on files that are read are noted.
pub fn begin_run() {
    *read() = Some(Vec::new());
}

/// Notes that a file of an input was opened.
pub fn note_read(path: &Path) {
    if let Some(files) = read().as_mut() {
        let file = FileIdentity::of(path);
        if !files.contains(&file) {
            files.push(file);
        }
    }
}

/// Refuses an output that would replace a file that this run has read.
///
/// # Errors
/// [`Usage`](Code::Usage).
pub fn refuse_read(output: &Path) -> Result<()> {
    let of_run = read();
    let Some(files) = of_run.as_ref() else { return Ok(()) };
    let own = FileIdentity::of(output);
    if files.iter().any(|file| file.is_same(&own)) {
        return Err(replaces(output).into());
    }
    Ok(())
}

/// The diagnostic for an output that is an input too.
pub fn replaces(output: &Path) -> Diagnostic {
    let message = format!("output {} is an input or another output of this run", output.display());
    Diagnostic::new(Code::Usage, message).with_help("choose another output name")
}

/// File that a path names, however the path is spelt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileIdentity {
    path: PathBuf,
    /// Device and number of an existing file: the same for all of its names.
    file: Option<(u64, u64)>,
}

impl FileIdentity {
    /// Of a file that exists or not.
    pub fn of(path: &Path) -> Self {
        let followed = followed(path).unwrap_or_else(|_| path.to_path_buf());
        // A file that does not exist yet has a folder that does.
        let in_folder = || {
            let folder = followed.parent().filter(|folder| !folder.as_os_str().is_empty());
            Some(std::fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?.join(followed.file_name()?))
        };
        let whole = std::fs::canonicalize(path).ok().or_else(in_folder);
        let path = whole.unwrap_or_else(|| std::path::absolute(path).unwrap_or_else(|_| path.into()));
        Self { file: file_number(&path), path }
    }

    /// True if both are one file: the same place, or two names of the same file.
    pub fn is_same(&self, other: &Self) -> bool {
        self.path == other.path || (self.file.is_some() && self.file == other.file)
    }
}

/// Opens a regular file. A pipe is refused at once, where opening it would wait for its writer, and so is a device,
/// which may never end.
///
/// # Errors
/// Every error of opening the file, and [`ErrorKind::InvalidInput`] if it is something else.
pub fn open_regular(path: &Path) -> std::io::Result<File> {
    let meta = std::fs::metadata(path)?;
    if meta.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    if !meta.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is not a regular file (a pipe or a device)"));
    }
    File::open(path)
}

/// Reads a regular file of at most `most` bytes as text.
///
/// # Errors
/// Every error of [`open_regular`] and of reading; [`ErrorKind::FileTooLarge`] if the file is longer.
pub fn read_text(path: &Path, most: u64) -> std::io::Result<String> {
    let mut text = String::new();
    open_regular(path)?.take(most + 1).read_to_string(&mut text)?;
    if text.len() as u64 > most {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("it has more than {most} bytes")));
    }
    Ok(text)
}

/// The file that an output path stands for: symbolic links are followed, to a file that does not exist yet as
/// well.
///
/// # Errors
/// Links that lead in a circle.
pub fn followed(path: &Path) -> std::io::Result<PathBuf> {
    let mut at = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match std::fs::symlink_metadata(&at) {
            Ok(meta) if meta.is_symlink() => {
                let target = std::fs::read_link(&at)?;
                at = at.parent().unwrap_or(Path::new("")).join(target);
            }
            _ => return Ok(at),
        }
    }
    Err(std::io::Error::other("its symbolic links lead in a circle"))
}

#[cfg(unix)]
fn file_number(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    let meta = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    Some((meta.dev(), meta.ino()))
}

#[cfg(not(unix))]
fn file_number(_: &Path) -> Option<(u64, u64)> {
    None
}

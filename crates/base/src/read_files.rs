//! Record of the files that a run has read. An output must not replace one of them, under whatever name it is given.
//!
//! Code that opens an input file records it here ([`note_read`]). Before the outputs of a run are put in place, each is
//! compared with the record. Files that a run itself writes and reads (the ledger of a batch) are not recorded.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Largest number of symbolic links in one path, as on Linux.
const MAX_LINKS: usize = 40;

/// Files read since the run began; `None` outside a run of the program, where a file may be read and replaced.
static FILES_READ: Mutex<Option<Vec<FileIdentity>>> = Mutex::new(None);

fn read() -> MutexGuard<'static, Option<Vec<FileIdentity>>> {
    FILES_READ.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins a run of the program: files that are read are recorded from now on.
pub fn begin_run() {
    *read() = Some(Vec::new());
}

/// Records that an input file was opened.
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
/// [`Usage`](Code::Usage) if the output is a recorded file.
pub fn refuse_read(output: &Path) -> Result<()> {
    let of_run = read();
    let Some(files) = of_run.as_ref() else { return Ok(()) };
    let target = FileIdentity::of(output);
    if files.iter().any(|file| file.is_same(&target)) {
        return Err(replaces(output).into());
    }
    Ok(())
}

/// Returns the diagnostic for an output that is also an input.
pub fn replaces(output: &Path) -> Diagnostic {
    let message = format!("output {} is an input or another output of this run", output.display());
    Diagnostic::new(Code::Usage, message).with_help("choose another output name")
}

/// Identity of the file that a path refers to, independent of the spelling of the path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileIdentity {
    path: PathBuf,
    /// Device and inode of an existing file, which all its names share.
    file: Option<(u64, u64)>,
}

impl FileIdentity {
    /// Returns the identity of the file at `path`, which need not exist.
    pub fn of(path: &Path) -> Self {
        let followed = followed(path).unwrap_or_else(|_| path.to_path_buf());
        // For a file that does not exist yet, resolve its folder.
        let in_folder = || {
            let folder = followed.parent().filter(|folder| !folder.as_os_str().is_empty());
            Some(std::fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?.join(followed.file_name()?))
        };
        let whole = std::fs::canonicalize(path).ok().or_else(in_folder);
        let path = whole.unwrap_or_else(|| std::path::absolute(path).unwrap_or_else(|_| path.into()));
        Self { file: file_number(&path), path }
    }

    /// Returns true if both are one file: equal paths, or two names of one file.
    pub fn is_same(&self, other: &Self) -> bool {
        self.path == other.path || (self.file.is_some() && self.file == other.file)
    }
}

/// Opens a regular file. A pipe is refused, since opening it would wait for its writer; so is a device, which may never
/// end.
///
/// # Errors
/// The errors of opening the file; [`ErrorKind::InvalidInput`] or [`ErrorKind::IsADirectory`] if it is not a regular
/// file.
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
/// The errors of [`open_regular`] and of reading; [`ErrorKind::FileTooLarge`] if the file is longer.
pub fn read_text(path: &Path, most: u64) -> std::io::Result<String> {
    let mut text = String::new();
    open_regular(path)?.take(most + 1).read_to_string(&mut text)?;
    if text.len() as u64 > most {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("it has more than {most} bytes")));
    }
    Ok(text)
}

/// Returns the file that an output path refers to. Symbolic links are followed, also to a file that does not exist yet.
///
/// # Errors
/// Links that form a circle, and the errors of reading a link.
pub fn followed(path: &Path) -> std::io::Result<PathBuf> {
    let mut at = path.to_path_buf();
    for _ in 0..MAX_LINKS {
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

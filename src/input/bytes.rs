//! A file as bytes: mapped into memory, so that a gigabyte of matrix is parsed where it lies.

// The one exception to `unsafe_code = "deny"` in this room: a memory map is sound only while nobody truncates
// the file under it. We map input files for the length of one read, and files without a name that are our own,
// and never write to them.
#![allow(unsafe_code)]

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::provenance::Fingerprint;
use crate::base::read_files::note_read;
use memmap2::Mmap;
use std::fs::File;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// An opened input file. Its bytes are those on disk (compressed files: as stored).
#[derive(Debug)]
pub struct InputFile {
    path: PathBuf,
    map: Mmap,
}

impl InputFile {
    /// Opens a regular file that is not empty.
    ///
    /// # Errors
    /// FB101 when it does not exist, is no regular file or may not be read; FB106 when it has no bytes.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Diagnostic> {
        let path = path.as_ref();
        let unreadable = |what: String| Diagnostic::new(Code::FileUnreadable, what).in_file(path);
        // Opening a pipe would wait for its writer, so ask what it is first.
        let metadata = std::fs::metadata(path).map_err(|e| unreadable(reason(&e)))?;
        if metadata.is_dir() {
            return Err(unreadable("this is a folder, not a file".into()));
        }
        if !metadata.is_file() {
            return Err(unreadable("this is not a regular file (a pipe or a device)".into()));
        }
        let file = File::open(path).map_err(|e| unreadable(reason(&e)))?;
        if metadata.len() == 0 {
            return Err(Diagnostic::new(Code::FileEmpty, "file has no bytes").in_file(path));
        }
        note_read(path);
        Self::of(&file, path)
    }

    /// An opened file, called `path` in messages.
    ///
    /// # Errors
    /// FB101 when it cannot be mapped.
    pub(super) fn of(file: &File, path: &Path) -> Result<Self, Diagnostic> {
        // SAFETY: the map is private to this value and read-only; see the head of this file for truncation.
        let map = unsafe { Mmap::map(file) }
            .map_err(|e| Diagnostic::new(Code::FileUnreadable, reason(&e)).in_file(path))?;
        Ok(Self { path: path.to_path_buf(), map })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the file, at least one.
    pub fn bytes(&self) -> &[u8] {
        &self.map
    }

    /// SHA-256 of its bytes, lowercase hex.
    pub fn sha256(&self) -> String {
        const BLOCK: usize = 8 << 20;
        let mut fingerprint = Fingerprint::default();
        for start in (0..self.map.len()).step_by(BLOCK) {
            let range = start..self.map.len().min(start + BLOCK);
            fingerprint.update(&self.map[range.clone()]);
            self.release(range);
        }
        fingerprint.hex()
    }

    /// [`Self::release`] of what lies before the byte `at`, block by block; `given` is how far it was done.
    pub(super) fn release_up_to(&self, at: usize, given: &mut usize) {
        const BLOCK: usize = 8 << 20;
        if at - *given >= BLOCK {
            self.release(*given..at);
            *given = at;
        }
    }

    /// Says that `range` of the bytes has been used: it need not stay in memory. It can still be read.
    pub(super) fn release(&self, range: Range<usize>) {
        // SAFETY: pages of a file mapped for reading hold nothing but the file; dropped ones are read again
        // when touched.
        #[cfg(unix)]
        unsafe {
            // A hint: where it is refused the bytes stay.
            let _ =
                self.map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, range.start, range.len());
        }
        #[cfg(not(unix))]
        let _ = range;
    }
}

/// The reason in words that do not depend on the operating system, where there are such.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "file does not exist".into(),
        ErrorKind::PermissionDenied => "no permission to read the file".into(),
        _ => format!("file cannot be read: {error}"),
    }
}

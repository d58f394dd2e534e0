//! Input files, read into memory as a whole or as a stream.
//!
//! Inputs are never mapped into memory: another program may truncate a file at any moment (an FE program that is
//! restarted does), and access to a missing page ends the process. The fingerprint is computed from the bytes while
//! they are read; a file that changes meanwhile is refused.

use crate::diagnostic::{Code, Diagnostic};
use crate::memory::{allow_failure, left, refuse_beyond};
use crate::provenance::Fingerprint;
use crate::read_files::note_read;
use std::fs::{File, Metadata};
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// Number of bytes that are read when a file is opened, to detect its format.
const HEAD_BYTES: usize = 4096;

/// Buffer size for a decoder of a compressed file, in bytes.
const DECODER_BYTES: usize = 1 << 17;

/// Opened input file. Its bytes are those on disk (compressed files: as stored).
#[derive(Debug)]
pub struct InputFile {
    path: PathBuf,
    file: File,
    state: FileState,
    head: Vec<u8>,
    /// All bytes, once they have been loaded.
    whole: OnceLock<Result<Vec<u8>, Diagnostic>>,
    sha256: OnceLock<String>,
}

impl InputFile {
    /// Opens a regular, non-empty file and reads it into memory. Of an HDF5 file only the beginning is read: the HDF5
    /// library reads the rest.
    ///
    /// # Errors
    /// FB101 if the file does not exist, is not regular or may not be read; FB106 if it is empty; FB132 if it changes
    /// while it is read; FB601 if it does not fit into the memory.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Diagnostic> {
        let file = Self::open_unread(path)?;
        file.load()?;
        Ok(file)
    }

    /// Opens a file and reads only its beginning, until [`Self::load`] is called.
    ///
    /// # Errors
    /// FB101, FB106, FB132.
    pub fn open_unread(path: impl AsRef<Path>) -> Result<Self, Diagnostic> {
        let path = path.as_ref();
        let unreadable = |what: String| Diagnostic::new(Code::FileUnreadable, what).in_file(path);
        // Check the type first: opening a pipe would wait for its writer.
        let metadata = std::fs::metadata(path).map_err(|e| unreadable(reason(&e)))?;
        if metadata.is_dir() {
            return Err(unreadable("this is a folder, not a file".into()));
        }
        if !metadata.is_file() {
            return Err(unreadable("this is not a regular file (a pipe or a device)".into()));
        }
        let file = File::open(path).map_err(|e| unreadable(reason(&e)))?;
        let state = FileState::of(&file.metadata().map_err(|e| unreadable(reason(&e)))?);
        if state.length == 0 {
            return Err(Diagnostic::new(Code::FileEmpty, "file has no bytes").in_file(path));
        }
        note_read(path);
        let (whole, sha256) = (OnceLock::new(), OnceLock::new());
        let mut opened = Self { path: path.to_path_buf(), file, state, head: Vec::new(), whole, sha256 };
        let mut head = Vec::new();
        let read = opened.reader().take(HEAD_BYTES as u64).read_to_end(&mut head);
        read.map_err(|e| opened.failed(&e))?;
        if head.len() as u64 == opened.state.length {
            // A small file is read once.
            opened.whole = OnceLock::from(Ok(head.clone()));
        }
        opened.head = head;
        Ok(opened)
    }

    /// Reads all bytes into memory, unless the file is HDF5 or already loaded.
    ///
    /// # Errors
    /// FB101, FB132, FB601.
    pub fn load(&self) -> Result<(), Diagnostic> {
        if is_hdf5(&self.head) {
            return Ok(());
        }
        self.whole.get_or_init(|| self.read_whole()).as_ref().map(|_| ()).map_err(Diagnostic::clone)
    }

    fn read_whole(&self) -> Result<Vec<u8>, Diagnostic> {
        let length = self.state.length;
        let refuse = |left: Option<u64>| {
            let refused = refuse_beyond(left, length as f64, "reading the file", MEMORY_HELP);
            refused.map_err(|error| error.first_error().clone().in_file(&self.path))
        };
        refuse(left())?;
        let mut bytes = Vec::new();
        // One byte more than expected: the end of the file is detected without growing the buffer.
        let size = usize::try_from(length).unwrap_or(usize::MAX).saturating_add(1);
        if allow_failure(|| bytes.try_reserve_exact(size)).is_err() {
            refuse(Some(0))?;
        }
        self.reader().read_to_end(&mut bytes).map_err(|e| self.failed(&e))?;
        self.refuse_changed()?;
        Ok(bytes)
    }

    /// Releases the memory of the bytes.
    pub fn forget_bytes(&mut self) {
        self.whole = OnceLock::new();
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the bytes that were read, at least one: all of them, or the beginning of an HDF5 file or one that was
    /// not loaded.
    pub fn bytes(&self) -> &[u8] {
        self.loaded().unwrap_or(&self.head)
    }

    /// Returns all bytes if they are in memory.
    pub fn loaded(&self) -> Option<&[u8]> {
        self.whole.get()?.as_deref().ok()
    }

    /// Returns the first bytes of the file, at most `limit`; fewer if the file is shorter or cannot be read.
    pub fn first_bytes(&self, limit: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        // The actual read reports the reason of an error.
        let _ = self.reader().take(limit as u64).read_to_end(&mut bytes);
        bytes
    }

    /// Returns the number of bytes of the file.
    pub fn length(&self) -> u64 {
        self.state.length
    }

    /// Returns a reader of all bytes from the beginning, which computes the fingerprint.
    pub fn reader(&self) -> FileReader<'_> {
        FileReader { file: self, at: 0, hashed: Some(Fingerprint::default()) }
    }

    /// Returns a buffered reader, for decoders that read a few bytes at a time.
    pub fn buffered(&self) -> BufReader<FileReader<'_>> {
        BufReader::with_capacity(DECODER_BYTES, self.reader())
    }

    /// Returns the SHA-256 of the file, lowercase hex. A file that was not read completely is read again.
    ///
    /// # Errors
    /// FB101, FB132.
    pub fn sha256(&self) -> Result<String, Diagnostic> {
        if self.sha256.get().is_none() {
            let mut piece = vec![0; 1 << 20];
            let mut reader = self.reader();
            while reader.read(&mut piece).map_err(|e| self.failed(&e))? > 0 {}
            self.refuse_changed()?;
        }
        self.sha256.get().cloned().ok_or_else(|| self.changed("its length has changed"))
    }

    /// Returns the path of the file with its fingerprint and its state, to detect later changes.
    ///
    /// # Errors
    /// The errors of [`Self::sha256`].
    pub fn seen(&self) -> Result<SeenFile, Diagnostic> {
        Ok(SeenFile { path: self.path.clone(), sha256: self.sha256()?, state: self.state })
    }

    /// Refuses a file that has changed since it was opened, by length, modification time and inode.
    ///
    /// # Errors
    /// FB132 if the file has changed.
    pub fn refuse_changed(&self) -> Result<(), Diagnostic> {
        self.state.refuse_changed(&self.path)
    }

    /// Returns FB132 for this file with the reason.
    pub fn changed(&self, what: &str) -> Diagnostic {
        changed(&self.path, what)
    }

    /// Returns the diagnostic of an error of reading this file.
    pub fn failed(&self, error: &std::io::Error) -> Diagnostic {
        let other_failure = || Diagnostic::new(Code::FileUnreadable, reason(error)).in_file(&self.path);
        reading_error(error).unwrap_or_else(other_failure)
    }
}

/// Returns true if a file that begins with `head` is HDF5: the signature is at 0 or, after a user block (which MATLAB
/// writes), at 512, 1024, 2048, ...
pub fn is_hdf5(head: &[u8]) -> bool {
    let signed = |&at: &usize| head.get(at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"));
    [0, 512, 1024, 2048].iter().any(signed)
}

const MEMORY_HELP: &str = "give the file in a compressed or binary form, or use a larger machine";

/// Returns the diagnostic inside an error of reading an input file; `None` for an error of a decoder.
pub fn reading_error(error: &std::io::Error) -> Option<Diagnostic> {
    error.get_ref()?.downcast_ref::<Failed>().map(|failed| failed.0.clone())
}

/// Returns a read error that carries a diagnostic.
pub fn failed(diagnostic: Diagnostic) -> std::io::Error {
    std::io::Error::other(Failed(diagnostic))
}

/// Read error that carries its diagnostic through decoders.
#[derive(Debug)]
struct Failed(Diagnostic);

impl std::fmt::Display for Failed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0.message())
    }
}

impl std::error::Error for Failed {}

/// Reader of a file from beginning to end. The end must be where the file ended when it was opened; otherwise reading
/// fails.
pub struct FileReader<'a> {
    file: &'a InputFile,
    at: u64,
    /// Fingerprint of all bytes up to `at`; `None` after a seek.
    hashed: Option<Fingerprint>,
}

impl Read for FileReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = loop {
            match read_at(&self.file.file, buffer, self.at) {
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => {
                    let diagnostic = Diagnostic::new(Code::FileUnreadable, reason(&e));
                    return Err(failed(diagnostic.in_file(&self.file.path)));
                }
                Ok(count) => break count,
            }
        };
        let length = self.file.state.length;
        let at = self.at + count as u64;
        if at > length || count == 0 && !buffer.is_empty() && at < length {
            return Err(failed(self.file.changed("its length has changed")));
        }
        self.at = at;
        if let Some(hashed) = &mut self.hashed {
            hashed.update(&buffer[..count]);
        }
        if at == length
            && let Some(hashed) = self.hashed.take()
        {
            // Another reader of these bytes computes an equal fingerprint.
            let _ = self.file.sha256.set(hashed.hex());
        }
        Ok(count)
    }
}

impl Seek for FileReader<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(from) => self.file.state.length.checked_add_signed(from),
            SeekFrom::Current(from) => self.at.checked_add_signed(from),
        };
        let at = at.ok_or(ErrorKind::InvalidInput)?;
        if at != self.at {
            (self.at, self.hashed) = (at.min(self.file.state.length), None);
        }
        Ok(self.at)
    }
}

/// Record of a file that was read.
#[derive(Debug, Clone)]
pub struct SeenFile {
    /// Path of the file.
    pub path: PathBuf,
    /// SHA-256 of its bytes, lowercase hex.
    pub sha256: String,
    state: FileState,
}

impl SeenFile {
    /// Refuses a file that has changed since it was read.
    ///
    /// # Errors
    /// FB132 if the file has changed.
    pub fn refuse_changed(&self) -> Result<(), Diagnostic> {
        self.state.refuse_changed(&self.path)
    }
}

/// Length, modification time and inode of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FileState {
    length: u64,
    modified: Option<SystemTime>,
    number: Option<(u64, u64)>,
}

impl FileState {
    fn of(metadata: &Metadata) -> Self {
        Self { length: metadata.len(), modified: metadata.modified().ok(), number: number(metadata) }
    }

    fn refuse_changed(&self, path: &Path) -> Result<(), Diagnostic> {
        let now = match std::fs::metadata(path) {
            Ok(metadata) => Self::of(&metadata),
            Err(e) => return Err(changed(path, &reason(&e))),
        };
        if now == *self {
            return Ok(());
        }
        let what = if now.length != self.length {
            format!("it had {} bytes, now it has {}", self.length, now.length)
        } else if now.number != self.number {
            "its name now belongs to another file".to_owned()
        } else {
            "it was modified".to_owned()
        };
        Err(changed(path, &what))
    }
}

/// Returns FB132 with the reason.
fn changed(path: &Path, what: &str) -> Diagnostic {
    Diagnostic::new(Code::InputChanged, format!("file changed while it was read: {what}")).in_file(path)
}

#[cfg(unix)]
fn number(metadata: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> Option<(u64, u64)> {
    None
}

#[cfg(unix)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> std::io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, at)
}

#[cfg(windows)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> std::io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, at)
}

/// Returns the reason of an error, independent of the operating system if possible.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "file does not exist".into(),
        ErrorKind::PermissionDenied => "no permission to read the file".into(),
        _ => format!("file cannot be read: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provenance::sha256_hex;

    /// Function that changes a file; the time is later than that of the file.
    type Change = fn(&Path, SystemTime);

    fn written(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("K.mtx");
        std::fs::write(&path, bytes).expect("written");
        (folder, path)
    }

    #[test]
    fn the_fingerprint_is_that_of_the_bytes_however_they_are_read() {
        let bytes: Vec<u8> = (0..3_000_000u32).map(|k| (k.wrapping_mul(k) >> 7) as u8).collect();
        let (_folder, path) = written(&bytes);
        let expected = sha256_hex(&bytes);
        let whole = InputFile::open(&path).expect("a file");
        assert_eq!((whole.bytes(), whole.sha256.get()), (&bytes[..], Some(&expected)));
        let streamed = InputFile::open_unread(&path).expect("a file");
        assert_eq!(streamed.bytes(), &bytes[..HEAD_BYTES]);
        std::io::copy(&mut streamed.buffered(), &mut std::io::sink()).expect("read");
        assert_eq!(streamed.sha256.get(), Some(&expected), "taken while reading");
        let partly = InputFile::open_unread(&path).expect("a file");
        let mut reader = partly.reader();
        reader.seek(SeekFrom::End(-5)).expect("within");
        let mut end = Vec::new();
        reader.read_to_end(&mut end).expect("read");
        assert_eq!((end.as_slice(), partly.sha256.get()), (&bytes[bytes.len() - 5..], None));
        assert_eq!(partly.sha256().expect("read again"), expected);
    }

    #[test]
    fn what_changes_while_it_is_read_is_refused() {
        let bytes = vec![b'1'; 100_000];
        let later = SystemTime::now() + std::time::Duration::from_secs(10);
        let changes: [(&str, Change); 5] = [
            ("cut off", |path, _| {
                File::options().write(true).open(path).and_then(|file| file.set_len(50_000)).expect("cut off")
            }),
            ("grown", |path, _| std::fs::write(path, vec![b'1'; 200_000]).expect("written")),
            ("written again", |path, later| {
                let file = File::options().write(true).open(path).expect("a file");
                file.set_modified(later).expect("touched");
            }),
            ("removed", |path, _| std::fs::remove_file(path).expect("removed")),
            ("replaced", |path, _| {
                let other = path.with_extension("new");
                std::fs::copy(path, &other).expect("copied");
                let time = std::fs::metadata(path).and_then(|meta| meta.modified()).expect("a time");
                File::options()
                    .write(true)
                    .open(&other)
                    .and_then(|file| file.set_modified(time))
                    .expect("time");
                std::fs::rename(&other, path).expect("renamed");
            }),
        ];
        for (name, change) in changes {
            let (_folder, path) = written(&bytes);
            let file = InputFile::open_unread(&path).expect("a file");
            assert_eq!(file.refuse_changed(), Ok(()));
            change(&path, later);
            assert_eq!(file.sha256().expect_err(name).code(), Code::InputChanged, "{name}");
            let found = file.load().expect_err(name);
            assert_eq!(found.code(), Code::InputChanged, "{name}: {found}");
        }
    }
}

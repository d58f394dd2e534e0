//! Output files that appear whole or not at all: a temporary file in the target folder is synced, then renamed.
//!
//! A temporary file is locked as long as its process lives. A later run removes unlocked temporary files in its output
//! folders, which killed processes left. Several outputs of one run appear together, see [`OutputSlot::commit_all`].
//!
//! In a run of the program ([`begin_run`]), outputs in place are taken back if the run ends without results: the files
//! that they replaced get their names again. [`end_run`] makes outputs final; from then on the exit code is fixed, and
//! a signal no longer changes it.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, ExitCode, Result};
use crate::read_files::{followed, refuse_read};
use std::fs::{File, Metadata, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;
use tempfile::TempPath;

/// Prefix of the names of temporary files.
const TEMPORARY_PREFIX: &str = ".flexbody-";
/// Suffix of the names of temporary files.
const TEMPORARY_SUFFIX: &str = ".tmp";

/// Place for one output file, reserved before the work starts.
///
/// Creating a slot proves that the folder exists and can be written. Only [`OutputSlot::commit`] changes the target;
/// dropping the slot removes the temporary file and leaves an existing target unchanged.
#[derive(Debug)]
pub struct OutputSlot {
    asked: PathBuf,
    target: PathBuf,
    temporary: Temporary,
    /// Properties of the file that existed when the slot was created.
    replaced: Option<Metadata>,
}

/// Temporary files and outputs of this process, for cleanup after an interruption.
#[derive(Debug)]
struct Book {
    /// Temporary files that exist.
    unfinished: Vec<PathBuf>,
    /// Folders that were searched for files of killed processes.
    swept: Vec<PathBuf>,
    /// Outputs of the run that are in place and can still be taken back.
    placed: Vec<Placed>,
    run: Run,
}

/// State of the run of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Run {
    /// No run, as in the library: outputs are final at once.
    None,
    Going,
    /// Ended run: its outputs are final, and the process ends with this code.
    Ended(ExitCode),
}

static BOOK: Mutex<Book> =
    Mutex::new(Book { unfinished: Vec::new(), swept: Vec::new(), placed: Vec::new(), run: Run::None });

/// True once the unfinished files are being removed; the book then stays locked until the process ends.
static IS_ABANDONED: AtomicBool = AtomicBool::new(false);

fn book() -> MutexGuard<'static, Book> {
    BOOK.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins a run of the program: outputs can be taken back until [`end_run`].
pub fn begin_run() {
    book().run = Run::Going;
}

/// Blocks forever in a process that an interruption is ending, so that nothing more is printed.
pub fn stand_by() {
    drop(book());
}

/// Ends the run with exit code `code` and makes its outputs final. If `has_results` is false, the outputs are taken
/// back, and the files that they replaced are restored.
pub fn end_run(code: ExitCode, has_results: bool) {
    let mut book = book();
    if has_results {
        book.placed.iter().for_each(Placed::forget_old);
    } else {
        book.take_back();
    }
    book.placed.clear();
    book.run = Run::Ended(code);
}

/// Removes the temporary file of every slot and takes outputs back, for a process that ends at once. The process can
/// then neither reserve nor finish an output file; a thread that tries blocks until the end. The function waits for
/// outputs that are being put in place together.
///
/// Returns the exit code of a run that has already ended: its outputs are final, and nothing remains to be done.
pub fn abandon_unfinished() -> Option<ExitCode> {
    abandon(book())
}

/// Does the work of `abandon_unfinished` without allocating and with a short timeout, since the thread that is out of
/// memory may hold the list. The next run removes files that remain.
pub fn abandon_unfinished_soon() {
    for _ in 0..100 {
        if IS_ABANDONED.load(Ordering::SeqCst) {
            return;
        }
        let book = match BOOK.try_lock() {
            Ok(book) => book,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {
                std::thread::sleep(Duration::from_millis(10));
                continue;
            }
        };
        abandon(book);
        return;
    }
}

fn abandon(book: MutexGuard<'_, Book>) -> Option<ExitCode> {
    if let Run::Ended(code) = book.run {
        return Some(code);
    }
    book.take_back();
    for file in &book.unfinished {
        // A file that cannot be removed is left to the next run.
        let _ = std::fs::remove_file(file);
    }
    IS_ABANDONED.store(true, Ordering::SeqCst);
    std::mem::forget(book);
    None
}

/// Temporary file that is listed in the [`Book`] as long as it exists, and locked as long as this process lives.
#[derive(Debug)]
struct Temporary {
    /// Path and open file; `None` once the file is finished.
    parts: Option<(TempPath, File)>,
}

impl Temporary {
    fn make(builder: &tempfile::Builder<'_, '_>, folder: &Path) -> std::io::Result<Self> {
        let mut book = book();
        book.sweep(folder);
        // Another process may remove the file as abandoned before it is locked: try again.
        for _ in 0..8 {
            let (file, path) = builder.tempfile_in(folder)?.into_parts();
            if lock(&file) && is_at(&file, &path) {
                book.unfinished.push(path.to_path_buf());
                return Ok(Self { parts: Some((path, file)) });
            }
        }
        Err(std::io::Error::other(
            "temporary files are removed by another process as soon as they are created",
        ))
    }

    fn path(&self) -> &Path {
        &self.parts.as_ref().expect("there until it is finished").0
    }

    fn file(&self) -> &File {
        &self.parts.as_ref().expect("there until it is finished").1
    }

    fn take(&mut self) -> (TempPath, File) {
        self.parts.take().expect("there until it is finished")
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some((path, _file)) = self.parts.take() {
            let mut book = book();
            book.forget(&path);
            drop(path); // removes the file, while nobody abandons
        }
    }
}

impl Book {
    /// Restores the files that outputs have replaced, in reverse order, since an output may have replaced another one
    /// of this run.
    fn take_back(&self) {
        self.placed.iter().rev().for_each(Placed::put_back);
    }

    fn forget(&mut self, path: &Path) {
        self.unfinished.retain(|other| other != path);
    }

    /// Removes from `folder` the temporary files of processes that have ended; once per folder.
    fn sweep(&mut self, folder: &Path) {
        if self.swept.iter().any(|swept| swept == folder) {
            return;
        }
        self.swept.push(folder.to_path_buf());
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let is_ours = name
                .to_str()
                .is_some_and(|n| n.starts_with(TEMPORARY_PREFIX) && n.ends_with(TEMPORARY_SUFFIX));
            if is_ours && entry.file_type().is_ok_and(|kind| kind.is_file()) {
                remove_if_abandoned(&entry.path());
            }
        }
    }
}

/// Locks the file of a slot. Returns false if another process holds the lock; true on file systems without locks.
#[cfg(unix)]
fn lock(file: &File) -> bool {
    !matches!(file.try_lock(), Err(std::fs::TryLockError::WouldBlock))
}

/// Returns true without a lock: on other systems a lock would prevent HDF5 and others from writing.
#[cfg(not(unix))]
fn lock(_: &File) -> bool {
    true
}

#[cfg(unix)]
fn remove_if_abandoned(path: &Path) {
    let Ok(file) = OpenOptions::new().read(true).write(true).open(path) else { return };
    // On a file system without locks it is unknown who holds a file.
    if file.try_lock().is_ok() && is_at(&file, path) {
        // A file of another user that cannot be removed does no harm.
        let _ = std::fs::remove_file(path);
    }
}

#[cfg(not(unix))]
fn remove_if_abandoned(_: &Path) {}

/// Returns true if the open `file` is the one at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(opened), Ok(named)) = (file.metadata(), std::fs::symlink_metadata(path)) else { return false };
    (opened.dev(), opened.ino()) == (named.dev(), named.ino())
}

#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

impl OutputSlot {
    /// Reserves `path`. A symbolic link is followed: its target is replaced or created, not the link.
    ///
    /// # Errors
    /// [`OutputNotFile`](Code::OutputNotFile) if `path` is a folder, a device, empty or a circle of links;
    /// [`OutputFolderMissing`](Code::OutputFolderMissing) if the folder does not exist;
    /// [`OutputForbidden`](Code::OutputForbidden) if `path` is a write-protected file, or the folder permits no new
    /// file; [`OutputUnwritable`](Code::OutputUnwritable) if no file can be created for another reason.
    pub fn prepare(path: impl AsRef<Path>) -> Result<Self> {
        let asked = path.as_ref().to_path_buf();
        let target = target_of(&asked)?;
        let unwritable = |e: std::io::Error, why: String| fail(code_of(&e), &asked, why);
        let folder = folder_of(&target);
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
            Err(e) => {
                let why = format!("folder {}: {e}", folder.display());
                return Err(unwritable(e, why));
            }
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY_PREFIX).suffix(TEMPORARY_SUFFIX);
        // Temporary files are private by default. A new output has mode 666 minus the umask. One that replaces a file
        // gets its mode at the end, and is private until then.
        let replaced = std::fs::metadata(&target).ok();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(match replaced {
            Some(_) => WORKING_MODE,
            None => 0o666,
        }));
        let temporary = Temporary::make(&builder, folder).map_err(|e| io(&asked, &e))?;
        Ok(Self { asked, target, temporary, replaced })
    }

    /// Returns the path as the user gave it.
    pub fn path(&self) -> &Path {
        &self.asked
    }

    /// Returns the path of the temporary file, for writers that need a path.
    pub fn temporary(&self) -> &Path {
        self.temporary.path()
    }

    /// Returns the error for a failed write to [`OutputSlot::temporary`] by another writer.
    pub fn failure(&self, error: &std::io::Error) -> Error {
        io(&self.asked, error)
    }

    /// Writes `bytes` and commits.
    ///
    /// # Errors
    /// [`DiskShort`](Code::DiskShort), [`OutputForbidden`](Code::OutputForbidden) or
    /// [`OutputUnwritable`](Code::OutputUnwritable) if the file cannot be written.
    pub fn write(self, bytes: &[u8]) -> Result<()> {
        self.fill(bytes)?;
        self.commit()
    }

    /// Writes `bytes` to the temporary file, and reads them back. They appear at the target with [`OutputSlot::commit`].
    ///
    /// # Errors
    /// The errors of [`OutputSlot::write`].
    pub fn fill(&self, bytes: &[u8]) -> Result<()> {
        let written = OpenOptions::new()
            .write(true)
            .truncate(true)
            .open(self.temporary())
            .and_then(|mut file| file.write_all(bytes))
            .and_then(|()| holds(self.temporary(), bytes));
        written.map_err(|e| self.failure(&e))
    }

    /// Flushes the temporary file to the disk and renames it to the target.
    ///
    /// # Errors
    /// The errors of [`OutputSlot::commit_all`].
    pub fn commit(self) -> Result<()> {
        Self::commit_all([self])
    }

    /// Does the work of [`OutputSlot::commit_all`] for files that remain however the run ends: the ledger of a batch,
    /// the folder of a cluster.
    ///
    /// # Errors
    /// The errors of [`OutputSlot::commit_all`].
    pub fn keep_all(slots: impl IntoIterator<Item = Self>) -> Result<()> {
        Self::place(slots, Lasting::Final)
    }

    /// Puts all files in place, or none. Every file is on the disk before the first is renamed, and a signal that ends
    /// the program waits until all are renamed. If one cannot be put in place, the files that the others replaced are
    /// restored. They are also restored if the run later ends without results.
    ///
    /// # Errors
    /// The errors of [`OutputSlot::write`]; [`Usage`](Code::Usage) if an output would replace a file that the run has
    /// read.
    pub fn commit_all(slots: impl IntoIterator<Item = Self>) -> Result<()> {
        Self::place(slots, Lasting::UntilEndOfRun)
    }

    fn place(slots: impl IntoIterator<Item = Self>, lasting: Lasting) -> Result<()> {
        let mut slots: Vec<Self> = slots.into_iter().collect();
        for slot in &slots {
            refuse_read(&slot.asked)?;
        }
        for slot in &slots {
            if let Some(replaced) = std::fs::metadata(&slot.target).ok().or_else(|| slot.replaced.clone()) {
                take_over(slot.temporary.file(), &replaced);
            }
            slot.temporary.file().sync_all().map_err(|e| slot.failure(&e))?;
        }
        let placed = place_all(&mut slots, lasting);
        // The renames are durable once the folders are synced. If a folder cannot be opened, syncing is unnecessary or
        // impossible; the files are in place in any case.
        let mut folders: Vec<&Path> = slots.iter().map(|slot| folder_of(&slot.target)).collect();
        folders.dedup();
        for folder in folders {
            if let Ok(folder) = File::open(folder) {
                let _ = folder.sync_all();
            }
        }
        placed
    }

    /// Creates another name for the file at the target, from which it can be restored; where the file system has no hard
    /// links, a copy of it. `None` if there is no file.
    fn keep_old(&self) -> std::io::Result<Option<Old>> {
        let mut name = self.temporary.path().file_name().unwrap_or_default().to_os_string();
        name.push(TEMPORARY_SUFFIX);
        let path = self.temporary.path().with_file_name(name);
        if std::fs::hard_link(&self.target, &path).is_err() {
            match std::fs::copy(&self.target, &path) {
                Ok(_) => File::open(&path)?.sync_all()?,
                Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
                Err(e) => {
                    // What was copied is of no use; a file that remains is removed by the next run.
                    let _ = std::fs::remove_file(&path);
                    return Err(e);
                }
            }
        }
        // A shared lock keeps other runs from removing the file as abandoned, without blocking readers.
        let lock = File::open(&path).ok().filter(|file| file.try_lock_shared().is_ok());
        Ok(Some(Old { path, _lock: lock }))
    }
}

/// Period in which an output that is in place can be taken back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lasting {
    Final,
    UntilEndOfRun,
}

/// Additional name of a file that an output has replaced.
#[derive(Debug)]
struct Old {
    path: PathBuf,
    _lock: Option<File>,
}

/// Output in its place, with the data for undoing it.
#[derive(Debug)]
struct Placed {
    target: PathBuf,
    /// Open, locked output: a file that another process has put in its place is not touched.
    file: File,
    old: Option<Old>,
    replaced: bool,
}

/// Renames all files, or restores the replaced files.
fn place_all(slots: &mut [OutputSlot], lasting: Lasting) -> Result<()> {
    // Held until the end, so that `abandon` waits.
    let mut book = book();
    let is_final = lasting == Lasting::Final || book.run != Run::Going;
    let is_undoable = slots.len() > 1 || !is_final;
    let mut placed: Vec<Placed> = Vec::with_capacity(slots.len());
    for slot in slots {
        let replaced = slot.target.exists();
        let renamed = if is_undoable { slot.keep_old() } else { Ok(None) }.and_then(|old| {
            let (path, file) = slot.temporary.take();
            book.forget(&path);
            let done = Placed { target: slot.target.clone(), file, old, replaced };
            match path.persist(&slot.target) {
                Ok(()) => Ok(done),
                Err(e) => {
                    done.forget_old();
                    Err(e.error)
                }
            }
        });
        match renamed {
            Ok(done) => placed.push(done),
            Err(e) => {
                placed.iter().rev().for_each(Placed::put_back);
                return Err(slot.failure(&e));
            }
        }
    }
    if is_final {
        placed.iter().for_each(Placed::forget_old);
    } else {
        book.placed.append(&mut placed);
    }
    Ok(())
}

impl Placed {
    fn forget_old(&self) {
        // A file that remains is removed by the next run.
        let _ = self.old.as_ref().map(|old| std::fs::remove_file(&old.path));
    }

    /// Undoes the rename as far as possible. Errors are ignored: the error of the run is reported.
    fn put_back(&self) {
        if !is_at(&self.file, &self.target) {
            return self.forget_old();
        }
        let _ = match &self.old {
            Some(old) => std::fs::rename(&old.path, &self.target),
            None if !self.replaced => std::fs::remove_file(&self.target),
            None => Ok(()),
        };
    }
}

/// Refuses a file at `path` that holds other bytes than `bytes`.
fn holds(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = File::open(path)?;
    let mut block = vec![0; 1 << 16];
    let is_whole = file.metadata()?.len() == bytes.len() as u64;
    for part in bytes.chunks(block.len()) {
        let found = &mut block[..part.len()];
        if !is_whole || file.read_exact(found).is_err() || found != part {
            return Err(std::io::Error::other("it was written, but it does not hold what was written"));
        }
    }
    Ok(())
}

/// Returns the file that `asked` refers to: one that exists and can be replaced, or one that does not exist.
fn target_of(asked: &Path) -> Result<PathBuf> {
    let not_a_file = |why: &str| fail(Code::OutputNotFile, asked, why.to_owned());
    if asked.as_os_str().is_empty() {
        return Err(not_a_file("the path is empty"));
    }
    let ends_in_separator = asked.to_string_lossy().ends_with(std::path::is_separator);
    if asked.is_dir() {
        return Err(not_a_file("it is a folder"));
    }
    if ends_in_separator || asked.file_name().is_none() {
        return Err(not_a_file("the path does not end in a file name"));
    }
    match std::fs::metadata(asked) {
        Ok(meta) if !meta.is_file() => Err(not_a_file("it is not a regular file")),
        Ok(meta) if meta.permissions().readonly() => {
            Err(fail(Code::OutputForbidden, asked, "the existing file is write-protected".to_owned()))
        }
        Ok(_) => std::fs::canonicalize(asked).map_err(|e| match e.kind() {
            ErrorKind::NotFound => not_a_file("the target of the link has been removed"),
            _ => io(asked, &e),
        }),
        // The name is too long: the temporary file, with its short name, would not reveal this.
        Err(e) if e.kind() == ErrorKind::InvalidFilename => Err(not_a_file(&e.to_string())),
        Err(_) => followed(asked).map_err(|e| not_a_file(&e.to_string())),
    }
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn fail(code: Code, path: &Path, why: String) -> Error {
    Diagnostic::new(code, format!("cannot write {}: {why}", path.display())).into()
}

fn io(path: &Path, error: &std::io::Error) -> Error {
    fail(code_of(error), path, error.to_string())
}

/// Returns the code for an output that cannot be created or written because of `error`.
pub fn code_of(error: &std::io::Error) -> Code {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => Code::DiskShort,
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => Code::OutputForbidden,
        _ => Code::OutputUnwritable,
    }
}

// Permissions of an output that replaces a file.

/// Mode of a temporary file that will replace a file: no other user may read it before the final mode is set.
#[cfg(unix)]
const WORKING_MODE: u32 = 0o600;

/// Gives `file` the owner, group and mode of the file that it replaces, as far as this process may.
///
/// If the group cannot be kept, the members of the new group get no more permissions than all other users.
#[cfg(unix)]
fn take_over(file: &File, replaced: &Metadata) {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let Ok(current) = file.metadata() else { return };
    let owner = (current.uid() != replaced.uid()).then(|| replaced.uid());
    let group = (current.gid() != replaced.gid()).then(|| replaced.gid());
    let mut mode = replaced.mode() & 0o777;
    let is_taken = (owner.is_none() && group.is_none()) || fchown(file, owner, group).is_ok();
    if !is_taken && group.is_some() && fchown(file, None, group).is_err() {
        mode = (mode & 0o707) | (mode & ((mode & 0o007) << 3));
    }
    // File systems without modes ignore the call.
    let _ = file.set_permissions(PermissionsExt::from_mode(mode));
}

/// Files take the permissions of their folder on other systems.
#[cfg(not(unix))]
pub fn take_over(_: &File, _: &Metadata) {}

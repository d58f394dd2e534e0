//! Safe opening of HDF5 files that may be damaged or malicious, and creation of files whose bytes depend only on their
//! content.

use super::heap;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::read_files::note_read;
use hdf5::file::{LibraryVersion, Sizeof};
use hdf5::plist::group_create::{AttrCreationOrder, LinkCreationOrder};
use hdf5::types::VarLenUnicode;
use hdf5_metno as hdf5;
use hdf5_metno_sys::h5pl::{H5PLremove, H5PLset_loading_state, H5PLsize};
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::path::Path;
use std::sync::Once;

/// Opens an HDF5 input file whose texts are safe to read. `what` names the expected file in messages; `foreign` is the
/// code for a file that is not HDF5. Returns the file and its size in bytes.
pub fn open_with_checked_texts(path: &Path, what: &str, foreign: Code) -> Result<(hdf5::File, u64)> {
    note_read(path);
    open_unrecorded(path, what, foreign)
}

/// Opens a file that the run itself writes and replaces, without recording it as an input.
pub fn open_unrecorded(path: &Path, what: &str, foreign: Code) -> Result<(hdf5::File, u64)> {
    let unreadable = |code, why: String| {
        Error::from(Diagnostic::new(code, format!("cannot read the {what}: {why}")).in_file(path))
    };
    let meta = std::fs::metadata(path).map_err(|e| unreadable(Code::FileUnreadable, e.to_string()))?;
    if !meta.is_file() {
        return Err(unreadable(Code::FileUnreadable, "it is not a regular file".to_owned()));
    }
    let broken_heap = std::fs::File::open(path).and_then(|mut file| heap::first_broken(&mut file));
    if let Some(position) = broken_heap.map_err(|e| unreadable(Code::FileUnreadable, e.to_string()))? {
        let why = format!("the text heap at byte {position} is damaged");
        return Err(unreadable(foreign, why));
    }
    without_plugins();
    // No lock: files of this program do not change once they have their names, and some file systems do not support
    // locks.
    let opened =
        by_utf8_name(path, |path| hdf5::File::with_options().with_fapl(|p| p.file_locking(false)).open(path));
    let file = opened.map_err(|e| match e.to_string() {
        text if text.contains("file signature not found") => {
            unreadable(foreign, "it is no HDF5 file".to_owned())
        }
        text => unreadable(foreign, text),
    })?;
    // The check of the heaps supports 8-byte sizes only, which all files in use have.
    let sizes = file.create_plist().and_then(|p| p.get_sizes());
    if !sizes.is_ok_and(|s| (s.sizeof_addr, s.sizeof_size) == (Sizeof::Bytes8, Sizeof::Bytes8)) {
        let why = "its addresses or sizes have another width than 8 bytes".to_owned();
        return Err(unreadable(foreign, why));
    }
    Ok((file, meta.len()))
}

/// Returns the version of the HDF5 library.
pub fn library_version() -> String {
    without_plugins();
    let (major, minor, release) = hdf5::library_version();
    format!("{major}.{minor}.{release}")
}

/// Creates an empty file at a temporary `path`. It ends by [`finish`](super::finish).
pub fn create(path: &Path) -> hdf5::Result<hdf5::File> {
    without_plugins();
    by_utf8_name(path, |path| creation().create(path))
}

/// Returns the properties of files that this program creates.
pub(super) fn creation() -> hdf5::FileBuilder {
    let mut builder = hdf5::File::with_options();
    builder
        // HDF5 1.8 is readable for the oldest readers in use; its metadata blocks have checksums. No lock: no other
        // program knows the temporary file, and a process started meanwhile would inherit the lock and hold it on
        // the finished file. No sieve buffer: it would be written when a dataset is dropped, where an error is lost.
        .with_fapl(|p| {
            p.libver_bounds(LibraryVersion::V18, LibraryVersion::V18).file_locking(false).sieve_buf_size(0)
        })
        // Time stamps would make equal bodies differ.
        .with_fcpl(|p| p.obj_track_times(false));
    builder
}

/// Creates a group that tracks the order of its members and attributes, without time stamps.
pub fn make(parent: &hdf5::Group, name: &str) -> hdf5::Result<hdf5::Group> {
    parent
        .create_group_builder()
        .obj_track_times(false)
        .with_gcpl(|p| {
            p.link_creation_order(LinkCreationOrder::Indexed).attr_creation_order(AttrCreationOrder::Indexed)
        })
        .create(name)
}

/// Adds a text attribute.
pub fn put_text(place: &hdf5::Location, name: &str, text: &str) -> hdf5::Result<()> {
    let text: VarLenUnicode = text.parse().map_err(|e| hdf5::Error::from(format!("{name}: {e}")))?;
    place.new_attr::<VarLenUnicode>().create(name)?.write_scalar(&text)
}

// Access to files whose names are not UTF-8, which the HDF5 library does not accept.

/// Opens a file by `open`, which receives a UTF-8 name: the path itself, or the name of an open descriptor.
pub fn by_utf8_name<T>(path: &Path, open: impl FnOnce(&Path) -> hdf5::Result<T>) -> hdf5::Result<T> {
    match path.to_str() {
        Some(_) => open(path),
        None => by_descriptor(path, open),
    }
}

/// Opens the file by its descriptor, whose name is UTF-8 for any path.
#[cfg(unix)]
fn by_descriptor<T>(path: &Path, open: impl FnOnce(&Path) -> hdf5::Result<T>) -> hdf5::Result<T> {
    use std::os::fd::AsRawFd;
    // Open for writing if permitted: a file to be created exists at this point, and is truncated by `open`.
    let file = File::options().read(true).write(true).open(path).or_else(|_| File::open(path));
    let file = file.map_err(|e| format!("file cannot be opened: {e}"))?;
    open(Path::new(&format!("/dev/fd/{}", file.as_raw_fd())))
}

#[cfg(not(unix))]
fn by_descriptor<T>(path: &Path, open: impl FnOnce(&Path) -> hdf5::Result<T>) -> hdf5::Result<T> {
    open(path)
}

// Plugins of the HDF5 library, which a file requests by the number of a filter, and the environment by name. They are
// never loaded.

/// Start of the names of variables that the HDF5 library obeys: HDF5_DRIVER and HDF5_VOL_CONNECTOR replace the way in
/// which files are written, HDF5_PLUGIN_PATH and HDF5_PLUGIN_PRELOAD name code to load.
const VARIABLES: &str = "HDF5_";
/// Variable that stays: file systems of clusters without locks need it.
const LOCKING: &str = "HDF5_USE_FILE_LOCKING";

/// Takes the variables that the HDF5 library obeys out of the environment of this process, and returns them.
// Exception to `unsafe_code = "deny"`: the environment is shared with other threads.
#[allow(unsafe_code)]
pub fn take_variables() -> Vec<(OsString, OsString)> {
    let is_obeyed =
        |name: &OsStr| name.to_str().is_some_and(|name| name.starts_with(VARIABLES) && name != LOCKING);
    let taken: Vec<_> = std::env::vars_os().filter(|(name, _)| is_obeyed(name)).collect();
    // SAFETY: the standard library locks the environment against its own readers. The program calls this before it starts
    // threads; a library does only where such a variable is set, once.
    taken.iter().for_each(|(name, _)| unsafe { std::env::remove_var(name) });
    taken
}

/// Prevents the HDF5 library of this process from loading plugins, and from obeying the environment. Only its built-in
/// filters remain; plugin folders that it was built with are removed. To be called before any other use of the library,
/// which reads the environment once: for that time the variables are not there.
// Exception to `unsafe_code = "deny"`: the bindings have no safe form of these three functions, and the environment is
// shared with other threads.
#[allow(unsafe_code)]
pub fn without_plugins() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let variables = take_variables();
        hdf5_metno::sync::sync(|| {
            let (mut nothing, mut folders) = (0, 0);
            // SAFETY: `sync` holds the lock of the library, and both pointers are those of variables that outlive the
            // calls.
            unsafe {
                H5PLset_loading_state(&raw mut nothing);
                if H5PLsize(&raw mut folders) >= 0 {
                    (0..folders).rev().for_each(|folder| _ = H5PLremove(folder));
                }
            }
        });
        // SAFETY: as in `take_variables`.
        variables.iter().for_each(|(name, value)| unsafe { std::env::set_var(name, value) });
    });
}

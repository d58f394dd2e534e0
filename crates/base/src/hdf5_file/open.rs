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
    let (major, minor, release) = hdf5::library_version();
    format!("{major}.{minor}.{release}")
}

/// Creates an empty file at a temporary `path`.
pub fn create(path: &Path) -> hdf5::Result<hdf5::File> {
    without_plugins();
    by_utf8_name(path, |path| {
        hdf5::File::with_options()
            // HDF5 1.8 is readable for the oldest readers in use; its metadata blocks have checksums. No lock: no other
            // program knows the temporary file, and a process started meanwhile would inherit the lock and hold it on
            // the finished file.
            .with_fapl(|p| p.libver_bounds(LibraryVersion::V18, LibraryVersion::V18).file_locking(false))
            // Time stamps would make equal bodies differ.
            .with_fcpl(|p| p.obj_track_times(false))
            .create(path)
    })
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

// Plugins of the HDF5 library, which a file requests by the number of a filter. They are never loaded.

/// Prevents the HDF5 library of this process from loading plugins. Only its built-in filters remain; plugin folders
/// that it was built with, or that HDF5_PLUGIN_PATH names, are removed.
// Exception to `unsafe_code = "deny"`: the bindings have no safe form of these three functions.
#[allow(unsafe_code)]
pub fn without_plugins() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
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
    });
}

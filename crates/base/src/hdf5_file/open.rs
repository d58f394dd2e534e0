//! Safe opening of HDF5 files that may be damaged or malicious.

use super::heap;
use super::names::by_utf8_name;
use super::plugins::without_plugins;
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::read_files::note_read;
use hdf5::file::Sizeof;
use hdf5_metno as hdf5;
use std::path::Path;

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
    let file = opened.map_err(|e| unreadable(foreign, e.to_string()))?;
    // The check of the heaps supports 8-byte sizes only, which all files in use have.
    let sizes = file.create_plist().and_then(|p| p.get_sizes());
    if !sizes.is_ok_and(|s| (s.sizeof_addr, s.sizeof_size) == (Sizeof::Bytes8, Sizeof::Bytes8)) {
        let why = "its addresses or sizes have another width than 8 bytes".to_owned();
        return Err(unreadable(foreign, why));
    }
    Ok((file, meta.len()))
}

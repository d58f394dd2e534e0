//! The end of a file that was written: no error of closing is lost, and what the file holds is what was meant.
//!
//! HDF5 keeps data and metadata in memory and writes them when a dataset, a group or the file is closed; the bindings
//! close objects where errors have no place. So a write that fails once can leave a file with a hole that nobody notices.

use super::digest::{Numbers, digests_of};
use super::open::{by_utf8_name, creation, without_plugins};
use super::seal::seal;
use super::value::Stored;
use hdf5_metno as hdf5;
use hdf5_metno_sys::h5f::H5Fget_file_image;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes the digests of all content to `file`, which was created at `path`, closes it, reads it back, and compares the
/// digests of what it holds with those of what was meant: `numbers`, the fingerprints of all datasets by path, and the
/// attributes as they are in memory.
///
/// # Errors
/// The errors of HDF5; an error that names the first entry whose content is another one.
pub fn finish(file: hdf5::File, path: &Path, numbers: &Numbers) -> hdf5::Result<()> {
    seal(&file, numbers)?;
    let meant = digests_of(&file, numbers, &mut Stored::new(0), &[])?;
    file.flush()?;
    file.close()?;
    let bytes = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
    let file = by_utf8_name(path, |path| {
        hdf5::File::with_options().with_fapl(|p| p.file_locking(false)).open(path)
    })?;
    let found = digests_of(&file, &Numbers::new(), &mut Stored::new(bytes), &[])?;
    file.close()?;
    if found == meant {
        return Ok(());
    }
    let lost = meant.iter().find(|&(entry, digest)| found.get(entry) != Some(digest));
    let entry = lost.map_or("another entry", |(entry, _)| entry);
    Err(format!("it was written, but {entry} in it is not what was written").into())
}

/// Returns the bytes of a file with what `fill` writes. The file is made in memory, where no write can fail.
///
/// # Errors
/// The errors of `fill` and of HDF5.
// Exception to `unsafe_code = "deny"`: the bindings have no safe form of this function.
#[allow(unsafe_code)]
pub fn bytes_of(fill: impl FnOnce(&hdf5::File) -> hdf5::Result<()>) -> hdf5::Result<Vec<u8>> {
    without_plugins();
    // HDF5 knows open files by their names.
    static MADE: AtomicU64 = AtomicU64::new(0);
    let name = format!("flexbody in memory {}", MADE.fetch_add(1, Ordering::Relaxed));
    let file = creation().with_fapl(|p| p.core_filebacked(false)).create(name)?;
    fill(&file)?;
    file.flush()?;
    let copy = |to: &mut [u8]| {
        let place = if to.is_empty() { std::ptr::null_mut() } else { to.as_mut_ptr().cast() };
        // SAFETY: `sync` holds the lock of the library. Without a place the function returns the number of bytes;
        // otherwise it writes no more than the length of `to`.
        let written = hdf5::sync::sync(|| unsafe { H5Fget_file_image(file.id(), place, to.len()) });
        usize::try_from(written).map_err(|_| hdf5::Error::from("the image of a file cannot be had"))
    };
    let mut bytes = vec![0; copy(&mut [])?];
    match copy(&mut bytes)? {
        written if written == bytes.len() => Ok(bytes),
        written => Err(format!("the image of a file has {written} of {} bytes", bytes.len()).into()),
    }
}

//! The end of a file that was written: no error of closing is lost, and what the file holds is what was meant.
//!
//! HDF5 keeps data and metadata in memory and writes them when a dataset, a group or the file is closed; the bindings
//! close objects where errors have no place. So a write that fails once can leave a file with a hole that nobody notices.

use super::digest::Numbers;
use super::open::{by_utf8_name, creation, without_plugins};
use super::seal::{broken_seal, seal};
use super::value::Stored;
use hdf5_metno as hdf5;
use hdf5_metno_sys::h5f::H5Fget_file_image;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes the digests of what is meant to `file`, which was created at `path`: `numbers`, the fingerprints of all datasets
/// by path, and the attributes as they are in memory. Closes the file, reads it back, and compares all that it holds with
/// these digests.
///
/// # Errors
/// The errors of HDF5; an error that names the entries whose content is another one.
pub fn finish(file: hdf5::File, path: &Path, numbers: &Numbers) -> hdf5::Result<()> {
    seal(&file, numbers)?;
    file.flush()?;
    file.close()?;
    let bytes = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
    let file = by_utf8_name(path, |path| {
        hdf5::File::with_options().with_fapl(|p| p.file_locking(false)).open(path)
    })?;
    let lost = broken_seal(&file, &mut Stored::new(bytes), true)?;
    file.close()?;
    lost.map_or(Ok(()), |lost| Err(format!("it was written, but holds something else: {lost}").into()))
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

//! Access to files whose names are not UTF-8, which the HDF5 library does not accept.

use hdf5_metno::Result;
use std::fs::File;
use std::path::Path;

/// Opens a file by `open`, which receives a UTF-8 name: the path itself, or the name of an open descriptor.
pub fn by_utf8_name<T>(path: &Path, open: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    match path.to_str() {
        Some(_) => open(path),
        None => by_descriptor(path, open),
    }
}

/// Opens the file by its descriptor, whose name is UTF-8 for any path.
#[cfg(unix)]
fn by_descriptor<T>(path: &Path, open: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    use std::os::fd::AsRawFd;
    // Open for writing if permitted: a file to be created exists at this point, and is truncated by `open`.
    let file = File::options().read(true).write(true).open(path).or_else(|_| File::open(path));
    let file = file.map_err(|e| format!("file cannot be opened: {e}"))?;
    open(Path::new(&format!("/dev/fd/{}", file.as_raw_fd())))
}

#[cfg(not(unix))]
fn by_descriptor<T>(path: &Path, open: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    open(path)
}

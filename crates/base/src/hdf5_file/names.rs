//! Files whose names the HDF5 library cannot be given: those that are not UTF-8.

use hdf5_metno::Result;
use std::fs::File;
use std::path::Path;

/// Opens a file by `open`, which is given a name in UTF-8: that of the file, or of an open one.
pub fn by_utf8_name<T>(path: &Path, open: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    match path.to_str() {
        Some(_) => open(path),
        None => by_descriptor(path, open),
    }
}

/// The name of an open file leads to the file whatever it is called.
#[cfg(unix)]
fn by_descriptor<T>(path: &Path, open: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    use std::os::fd::AsRawFd;
    // For writing where it may be: a file that is made exists by then, and is made empty.
    let file = File::options().read(true).write(true).open(path).or_else(|_| File::open(path));
    let file = file.map_err(|e| format!("file cannot be opened: {e}"))?;
    open(Path::new(&format!("/dev/fd/{}", file.as_raw_fd())))
}

#[cfg(not(unix))]
fn by_descriptor<T>(path: &Path, open: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    open(path)
}

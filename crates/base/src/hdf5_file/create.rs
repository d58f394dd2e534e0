//! HDF5 files whose bytes depend only on their content.

use super::names::by_utf8_name;
use super::plugins::without_plugins;
use hdf5::file::LibraryVersion;
use hdf5::plist::group_create::{AttrCreationOrder, LinkCreationOrder};
use hdf5::types::VarLenUnicode;
use hdf5_metno as hdf5;
use std::path::Path;

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

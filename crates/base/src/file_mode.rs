//! Permissions of an output that replaces a file.

use std::fs::{File, Metadata};

/// Mode of a temporary file whose output replaces a file: nobody else reads it before the mode of that is known.
#[cfg(unix)]
pub(crate) const WORKING_MODE: u32 = 0o600;

/// Gives `file` the owner, the group and the mode of the file that it replaces, as far as this process may.
///
/// A group that cannot be kept is another one: its members get no more than everybody else.
#[cfg(unix)]
pub(crate) fn take_over(file: &File, replaced: &Metadata) {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let Ok(own) = file.metadata() else { return };
    let owner = (own.uid() != replaced.uid()).then(|| replaced.uid());
    let group = (own.gid() != replaced.gid()).then(|| replaced.gid());
    let mut mode = replaced.mode() & 0o777;
    let is_taken = (owner.is_none() && group.is_none()) || fchown(file, owner, group).is_ok();
    if !is_taken && group.is_some() && fchown(file, None, group).is_err() {
        mode = (mode & 0o707) | (mode & ((mode & 0o007) << 3));
    }
    // File systems without modes have the same for all files.
    let _ = file.set_permissions(PermissionsExt::from_mode(mode));
}

/// Elsewhere files take the permissions of their folder.
#[cfg(not(unix))]
pub fn take_over(_: &File, _: &Metadata) {}

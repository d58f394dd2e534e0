//! Permissions of an output that replaces a file.

use std::fs::{File, Metadata};

/// Mode of a temporary file that will replace a file: no other user may read it before the final mode is set.
#[cfg(unix)]
pub(crate) const WORKING_MODE: u32 = 0o600;

/// Gives `file` the owner, group and mode of the file that it replaces, as far as this process may.
///
/// If the group cannot be kept, the members of the new group get no more permissions than all other users.
#[cfg(unix)]
pub(crate) fn take_over(file: &File, replaced: &Metadata) {
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

//! Opening of HDF5 files, and limits of the search in them.

use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::hdf5_file::{by_utf8_name, without_plugins};
use flexbody_base::text::InputFile;
use hdf5_metno::{File, Group};

/// Largest number of groups that are searched: a file must not make the search endless.
pub(crate) const MAX_GROUPS: usize = 1000;

/// Largest depth of groups that are searched.
pub(crate) const MAX_DEPTH: usize = 6;

/// Opens a file with the HDF5 library, which loads no plugins.
pub(crate) fn opened(file: &InputFile) -> Diagnosed<File> {
    without_plugins();
    by_utf8_name(file.path(), |path| File::open(path)).map_err(|e| {
        let message = format!("HDF5 file cannot be opened: {e}");
        vec![Diagnostic::new(Code::FileUnreadable, message).with_help("transfer or write the file again")]
    })
}

/// Returns FB310 with a message.
pub(crate) fn layout(message: String) -> Diagnostic {
    Diagnostic::new(Code::Hdf5Layout, message)
}

/// Returns the group that holds all others.
pub(super) fn root(file: &File) -> Diagnosed<Group> {
    file.group("/").map_err(|e| vec![layout(format!("root group cannot be read: {e}"))])
}

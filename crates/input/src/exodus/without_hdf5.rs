//! Exodus II in netCDF-4 in a build without HDF5: refused by name.

use super::variables::ExodusFile;
use crate::hdf5::left_out;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;

/// Refuses an Exodus file.
pub(super) fn with_exodus<T>(_: &InputFile, _: impl FnOnce(&dyn ExodusFile) -> T) -> Diagnosed<T> {
    Err(vec![left_out()])
}

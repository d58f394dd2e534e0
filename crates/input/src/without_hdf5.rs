//! HDF5 files in a build without HDF5: recognised, and refused by name.

use super::array::Array;
use super::exodus::ExodusFile;
use super::reader::{MatrixSource, Reader};
use super::recovery_files::Rectangular;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::input_file::{InputFile, is_hdf5};
use flexbody_model::RawMatrix;

/// Substitute of the HDF5 reader, which refuses every file.
pub(super) struct Hdf5;

impl Reader for Hdf5 {
    fn name(&self) -> &'static str {
        "HDF5"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &[]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        is_hdf5(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        Err(Error::from(left_out().in_file(source.file.path())))
    }
}

/// Refuses an array of shapes.
pub(super) fn read_array(_: &InputFile, _: Option<&str>) -> std::result::Result<Array, Vec<Diagnostic>> {
    Err(vec![left_out()])
}

/// Refuses an operator.
pub(super) fn read_rectangular(
    _: &InputFile,
    _: Option<&str>,
) -> std::result::Result<Rectangular, Vec<Diagnostic>> {
    Err(vec![left_out()])
}

/// Refuses an Exodus file.
pub(super) fn with_exodus<T>(
    _: &InputFile,
    _: impl FnOnce(&dyn ExodusFile) -> T,
) -> std::result::Result<T, Vec<Diagnostic>> {
    Err(vec![left_out()])
}

fn left_out() -> Diagnostic {
    let message = "file is HDF5, which this build of flexbody does not read";
    Diagnostic::new(Code::FileFormatUnknown, message).with_help("build it with the feature `hdf5`")
}

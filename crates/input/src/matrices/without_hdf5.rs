//! Matrices in HDF5 files in a build without HDF5: recognised, and refused by name.

use super::reader::{MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::hdf5::left_out;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::{Error, Result};
use flexbody_base::text::input_file::{InputFile, is_hdf5};
use flexbody_model::RawMatrix;

/// Substitute of the HDF5 reader, which refuses every file.
pub(crate) struct Hdf5;

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

/// Refuses an operator.
pub(crate) fn read_rectangular(
    _: &InputFile,
    _: Option<&str>,
) -> std::result::Result<Rectangular, Vec<Diagnostic>> {
    Err(vec![left_out()])
}

//! Matrices in HDF5 files in a build without HDF5: recognised, and refused by name.

use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use crate::array::Array;
use crate::hdf5::left_out;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::error::{Error, Result};
use flexbody_base::text::input_file::is_hdf5;
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

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        source.is_plain().then(|| Err(vec![left_out()]))
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        source.is_plain().then(|| Err(vec![left_out()]))
    }
}

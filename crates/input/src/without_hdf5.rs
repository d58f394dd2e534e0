//! HDF5 files in a build without HDF5: refused by name.

use super::array::Array;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;

/// Refuses an array of shapes.
pub(super) fn read_array(_: &InputFile, _: Option<&str>) -> Diagnosed<Array> {
    Err(vec![left_out()])
}

/// Returns FB102: this build reads no HDF5.
pub(super) fn left_out() -> Diagnostic {
    let message = "file is HDF5, which this build of flexbody does not read";
    Diagnostic::new(Code::FileFormatUnknown, message).with_help("build it with the feature `hdf5`")
}

//! Reading of one matrix in any of the formats.

use crate::matrices::{MatrixRole, MatrixSource, reader_for};
use crate::model_files::MatrixLocation;
use flexbody_base::error::Result;
use flexbody_base::text::{Compression, InputFile};
use flexbody_model::RawMatrix;
use std::path::Path;

/// Reads one matrix with both triangles, whichever of them are stored.
///
/// # Errors
/// FB101 to FB106 for a file that cannot be read, FB301 to FB313 for an invalid matrix, all that are found in the file.
pub fn read_matrix(location: &MatrixLocation, role: MatrixRole) -> Result<RawMatrix> {
    read_opened(&InputFile::open_unread(&location.path)?, location.group.as_deref(), role, None)
}

/// Reads one matrix of an opened file.
///
/// # Errors
/// The errors of [`read_matrix`]; FB132 for a file that changed, in place of other errors.
pub(super) fn read_opened(
    file: &InputFile,
    group: Option<&str>,
    role: MatrixRole,
    keep_in: Option<&Path>,
) -> Result<RawMatrix> {
    let compression = Compression::of(file.bytes());
    let reader = reader_for(file, compression)?;
    if !reader.reads_by_itself() {
        file.load()?;
    }
    let read = reader.read(&MatrixSource { file, compression, group, role, keep_in });
    // A change of the file during reading may be the cause of other problems, so it is reported first.
    file.refuse_changed()?;
    read
}

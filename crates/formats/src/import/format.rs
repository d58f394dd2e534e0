//! What a format of another program is that is read.

use super::{AuditCheck, ImportedBody};
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;

/// A file of another program, read.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedFile {
    /// Name of the format.
    pub format: &'static str,
    /// The variant that was detected, as the documentation calls it; empty where there is a single one.
    pub dialect: String,
    /// Why it is taken for that variant, and other facts that are no fault: sentences without a full stop.
    pub notes: Vec<String>,
    /// What must hold in files of this format: redundant arrays, digits, layout. What every body must fulfil
    /// is checked elsewhere.
    pub checks: Vec<AuditCheck>,
    /// Why no body must be made of the file although it can be read: whole sentences without a full stop.
    /// Checks say the same.
    pub unsound: Vec<String>,
    /// The body.
    pub body: ImportedBody,
}

/// A format that is read.
pub trait ImportFormat: Sync {
    /// Name on the command line.
    fn name(&self) -> &'static str;

    /// Whether the file can be of this format, by what stands at its beginning (of an HDF5 file by the names
    /// in it).
    fn recognises(&self, file: &InputFile) -> bool;

    /// Reads a file.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](flexbody_base::diagnostic::Code::ForeignUnreadable) with the line,
    /// [`ForeignIncomplete`](flexbody_base::diagnostic::Code::ForeignIncomplete) for a file from which not even shapes of arrays follow.
    fn read(&self, file: &InputFile) -> Result<ImportedFile>;
}

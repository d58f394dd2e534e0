//! Trait of import formats, and the result of reading a file.

use super::{AuditCheck, ImportedBody};
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;

/// Result of reading a file of another program.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedFile {
    /// Name of the format.
    pub format: &'static str,
    /// Detected dialect in the terms of the documentation; empty for a format with a single form.
    pub dialect: String,
    /// Reasons for the dialect, and other facts that are no errors, as sentences without a full stop.
    pub notes: Vec<String>,
    /// Checks of the format: redundant arrays, digits, layout. Identities of every body are checked
    /// elsewhere.
    pub checks: Vec<AuditCheck>,
    /// Reasons why no body may be made from the file although it can be read, as sentences without a full
    /// stop. The checks report the same defects.
    pub unsound: Vec<String>,
    /// Body described by the file.
    pub body: ImportedBody,
}

/// A format that can be read.
pub trait ImportFormat: Sync {
    /// Returns the name on the command line.
    fn name(&self) -> &'static str;

    /// Returns true if the file can be of this format, judged by its beginning (for an HDF5 file by its
    /// names).
    fn recognises(&self, file: &InputFile) -> bool;

    /// Reads a file.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](flexbody_base::diagnostic::Code::ForeignUnreadable) with the line,
    /// [`ForeignIncomplete`](flexbody_base::diagnostic::Code::ForeignIncomplete) for a file that does not
    /// even determine the shapes of the arrays.
    fn read(&self, file: &InputFile) -> Result<ImportedFile>;
}

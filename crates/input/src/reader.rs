//! What a reader of a matrix format is, and what it is given.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::Compression;
use flexbody_base::text::InputFile;
use flexbody_model::RawMatrix;
use std::path::Path;

/// The role of a matrix in the model. Files that hold several matrices tell them apart by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixRole {
    /// K.
    Stiffness,
    /// M.
    Mass,
    /// D.
    Damping,
    /// K_geo of a unit load.
    GeometricStiffness,
}

impl MatrixRole {
    /// Every role.
    pub const ALL: [Self; 4] = [Self::Stiffness, Self::Mass, Self::Damping, Self::GeometricStiffness];

    /// Its name in messages and in [`flexbody_base::provenance::SourceFile::role`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass",
            Self::Damping => "damping",
            Self::GeometricStiffness => "geometric_stiffness",
        }
    }

    /// Whether a matrix called `name` (any case) is meant to be this one: `K` or `stiffness`, `M` or `mass`,
    /// `D` or `damping`, `Kg` or `geometric_stiffness`.
    pub fn is_named(self, name: &str) -> bool {
        let letter = match self {
            Self::Stiffness => "k",
            Self::Mass => "m",
            Self::Damping => "d",
            Self::GeometricStiffness => "kg",
        };
        name.eq_ignore_ascii_case(letter) || name.eq_ignore_ascii_case(self.name())
    }
}

/// A matrix to read: a file and where in it.
#[derive(Debug, Clone, Copy)]
pub struct MatrixSource<'a> {
    /// The file.
    pub file: &'a InputFile,
    /// Compression of the file.
    pub compression: Compression,
    /// Group within the file, when the user named one.
    pub group: Option<&'a str>,
    /// Role of the matrix in the model.
    pub role: MatrixRole,
    /// The folder for files of its numbers where they are not to be held in memory, and a reader can do so.
    pub keep_in: Option<&'a Path>,
}

impl<'a> MatrixSource<'a> {
    /// Refuses a group in a file of a format (`what`, as in "an archive of SciPy") that has none.
    pub(super) fn has_one_matrix(&self, what: &str) -> std::result::Result<(), Diagnostic> {
        let Some(group) = self.group else { return Ok(()) };
        let message = format!("group `{group}` is named, but {what} holds one matrix");
        Err(Diagnostic::new(Code::Hdf5Layout, message).with_help("give the file without a group"))
    }

    /// The bytes of a file of a binary format (`what`, as in "PETSc file") that is read where it lies.
    pub(super) fn not_packed(&self, what: &str) -> std::result::Result<&'a [u8], Diagnostic> {
        if self.compression == Compression::None {
            return Ok(self.file.bytes());
        }
        let message = format!("{what} is compressed as a whole");
        Err(Diagnostic::new(Code::FileFormatUnknown, message).with_help("unpack it"))
    }
}

/// Reads one matrix format. A new format is one file of this room, one entry in [`READERS`](super::READERS)
/// and one folder in `fixtures/readers/`.
pub trait Reader: Sync {
    /// Name of the format in messages; in lower case with `-` for blanks, of its fixture folder.
    fn name(&self) -> &'static str;

    /// File extensions in lower case, without the dot and without `.gz` or `.zst`. They decide only where the
    /// content does not.
    fn extensions(&self) -> &'static [&'static str];

    /// Whether a file (unpacked) that begins with `head` is of this format. `head` has at least [`HEAD`]
    /// bytes unless the file is shorter.
    fn recognises(&self, head: &[u8]) -> bool;

    /// True if the reader takes the file piece by piece or by its path; others are given a file whose bytes are in
    /// memory.
    fn reads_by_itself(&self) -> bool {
        false
    }

    /// Reads the matrix: both triangles, zeros dropped, duplicates summed; symmetry of a matrix that is
    /// stored in full is not checked here.
    ///
    /// # Errors
    /// FB103, FB301 to FB313 and FB101 for what the file is not, as many as are found.
    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix>;
}

/// Number of bytes that [`Reader::recognises`] is shown. HDF5 files may begin with a user block of this size.
pub const HEAD: usize = 2048 + 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_know_their_names() {
        assert!(MatrixRole::Stiffness.is_named("k") && MatrixRole::Stiffness.is_named("Stiffness"));
        assert!(!MatrixRole::Mass.is_named("K") && MatrixRole::Mass.is_named("M"));
    }
}

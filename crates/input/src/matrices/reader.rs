//! The interface of a reader of a matrix format, and its input.

use super::operator::OperatorColumns;
use crate::array::Array;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::{Compression, InputFile};
use flexbody_model::{DofLabel, RawMatrix};
use std::path::Path;

/// Role of a matrix in the model. It selects among several matrices of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "snake_case")]
pub enum MatrixRole {
    /// Stiffness matrix K.
    Stiffness,
    /// Mass matrix M.
    Mass,
    /// Damping matrix D.
    Damping,
    /// Geometric stiffness matrix K_geo of a unit load.
    GeometricStiffness,
}

impl MatrixRole {
    /// Every role.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Returns the name in messages and in [`flexbody_base::provenance::SourceFile::role`].
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns true when a matrix called `name` (in any case) has this role: `K` or `stiffness`, `M` or `mass`, `D` or
    /// `damping`, `Kg` or `geometric_stiffness`.
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

/// Location of a matrix to read.
#[derive(Debug, Clone, Copy)]
pub struct MatrixSource<'a> {
    /// File of the matrix.
    pub file: &'a InputFile,
    /// Compression of the file.
    pub compression: Compression,
    /// Group within the file, if the user named one.
    pub group: Option<&'a str>,
    /// Role of the matrix in the model.
    pub role: MatrixRole,
    /// Folder for files of the numbers, if these should not be held in memory and the reader supports it.
    pub keep_in: Option<&'a Path>,
}

impl<'a> MatrixSource<'a> {
    /// Refuses a group in a file of a format (`what`, as in "an archive of SciPy") without groups.
    pub(super) fn has_one_matrix(&self, what: &str) -> std::result::Result<(), Diagnostic> {
        let Some(group) = self.group else { return Ok(()) };
        let message = format!("group `{group}` is named, but {what} holds one matrix");
        Err(Diagnostic::new(Code::Hdf5Layout, message).with_help("give the file without a group"))
    }

    /// Returns the bytes of an uncompressed file of a binary format (`what`, as in "PETSc file"); refuses a compressed
    /// one.
    pub(super) fn not_packed(&self, what: &str) -> std::result::Result<&'a [u8], Diagnostic> {
        if self.compression == Compression::None {
            return Ok(self.file.bytes());
        }
        let message = format!("{what} is compressed as a whole");
        Err(Diagnostic::new(Code::FileFormatUnknown, message).with_help("unpack it"))
    }
}

/// Location of a matrix that need not be square, or of an array: an operator, shapes, loads, values.
#[derive(Debug, Clone, Copy)]
pub struct ArraySource<'a> {
    /// File of the matrix.
    pub file: &'a InputFile,
    /// Compression of the file.
    pub compression: Compression,
    /// First bytes of the unpacked file, as [`Reader::recognises`] receives them.
    pub head: &'a [u8],
    /// Name of the matrix or dataset within the file, if the user named one.
    pub name: Option<&'a str>,
}

impl ArraySource<'_> {
    /// Returns true if the file is not compressed as a whole.
    pub(super) fn is_plain(&self) -> bool {
        self.compression == Compression::None
    }

    /// Returns true if the user named no matrix of the file, and it is not compressed as a whole.
    pub(super) fn is_plain_of_one(&self) -> bool {
        self.is_plain() && self.name.is_none()
    }
}

/// Reader of one matrix format. A new format has one file in this crate, one entry in [`READERS`](super::READERS) and
/// one folder in `fixtures/readers/`.
pub trait Reader: Sync {
    /// Returns the name of the format in messages; in lower case with `-` for blanks it is the name of its fixture
    /// folder.
    fn name(&self) -> &'static str;

    /// Returns the file extensions in lower case, without the dot and without `.gz` or `.zst`. They decide only if the
    /// content does not.
    fn extensions(&self) -> &'static [&'static str];

    /// Returns true when an (unpacked) file that begins with `head` has this format. `head` has at least [`HEAD`] bytes
    /// unless the file is shorter.
    fn recognises(&self, head: &[u8]) -> bool;

    /// Returns true when the reader reads the file piece by piece or by its path. Other readers get a file whose bytes
    /// are in memory.
    fn reads_by_itself(&self) -> bool {
        false
    }

    /// Reads the matrix with both triangles, without zeros, with summed duplicates. The symmetry of a matrix that is
    /// stored in full is not checked.
    ///
    /// # Errors
    /// FB101, FB103 for a file that cannot be read, FB301 to FB313 for an invalid matrix, all that are found.
    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix>;

    /// Returns the labels of the rows if the file names them; `None` for formats that number them.
    ///
    /// # Errors
    /// The errors of [`Reader::read`].
    fn labels(&self, source: &MatrixSource<'_>) -> Result<Option<Vec<DofLabel>>> {
        let _ = source;
        Ok(None)
    }

    /// Reads a sparse matrix that need not be square, such as an operator; `None` if a file of this format holds none in
    /// this way.
    ///
    /// # Errors
    /// The errors of [`Reader::read`], apart from those of matrices that are not square.
    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let _ = source;
        None
    }

    /// Reads a dense array with one or two extents: shapes, loads, values; `None` if a file of this format holds none.
    ///
    /// # Errors
    /// FB103, FB301 to FB313 for a file that cannot be read.
    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        let _ = source;
        None
    }
}

/// Number of bytes that [`Reader::recognises`] receives. HDF5 files may begin with a user block of this size.
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

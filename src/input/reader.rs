//! Matrix formats: what a reader is, and the registry of them.

use super::bytes::InputFile;
use super::compression::Compression;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::model::RawMatrix;
use std::path::Path;

/// What a matrix is in the model. Files that hold several matrices tell them apart by it.
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

    /// Its name in messages and in [`crate::base::provenance::SourceFile::role`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass",
            Self::Damping => "damping",
            Self::GeometricStiffness => "geometric_stiffness",
        }
    }

    /// Whether a matrix called `name` (any case) is meant to be this one: `K` or `stiffness`, `M` or `mass`, `D`
    /// or `damping`, `Kg` or `geometric_stiffness`.
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
    /// How its bytes are packed.
    pub compression: Compression,
    /// Group within the file, when the user named one.
    pub group: Option<&'a str>,
    /// What the matrix is in the model.
    pub role: MatrixRole,
}

/// Reads one matrix format. A new format is one file of this room, one entry in [`READERS`] and one folder in
/// `fixtures/readers/`.
pub trait Reader: Sync {
    /// Name of the format in messages; in lower case with `-` for blanks, of its fixture folder.
    fn name(&self) -> &'static str;

    /// File extensions in lower case, without the dot and without `.gz` or `.zst`. They decide only where the
    /// content does not.
    fn extensions(&self) -> &'static [&'static str];

    /// Whether a file (unpacked) that begins with `head` is of this format. `head` has at least [`HEAD`] bytes
    /// unless the file is shorter.
    fn recognises(&self, head: &[u8]) -> bool;

    /// Reads the matrix: both triangles, zeros dropped, duplicates summed; symmetry of a matrix that is stored
    /// in full is not checked here.
    ///
    /// # Errors
    /// FB103, FB301 to FB313 and FB101 for what the file is not, as many as are found.
    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix>;
}

/// Every matrix format that is understood.
pub const READERS: &[&dyn Reader] = &[&super::matrix_market::MatrixMarket, &super::hdf5::Hdf5];

/// Whether a file that begins with `head` is HDF5: the signature stands at 0 or, after a user block (MATLAB writes one), at 512, 1024,
/// 2048, ...
pub(super) fn is_hdf5(head: &[u8]) -> bool {
    let signed = |&at: &usize| head.get(at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"));
    [0, 512, 1024, 2048].iter().any(signed)
}

/// Number of bytes that [`Reader::recognises`] is shown. HDF5 files may begin with a user block of this size.
pub const HEAD: usize = 2048 + 8;

/// The reader for a file: by its content, else by its extension.
///
/// # Errors
/// FB102 when neither tells, with what the file seems to be.
pub(super) fn reader_for(file: &InputFile, compression: Compression) -> Result<&'static dyn Reader> {
    let head = compression.head(file.bytes(), HEAD);
    let by_content = READERS.iter().find(|reader| reader.recognises(&head));
    let by_name = || {
        let extension = extension(file.path());
        READERS.iter().find(|reader| reader.extensions().contains(&extension.as_str()))
    };
    // A known foreign format is better named than parsed as what its extension says.
    let foreign = FOREIGN.iter().find(|(magic, ..)| head.starts_with(magic));
    match (by_content, foreign) {
        (Some(reader), _) => Ok(*reader),
        (None, Some((_, what, help))) => {
            let message = format!("file is {what}");
            Err(Diagnostic::new(Code::FileFormatUnknown, message)
                .in_file(file.path())
                .with_help(*help)
                .into())
        }
        (None, None) => by_name().copied().ok_or_else(|| {
            let start = &head[..head.len().min(24)];
            let message = format!("file begins with `{}`", start.escape_ascii());
            Diagnostic::new(Code::FileFormatUnknown, message).in_file(file.path()).into()
        }),
    }
}

/// First bytes of files that people have and that are not read, what they are, and what to do.
const FOREIGN: &[(&[u8], &str, &str)] = &[
    (b"PK\x03\x04", "a zip archive (scipy's .npz?)", "write it by scipy.io.mmwrite, or unpack it"),
    (b"MATLAB 5.0", "a MATLAB file of version 5 to 7", "save it with the option -v7.3, which is HDF5"),
    (b"BZh", "compressed by bzip2", "unpack it, or compress it by gzip or zstd"),
    (b"\xfd7zXZ", "compressed by xz", "unpack it, or compress it by gzip or zstd"),
    (b"\x1f\x8b", "compressed twice", "unpack it once"),
    (b"\x28\xb5\x2f\xfd", "compressed twice", "unpack it once"),
];

/// Extension in lower case, without that of the compression: `k.MTX.gz` gives `mtx`.
fn extension(path: &Path) -> String {
    let lower = |p: &Path| p.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    match lower(path).as_str() {
        "gz" | "zst" => lower(&path.with_extension("")),
        other => other.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compression_suffixes_are_not_the_format() {
        for (path, expected) in [("a/K.MTX", "mtx"), ("K.mtx.gz", "mtx"), ("K.1.h5.zst", "h5"), ("K", "")] {
            assert_eq!(extension(Path::new(path)), expected, "{path}");
        }
    }

    #[test]
    fn roles_know_their_names() {
        assert!(MatrixRole::Stiffness.is_named("k") && MatrixRole::Stiffness.is_named("Stiffness"));
        assert!(!MatrixRole::Mass.is_named("K") && MatrixRole::Mass.is_named("M"));
    }
}

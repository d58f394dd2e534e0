//! Matrices in files. Each format has one file behind [`Reader`] and [`READERS`]; the other files build a matrix from
//! its entries and choose one of several.

pub(super) mod assemble;
mod compressed;
pub(super) mod coordinates;
pub(super) mod dmig;
mod harwell_boeing;
#[cfg(feature = "hdf5")]
pub(super) mod hdf5;
#[cfg(not(feature = "hdf5"))]
#[path = "matrices/without_hdf5.rs"]
pub(super) mod hdf5;
#[cfg(feature = "hdf5")]
mod lent;
pub(super) mod mat5;
pub(super) mod matrix_market;
pub(super) mod named_matrices;
mod npy_matrix;
pub(super) mod npz_archive;
mod npz_full;
pub(super) mod operator;
pub(super) mod output4;
pub(super) mod petsc;
mod reader;
pub(super) mod recent;
pub(super) mod rectangular;
pub(super) mod scipy_npz;
mod text_array;
pub(super) mod turn;

use dmig::DmigPunch;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::{Compression, InputFile};
use harwell_boeing::HarwellBoeing;
use hdf5::Hdf5;
use mat5::Mat5;
use matrix_market::MatrixMarket;
use npy_matrix::Npy;
use output4::Output4;
use petsc::Petsc;
use scipy_npz::ScipyNpz;
use std::path::Path;
use text_array::TextArray;

pub use reader::{ArraySource, HEAD, MatrixRole, MatrixSource, Reader};

/// Every supported matrix format.
pub const READERS: &[&dyn Reader] =
    &[&MatrixMarket, &Hdf5, &ScipyNpz, &Npy, &Mat5, &Petsc, &Output4, &DmigPunch, &HarwellBoeing, &TextArray];

/// Returns the reader for a file: by its content, else by its extension.
///
/// # Errors
/// FB102 if neither determines the format, with the likely kind of the file.
pub(super) fn reader_for(file: &InputFile, compression: Compression) -> Result<&'static dyn Reader> {
    let head = compression.head(file, HEAD);
    let by_content = recognised(file.path(), &head);
    let by_name = || {
        let extension = extension(file.path());
        READERS.iter().find(|reader| reader.extensions().contains(&extension.as_str()))
    };
    // A known foreign format is reported by name rather than parsed by its extension.
    let not_read = NOT_READ.iter().find(|(magic, ..)| head.starts_with(magic));
    match (by_content, not_read) {
        (Some(reader), _) => Ok(reader),
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

/// Returns what `read` gives for the reader that recognises the file by its content; `None` if none does. `name` is the
/// matrix or dataset of a file with several.
pub(super) fn with_reader<T>(
    file: &InputFile,
    name: Option<&str>,
    read: impl FnOnce(&dyn Reader, &ArraySource<'_>) -> Option<T>,
) -> Option<T> {
    let compression = Compression::of(file.bytes());
    let head = compression.head(file, HEAD);
    let reader = recognised(file.path(), &head)?;
    read(reader, &ArraySource { file, compression, head: &head, name })
}

/// Returns the reader that recognises the beginning of a file. Lines of numbers in a file that is named like Matrix Market
/// are no plain array but a list whose head is missing.
fn recognised(path: &Path, head: &[u8]) -> Option<&'static dyn Reader> {
    let reader = *READERS.iter().find(|reader| reader.recognises(head))?;
    let is_list = MatrixMarket.extensions().contains(&extension(path).as_str());
    (reader.name() != TextArray.name() || !is_list).then_some(reader)
}

/// First bytes of known file formats that are not supported, with their kind and advice.
const NOT_READ: &[(&[u8], &str, &str)] = &[
    (b"PK\x03\x04", "a zip archive", "unpack it"),
    (
        b"[row ",
        "printed by MFEM's SparseMatrix::Print",
        "write it by A.PrintMM(file), which is Matrix Market",
    ),
    (
        b"% size ",
        "printed by MFEM's SparseMatrix::PrintMatlab",
        "write it by A.PrintMM(file), which is Matrix Market",
    ),
    (
        b"**\n** GENERATION OF SUBSTRUCTURE",
        "a substructure of Abaqus",
        "give the deck that names it: flexbody convert job.inp",
    ),
    (
        b"**\r\n** GENERATION OF SUBSTRUCTURE",
        "a substructure of Abaqus",
        "give the deck that names it: flexbody convert job.inp",
    ),
    (b"BZh", "compressed by bzip2", "unpack it, or compress it by gzip or zstd"),
    (b"\xfd7zXZ", "compressed by xz", "unpack it, or compress it by gzip or zstd"),
    (b"\x1f\x8b", "compressed twice", "unpack it once"),
    (b"\x28\xb5\x2f\xfd", "compressed twice", "unpack it once"),
];

/// Returns the extension in lower case, without that of the compression: `mtx` for `k.MTX.gz`.
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
}

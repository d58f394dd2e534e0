//! Archives of arrays of NumPy (`numpy.savez`), which are zip archives with one member for every array.

use crate::npy;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::memory::{left, refuse_beyond};
use std::io::{Cursor, Read};
use zip::ZipArchive;

const HELP: &str = "write it again: scipy.sparse.save_npz(file, A.tocsc()), or numpy.savez(file, K=K, M=M)";
const MEMORY_HELP: &str = "use a larger machine";

/// Number of bytes of an array that are unpacked before its header is parsed: no header of NumPy is longer.
const HEAD_BYTES: u64 = 1 << 17;

/// Archive of arrays of NumPy.
pub(crate) struct Archive<'a>(ZipArchive<Cursor<&'a [u8]>>);

impl<'a> Archive<'a> {
    pub(crate) fn open(bytes: &'a [u8]) -> std::result::Result<Self, Diagnostic> {
        ZipArchive::new(Cursor::new(bytes)).map(Self).map_err(|error| damaged(&error))
    }

    fn open_member(&mut self, name: &str) -> std::result::Result<impl Read + use<'_, 'a>, Diagnostic> {
        self.0.by_name(&format!("{name}.npy")).map_err(|error| match error {
            zip::result::ZipError::FileNotFound => {
                let message = format!("archive has no array `{name}`: it is not a sparse matrix of SciPy");
                Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
            }
            error => damaged(&error),
        })
    }

    /// Returns the bytes of the array `name`, verified by its checksum.
    pub(crate) fn member(&mut self, name: &str) -> std::result::Result<Vec<u8>, Diagnostic> {
        let mut member = self.open_member(name)?;
        let mut bytes = Vec::new();
        let mut take = |bytes: &mut Vec<u8>, most: u64| {
            let more = most.saturating_sub(bytes.len() as u64);
            member.by_ref().take(more).read_to_end(bytes).map_err(|error| damaged(&error)).map(|_| ())
        };
        take(&mut bytes, HEAD_BYTES)?;
        // A member that is no array is refused by its beginning; of an array no more is unpacked than its header
        // announces.
        if let Some(announced) = npy::announced_bytes(&bytes) {
            let refused =
                refuse_beyond(left(), announced as f64, &format!("the array `{name}`"), MEMORY_HELP);
            refused.map_err(|error| error.first_error().clone())?;
            take(&mut bytes, announced.saturating_add(1))?;
        }
        Ok(bytes)
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.0.index_for_name(&format!("{name}.npy")).is_some()
    }

    /// Returns true if the archive holds a sparse matrix of SciPy, not full arrays: only the former states a format.
    pub(super) fn is_sparse(&self) -> bool {
        self.has("format")
    }

    /// Returns the names of the arrays in the order of the archive.
    pub(super) fn names(&self) -> Vec<String> {
        let of = |name: &str| name.strip_suffix(".npy").map(str::to_owned);
        self.0.file_names().filter_map(|name| of(&name.ok()?)).collect()
    }

    /// Returns the extents of the array `name` by its header; `None` if the member is no array.
    pub(super) fn extents(&mut self, name: &str) -> Option<Vec<usize>> {
        npy::announced_extents(&self.head(name).ok()?)
    }

    /// Returns the number of values that the header of the array `name` announces.
    pub(super) fn count(&mut self, name: &str) -> std::result::Result<u64, Diagnostic> {
        npy::announced_values(&self.head(name)?)
    }

    /// Returns the beginning of the array `name`, with its header.
    fn head(&mut self, name: &str) -> std::result::Result<Vec<u8>, Diagnostic> {
        let mut bytes = Vec::new();
        let read = self.open_member(name)?.take(HEAD_BYTES).read_to_end(&mut bytes);
        read.map_err(|error| damaged(&error))?;
        Ok(bytes)
    }
}

fn damaged(error: &dyn std::fmt::Display) -> Diagnostic {
    Diagnostic::new(Code::FileCompressionBroken, format!("archive is damaged: {error}")).with_help(HELP)
}

//! Provenance of a result: fingerprints of the input files and the name of the generator.

use crate::diagnostic::Diagnostic;
use crate::read_files::open_regular;
use std::io::Read;
use std::ops::Deref;
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// Input file of a model.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SourceFile {
    /// Role: `manifest`, `stiffness`, `mass`, `nodes`, `dofs`, `interface`, `scene`, `history`, ...
    pub role: String,
    /// File name without folders, so that results do not depend on the location of the model.
    pub name: String,
    /// SHA-256 of the bytes on disk (compressed files: as stored), lowercase hex.
    pub sha256: String,
}

impl SourceFile {
    /// Creates the entry of the file at `path`, of which only the name is kept.
    pub fn new(role: &str, path: &Path, sha256: String) -> Self {
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Self { role: role.to_owned(), name, sha256 }
    }
}

/// Input files of a model. Their fingerprints are computed at the first access: a file of gigabytes takes seconds,
/// which could delay other work on a single thread.
#[derive(Clone)]
pub struct Sources(Arc<LazyLock<Result<Vec<SourceFile>, Diagnostic>, Find>>);

type Find = Box<dyn FnOnce() -> Result<Vec<SourceFile>, Diagnostic> + Send>;

impl Sources {
    /// Creates a list that `find` computes at the first access.
    pub fn later(find: impl FnOnce() -> Result<Vec<SourceFile>, Diagnostic> + Send + 'static) -> Self {
        Self(Arc::new(LazyLock::new(Box::new(find))))
    }

    /// Computes the fingerprints that were not taken while reading.
    ///
    /// # Errors
    /// FB101, FB132 for a file that has changed since it was read.
    pub fn find(&self) -> Result<(), Diagnostic> {
        LazyLock::force(&self.0).as_ref().map(|_| ()).map_err(Diagnostic::clone)
    }
}

impl Default for Sources {
    fn default() -> Self {
        Self::later(|| Ok(Vec::new()))
    }
}

impl Deref for Sources {
    type Target = [SourceFile];

    /// Returns the files; empty if [`Self::find`] fails.
    fn deref(&self) -> &[SourceFile] {
        self.0.as_ref().as_ref().map_or(&[], Vec::as_slice)
    }
}

impl PartialEq for Sources {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl std::fmt::Debug for Sources {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// Returns the name and version that are written into every output.
pub fn generator() -> String {
    format!("flexbody {}", env!("CARGO_PKG_VERSION"))
}

/// SHA-256 of bytes that arrive piece by piece.
#[derive(Debug, Clone, Default)]
pub struct Fingerprint(sha2::Sha256);

impl Fingerprint {
    /// Adds the next bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        use sha2::Digest;
        self.0.update(bytes);
    }

    /// Returns the SHA-256 of all bytes so far, in lowercase hex.
    pub fn hex(self) -> String {
        use sha2::Digest;
        use std::fmt::Write;
        let mut hex = String::with_capacity(64);
        for byte in self.0.finalize() {
            write!(hex, "{byte:02x}").expect("writing to a String cannot fail");
        }
        hex
    }
}

/// Returns the SHA-256 of `bytes`, in lowercase hex.
pub fn sha256_hex(bytes: &[u8]) -> String {
    let mut fingerprint = Fingerprint::default();
    fingerprint.update(bytes);
    fingerprint.hex()
}

/// Returns the SHA-256 of the content of a file, in lowercase hex. The file is read piece by piece.
///
/// # Errors
/// The errors of reading the file.
pub fn sha256_of_file(path: &Path) -> std::io::Result<String> {
    let (mut file, mut fingerprint) = (open_regular(path)?, Fingerprint::default());
    let mut piece = vec![0; 1 << 20];
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(fingerprint.hex()),
            length => fingerprint.update(&piece[..length]),
        }
    }
}

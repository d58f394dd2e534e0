//! Provenance of a result: fingerprints of the input files and the name of the generator.

use crate::diagnostic::Diagnostic;
use crate::read_files::open_regular;
use std::ffi::OsString;
use std::io::Read;
use std::ops::Deref;
use std::path::Path;
use std::sync::{Arc, LazyLock, OnceLock};
use std::time::SystemTime;

/// Name of the root attribute of an HDF5 file with the list of digests: a line `SHA-256  path` for each group and
/// dataset, by path.
pub const LIST_OF_DIGESTS: &str = "digests";
/// Name of the root attribute of an HDF5 file with the SHA-256 of that list.
pub const DIGEST_OF_LIST: &str = "sha256";

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

/// Command line of this process and the time of its start.
static STARTED: OnceLock<Started> = OnceLock::new();

/// Command line of the program and the time at which it was started.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Started {
    /// Command line, quoted for a shell.
    pub command: String,
    /// Time of the start: `2026-01-31 14:05 UTC`.
    pub time: String,
}

/// States the command line of the program, which its pages then show. Only the first call counts; a library in another
/// program states none.
pub fn state_command(words: &[OsString]) {
    // The folder of the program says nothing about the run.
    let program = words.first().and_then(|word| Path::new(word).file_name());
    let words = program.into_iter().chain(words.iter().skip(1).map(OsString::as_os_str));
    let words: Vec<String> = words.map(|word| shell_word(&word.to_string_lossy())).collect();
    let seconds = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    // A second call would be a second command of one process.
    let _ = STARTED.set(Started { command: words.join(" "), time: in_utc(seconds) });
}

/// Returns the command line of the program; `None` in a library.
pub fn started() -> Option<&'static Started> {
    STARTED.get()
}

/// Returns a word as a POSIX shell reads it: in single quotes if it has characters with a meaning there.
pub fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_./,=:@%+-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Returns date and minute of a time in seconds since 1970, in the Gregorian calendar.
fn in_utc(seconds: u64) -> String {
    let (days, minutes) = (seconds / 86_400, seconds / 60 % 1440);
    // Days of eras of 400 years that begin on 1 March of year 0, so that leap days end their years.
    let from_march = days + 719_468;
    let (era, day) = (from_march / 146_097, from_march % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = 400 * era + year + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", minutes / 60, minutes % 60)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (951_868_800, "2000-03-01 00:00 UTC"),
            (1_709_210_096, "2024-02-29 12:34 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(in_utc(seconds), expected);
        }
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        for (word, expected) in [
            ("a/b-1.toml", "a/b-1.toml"),
            ("two words", "'two words'"),
            ("it's", "'it'\\''s'"),
            ("$(x)", "'$(x)'"),
            ("", "''"),
        ] {
            assert_eq!(shell_word(word), expected);
        }
    }
}

//! Small files of two lines of JSON: a head with the format and the digest of the second line, and the content.
//! Truncated, mixed up or edited files are detected; files of another version are distinguished.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::sha256_hex;
use flexbody_base::read_files::{note_read, read_text};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the files that this program and its driver write.
const VERSION: u32 = 1;

/// Largest size of such a file in bytes: ledgers of some hundred thousand bodies.
const MAX_BYTES: u64 = 1 << 30;

#[derive(Serialize, Deserialize)]
struct Head {
    format: String,
    version: u32,
    sha256: String,
}

/// Returns the text of a file with this content.
pub(super) fn seal(format: &str, content: &impl Serialize) -> String {
    let body = serde_json::to_string(content).expect("texts and finite numbers");
    let head = Head { format: format.to_owned(), version: VERSION, sha256: sha256_hex(body.as_bytes()) };
    let head = serde_json::to_string(&head).expect("texts and a number");
    format!("{head}\n{body}\n")
}

/// Reads the content of an input file.
///
/// # Errors
/// The errors of [`open_unrecorded`].
pub(super) fn open<T: DeserializeOwned>(path: &Path, format: &str) -> Result<T> {
    note_read(path);
    open_unrecorded(path, format)
}

/// Reads the content of a file that the run itself writes and replaces.
///
/// # Errors
/// [`ClusterUnreadable`](Code::ClusterUnreadable) if the file cannot be read or does not have this format;
/// [`ClusterChanged`](Code::ClusterChanged) if its digest differs.
pub(super) fn open_unrecorded<T: DeserializeOwned>(path: &Path, format: &str) -> Result<T> {
    let unreadable = |why: String| Error::from(Diagnostic::new(Code::ClusterUnreadable, why).in_file(path));
    let text = read_text(path, MAX_BYTES).map_err(|e| unreadable(format!("file cannot be read: {e}")))?;
    let wrong_format = || unreadable(format!("file is not a `{format}` file"));
    let (head, body) = text.split_once('\n').ok_or_else(wrong_format)?;
    let head: Head = serde_json::from_str(head).map_err(|_| wrong_format())?;
    if head.format != format {
        return Err(wrong_format());
    }
    if head.version != VERSION {
        let message =
            format!("file has version {} of its format, this program reads {VERSION}", head.version);
        return Err(unreadable(message));
    }
    let body = body.strip_suffix('\n').unwrap_or(body);
    if sha256_hex(body.as_bytes()) != head.sha256 {
        let message = "the content of the file changed since it was written";
        return Err(Diagnostic::new(Code::ClusterChanged, message).in_file(path).into());
    }
    serde_json::from_str(body)
        .map_err(|e| unreadable(format!("the content of the file is not understood: {e}")))
}

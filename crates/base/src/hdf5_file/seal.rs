//! The digests in a file of the program: a SHA-256 of every group and dataset by path, and a SHA-256 of this list
//! (`docs/reference/file_format.md`).

use super::digest::{Digests, Numbers, digests_of};
use super::open::put_text;
use super::value::{Stored, text};
use crate::provenance::{DIGEST_OF_LIST, LIST_OF_DIGESTS, sha256_hex};
use hdf5_metno as hdf5;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Attributes of the root that the digests do not count.
const ATTRIBUTES: [&str; 2] = [LIST_OF_DIGESTS, DIGEST_OF_LIST];

/// Largest number of entries named in a message.
const MAX_NAMED: usize = 6;

/// Returns the text of the list, and its SHA-256.
fn sealed(digests: &Digests) -> (String, String) {
    let mut list = String::new();
    for (path, digest) in digests {
        writeln!(list, "{digest}  {path}").expect("writing to a String cannot fail");
    }
    let whole = sha256_hex(list.as_bytes());
    (list, whole)
}

/// Writes the digests of all content of `file` to attributes of its root, with which it ends. `numbers` holds the
/// fingerprints of its datasets.
///
/// # Errors
/// The errors of HDF5, and of an entry that no flex-body file has.
pub(super) fn seal(file: &hdf5::File, numbers: &Numbers) -> hdf5::Result<()> {
    let (list, whole) = sealed(&digests_of(file, numbers, &mut Stored::new(0), &ATTRIBUTES)?);
    put_text(file, LIST_OF_DIGESTS, &list)?;
    put_text(file, DIGEST_OF_LIST, &whole)
}

/// Returns the difference between all content of `file` and the digests in it; `None` if there is none, or if the file
/// has no digests and `required` is false.
///
/// # Errors
/// The path of an entry that cannot be read, with the problem.
pub fn broken_seal(file: &hdf5::File, stored: &mut Stored, required: bool) -> Result<Option<String>, String> {
    let root = file.as_group().map_err(|e| e.to_string())?;
    match (text(&root, LIST_OF_DIGESTS)?, text(&root, DIGEST_OF_LIST)?) {
        (Some(list), Some(whole)) => {
            Ok(difference(&digests_of(file, &Numbers::new(), stored, &ATTRIBUTES)?, &list, &whole))
        }
        (None, None) if !required => Ok(None),
        _ => Ok(Some(format!("the attributes `{LIST_OF_DIGESTS}` and `{DIGEST_OF_LIST}` were removed"))),
    }
}

/// Returns the difference between the content and the list stored with it; `None` if there is none.
pub fn difference(found: &Digests, list: &str, whole: &str) -> Option<String> {
    if sealed(found) == (list.to_owned(), whole.to_owned()) {
        return None;
    }
    if sha256_hex(list.as_bytes()) != whole {
        return Some(format!("/@{LIST_OF_DIGESTS} does not have the SHA-256 that /@{DIGEST_OF_LIST} states"));
    }
    let stated: BTreeMap<&str, &str> =
        list.lines().filter_map(|line| line.split_once("  ")).map(|(digest, path)| (path, digest)).collect();
    let is_new = |path: &&String| !stated.contains_key(path.as_str());
    let other = |path: &&String| stated.get(path.as_str()).is_some_and(|digest| *digest != found[*path]);
    let parts = [
        ("changed", found.keys().filter(other).map(String::as_str).collect::<Vec<_>>()),
        ("added", found.keys().filter(is_new).map(String::as_str).collect()),
        ("removed", stated.keys().filter(|path| !found.contains_key(**path)).copied().collect()),
    ];
    let differences = parts.iter().filter(|(_, paths)| !paths.is_empty()).map(|(what, paths)| {
        let more = match paths.len().saturating_sub(MAX_NAMED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!("{what}: {}{more}", paths[..paths.len().min(MAX_NAMED)].join(", "))
    });
    Some(differences.collect::<Vec<_>>().join("; "))
}

//! The list of digests in a flex-body file (`docs/reference/file_format.md`): a SHA-256 of every group and dataset by
//! path, and a SHA-256 of this list.

use super::schema::{LIST, WHOLE};
use flexbody_base::hdf5_file::Digests;
use flexbody_base::provenance::sha256_hex;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Largest number of entries named in a message.
const MAX_NAMED: usize = 6;

/// Returns the text of the list, and its SHA-256.
pub(super) fn sealed(digests: &Digests) -> (String, String) {
    let mut list = String::new();
    for (path, digest) in digests {
        writeln!(list, "{digest}  {path}").expect("writing to a String cannot fail");
    }
    let whole = sha256_hex(list.as_bytes());
    (list, whole)
}

/// Returns the difference between the content and the list stored with it; `None` if there is none.
pub(super) fn difference(found: &Digests, list: &str, whole: &str) -> Option<String> {
    if sealed(found) == (list.to_owned(), whole.to_owned()) {
        return None;
    }
    if sha256_hex(list.as_bytes()) != whole {
        return Some(format!("/@{LIST} does not have the SHA-256 that /@{WHOLE} states"));
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

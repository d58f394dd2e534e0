//! Sparse matrices in HDF5 files: opens the file, and finds the group with the matrix.

mod exodus;
mod group;
mod values;

use super::named_matrices::NamedMatrices;
use super::reader::{MatrixRole, MatrixSource, Reader};
use super::recovery_files::Rectangular;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file::{by_utf8_name, without_plugins};
use flexbody_base::text::Compression;
use flexbody_base::text::input_file::{InputFile, is_hdf5};
use flexbody_model::RawMatrix;
use hdf5_metno::{File, Group, LinkType};
use std::collections::BTreeMap;
use values::Found;

pub(super) use exodus::with_exodus;
pub(super) use values::read_array;

/// Reader of HDF5 files.
pub(super) struct Hdf5;

const NAMES: NamedMatrices = NamedMatrices { holder: "group", file: "FILE.h5", matrices: "sparse matrices" };

/// Largest number of groups that are searched, and their largest depth: a file must not make the search endless.
const MAX_GROUPS: usize = 1000;
const MAX_DEPTH: usize = 6;

impl Reader for Hdf5 {
    fn name(&self) -> &'static str {
        "HDF5"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["h5", "hdf5", "hdf", "h5ad"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        is_hdf5(head)
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        let read = || {
            if source.compression != Compression::None {
                let message = "HDF5 file is compressed as a whole";
                let help = "unpack it: HDF5 compresses inside the file";
                return Err(vec![Diagnostic::new(Code::FileFormatUnknown, message).with_help(help)]);
            }
            let file = opened(source.file)?;
            let (name, group) = match source.group {
                Some(name) => (name.to_owned(), named(&file, name)?),
                None => search(&file, source.role)?,
            };
            group::read(&group, &name, source)
        };
        read().map_err(|found| Error::new(found.into_iter().map(|d| d.in_file(path)).collect()))
    }
}

/// Reads a matrix that need not be square: the sparse matrix or the dense array `name`, or the only one of the file.
///
/// # Errors
/// FB310 if there is no such matrix or several, FB302 to FB313 for an invalid one.
pub(super) fn read_rectangular(file: &InputFile, name: Option<&str>) -> Found<Rectangular> {
    let opened = opened(file)?;
    let found = matrices(&opened);
    let wanted = name.map(|name| format!("/{}", name.trim_matches('/')));
    let sparse = match &wanted {
        Some(wanted) => found.iter().find(|(name, _)| name == wanted),
        None => {
            found.first().filter(|_| found.len() == 1 && !values::has_arrays_beside(&opened, &found[0].0))
        }
    };
    match sparse {
        Some((name, group)) => group::read_rectangular(group, name, file),
        None if wanted.is_none() && found.len() > 1 => {
            let message = format!("file holds {} sparse matrices; which is the operator?", found.len());
            Err(vec![layout(message).with_help(listing(&found))])
        }
        None => values::read_rectangular(file, name),
    }
}

/// Opens a file with the HDF5 library, which loads no plugins.
fn opened(file: &InputFile) -> Found<File> {
    without_plugins();
    by_utf8_name(file.path(), |path| File::open(path)).map_err(|e| {
        let message = format!("HDF5 file cannot be opened: {e}");
        vec![Diagnostic::new(Code::FileUnreadable, message).with_help("transfer or write the file again")]
    })
}

/// Opens the group that the user named.
fn named(file: &File, name: &str) -> Found<Group> {
    let mut group = file.group("/").map_err(|e| vec![layout(format!("root group cannot be read: {e}"))])?;
    for part in name.split('/').filter(|part| !part.is_empty()) {
        if Members::of(&group).is_elsewhere(part) {
            let message =
                format!("`{part}` of group `{name}` is a soft or external link, which is not followed");
            return Err(vec![
                layout(message).with_help("name the group that it leads to, in the file that holds it"),
            ]);
        }
        group = group.group(part).map_err(|_| {
            let what =
                if group.dataset(part).is_ok() { "is a dataset, not a group" } else { "is not in the file" };
            vec![layout(format!("group `{name}`: `{part}` {what}")).with_help(listing(&matrices(file)))]
        })?;
    }
    if Members::of(&group).look_like_a_matrix() {
        return Ok(group);
    }
    let message = format!("group `{name}` holds no sparse matrix");
    Err(vec![layout(message).with_help(listing(&matrices(file)))])
}

/// Returns the only matrix of the file, or the only one named after its role.
fn search(file: &File, role: MatrixRole) -> Found<(String, Group)> {
    let mut found = matrices(file);
    if found.is_empty() {
        return Err(vec![layout("file holds no sparse matrix".into())]);
    }
    let chosen = NAMES.choose(&names(&found), role).map_err(|diagnostic| vec![diagnostic])?;
    Ok(found.swap_remove(chosen))
}

/// Returns names and groups of all sparse matrices of the file, breadth first.
fn matrices(file: &File) -> Vec<(String, Group)> {
    let mut found = Vec::new();
    let mut level: Vec<(String, Group)> =
        file.group("/").map(|root| (String::new(), root)).into_iter().collect();
    let mut visited = 0;
    for _ in 0..MAX_DEPTH {
        let mut next = Vec::new();
        for (name, group) in level {
            let members = Members::of(&group);
            if members.look_like_a_matrix() {
                let name = if name.is_empty() { "/".to_owned() } else { name };
                found.push((name, group));
                continue;
            }
            // MATLAB keeps internal data in groups that begin with `#`.
            for child in members.hard_links().filter(|child| !child.starts_with('#')) {
                visited += 1;
                if visited > MAX_GROUPS {
                    return found;
                }
                if let Ok(inner) = group.group(child) {
                    next.push((format!("{name}/{child}"), inner));
                }
            }
        }
        level = next;
    }
    found
}

fn names(found: &[(String, Group)]) -> Vec<&str> {
    found.iter().map(|(name, _)| name.as_str()).collect()
}

fn listing(found: &[(String, Group)]) -> String {
    if found.is_empty() { Code::Hdf5Layout.help().to_owned() } else { NAMES.listing(&names(found)) }
}

fn layout(message: String) -> Diagnostic {
    Diagnostic::new(Code::Hdf5Layout, message)
}

// The members of a group, and the names under which it holds a sparse matrix.

const INDICES: &[&str] = &["indices", "ir"];
const POINTERS: &[&str] = &["indptr", "jc"];
const VALUES: &[&str] = &["data", "values", "val"];
const ROWS: &[&str] = &["row", "rows", "i"];
const COLUMNS: &[&str] = &["col", "cols", "j"];

/// Links of a group by name.
struct Members(BTreeMap<String, LinkType>);

impl Members {
    /// Returns the links of `group`; none if they cannot be listed.
    fn of(group: &Group) -> Self {
        let mut links = BTreeMap::new();
        // A group that cannot be listed is reported as a group without a matrix.
        let _ = group.iter_visit_default(|name, info| {
            links.insert(name.to_owned(), info.link_type);
            Ok(())
        });
        Self(links)
    }

    fn link(&self, name: &str) -> Option<LinkType> {
        self.0.get(name).copied()
    }

    /// Returns true when `name` is a hard link. A soft link may lead to another file.
    fn is_here(&self, name: &str) -> bool {
        self.link(name) == Some(LinkType::Hard)
    }

    /// Returns true when `name` is a soft or external link. Such links are not followed.
    fn is_elsewhere(&self, name: &str) -> bool {
        self.link(name).is_some_and(|link| link != LinkType::Hard)
    }

    fn hard_links(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|(_, link)| **link == LinkType::Hard).map(|(name, _)| name.as_str())
    }

    fn first(&self, names: &[&'static str]) -> Option<&'static str> {
        names.iter().copied().find(|name| self.0.contains_key(*name))
    }

    /// Returns the names of values, indices and pointers; `None` if one is missing.
    fn compressed(&self) -> Option<(&'static str, &'static str, &'static str)> {
        Some((self.first(VALUES)?, self.first(INDICES)?, self.first(POINTERS)?))
    }

    /// Returns the names of values, rows and columns; `None` if one is missing.
    fn coordinates(&self) -> Option<(&'static str, &'static str, &'static str)> {
        Some((self.first(VALUES)?, self.first(ROWS)?, self.first(COLUMNS)?))
    }

    fn look_like_a_matrix(&self) -> bool {
        self.compressed().is_some() || self.coordinates().is_some()
    }
}

//! Sparse matrices in HDF5 files: opening, and finding the group that holds the matrix.

use super::compression::Compression;
use super::reader::{MatrixRole, MatrixSource, Reader, is_hdf5};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::RawMatrix;
use hdf5_metno::{File, Group, LinkType};

mod array;
mod group;
mod members;
mod values;

pub(super) use array::read_array;
use members::Members;
use values::Found;

/// The HDF5 reader.
pub(super) struct Hdf5;

/// Groups that are searched at most, and how deep: a file must not keep us busy.
const GROUPS: usize = 1000;
const DEPTH: usize = 6;

impl Reader for Hdf5 {
    fn name(&self) -> &'static str {
        "HDF5"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["h5", "hdf5", "hdf", "mat", "h5ad"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        is_hdf5(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        let read = || {
            if source.compression != Compression::None {
                let message = "HDF5 file is compressed as a whole";
                let help = "unpack it: HDF5 compresses inside the file";
                return Err(vec![Diagnostic::new(Code::FileFormatUnknown, message).with_help(help)]);
            }
            let file = File::open(path).map_err(|e| {
                let message = format!("HDF5 file cannot be opened: {e}");
                vec![
                    Diagnostic::new(Code::FileUnreadable, message)
                        .with_help("transfer or write the file again"),
                ]
            })?;
            let (name, group) = match source.group {
                Some(name) => (name.to_owned(), named(&file, name)?),
                None => search(&file, source.role)?,
            };
            group::read(&group, &name, source.file)
        };
        read().map_err(|found| Error::new(found.into_iter().map(|d| d.in_file(path)).collect()))
    }
}

/// The group that the user named.
fn named(file: &File, name: &str) -> Found<Group> {
    let mut group = file.group("/").map_err(|e| vec![layout(format!("root group cannot be read: {e}"))])?;
    for part in name.split('/').filter(|part| !part.is_empty()) {
        if Members::of(&group).link(part) == Some(LinkType::External) {
            let message = format!("`{part}` of group `{name}` is a link to another file");
            return Err(vec![layout(message).with_help("give that file itself")]);
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

/// The only matrix of the file, or the only one named after its role.
fn search(file: &File, role: MatrixRole) -> Found<(String, Group)> {
    let mut found = matrices(file);
    let last = |name: &str| name.rsplit('/').next().unwrap_or("").to_owned();
    if found.is_empty() {
        return Err(vec![layout("file holds no sparse matrix".into())]);
    }
    if let [(name, _)] = found.as_slice() {
        let named = |other: &&MatrixRole| **other != role && other.is_named(&last(name));
        if let Some(other) = MatrixRole::ALL.iter().find(named).map(|other| other.name()) {
            let message = format!("the only matrix of the file, `{name}`, is named like the {other} matrix");
            let help = format!("if it is the {} matrix, name the group: FILE.h5:{name}", role.name());
            return Err(vec![layout(message).with_help(help)]);
        }
        return Ok(found.remove(0));
    }
    let mut by_name: Vec<usize> = (0..found.len()).filter(|&k| role.is_named(&last(&found[k].0))).collect();
    match (by_name.pop(), by_name.is_empty()) {
        (Some(only), true) => Ok(found.remove(only)),
        _ => {
            let message =
                format!("file holds {} sparse matrices; which is the {} matrix?", found.len(), role.name());
            Err(vec![layout(message).with_help(listing(&found))])
        }
    }
}

/// Names and groups of all sparse matrices of the file, breadth first.
fn matrices(file: &File) -> Vec<(String, Group)> {
    let mut found = Vec::new();
    let mut level: Vec<(String, Group)> =
        file.group("/").map(|root| (String::new(), root)).into_iter().collect();
    let mut visited = 0;
    for _ in 0..DEPTH {
        let mut next = Vec::new();
        for (name, group) in level {
            let members = Members::of(&group);
            if members.look_like_a_matrix() {
                let name = if name.is_empty() { "/".to_owned() } else { name };
                found.push((name, group));
                continue;
            }
            // MATLAB keeps its own things in groups that begin with `#`.
            for child in members.hard_links().filter(|child| !child.starts_with('#')) {
                visited += 1;
                if visited > GROUPS {
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

fn listing(found: &[(String, Group)]) -> String {
    if found.is_empty() {
        return Code::Hdf5Layout.help().to_owned();
    }
    let names: Vec<&str> = found.iter().take(8).map(|(name, _)| name.as_str()).collect();
    let more = if found.len() > names.len() { ", ..." } else { "" };
    format!("name the group as FILE.h5:/group; the file has {}{more}", names.join(", "))
}

fn layout(message: String) -> Diagnostic {
    Diagnostic::new(Code::Hdf5Layout, message)
}

//! Dense arrays in HDF5 files: the named dataset, or the only one with two extents.

use super::file::{MAX_DEPTH, MAX_GROUPS, layout, opened, root};
use super::members::Members;
use super::values::{Numbers, refuse_beyond_memory};
use crate::array::Array;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use hdf5_metno::{File, Group};

/// Reads the dataset `name`, or the only array of the file.
pub(crate) fn read_array(file: &InputFile, name: Option<&str>) -> Diagnosed<Array> {
    array_of(&named_or_only(&opened(file)?, name)?)
}

/// Dense array as its file stores it.
pub(crate) struct StoredArray {
    pub array: Array,
    /// True if MATLAB wrote the array: it stores the transposed one.
    pub is_transposed: bool,
}

/// Reads the dataset `name`, or the only array of the file, and whether it is transposed.
pub(crate) fn read_stored_array(file: &InputFile, name: Option<&str>) -> Diagnosed<StoredArray> {
    let numbers = named_or_only(&opened(file)?, name)?;
    let is_transposed = numbers.dataset.attr("MATLAB_class").is_ok();
    Ok(StoredArray { array: array_of(&numbers)?, is_transposed })
}

fn named_or_only(file: &File, name: Option<&str>) -> Diagnosed<Numbers> {
    match name {
        Some(name) => named(file, name),
        None => search(file),
    }
}

fn array_of(numbers: &Numbers) -> Diagnosed<Array> {
    let shape = numbers.dataset.shape();
    let (rows, cols) = match *shape.as_slice() {
        [rows] => (rows, 1),
        [rows, cols] => (rows, cols),
        _ => {
            let message = format!("dataset {} has the shape {shape:?}, expected two extents", numbers.name);
            return Err(vec![Diagnostic::new(Code::MatrixKind, message)]);
        }
    };
    let single = numbers.is_single_precision();
    refuse_beyond_memory(rows.saturating_mul(cols), &numbers.name)?;
    let values = numbers.dataset.read_raw::<f64>().map_err(|e| {
        let message = format!("dataset {} cannot be read: {e}", numbers.name);
        vec![Diagnostic::new(Code::FileUnreadable, message).with_help("write the file again")]
    })?;
    Ok(Array { rows, cols, row_major: true, values, digits: if single { 7 } else { 17 } })
}

/// Returns the paths of the square datasets of the file, breadth first.
pub(crate) fn square_arrays(file: &File) -> Vec<String> {
    let is_square = |group: &Group, name: &str| {
        group.dataset(name).is_ok_and(|set| matches!(*set.shape().as_slice(), [n, m] if n == m && n > 1))
    };
    let square = arrays(file).into_iter().filter(|(group, _, name)| is_square(group, name));
    square.map(|(_, path, name)| format!("{path}/{name}")).collect()
}

/// Returns true if `name` is a dataset with two extents.
pub(crate) fn is_array(file: &File, name: &str) -> bool {
    let wanted = name.trim_matches('/');
    arrays(file).iter().any(|(_, path, name)| format!("{path}/{name}")[1..] == *wanted)
}

/// Returns true if the file has arrays with two extents outside the group `name`.
pub(crate) fn has_arrays_beside(file: &File, name: &str) -> bool {
    arrays(file).iter().any(|(_, path, _)| path != name && !(path.is_empty() && name == "/"))
}

fn named(file: &File, name: &str) -> Diagnosed<Numbers> {
    let parts: Vec<&str> = name.split('/').filter(|part| !part.is_empty()).collect();
    let Some((last, groups)) = parts.split_last() else { return search(file) };
    let mut group = root(file)?;
    let mut path = String::new();
    for part in groups {
        let missing = || {
            vec![layout(format!("`{part}` of `{name}` is not a group of the file")).with_help(listing(file))]
        };
        if !Members::of(&group).is_here(part) {
            return Err(missing());
        }
        group = group.group(part).map_err(|_| missing())?;
        path = format!("{path}/{part}");
    }
    let members = Members::of(&group);
    if members.link(last).is_none() {
        return Err(vec![layout(format!("dataset `{name}` is not in the file")).with_help(listing(file))]);
    }
    Numbers::open(&group, &members, &path, last)
}

fn search(file: &File) -> Diagnosed<Numbers> {
    let mut found = arrays(file);
    match (found.pop(), found.is_empty()) {
        (Some((group, path, name)), true) => Numbers::open(&group, &Members::of(&group), &path, &name),
        (None, _) => Err(vec![layout("file holds no array with two extents".into()).with_help(HELP)]),
        (Some(_), false) => {
            let message =
                format!("file holds {} arrays with two extents; which has the shapes?", found.len() + 1);
            Err(vec![layout(message).with_help(listing(file))])
        }
    }
}

const HELP: &str = "store the shapes as a dataset with one row for every matrix row";

fn listing(file: &File) -> String {
    let found = arrays(file);
    if found.is_empty() {
        return HELP.to_owned();
    }
    let names: Vec<String> = found.iter().take(8).map(|(_, path, name)| format!("{path}/{name}")).collect();
    let more = if found.len() > names.len() { ", ..." } else { "" };
    format!("name the dataset as FILE.h5:/dataset; the file has {}{more}", names.join(", "))
}

/// Returns all datasets with two extents, breadth first: group, path of the group, and name.
fn arrays(file: &File) -> Vec<(Group, String, String)> {
    let mut found = Vec::new();
    let mut level: Vec<(String, Group)> = root(file).map(|root| (String::new(), root)).into_iter().collect();
    let mut visited = 0;
    for _ in 0..MAX_DEPTH {
        let mut next = Vec::new();
        for (path, group) in level {
            let members = Members::of(&group);
            for child in members.hard_links().filter(|child| !child.starts_with('#')) {
                visited += 1;
                if visited > MAX_GROUPS {
                    return found;
                }
                if let Ok(inner) = group.group(child) {
                    next.push((format!("{path}/{child}"), inner));
                } else if group.dataset(child).is_ok_and(|dataset| dataset.ndim() == 2) {
                    found.push((group.clone(), path.clone(), child.to_owned()));
                }
            }
        }
        level = next;
    }
    found
}

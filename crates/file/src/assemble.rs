//! Assembles the parts of a body from the values of a file, row by row of the table.

use super::draft::Draft;
use super::item::{EntrySet, Extent, Item, Membership, Origin, Per, SchemaGroup};
use super::names::place;
use super::scan::{Scan, key};
use super::schema::TABLE;
use super::value::ReadValue;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::Parts;

/// Assembles the parts of a body. Returns `None` if texts or counts are invalid, or if entries are missing that belong
/// together; the reason is then among the problems of `scan`.
///
/// `scan` must have no problems before: every required entry then exists, of its kind and with its shape.
pub(super) fn assemble(scan: &mut Scan, units: UnitSystem) -> Option<Parts> {
    check_together(scan);
    let groups = scan.held()?;
    let mut draft = Draft::new(units, scan.storage, groups);
    draft.n_coordinates = Some(scan.sizes.of(Extent::Coordinates)).filter(|size| *size > 0);
    for group in TABLE {
        for (at, (name, path)) in instances(scan, group).into_iter().enumerate() {
            if let Err(problem) = draft.begin(group.per, at, &name) {
                scan.add(format!("{path}: {problem}"));
            }
            group.entries().for_each(|item| put(scan, &mut draft, &path, item));
        }
    }
    let mut problems = Vec::new();
    let parts = draft.finish(&mut problems);
    problems.into_iter().for_each(|problem| scan.add(problem));
    scan.problems.is_empty().then_some(parts)
}

/// Returns names and paths of the instances of a group.
fn instances(scan: &Scan, group: &SchemaGroup) -> Vec<(String, String)> {
    match group.per {
        Per::Body => vec![(String::new(), group.path.to_owned())],
        _ => {
            let named = scan.instances(group.parent()).into_iter();
            named.map(|(name, link)| (name, place(group, Some(&link)))).collect()
        }
    }
}

/// Moves the value of an entry from the scan into the draft.
fn put(scan: &mut Scan, draft: &mut Draft, path: &str, item: &Item) {
    let Some(put) = item.put else { return };
    let name = key(path, item);
    let value = match item.origin {
        // The value is kept: it is compared with that of the finished body.
        Origin::Derived(..) => scan.values.get(&name).cloned(),
        _ => scan.values.remove(&name),
    };
    let Some(value) = value else { return };
    let columns = item.shape().and_then(|shape| shape.last()).map_or(0, |extent| scan.sizes.of(*extent));
    if let Err(problem) = put(draft, ReadValue { value, columns }) {
        scan.add(format!("{name}: {problem}"));
    }
}

/// Entries of a file that must occur together.
struct FoundSet {
    set: &'static EntrySet,
    /// Keys of the entries; true for each that the file holds.
    entries: Vec<(String, bool)>,
    /// True if an entry is missing that the set requires.
    is_incomplete: bool,
}

/// Adds a problem for every set of entries of which the file holds some but not all required ones.
fn check_together(scan: &mut Scan) {
    let mut sets: Vec<FoundSet> = Vec::new();
    for group in TABLE {
        for item in group.entries() {
            let Some(Membership { set, required }) = item.together else { continue };
            let name = if group.per == Per::Body { key(group.path, item) } else { group.parent().to_owned() };
            let there = scan.values.contains_key(&name) || !scan.instances(&name).is_empty();
            let at = sets.iter().position(|known| std::ptr::eq(known.set, set)).unwrap_or_else(|| {
                sets.push(FoundSet { set, entries: Vec::new(), is_incomplete: false });
                sets.len() - 1
            });
            sets[at].is_incomplete |= required && !there;
            sets[at].entries.push((name, there));
        }
    }
    for FoundSet { set, entries, .. } in sets.into_iter().filter(|set| set.is_incomplete) {
        if entries.iter().any(|(_, there)| *there) {
            scan.add((set.problem)(&entries));
        }
    }
}

//! Reads a body file: format, entries, assembly, and checks of derived entries and digests.

use super::draft::Draft;
use super::item::{
    DERIVED_TOLERANCE, EntrySet, Extent, Item, Membership, Need, Origin, SHORT_TOLERANCE, SchemaGroup,
};
use super::per::Per;
use super::scan::{Scan, index, key};
use super::schema::{FORMAT, TABLE};
use super::value::{ReadValue, Value, View};
use super::version::MAJOR;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file;
use flexbody_base::hdf5_file::open_with_checked_texts;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{FlexBody, Parts};
use hdf5_metno as hdf5;
use std::path::Path;

/// Reads a body. Every number is bit for bit the written one.
///
/// # Errors
/// [`FileUnreadable`](Code::FileUnreadable) if the file cannot be read; [`BodyUnreadable`](Code::BodyUnreadable) if it
/// is not HDF5, or not of this program; [`BodyVersion`](Code::BodyVersion) for a newer format;
/// [`BodySchema`](Code::BodySchema) for entries that are missing, of the wrong shape or not finite, one diagnostic per
/// entry; [`BodyIdentity`](Code::BodyIdentity) for entries that contradict each other;
/// [`BodyChanged`](Code::BodyChanged) if the content has other digests.
pub fn read(path: impl AsRef<Path>) -> Result<FlexBody> {
    read_with_notes(path).map(|(body, _)| body)
}

/// Reads a body, and returns the notes about a valid file: [`BodyWithoutDigest`](Code::BodyWithoutDigest) for a file of
/// an older format.
///
/// # Errors
/// The errors of [`read`].
pub fn read_with_notes(path: impl AsRef<Path>) -> Result<(FlexBody, Vec<Diagnostic>)> {
    let examined = examine(path.as_ref())?;
    match examined.body {
        Some(body) if examined.problems.is_empty() => Ok((body, examined.notes)),
        _ => Err(Error::new(examined.problems)),
    }
}

/// Content of a file, and the problems found in it.
struct Examined {
    body: Option<FlexBody>,
    problems: Vec<Diagnostic>,
    notes: Vec<Diagnostic>,
}

/// Returns every violation of the schema by the file at `path`; empty if [`read`] would succeed.
pub fn validate(path: impl AsRef<Path>) -> Vec<Diagnostic> {
    examine(path.as_ref()).map_or_else(Error::into_diagnostics, |examined| examined.problems)
}

fn examine(path: &Path) -> Result<Examined> {
    let (file, bytes) = open_checked(path)?;
    let mut scan = Scan::new(&file, path, bytes);
    let units = scan.units().cloned().filter(|_| scan.problems.is_empty());
    let Some(parts) = units.and_then(|units| assemble(&mut scan, units)) else {
        return Ok(Examined { body: None, problems: scan.problems, notes: Vec::new() });
    };
    match FlexBody::new(parts) {
        Ok(body) => {
            check_derived(&mut scan, body.parts());
            // Contradictions of the format or of the entries are reported instead: they are more specific than a
            // changed digest.
            if scan.problems.is_empty() {
                scan.check_digests(&file);
            }
            let note = scan.stated_digests().is_none().then(|| without_digest(&scan).in_file(path));
            Ok(Examined { body: Some(body), problems: scan.problems, notes: note.into_iter().collect() })
        }
        Err(e) => {
            let problems = e.into_diagnostics().into_iter().map(|d| d.in_file(path)).collect();
            Ok(Examined { body: None, problems, notes: Vec::new() })
        }
    }
}

fn without_digest(scan: &Scan) -> Diagnostic {
    let message =
        format!("the file has no digest: it was written in format version {MAJOR}.{}", scan.minor());
    Diagnostic::new(Code::BodyWithoutDigest, message)
}

/// Opens a file of this program with a format that this version can read. Returns also its size in bytes.
pub(super) fn open_checked(path: &Path) -> Result<(hdf5::File, u64)> {
    let (file, bytes) = open_with_checked_texts(path, "flexible body", Code::BodyUnreadable)?;
    check_format(&file, path)?;
    Ok((file, bytes))
}

fn check_format(file: &hdf5::File, path: &Path) -> Result<()> {
    let fail = |code, message: String| Err(Diagnostic::new(code, message).in_file(path).into());
    match hdf5_file::text(file, "format") {
        Ok(Some(format)) if format == FORMAT => {}
        Ok(Some(format)) => {
            return fail(
                Code::BodyUnreadable,
                format!("attribute `format` is {format:?}, expected `{FORMAT}`"),
            );
        }
        Ok(None) => {
            return fail(
                Code::BodyUnreadable,
                format!("HDF5 file without the attribute `format` = `{FORMAT}`"),
            );
        }
        Err(problem) => return fail(Code::BodyUnreadable, format!("attribute `format`: {problem}")),
    }
    match hdf5_file::int(file, "format_major") {
        Ok(Some(major)) if major > MAJOR => {
            let writer = match hdf5_file::text(file, "generator") {
                Ok(Some(generator)) => generator,
                _ => "an unnamed program".to_owned(),
            };
            let help = format!("read it with {writer} or newer");
            let message =
                format!("format version {major}, written by {writer}; this version reads up to {MAJOR}");
            Err(Diagnostic::new(Code::BodyVersion, message).in_file(path).with_help(help).into())
        }
        // Other values of the version are reported with the other entries.
        _ => Ok(()),
    }
}

// Assembles the parts of a body from the values of a file, row by row of the table.

/// Assembles the parts of a body. Returns `None` if texts or counts are invalid, or if entries are missing that belong
/// together; the reason is then among the problems of `scan`.
///
/// `scan` must have no problems before: every required entry then exists, of its kind and with its shape.
fn assemble(scan: &mut Scan, units: UnitSystem) -> Option<Parts> {
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
            named.map(|(name, link)| (name, group.place(Some(&link)))).collect()
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
            let Some(Membership { set, need }) = item.together else { continue };
            let name = if group.per == Per::Body { key(group.path, item) } else { group.parent().to_owned() };
            let there = scan.values.contains_key(&name) || !scan.instances(&name).is_empty();
            let at = sets.iter().position(|known| std::ptr::eq(known.set, set)).unwrap_or_else(|| {
                sets.push(FoundSet { set, entries: Vec::new(), is_incomplete: false });
                sets.len() - 1
            });
            sets[at].is_incomplete |= need == Need::Always && !there;
            sets[at].entries.push((name, there));
        }
    }
    for FoundSet { set, entries, .. } in sets.into_iter().filter(|set| set.is_incomplete) {
        if entries.iter().any(|(_, there)| *there) {
            scan.add((set.problem)(&entries));
        }
    }
}

// Comparison of derived entries of a file with the values that follow from the body.

/// Adds a problem for every derived entry of the scanned file that contradicts `body`, which was assembled from the
/// primary entries.
fn check_derived(scan: &mut Scan, body: &Parts) {
    for group in TABLE {
        let links: Vec<Option<String>> = match group.per {
            Per::Body => vec![None],
            _ => scan.instances(group.parent()).into_iter().map(|(_, link)| Some(link)).collect(),
        };
        for ((_, view), link) in group.instances(body).into_iter().zip(links) {
            check_group(scan, group, &group.place(link.as_deref()), &view);
        }
    }
}

fn check_group(scan: &mut Scan, group: &SchemaGroup, path: &str, view: &View<'_>) {
    for item in group.entries() {
        let Origin::Derived(get, scale) = item.origin else { continue };
        let name = key(path, item);
        let (Some(found), Some(expected)) = (scan.values.remove(&name), get(view)) else { continue };
        match (&found, &expected) {
            (Value::Floats(found), Value::Floats(expected)) => {
                let largest = match group.entries().find(|i| i.name == scale).and_then(|i| i.value(view)) {
                    Some(Value::Floats(values)) => values.iter().fold(0.0f64, |m, v| m.max(v.abs())),
                    _ => 0.0,
                };
                let tolerance =
                    if item.is_short(view.body.storage) { SHORT_TOLERANCE } else { DERIVED_TOLERANCE };
                let differs = |(a, b): (&f64, &f64)| (a - b).abs() > tolerance * largest;
                if let Some(i) = found.iter().zip(expected).position(differs) {
                    let at = index(i, &item.dims(view));
                    let (found, expected) = (found[i], expected[i]);
                    scan.add_as(
                        Code::BodyIdentity,
                        format!("{name}: found {found:e} at {at}, but the primary data give {expected:e}"),
                    );
                }
            }
            (Value::Int(a), Value::Int(b)) if a != b => scan.add(format!("{name}: expected {b}, found {a}")),
            (Value::Text(a), Value::Text(b)) if a != b => {
                scan.add(format!("{name}: expected `{b}`, found {a:?}"));
            }
            _ => {}
        }
    }
}

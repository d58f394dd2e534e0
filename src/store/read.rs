//! Reads a body file: format, entries, assembly, and the entries that follow from others.

use super::assemble::assemble;
use super::derived::check_derived;
use super::scan::Scan;
use super::schema::{FORMAT, MAJOR};
use super::{hdf5_value, heap};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::flex_body::FlexBody;
use hdf5::file::Sizeof;
use hdf5_metno as hdf5;
use std::path::Path;

/// Reads a body; every number is bit for bit the one that was written.
///
/// # Errors
/// [`FileUnreadable`](Code::FileUnreadable); [`BodyUnreadable`](Code::BodyUnreadable): not HDF5, or not of this
/// program; [`BodyVersion`](Code::BodyVersion): a newer format; [`BodySchema`](Code::BodySchema): missing, mis-shaped
/// or not finite, one diagnostic per entry; [`BodyIdentity`](Code::BodyIdentity): entries that contradict each other.
pub fn read(path: impl AsRef<Path>) -> Result<FlexBody> {
    let (body, problems) = examine(path.as_ref())?;
    match body {
        Some(body) if problems.is_empty() => Ok(body),
        _ => Err(Error::new(problems)),
    }
}

/// Everything that is wrong with the file at `path` by its schema; empty when [`read`] would succeed.
pub fn validate(path: impl AsRef<Path>) -> Vec<Diagnostic> {
    examine(path.as_ref()).map_or_else(Error::into_diagnostics, |(_, problems)| problems)
}

fn examine(path: &Path) -> Result<(Option<FlexBody>, Vec<Diagnostic>)> {
    let (file, bytes) = open_checked(path)?;
    let mut scan = Scan::new(&file, path, bytes);
    let units = scan.units().cloned().filter(|_| scan.problems.is_empty());
    let Some(parts) = units.and_then(|units| assemble(&mut scan, units)) else {
        return Ok((None, scan.problems));
    };
    match FlexBody::new(parts) {
        Ok(body) => {
            check_derived(&mut scan, body.parts());
            Ok((Some(body), scan.problems))
        }
        Err(e) => Ok((None, e.into_diagnostics().into_iter().map(|d| d.in_file(path)).collect())),
    }
}

/// Opens a file of this program and of a format that this version knows; also gives its size in bytes.
pub(super) fn open_checked(path: &Path) -> Result<(hdf5::File, u64)> {
    let (file, bytes) = open_sound(path, "flexible body", Code::BodyUnreadable)?;
    check_format(&file, path)?;
    Ok((file, bytes))
}

/// Opens an HDF5 file whose texts can be read without harm; `what` it should be, and the code when it is not HDF5.
pub(super) fn open_sound(path: &Path, what: &str, foreign: Code) -> Result<(hdf5::File, u64)> {
    let unreadable = |code, why: String| {
        Error::from(Diagnostic::new(code, format!("cannot read the {what}: {why}")).in_file(path))
    };
    let meta = std::fs::metadata(path).map_err(|e| unreadable(Code::FileUnreadable, e.to_string()))?;
    if !meta.is_file() {
        return Err(unreadable(Code::FileUnreadable, "it is not a regular file".to_owned()));
    }
    let broken_heap = std::fs::File::open(path).and_then(|mut file| heap::first_broken(&mut file));
    if let Some(position) = broken_heap.map_err(|e| unreadable(Code::FileUnreadable, e.to_string()))? {
        let why = format!("the text heap at byte {position} is damaged");
        return Err(unreadable(foreign, why));
    }
    // Without a lock: no file of this program changes once it has its name, and some file systems know no locks.
    let opened = hdf5::File::with_options().with_fapl(|p| p.file_locking(false)).open(path);
    let file = opened.map_err(|e| unreadable(foreign, e.to_string()))?;
    // The check of the heaps knows 8-byte sizes only; nothing else is in use.
    let sizes = file.create_plist().and_then(|p| p.get_sizes());
    if !sizes.is_ok_and(|s| (s.sizeof_addr, s.sizeof_size) == (Sizeof::Bytes8, Sizeof::Bytes8)) {
        let why = "its addresses or sizes do not have 8 bytes".to_owned();
        return Err(unreadable(foreign, why));
    }
    Ok((file, meta.len()))
}

fn check_format(file: &hdf5::File, path: &Path) -> Result<()> {
    let fail = |code, message: String| Err(Diagnostic::new(code, message).in_file(path).into());
    match hdf5_value::text(file, "format") {
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
    match hdf5_value::int(file, "format_major") {
        Ok(Some(major)) if major > MAJOR => {
            let writer = match hdf5_value::text(file, "generator") {
                Ok(Some(generator)) => generator,
                _ => "an unnamed program".to_owned(),
            };
            let help = format!("read it with {writer} or newer");
            let message =
                format!("format version {major}, written by {writer}; this version reads up to {MAJOR}");
            Err(Diagnostic::new(Code::BodyVersion, message).in_file(path).with_help(help).into())
        }
        // Anything else that is wrong with it is found with the other entries.
        _ => Ok(()),
    }
}

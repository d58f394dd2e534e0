//! Reads a body file: format, entries, assembly, and checks of derived entries and digests.

use super::assemble::assemble;
use super::derived::check_derived;
use super::scan::Scan;
use super::schema::{FORMAT, MAJOR};
use super::value::Value;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file::{self as hdf5_file, open_with_checked_texts};
use flexbody_body::flex_body::FlexBody;
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
    let minor = match scan.values.get("/@format_minor") {
        Some(Value::Int(minor)) => *minor,
        _ => 0,
    };
    let message = format!("the file has no digest: it was written in format version {MAJOR}.{minor}");
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

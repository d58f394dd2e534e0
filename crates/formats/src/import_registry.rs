//! Registry of the formats of other programs whose bodies are read.

use super::import::{Audit, ImportFormat, Imported, accept_imported, audit, import_body};
#[cfg(feature = "hdf5")]
use super::{exudyn, mbsim};
use super::{mbdyn, sid};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::Storage;
use flexbody_body::invariants::FrameChoice;
use std::path::Path;

/// All import formats in the order in which files are recognised.
pub const IMPORT_FORMATS: &[&dyn ImportFormat] = &[
    &sid::read::SidFile,
    &mbdyn::read::Mbdyn,
    #[cfg(feature = "hdf5")]
    &mbsim::read::Mbsim,
    #[cfg(feature = "hdf5")]
    &exudyn::read::Exudyn,
];

/// Returns the import format with this name.
///
/// # Errors
/// [`Usage`](Code::Usage) for an unknown name, with the known names.
pub fn find_import_format(name: &str) -> Result<&'static dyn ImportFormat> {
    IMPORT_FORMATS.iter().copied().find(|format| format.name() == name).ok_or_else(|| {
        let names: Vec<&str> = IMPORT_FORMATS.iter().map(|format| format.name()).collect();
        let message = format!("`{name}` is not an import format");
        Diagnostic::new(Code::Usage, message).with_help(names.join(", ")).into()
    })
}

/// Reads a body in a file of another program and checks it: in the format with the given name, or in the format that its
/// content shows.
///
/// # Errors
/// [`Usage`](Code::Usage) for an unknown name; [`ForeignUnreadable`](Code::ForeignUnreadable) for a file that cannot be
/// read; the errors of [`InputFile::open`].
pub fn audit_file(path: &Path, format: Option<&str>, tolerance: f64) -> Result<Audit> {
    let named = format.map(find_import_format).transpose()?;
    let file = InputFile::open(path)?;
    let format = named.map_or_else(|| recognise(&file), Ok)?;
    Ok(audit(&format.read(&file)?, tolerance))
}

/// Reads a body in a file of another program as a flexible body, in the stated units (m, kg and s for `None`) and with
/// the floats of `storage`.
///
/// # Errors
/// [`Usage`](Code::Usage) for an unknown format; the errors of [`ImportFormat::read`], [`import_body`] and
/// [`accept_imported`].
pub fn import_file(
    path: &Path,
    format: &str,
    units: Option<UnitSystem>,
    frame: Option<&FrameChoice>,
    storage: Storage,
) -> Result<Imported> {
    let format = find_import_format(format)?;
    let file = InputFile::open(path)?;
    let read = format.read(&file);
    file.refuse_changed()?;
    let source = SourceFile::new("body", path, file.sha256()?);
    let imported = import_body(&read?, source, units.unwrap_or_default(), frame);
    let mut imported = imported.map_err(|error| error.in_file(path))?;
    if storage == Storage::F32 {
        imported.body = imported.body.rounded_to_f32()?;
    }
    accept_imported(&imported).map_err(|error| error.in_file(path))?;
    Ok(imported)
}

/// Returns the format of a file.
///
/// # Errors
/// [`ForeignUnreadable`](Code::ForeignUnreadable) if no format recognises the file.
pub fn recognise(file: &InputFile) -> Result<&'static dyn ImportFormat> {
    IMPORT_FORMATS.iter().copied().find(|format| format.recognises(file)).ok_or_else(|| {
        let names: Vec<&str> = IMPORT_FORMATS.iter().map(|format| format.name()).collect();
        let message = format!("the format of the file is not recognised: it is none of {}", names.join(", "));
        Diagnostic::new(Code::ForeignUnreadable, message).in_file(file.path()).into()
    })
}

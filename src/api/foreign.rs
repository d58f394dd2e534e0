//! Bodies in files of other programs.

use super::{Conversion, FlexBody, FrameChoice};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::Storage;
use flexbody_formats::{IMPORT_FORMATS, audit_file, import, import_file};
use flexbody_input::parse_units;
use flexbody_report::{audit_json, audit_text};
use std::path::Path;

/// Audit of a file of another program: dialect, identities, digits, units.
#[derive(Debug, Clone)]
pub struct Audit {
    inner: import::Audit,
    file: String,
}

impl Audit {
    /// Tolerance of the identities that `flexbody audit` takes.
    pub const TOLERANCE: f64 = 1e-6;

    /// Reads and checks a file of a flexible body, like `flexbody audit`: in the format with the given name, or in the
    /// one that its content shows. Identities pass up to `tolerance`, relative to the size of their terms.
    ///
    /// # Errors
    /// FB801 for an unknown format, FB101 for a file that cannot be opened, FB730 for one that cannot be read.
    pub fn of(path: impl AsRef<Path>, format: Option<&str>, tolerance: f64) -> Result<Self> {
        let path = path.as_ref();
        let inner = audit_file(path, format, tolerance)?;
        Ok(Self { inner, file: path.display().to_string() })
    }

    /// Returns true if every check passed.
    pub fn passed(&self) -> bool {
        self.inner.passed()
    }

    /// Returns the name of the format.
    pub fn format(&self) -> &'static str {
        self.inner.format
    }

    /// Returns the dialect of the format; empty for a format with a single form.
    pub fn dialect(&self) -> &str {
        &self.inner.dialect
    }

    /// Returns the diagnostics of the failed checks.
    pub fn findings(&self) -> Vec<Diagnostic> {
        self.inner.findings()
    }

    /// Returns the report of `flexbody audit` as text.
    pub fn text(&self) -> String {
        audit_text(&self.file, &self.inner)
    }

    /// Returns the report of `flexbody audit` as JSON.
    pub fn json(&self) -> String {
        format!("{:#}", audit_json(&self.file, &self.inner))
    }
}

impl FlexBody {
    /// Reads a body in a file of another program, like `flexbody convert --from`.
    ///
    /// * `units`: units of length, mass and time as in `mm,t,s`; m, kg and s for `None`.
    /// * `frame`: body frame; `None` for that of the file.
    ///
    /// # Errors
    /// FB801 for an unknown format, FB202 for an unknown unit, FB730, FB731 and FB749 for a file that cannot be read, does not
    /// determine a body, or contradicts itself.
    pub fn import(
        path: impl AsRef<Path>,
        format: &str,
        units: Option<&str>,
        frame: Option<&FrameChoice>,
    ) -> Result<Conversion> {
        let units = units.map(parse_units).transpose()?;
        let imported = import_file(path.as_ref(), format, units, frame, Storage::F64)?;
        Ok(Conversion { body: Self(imported.body), diagnostics: imported.diagnostics })
    }

    /// Returns the names of the formats of [`FlexBody::import`] and [`Audit::of`].
    pub fn import_formats() -> Vec<&'static str> {
        IMPORT_FORMATS.iter().map(|format| format.name()).collect()
    }
}

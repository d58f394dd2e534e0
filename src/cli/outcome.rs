//! Outcome of a command.

use super::arguments::Printing;
use flexbody_base::diagnostic::{Code, Diagnostic, Severity};
use flexbody_base::error::{Error, Result};
use flexbody_base::output::OutputSlot;
use flexbody_base::read_files::{FileIdentity, refuse_read, replaces};
use flexbody_report::Format;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Outcome of a command: text for stdout, its content as JSON, warnings and notes, and whether its checks passed.
pub(super) struct Outcome {
    pub text: String,
    /// Member `results` of the object that `--json` prints.
    pub json: String,
    pub diagnostics: Vec<Diagnostic>,
    pub passed: bool,
}

/// Returns the warnings among diagnostics.
pub(super) fn warnings(diagnostics: &[Diagnostic]) -> impl Iterator<Item = &Diagnostic> {
    diagnostics.iter().filter(|diagnostic| diagnostic.severity() == Severity::Warning)
}

/// Ends a command before it writes, if `--deny-warnings` is set and there is a warning.
///
/// # Errors
/// All `diagnostics`, with [`WarningsDenied`](Code::WarningsDenied).
pub(super) fn refuse_warnings(printing: Printing, diagnostics: &[Diagnostic]) -> Result<()> {
    let mut codes: Vec<&str> = warnings(diagnostics).map(|warning| warning.code().id()).collect();
    if !printing.deny_warnings || codes.is_empty() {
        return Ok(());
    }
    codes.dedup();
    let message = format!("no file was written because of --deny-warnings and {}", codes.join(", "));
    Err(Error::from(Diagnostic::new(Code::WarningsDenied, message)).after(diagnostics.to_vec()))
}

// Places of outputs: each is reserved before the work, and appears after it.

/// Output files of one body.
pub(super) struct BodyOutputs {
    pub body: PathBuf,
    pub reports: Vec<PathBuf>,
}

/// Reserved output files of one body.
pub(super) struct Reserved {
    pub body: OutputSlot,
    pub reports: Vec<OutputSlot>,
}

impl BodyOutputs {
    /// Returns the outputs of a body; of one of several bodies, with its number in every name.
    pub(super) fn of(body: &Path, reports: &[PathBuf], number: Option<usize>) -> Self {
        let place = |path: &Path| number.map_or_else(|| path.to_owned(), |number| marked(path, number));
        Self { body: place(body), reports: reports.iter().map(|path| place(path)).collect() }
    }

    /// Returns all files.
    pub(super) fn all(&self) -> impl Iterator<Item = &PathBuf> {
        std::iter::once(&self.body).chain(&self.reports)
    }

    pub(super) fn reserve(&self) -> Result<Reserved> {
        Ok(Reserved {
            body: flexbody_file::prepare_output(&self.body)?,
            reports: self.reports.iter().map(OutputSlot::prepare).collect::<Result<_>>()?,
        })
    }
}

/// Writes the temporary file of a slot piece by piece.
///
/// # Errors
/// FB104 and FB602 if it cannot be written.
pub(super) fn fill_by(
    slot: &OutputSlot,
    write: impl Fn(&mut BufWriter<File>) -> std::io::Result<()>,
) -> Result<()> {
    let all = || {
        let file = OpenOptions::new().write(true).truncate(true).open(slot.temporary())?;
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.flush()
    };
    all().map_err(|error| slot.failure(&error))
}

/// Returns the size of the content of a slot in bytes; zero if it is not known.
pub(super) fn size_of(slot: &OutputSlot) -> u64 {
    std::fs::metadata(slot.temporary()).map_or(0, |file| file.len())
}

/// Returns the format of a report by its file name.
pub(super) fn format_of(path: &Path) -> Result<Format> {
    Format::from_path(path).ok_or_else(|| {
        let message = format!("report {} has no known extension", path.display());
        Diagnostic::new(Code::Usage, message).with_help("give it the extension .html, .json or .txt").into()
    })
}

/// Refuses an output that would replace an input or another output.
pub(super) fn refuse_replacing<'i, 'o>(
    inputs: impl Iterator<Item = &'i PathBuf>,
    outputs: impl Iterator<Item = &'o PathBuf>,
) -> Result<()> {
    let mut taken: Vec<FileIdentity> = inputs.map(|path| FileIdentity::of(path)).collect();
    for output in outputs {
        let path = FileIdentity::of(output);
        if taken.iter().any(|other| other.is_same(&path)) {
            return Err(replaces(output).into());
        }
        taken.push(path);
    }
    Ok(())
}

/// Refuses an output that would replace a file that was read, including files that a deck includes or assigns.
pub(super) fn refuse_replacing_read<'o>(mut outputs: impl Iterator<Item = &'o PathBuf>) -> Result<()> {
    outputs.try_for_each(|output| refuse_read(output))
}

/// Returns the path with a number or a name before the extension: `rotor-2.flex.h5` from `rotor.flex.h5`,
/// `report-2.html` from `report.html`.
pub(super) fn marked(path: &Path, mark: impl std::fmt::Display) -> PathBuf {
    let (Some(stem), extension) = (path.file_stem(), path.extension()) else { return path.to_path_buf() };
    let inner = Path::new(stem);
    let double = inner.extension().filter(|inner| *inner == "flex");
    let stem = double.and(inner.file_stem()).unwrap_or(stem);
    let mut name = stem.to_os_string();
    name.push(format!("-{mark}"));
    for extension in double.into_iter().chain(extension) {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_stands_before_the_extension() {
        for (path, with_number) in [
            ("a/rotor.flex.h5", "a/rotor-12.flex.h5"),
            ("rotor.h5", "rotor-12.h5"),
            ("v1.2/rotor.v3.flex.h5", "v1.2/rotor.v3-12.flex.h5"),
            ("report.html", "report-12.html"),
            ("rotor", "rotor-12"),
            (".flex.h5", ".flex-12.h5"),
            ("..", ".."),
        ] {
            assert_eq!(marked(Path::new(path), 12), Path::new(with_number), "{path}");
        }
    }
}

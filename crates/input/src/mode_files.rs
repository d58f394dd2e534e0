//! Modes as FE programs write them, by nodes and with their eigenvalues. Each format has one file and is recognised by
//! its content.

mod ansys_list;
mod frd;
mod mode_table;
mod op2;
mod punch;

use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_model::RawModes;
use mode_table::ModeTable;

/// Format of files of modes.
struct Format {
    recognises: fn(&[u8]) -> bool,
    read: fn(&InputFile) -> Diagnosed<ModeTable>,
}

/// Formats of files of modes. The first that recognises the beginning of a file reads it.
const FORMATS: &[Format] = &[
    Format { recognises: frd::recognises, read: frd::read },
    Format { recognises: op2::recognises, read: op2::read },
    Format { recognises: punch::recognises, read: punch::read },
    Format { recognises: ansys_list::recognises, read: ansys_list::read },
];

/// Number of bytes by which formats are recognised.
const HEAD: usize = 4096;

/// Reads the modes of a file; returns `None` for a file of another format. `role` is the role of the file in the
/// provenance.
///
/// # Errors
/// FB128 for a file that cannot be read, FB306 for values that are not finite.
pub(super) fn read_modes(file: &InputFile, role: &str) -> Option<Diagnosed<RawModes>> {
    let bytes = file.bytes();
    let head = &bytes[..bytes.len().min(HEAD)];
    let format = FORMATS.iter().find(|format| (format.recognises)(head))?;
    if let Err(diagnostic) = file.load() {
        return Some(Err(vec![diagnostic]));
    }
    let modes = |table: ModeTable| {
        let sha256 = file.sha256().map_err(|diagnostic| vec![diagnostic])?;
        table.into_modes(file, SourceFile::new(role, file.path(), sha256))
    };
    Some((format.read)(file).and_then(modes))
}

/// Returns true when a file begins like a punch file of Nastran with results.
pub(super) fn is_punch(head: &[u8]) -> bool {
    punch::recognises(head)
}

#[cfg(test)]
mod tests {
    use super::{FORMATS, HEAD};
    use std::path::Path;

    /// The fuzz test of modes reads these files.
    #[test]
    fn every_format_has_a_fixture() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/small/modes");
        let read = |entry: std::io::Result<std::fs::DirEntry>| std::fs::read(entry.expect("an entry").path());
        let files: Vec<Vec<u8>> =
            std::fs::read_dir(folder).expect("fixtures").map(|entry| read(entry).expect("a file")).collect();
        for (at, format) in FORMATS.iter().enumerate() {
            let known = |bytes: &Vec<u8>| (format.recognises)(&bytes[..bytes.len().min(HEAD)]);
            assert!(files.iter().any(known), "format {at} of modes has no fixture");
        }
    }
}

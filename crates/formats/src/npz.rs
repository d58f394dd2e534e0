//! NumPy: the entries of the flex-body file as an `.npz` archive.
//!
//! Layout of the members: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>, version
//! 1.0.

use super::export::arrays::{ALL_ENTRIES, Document};
use super::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::{Numbers, contents};
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, System, ZipWriter};

/// Export format of NumPy.
pub(crate) struct Npz;

impl ExportFormat for Npz {
    fn name(&self) -> &'static str {
        "npz"
    }

    fn reader(&self) -> &'static str {
        "NumPy: the entries of the flex-body file"
    }

    fn checklist(&self, _: &FlexBody, _: &ExportOptions) -> ExportChecklist {
        ALL_ENTRIES
    }

    fn write(&self, body: &FlexBody, _: &ExportOptions) -> Result<Exported> {
        let (attributes, arrays) = contents(body);
        let metadata = serde_json::to_string(&Document::new(&attributes, &arrays, false))
            .expect("texts and finite numbers are valid JSON");
        let mut members = vec![("metadata", text(&metadata))];
        members.extend(arrays.iter().map(|array| {
            let member = match &array.values {
                Numbers::Floats(values) => npy("<f8", &array.shape, values.iter().map(|v| v.to_le_bytes())),
                Numbers::Ints(values) => npy("<i8", &array.shape, values.iter().map(|v| v.to_le_bytes())),
            };
            (array.path.as_str(), member)
        }));
        let file = archive(members).expect("memory takes every byte, and no two paths are the same");
        Ok(Exported::single(file))
    }
}

/// Returns an archive of uncompressed members: compression reduces shapes by 5 to 20 % only (`store`), and
/// NumPy maps uncompressed members into memory.
pub(crate) fn archive(members: Vec<(&str, Vec<u8>)>) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        // Neither clock nor platform is recorded, so that equal bodies give equal bytes.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .system(System::Unix)
            .large_file(u32::try_from(bytes.len()).is_err());
        archive.start_file(format!("{name}.npy"), options)?;
        archive.write_all(&bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// Returns an array in row-major order as a member.
pub(crate) fn npy<const N: usize>(
    kind: &str,
    shape: &[usize],
    values: impl Iterator<Item = [u8; N]>,
) -> Vec<u8> {
    let extents: String = shape.iter().map(|extent| format!("{extent}, ")).collect();
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({extents}), }}");
    // The header is padded so that the numbers begin at a multiple of 64.
    let width = (PREFIX + header.len() + 1).next_multiple_of(64) - PREFIX - 1;
    let header = format!("{header:<width$}\n");
    let length = u16::try_from(header.len()).expect("a few extents");
    let mut member = b"\x93NUMPY\x01\x00".to_vec();
    member.extend(length.to_le_bytes());
    member.extend(header.into_bytes());
    member.extend(values.flatten());
    member
}

/// Length of magic, version and header length in bytes.
const PREFIX: usize = 10;

/// Returns a text as an array without extents: four bytes for each character.
pub(crate) fn text(text: &str) -> Vec<u8> {
    let characters: Vec<char> = text.chars().collect();
    npy(&format!("<U{}", characters.len()), &[], characters.iter().map(|c| u32::from(*c).to_le_bytes()))
}

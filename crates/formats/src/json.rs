//! JSON: the entries of the flex-body file as one document.

use super::export::arrays::{ALL_ENTRIES, Document};
use super::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::contents;
use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;
use std::io::{self, Write};

/// Export format of JSON.
pub(crate) struct Json;

impl ExportFormat for Json {
    fn name(&self) -> &'static str {
        "json"
    }

    fn reader(&self) -> &'static str {
        "any language: the entries of the flex-body file as JSON"
    }

    fn checklist(&self, _: &FlexBody, _: &ExportOptions) -> ExportChecklist {
        ALL_ENTRIES
    }

    fn write(&self, body: &FlexBody, _: &ExportOptions) -> Result<Exported> {
        let (attributes, arrays) = contents(body);
        let mut file = Vec::new();
        Document::new(&attributes, &arrays, true)
            .serialize(&mut Serializer::with_formatter(&mut file, KeyPerLine))
            .expect("texts and finite numbers are valid JSON");
        file.push(b'\n');
        Ok(Exported::single(file))
    }
}

/// Formatter with one key per line and each array on a single line.
struct KeyPerLine;

impl Formatter for KeyPerLine {
    fn begin_object_key<W: Write + ?Sized>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        writer.write_all(if first { b"\n" } else { b",\n" })
    }

    fn end_object<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n}")
    }
}

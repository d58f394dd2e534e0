//! The formats of a report.

use super::document::Document;
use super::{Facts, body_report};
use serde::Serialize;
use std::path::Path;

/// Formats of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// For programs: `schemas/report.schema.json`; floats round-trip.
    Json,
    /// For a terminal: at most 80 columns.
    Text,
    /// For people and archives: one file, nothing loaded from elsewhere, readable without scripts.
    Html,
}

impl Format {
    /// The format that a file name asks for: `.json`, `.txt` or `.html`, in any case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "json" => Some(Self::Json),
            "txt" => Some(Self::Text),
            "html" => Some(Self::Html),
            _ => None,
        }
    }
}

/// Facts as JSON, ending with a line break.
pub(super) fn json(facts: &impl Serialize) -> String {
    let json = serde_json::to_string_pretty(facts);
    json.expect("keys are strings and numbers that are not finite become null") + "\n"
}

/// Writes the facts, ending with a line break.
pub fn render(facts: &Facts<'_>, format: Format) -> String {
    Document::render(facts, format, || body_report::document(facts))
}

//! Formats of a report.

use serde::Serialize;
use std::path::Path;

/// Format of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// JSON for programs, following `schemas/report.schema.json`; floats round-trip.
    Json,
    /// Text of at most 80 columns, for files.
    Text,
    /// Text for a terminal, on which warnings and notes are printed apart.
    Terminal,
    /// One HTML file for people and archives, without external resources, readable without scripts.
    Html,
}

impl Format {
    /// Returns the format for a file name that ends in `.json`, `.txt` or `.html`, in any case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "json" => Some(Self::Json),
            "txt" => Some(Self::Text),
            "html" => Some(Self::Html),
            _ => None,
        }
    }
}

/// Returns facts as JSON, ending with a line break.
pub(crate) fn json(facts: &impl Serialize) -> String {
    let json = serde_json::to_string_pretty(facts);
    json.expect("keys are strings and numbers that are not finite become null") + "\n"
}

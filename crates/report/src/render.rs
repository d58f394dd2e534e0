//! Formats of a report, and the JSON object that every command prints with `--json` (`schemas/output.schema.json`).

use crate::document::Document;
use crate::{Facts, body_report};
use flexbody_base::diagnostic::{Diagnostic, Severity};
use flexbody_base::error::ExitCode;
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
pub(super) fn json(facts: &impl Serialize) -> String {
    let json = serde_json::to_string_pretty(facts);
    json.expect("keys are strings and numbers that are not finite become null") + "\n"
}

/// Renders the facts in a format, ending with a line break.
pub fn render(facts: &Facts<'_>, format: Format) -> String {
    Document::render(facts, format, || body_report::document(facts))
}

// JSON object that every command prints with `--json` (`schemas/output.schema.json`).

#[derive(Serialize)]
struct Output<'a> {
    flexbody: &'static str,
    format: &'static str,
    format_major: u32,
    format_minor: u32,
    command: Option<&'a str>,
    passed: bool,
    exit_code: u8,
    errors: usize,
    warnings: usize,
    notes: usize,
    diagnostics: &'a [Diagnostic],
}

/// Returns the JSON object of `command` (`None` if the command line names none), which ends with `code`.
/// `results` are the results as JSON; `None` if the command failed before it had results.
///
/// # Panics
/// Never: the head of the object has text keys and finite numbers.
pub fn output_json(
    command: Option<&str>,
    code: ExitCode,
    diagnostics: &[Diagnostic],
    results: Option<&str>,
) -> String {
    let count = |severity| diagnostics.iter().filter(|d| d.severity() == severity).count();
    let head = Output {
        flexbody: env!("CARGO_PKG_VERSION"),
        format: "flexbody-output",
        format_major: 1,
        format_minor: 0,
        command,
        passed: code == ExitCode::Done,
        exit_code: code as u8,
        errors: count(Severity::Error),
        warnings: count(Severity::Warning),
        notes: count(Severity::Note),
        diagnostics,
    };
    let head = serde_json::to_string_pretty(&head).expect("texts and numbers");
    // Results keep the order of their keys and the digits of their numbers. Texts in JSON contain no line
    // break, so that every line break can be indented.
    let results = results.unwrap_or("null").trim_end().replace('\n', "\n  ");
    format!("{},\n  \"results\": {results}\n}}\n", head.trim_end_matches("\n}"))
}

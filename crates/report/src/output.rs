//! JSON object that every command prints with `--json` (`schemas/output.schema.json`).

use flexbody_base::diagnostic::{Diagnostic, Severity};
use flexbody_base::error::ExitCode;
use serde::Serialize;

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

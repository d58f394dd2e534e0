//! Results of checks, and diagnostics, for terminals and programs.

use crate::body::dropped_text;
use crate::document::text::{self, Screen};
use crate::document::{Block, Inline, Table, cells};
use crate::notation::numbers::significant;
use flexbody_base::diagnostic::{Diagnostic, Severity};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::IdentityCheck;
use flexbody_body::verification::Checks;
use serde_json::{Value, json};

/// Renders the checks of `body`, with a note for every group that no check covers because it was dropped.
pub fn checks_text(body: &FlexBody, checks: &Checks) -> String {
    identities_text(&checks.identities) + &dropped_text(body)
}

/// Returns the checks as the JSON of `flexbody check`.
pub fn checks_json(checks: &Checks) -> String {
    format!("{:#}", json!({ "identities": identities_json(&checks.identities) }))
}

/// Renders a table of identities with failed ones marked, and their count.
pub fn identities_text(checks: &[IdentityCheck]) -> String {
    let rows = checks.iter().map(|c| check_row(c.name, [c.value, c.limit], c.formula, c.passed)).collect();
    let failed = checks.iter().filter(|c| !c.passed).count();
    let end = match (failed, checks.len()) {
        (0, 1) => "the identity holds".to_owned(),
        (0, all) => format!("all {all} identities hold"),
        (failed, all) => format!("{failed} of {all} identities FAILED"),
    };
    text::render(&[Block::Table(check_table("identity", rows)), Block::Line(end)], Screen::default())
}

/// Returns the row of a check: name, value, limit, formula, and a mark of failure.
pub(crate) fn check_row(name: &str, [value, limit]: [f64; 2], formula: &str, passed: bool) -> Vec<Inline> {
    let mark = if passed { "" } else { "FAILED" };
    cells([name, &significant(value, 2), &significant(limit, 2), formula, mark].map(str::to_owned))
}

/// Returns the table of checks for a terminal.
pub(crate) fn check_table(kind: &str, rows: Vec<Vec<Inline>>) -> Table {
    let heads = [kind, "value", "limit", "identity", ""];
    Table::new("", heads, &[0, 3, 4], rows).in_text(|_| true)
}

/// Returns an array of objects with `name`, `formula`, `value` (null if not finite), `limit`, `passed`.
pub fn identities_json(checks: &[IdentityCheck]) -> Value {
    let object = |c: &IdentityCheck| json!({ "name": c.name, "formula": c.formula, "value": c.value, "limit": c.limit, "passed": c.passed });
    checks.iter().map(object).collect()
}

/// Returns an object with the counts `errors`, `warnings`, `notes` and the array `diagnostics`: `code`,
/// `severity`, `message`, `file`, `line`, `help`.
pub fn diagnostics_json(diagnostics: &[Diagnostic]) -> Value {
    let count = |severity| diagnostics.iter().filter(|d| d.severity() == severity).count();
    json!({
        "errors": count(Severity::Error),
        "warnings": count(Severity::Warning),
        "notes": count(Severity::Note),
        "diagnostics": diagnostics,
    })
}

//! Results of checks, and diagnostics, for terminals and programs.

use super::numbers::significant;
use flexbody_base::diagnostic::{Diagnostic, Severity};
use flexbody_body::invariants::IdentityCheck;
use serde_json::{Value, json};

/// A table of identities, failed ones marked, and the count.
pub fn identities_text(checks: &[IdentityCheck]) -> String {
    let mut text = format!("{:26} {:>10} {:>10}  what must hold\n", "identity", "value", "limit");
    for check in checks {
        let (value, limit) = (significant(check.value, 2), significant(check.limit, 2));
        let mark = if check.passed { "" } else { "  FAILED" };
        text.push_str(&format!("{:26} {value:>10} {limit:>10}  {}{mark}\n", check.name, check.formula));
    }
    let failed = checks.iter().filter(|c| !c.passed).count();
    text.push_str(&match (failed, checks.len()) {
        (0, 1) => "the identity holds\n".to_owned(),
        (0, all) => format!("all {all} identities hold\n"),
        (failed, all) => format!("{failed} of {all} identities FAILED\n"),
    });
    text
}

/// An array of objects with `name`, `formula`, `value` (null when not finite), `limit`, `passed`.
pub fn identities_json(checks: &[IdentityCheck]) -> Value {
    let object = |c: &IdentityCheck| json!({ "name": c.name, "formula": c.formula, "value": c.value, "limit": c.limit, "passed": c.passed });
    checks.iter().map(object).collect()
}

/// An object with the counts `errors`, `warnings`, `notes` and the array `diagnostics`: `code`, `severity`,
/// `message`, `file`, `line`, `help`.
pub fn diagnostics_json(diagnostics: &[Diagnostic]) -> Value {
    let count = |severity| diagnostics.iter().filter(|d| d.severity() == severity).count();
    json!({
        "errors": count(Severity::Error),
        "warnings": count(Severity::Warning),
        "notes": count(Severity::Note),
        "diagnostics": diagnostics,
    })
}

//! An audit as text and as JSON.

use super::numbers::significant;
use flexbody_base::provenance::generator;
use flexbody_formats::import::{Audit, AuditCheck};
use serde_json::{Value, json};

/// Version of the JSON: a newer major breaks readers, a newer minor only adds keys.
const VERSION: (u32, u32) = (1, 0);

/// Frequencies that are printed.
const FREQUENCIES: usize = 6;

/// What was read, every check, and the findings in plain words.
pub fn audit_text(file: &str, audit: &Audit) -> String {
    let Audit { format, dialect, name, mass, n_modes, n_frames, .. } = audit;
    let dialect = if dialect.is_empty() { String::new() } else { format!(", dialect {dialect}") };
    let called = if name.is_empty() { String::new() } else { format!(" `{name}`") };
    let mut text = format!(
        "{file}: {format}{dialect}\nbody{called}: mass {}, {n_modes} modes, {n_frames} nodes or frames\n",
        significant(*mass, 6)
    );
    let told = audit.frequencies.iter().take(FREQUENCIES).map(|f| significant(*f, 5)).collect::<Vec<_>>();
    let more = if audit.frequencies.len() > FREQUENCIES { ", ..." } else { "" };
    text.push_str(&format!("frequencies {}{more} cycles per time unit of the file\n", told.join(", ")));
    for note in &audit.notes {
        text.push_str(&format!("note: {note}\n"));
    }
    text.push_str(&format!("\n{:30} {:>10} {:>10}  what must hold\n", "check", "value", "limit"));
    for check in &audit.checks {
        let (value, limit) = (significant(check.value, 2), significant(check.limit, 2));
        let mark = if check.passed() { "" } else { "  FAILED" };
        text.push_str(&format!("{:30} {value:>10} {limit:>10}  {}{mark}\n", check.name, check.formula));
    }
    let findings = audit.findings();
    text.push_str(&match (findings.len(), audit.checks.len()) {
        (0, all) => format!("\nall {all} checks passed\n"),
        (failed, all) => format!("\n{failed} of {all} checks FAILED\n"),
    });
    for finding in findings {
        text.push_str(&format!("\n{finding}\n"));
    }
    text
}

/// The contract `schemas/audit.schema.json`.
pub fn audit_json(file: &str, audit: &Audit) -> Value {
    let check = |c: &AuditCheck| {
        json!({
            "name": c.name, "formula": c.formula, "value": c.value, "limit": c.limit,
            "passed": c.passed(), "code": c.code.id(), "meaning": c.meaning,
        })
    };
    json!({
        "format": "flexbody-audit",
        "format_major": VERSION.0,
        "format_minor": VERSION.1,
        "generator": generator(),
        "file": file,
        "file_format": audit.format,
        "dialect": audit.dialect,
        "name": audit.name,
        "mass": audit.mass,
        "modes": audit.n_modes,
        "frames": audit.n_frames,
        "frequencies": audit.frequencies,
        "notes": audit.notes,
        "passed": audit.passed(),
        "checks": audit.checks.iter().map(check).collect::<Vec<_>>(),
        "findings": audit.findings(),
    })
}

//! Audits of files of other programs, for terminals and programs.

use crate::checks::{check_row, check_table};
use crate::document::Block;
use crate::document::text::{self, Screen};
use crate::notation::numbers::significant;
use flexbody_base::provenance::generator;
use flexbody_formats::import::{Audit, AuditCheck};
use serde_json::{Value, json};

/// Version of the JSON: a newer major version breaks readers, a newer minor version only adds keys.
const VERSION: (u32, u32) = (1, 0);

/// Number of frequencies that are printed.
const FREQUENCIES: usize = 6;

/// Renders a summary of the file, every check, and the findings in words.
pub fn audit_text(file: &str, audit: &Audit) -> String {
    let Audit { format, dialect, name, mass, n_modes, n_frames, .. } = audit;
    let dialect = if dialect.is_empty() { String::new() } else { format!(", dialect {dialect}") };
    let called = if name.is_empty() { String::new() } else { format!(" `{name}`") };
    let frequencies =
        audit.frequencies.iter().take(FREQUENCIES).map(|f| significant(*f, 5)).collect::<Vec<_>>();
    let more = if audit.frequencies.len() > FREQUENCIES { ", ..." } else { "" };
    let mut lines = vec![
        format!("{file}: {format}{dialect}"),
        format!("body{called}: mass {}, {n_modes} modes, {n_frames} nodes or frames", significant(*mass, 6)),
        format!("frequencies {}{more} cycles per time unit of the file", frequencies.join(", ")),
    ];
    lines.extend(audit.notes.iter().map(|note| format!("note: {note}")));
    let rows = audit.checks.iter().map(|c| check_row(c.name, [c.value, c.limit], c.formula, c.passed()));
    let findings = audit.findings();
    let end = match (findings.len(), audit.checks.len()) {
        (0, all) => format!("all {all} checks passed"),
        (failed, all) => format!("{failed} of {all} checks FAILED"),
    };
    let mut blocks: Vec<Block<'_>> = lines.into_iter().map(Block::Line).collect();
    blocks.extend([Block::Gap, Block::Table(check_table("check", rows.collect()))]);
    blocks.extend([Block::Gap, Block::Line(end)]);
    for finding in findings {
        blocks.push(Block::Gap);
        blocks.extend(finding.to_string().lines().map(|line| Block::Line(line.to_owned())));
    }
    text::render(&blocks, Screen::default())
}

/// Returns the audit as JSON that follows the schema `schemas/audit.schema.json`.
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

//! Generated documents are what the code generates. `FLEXBODY_BLESS=1 cargo test --test docs_generated` writes them.

use flexbody::diagnostic::{Code, Severity};
use flexbody::{diagnostic, store};
use std::path::Path;

#[track_caller]
fn assert_generated(path: &str, generated: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    if std::env::var_os("FLEXBODY_BLESS").is_some_and(|v| v == "1") {
        std::fs::write(&file, generated).unwrap();
    }
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        committed == generated,
        "{path} is out of date: FLEXBODY_BLESS=1 cargo test --test docs_generated writes it"
    );
}

#[test]
fn format_description() {
    assert_generated("docs/format.md", &store::format_markdown());
}

#[test]
fn format_schema() {
    assert_generated("schemas/flexbody-file.schema.json", &store::format_schema());
}

#[test]
fn diagnostic_codes() {
    assert_generated("docs/codes.md", &diagnostic::codes_markdown());
}

#[test]
fn codes_are_unique_and_their_exit_codes_fit_their_severity() {
    let mut ids: Vec<_> = Code::ALL.iter().map(|c| c.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), Code::ALL.len());
    for code in Code::ALL {
        let fails = code.exit_code() != flexbody::error::ExitCode::Done;
        assert_eq!(fails, code.severity() == Severity::Error, "{}", code.id());
    }
}

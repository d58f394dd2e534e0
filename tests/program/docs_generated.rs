//! Generated documents agree with the code. `FLEXBODY_BLESS=1 cargo test --test program docs_generated`
//! writes them. Handwritten documents refer to existing files and codes.

use flexbody_base::diagnostic;
use flexbody_base::diagnostic::{Code, Severity};
use flexbody_input::RECIPES;
use std::path::PathBuf;

#[track_caller]
fn assert_generated(path: &str, generated: &str) {
    let file = oracle::root().join(path);
    if std::env::var_os("FLEXBODY_BLESS").is_some_and(|v| v == "1") {
        std::fs::write(&file, generated).unwrap();
    }
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        committed == generated,
        "{path} is out of date: FLEXBODY_BLESS=1 cargo test --test program docs_generated writes it"
    );
}

#[test]
fn format_description() {
    assert_generated("docs/reference/file_format.md", &flexbody_file::format_markdown());
}

#[test]
fn format_schema() {
    assert_generated("schemas/flexbody-file.schema.json", &flexbody_file::format_schema());
}

#[test]
fn diagnostic_codes() {
    assert_generated("docs/reference/codes.md", &diagnostic::codes_markdown());
}

#[test]
fn python_stub() {
    assert_generated("python/python/flexbody/_flexbody.pyi", &crate::python_stub::python_stub());
}

/// The output of `flexbody recipe` is in the page of each FE program, each piece in a block of its own.
#[test]
fn recipes_are_those_of_the_pages() {
    for recipe in RECIPES {
        let name = format!("docs/how_to/from_{}.md", recipe.program);
        let page = std::fs::read_to_string(oracle::root().join(&name)).expect("a page");
        for step in recipe.steps {
            let block = format!("{}:\n\n```\n{}\n```\n", step.place, step.lines);
            assert!(page.contains(&block), "{name} lacks\n{block}");
        }
    }
}

/// Returns README, ARCHITECTURE, CHANGELOG and all documents of `docs/`, `evidence/`, `fixtures/` and `benches/`
/// with their text.
fn documents() -> Vec<(PathBuf, String)> {
    let root = oracle::root();
    let mut found = Vec::new();
    let mut left: Vec<PathBuf> =
        ["docs", "evidence", "fixtures", "benches/peers"].map(|folder| root.join(folder)).into();
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().path()).collect();
    while let Some(folder) = left.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { left.push(path) } else { entries.push(path) }
        }
    }
    for path in entries {
        if path.extension().is_some_and(|e| e == "md") {
            let text = std::fs::read_to_string(&path).unwrap();
            found.push((path, text));
        }
    }
    found
}

#[test]
fn codes_named_in_documents_exist() {
    for (path, text) in documents() {
        for (at, _) in text.match_indices("FB") {
            let Some(id) = text.get(at..at + 5) else { continue };
            if id[2..].bytes().all(|b| b.is_ascii_digit()) {
                assert!(Code::ALL.iter().any(|c| c.id() == id), "{} names {id}", path.display());
            }
        }
    }
}

#[test]
fn codes_are_unique_and_their_exit_codes_fit_their_severity() {
    let mut ids: Vec<_> = Code::ALL.iter().map(|c| c.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), Code::ALL.len());
    for code in Code::ALL {
        let fails = code.exit_code() != flexbody_base::error::ExitCode::Done;
        assert_eq!(fails, code.severity() == Severity::Error, "{}", code.id());
    }
}

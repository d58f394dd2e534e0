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

/// The output of `flexbody recipe` is in the page on FE programs, each piece in a block of its own.
#[test]
fn recipes_are_those_of_the_page() {
    let page = oracle::root().join("docs/how_to/from_fe_programs.md");
    let page = std::fs::read_to_string(page).expect("the page");
    for recipe in RECIPES {
        for step in recipe.steps {
            let block = format!("{}:\n\n```\n{}\n```\n", step.place, step.lines);
            assert!(page.contains(&block), "{}: docs/how_to/from_fe_programs.md lacks\n{block}", recipe.program);
        }
    }
}

/// Returns README, ARCHITECTURE, CHANGELOG and all documents of `docs/`, `fixtures/` and `benches/` with
/// their text.
fn documents() -> Vec<(PathBuf, String)> {
    let root = oracle::root();
    let mut found = Vec::new();
    for folder in ["", "docs", "docs/formats", "fixtures", "fixtures/cases", "benches/peers"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "md") {
                let text = std::fs::read_to_string(&path).unwrap();
                found.push((path, text));
            }
        }
    }
    found
}

#[test]
fn links_between_documents_lead_to_files() {
    let mut links = 0;
    for (path, text) in documents() {
        for target in text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next()) {
            if !target.is_empty() && !target.contains(':') {
                let file = path.parent().unwrap().join(target);
                assert!(file.exists(), "{} links to {target}, which does not exist", path.display());
                links += 1;
            }
        }
    }
    assert!(links >= 10, "{links} links");
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

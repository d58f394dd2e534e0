//! `ARCHITECTURE.md` agrees with the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest number of lines of a file. A longer file should be split by topic.
const LONGEST_FILE: usize = 700;

fn read(path: impl AsRef<Path>) -> String {
    fs::read_to_string(oracle::root().join(&path))
        .unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))
}

/// Returns the words of a text between backquotes.
fn quoted(text: &str) -> BTreeSet<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Returns all Rust files below a folder of the workspace, with paths from the root.
pub(crate) fn rust_files(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut left = vec![PathBuf::from(folder)];
    while let Some(place) = left.pop() {
        for entry in fs::read_dir(oracle::root().join(&place)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = place.join(entry.file_name());
            if entry.file_type().expect("a type").is_dir() {
                left.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    found
}

/// Returns for each crate the crates of the workspace among the dependencies of its manifest.
fn manifests() -> BTreeMap<String, BTreeSet<String>> {
    oracle::members(&oracle::root().join("crates"))
        .into_iter()
        .filter(|name| name != "oracle")
        .map(|name| {
            let manifest: toml::Table =
                toml::from_str(&read(format!("crates/{name}/Cargo.toml"))).expect("TOML");
            let uses = manifest["dependencies"].as_table().expect("a table").keys();
            let uses = uses.filter_map(|used| used.strip_prefix("flexbody-")).map(str::to_owned).collect();
            (name, uses)
        })
        .collect()
}

#[test]
fn the_table_of_crates_says_what_the_manifests_say() {
    let page = read("ARCHITECTURE.md");
    let section =
        page.split("\n## ").find(|part| part.starts_with("Crates")).expect("a section about crates");
    let rows = section.lines().filter(|line| line.starts_with("| `") && !line.starts_with("| `flexbody`"));
    let written: BTreeMap<String, BTreeSet<String>> = rows
        .map(|row| {
            let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
            (quoted(cells[0]).into_iter().next().expect("a name"), quoted(cells[2]))
        })
        .collect();
    assert_eq!(written, manifests());
}

#[test]
fn every_exception_to_the_ban_of_unsafe_code_is_named() {
    let page = read("ARCHITECTURE.md");
    let paragraph = page.split("\n\n").find(|part| part.starts_with("**Unsafe code**")).expect("a paragraph");
    let mut found = BTreeSet::new();
    for file in rust_files("src").into_iter().chain(rust_files("crates")) {
        let is_tested = file.components().any(|part| part.as_os_str() == "tests");
        if !is_tested && read(&file).contains("allow(unsafe_code)") {
            found.insert(file.to_str().expect("our own names").to_owned());
        }
    }
    assert_eq!(quoted(paragraph), found);
}

/// Choices among computed values allow for rounding: `max_by` and `min_by` with a comparison of their own take the last or
/// first of values that rounding makes unequal.
#[test]
fn choices_among_values_allow_for_rounding() {
    let files = ["src", "crates", "python/src"].iter().flat_map(|folder| rust_files(folder));
    let ruled = files.filter(|file| !file.starts_with("crates/oracle") && !file.ends_with("src/ties.rs"));
    let found: Vec<String> = ruled
        .filter(|file| !file.components().any(|part| part.as_os_str() == "tests"))
        .filter(|file| ["max_by(|", "min_by(|"].iter().any(|choice| read(file).contains(choice)))
        .map(|file| format!("{}: use flexbody_linalg::ties", file.display()))
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn files_stay_short() {
    let folders = ["src", "crates", "tests", "benches", "examples"];
    let long: Vec<String> = folders
        .iter()
        .flat_map(|folder| rust_files(folder))
        .filter_map(|file| {
            let lines = read(&file).lines().count();
            (lines > LONGEST_FILE).then(|| format!("{} has {lines} lines", file.display()))
        })
        .collect();
    assert!(long.is_empty(), "{}", long.join("\n"));
}

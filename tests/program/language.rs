//! The language of comments and messages: doc comments are whole statements, and phrases that readers stumbled over stay out.

use std::fs;
use std::path::{Path, PathBuf};

/// Words that begin a fragment instead of a statement.
const OPENINGS: [&str; 9] = ["What", "Whether", "How", "Where", "Those", "That", "It", "As", "The same"];

/// Phrases that say nothing a reader can look up, or speak of persons where there are none.
const PHRASES: [&str; 9] =
    ["in vain", " anew", "is told", "are told", "is said", "are said", "of ours", "nobody", "bug of ours"];

/// Functions of the standard library and of `nalgebra` that the C library computes: `libm` and `flexbody_linalg::rotation` have the
/// same last bits everywhere.
const OF_THE_C_LIBRARY: [&str; 26] = [
    "sin",
    "cos",
    "tan",
    "sin_cos",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "exp",
    "exp2",
    "exp_m1",
    "ln",
    "ln_1p",
    "log",
    "log2",
    "log10",
    "powf",
    "cbrt",
    "hypot",
    "scaled_axis",
    "angle",
    "slerp",
    "powc",
];

/// The sources of the workspace and of the Python package: Rust, without tests.
fn sources() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let crates = fs::read_dir(oracle::root().join("crates")).expect("crates");
    let folders = crates.map(|entry| entry.expect("an entry").path().join("src"));
    for folder in folders.chain(["src", "python/src"].map(|name| oracle::root().join(name))) {
        walk(&folder, &mut found);
    }
    found
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            walk(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The first lines of all doc comments of a source, and the items of their lists, with the numbers of the lines.
fn openings(text: &str) -> Vec<(usize, &str)> {
    let doc = |line: &str| ["///", "//!"].iter().any(|mark| line.trim_start().starts_with(mark));
    let lines: Vec<&str> = text.lines().collect();
    let begins = |at: usize| {
        let before = at.checked_sub(1).map(|at| lines[at].trim_start());
        before.is_none_or(|before| !doc(before) || before.len() <= 3)
    };
    let said = |at: usize| lines[at].trim_start()[3..].trim_start();
    let is_first = |at: &usize| doc(lines[*at]) && (begins(*at) || said(*at).starts_with("* "));
    (0..lines.len()).filter(is_first).map(|at| (at + 1, said(at).trim_start_matches("* "))).collect()
}

#[test]
fn doc_comments_are_whole_statements() {
    let mut wrong = Vec::new();
    for path in sources() {
        let text = fs::read_to_string(&path).expect("a source");
        for (line, said) in openings(&text) {
            let begins = |opening: &str| {
                said.strip_prefix(opening).is_some_and(|rest| rest.starts_with([' ', ',', ':']))
            };
            if OPENINGS.iter().any(|opening| begins(opening)) {
                wrong.push(format!("{}:{line}: {said}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{} fragments:\n{}", wrong.len(), wrong.join("\n"));
}

/// Comments, messages and help; the tests of a source may quote what they like.
#[test]
fn phrases_that_readers_stumbled_over_stay_out() {
    let mut wrong = Vec::new();
    for path in
        sources().into_iter().filter(|path| !path.components().any(|part| part.as_os_str() == "oracle"))
    {
        let text = fs::read_to_string(&path).expect("a source");
        let shipped = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (at, line) in shipped.lines().enumerate() {
            let spoken = line.trim_start().starts_with("//") || line.contains('"');
            let lower = line.to_lowercase();
            for phrase in PHRASES.iter().filter(|phrase| spoken && lower.contains(**phrase)) {
                wrong.push(format!("{}:{}: `{}` in {}", path.display(), at + 1, phrase.trim(), line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "{} places:\n{}", wrong.len(), wrong.join("\n"));
}

/// The exponential of a matrix takes no function of the C library.
#[test]
fn elementary_functions_have_one_source() {
    let mut wrong = Vec::new();
    for path in sources() {
        let text = fs::read_to_string(&path).expect("a source");
        if path.components().any(|part| part.as_os_str() == "oracle" || part.as_os_str() == "tests") {
            continue;
        }
        let shipped = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (at, line) in shipped.lines().enumerate() {
            let is_method =
                |name: &&&str| line.contains(&format!(".{name}(")) || line.contains(&format!("f64::{name}"));
            let turns =
                ["Rotation3::from_axis_angle", "Rotation3::new("].iter().find(|name| line.contains(**name));
            let of_matrix = line.contains("* step).exp()");
            if let Some(name) = OF_THE_C_LIBRARY.iter().find(is_method).or(turns).filter(|_| !of_matrix) {
                wrong.push(format!("{}:{}: `{name}`", path.display(), at + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "{} places:\n{}", wrong.len(), wrong.join("\n"));
}

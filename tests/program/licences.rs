//! Every dependency in the program or in the Python package has a permissive licence.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Licences that require attribution at most. `WITH` binds an exception to its licence.
const PERMISSIVE: &[&str] = &[
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unicode-DFS-2016",
    "Unlicense",
    "Zlib",
];

/// Packages with a licence file instead of an expression, and a sentence that the file must contain.
const BY_FILE: &[(&str, &str)] = &[("hdf5-metno-src", "covered by the 3-clause BSD License")];

/// Returns true if permissive licences alone satisfy an SPDX expression: one side of `OR`, both of `AND`.
///
/// `/` is the old form of `OR`. Returns `None` for an invalid expression.
fn is_permissive(expression: &str) -> Option<bool> {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let (value, rest) = either(&words)?;
    rest.is_empty().then_some(value)
}

fn either<'a>(words: &'a [&'a str]) -> Option<(bool, &'a [&'a str])> {
    let (mut value, mut rest) = both(words)?;
    while let Some(("OR", after)) = rest.split_first().map(|(word, after)| (*word, after)) {
        let (other, after) = both(after)?;
        (value, rest) = (value || other, after);
    }
    Some((value, rest))
}

fn both<'a>(words: &'a [&'a str]) -> Option<(bool, &'a [&'a str])> {
    let (mut value, mut rest) = one(words)?;
    while let Some(("AND", after)) = rest.split_first().map(|(word, after)| (*word, after)) {
        let (other, after) = one(after)?;
        (value, rest) = (value && other, after);
    }
    Some((value, rest))
}

fn one<'a>(words: &'a [&'a str]) -> Option<(bool, &'a [&'a str])> {
    match words {
        ["(", inner @ ..] => match either(inner)? {
            (value, [")", rest @ ..]) => Some((value, rest)),
            _ => None,
        },
        [")" | "OR" | "AND" | "WITH", ..] | [] => None,
        [licence, "WITH", exception, rest @ ..] => {
            Some((PERMISSIVE.contains(&format!("{licence} WITH {exception}").as_str()), rest))
        }
        [licence, rest @ ..] => Some((PERMISSIVE.contains(licence), rest)),
    }
}

fn output_of(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap_or_else(|e| panic!("{program}: {e}"));
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Returns the packages linked into package `root`: its normal dependencies, recursively.
fn linked<'a>(metadata: &'a Value, root: &'a str) -> BTreeSet<&'a str> {
    let nodes = metadata["resolve"]["nodes"].as_array().expect("a resolved graph");
    let by_id: BTreeMap<&str, &Value> =
        nodes.iter().map(|node| (node["id"].as_str().expect("an id"), node)).collect();
    let mut found = BTreeSet::new();
    let mut open = vec![root];
    while let Some(id) = open.pop() {
        for dependency in by_id[id]["deps"].as_array().expect("dependencies") {
            let kinds = dependency["dep_kinds"].as_array().expect("kinds");
            let package = dependency["pkg"].as_str().expect("an id");
            if kinds.iter().any(|kind| kind["kind"].is_null()) && found.insert(package) {
                open.push(package);
            }
        }
    }
    found
}

/// Returns true if the licence file of a package is known and permissive.
fn has_known_file(package: &Value) -> bool {
    let name = package["name"].as_str().expect("a name");
    let Some((_, sentence)) = BY_FILE.iter().find(|(known, _)| *known == name) else { return false };
    let folder = Path::new(package["manifest_path"].as_str().expect("a path")).parent().expect("a folder");
    let file = folder.join(package["license_file"].as_str().unwrap_or("LICENSE"));
    std::fs::read_to_string(file).is_ok_and(|text| text.contains(sentence))
}

/// Returns the packages linked into the package of `manifest` on this machine that are not permissive.
fn offenders(manifest: &str) -> Vec<String> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let version = output_of(&rustc, &["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host triple");
    let metadata = ["metadata", "--locked", "--format-version", "1", "--filter-platform", host];
    let metadata = [&metadata[..], &["--manifest-path", manifest]].concat();
    let metadata: Value = serde_json::from_str(&output_of(&cargo, &metadata)).expect("JSON");
    let root = metadata["resolve"]["root"].as_str().expect("one package");
    let linked = linked(&metadata, root);
    assert!(linked.len() > 20, "{} dependencies: the graph was not read", linked.len());
    let mut offenders = Vec::new();
    for package in metadata["packages"].as_array().expect("packages") {
        if !linked.contains(package["id"].as_str().expect("an id")) {
            continue;
        }
        let allowed = match package["license"].as_str() {
            Some(expression) => is_permissive(expression) == Some(true),
            None => has_known_file(package),
        };
        if !allowed {
            let licence = package["license"].as_str().unwrap_or("no known licence");
            offenders.push(format!("{} {}: {licence}", package["name"], package["version"]));
        }
    }
    offenders
}

#[test]
fn every_linked_dependency_is_permissive() {
    for manifest in ["Cargo.toml", "python/Cargo.toml"] {
        let offenders = offenders(manifest);
        assert!(offenders.is_empty(), "{manifest}: not permissive:\n{}", offenders.join("\n"));
    }
}

#[test]
fn expressions_are_evaluated_as_spdx_says() {
    for (expression, expected) in [
        ("MIT", Some(true)),
        ("GPL-3.0-only", Some(false)),
        ("MIT OR GPL-3.0-only", Some(true)),
        ("MIT/GPL-3.0-only", Some(true)),
        ("MIT AND GPL-3.0-only", Some(false)),
        ("GPL-3.0-only OR MIT AND Zlib", Some(true)),
        ("(GPL-3.0-only OR MIT) AND MPL-2.0", Some(false)),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", Some(true)),
        ("Apache-2.0 WITH LLVM-exception", Some(true)),
        ("GPL-2.0-only WITH Classpath-exception-2.0", Some(false)),
        ("no licence", None),
        ("(MIT", None),
        ("MIT OR", None),
        ("", None),
    ] {
        assert_eq!(is_permissive(expression), expected, "{expression}");
    }
}

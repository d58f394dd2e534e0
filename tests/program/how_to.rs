//! Pages of docs/how_to: every command runs and prints the lines of the page.

use std::path::Path;
use std::process::Command;

/// Returns the blocks of a page: language and text.
fn blocks(page: &str) -> Vec<(&str, &str)> {
    let mut parts = page.split("```");
    parts.next();
    let mut found = Vec::new();
    while let (Some(block), Some(_)) = (parts.next(), parts.next()) {
        found.push(block.split_once('\n').expect("a language and lines"));
    }
    found
}

/// Runs the commands and returns their output, both streams together.
fn run(commands: &str, folder: &Path) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_flexbody")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new("bash");
    shell.args(["-euc", &format!("exec 2>&1\n{commands}")]).current_dir(folder);
    shell.env("PATH", format!("{}:{path}", program.display())).env("COLUMNS", "100");
    let output = shell.output().expect("bash");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{commands}\n{said}");
    said
}

fn check(name: &str) {
    let root = oracle::root();
    let page = std::fs::read_to_string(root.join("docs/how_to").join(name)).expect("a page");
    let folder = tempfile::tempdir().expect("a folder");
    std::os::unix::fs::symlink(root.join("fixtures"), folder.path().join("fixtures")).expect("a link");
    let (mut said, mut commands, mut shown) = (String::new(), 0, 0);
    for (language, text) in blocks(&page) {
        match language {
            "sh" => {
                said = run(text, folder.path());
                commands += text.lines().count();
            }
            "text" => {
                let mut rest = said.as_str();
                for line in text.lines() {
                    let at = rest.find(line).unwrap_or_else(|| panic!("{name}: `{line}` is not in\n{said}"));
                    rest = &rest[at..];
                    shown += 1;
                }
            }
            other => panic!("{name}: a block of `{other}`"),
        }
    }
    assert!(commands >= 3 && shown >= 3, "{name}: {commands} commands, {shown} lines");
}

#[test]
#[ignore = "slow"]
fn rotor() {
    check("rotor.md");
}

#[test]
fn robot_link() {
    check("robot_link.md");
}

#[test]
#[ignore = "slow"]
fn satellite() {
    check("satellite.md");
}

#[test]
#[ignore = "slow"]
fn vehicle_frame() {
    check("vehicle_frame.md");
}

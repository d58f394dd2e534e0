//! The command that ends a verdict makes exactly the recommended body.

use crate::program::{flexbody, program};
use flexbody_body::flex_body::{FlexBody, Subset};
use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A cube that turns and is shaken, so that few modes and some terms suffice.
const SHAKEN: &str = "variation = []\n[run]\nduration = 2e-3\noutputs = 20\n\
    [initial]\nangular_velocity = [0, 0, 200]\n\
    [[load]]\nnode = 99\nforce = [300, 0, 0]\naxes = \"body\"\nhistory = { amplitude = 1, frequency = 1500 }\n\
    [tolerance]\ndeflection = 0.1\nstress = 0.1\nattitude = 0.01\n";

/// A body whose interface carries it and is shaken.
const CARRIED: &str = "variation = []\n[run]\nduration = 2e-3\noutputs = 20\n\
    [carried]\ninterface = \"root\"\n\
    [carried.translation]\ndirection = [0, 1, 0]\nacceleration = { to = 1e6, duration = 1e-3 }\n\
    [tolerance]\ndeflection = 0.1\nstress = 0.1\nreaction = 0.1\n";

const MODEL: &str = "models/cube_hex8/model.toml";

/// A model with interfaces.
const BLADE: &str = "models/turbine_blade/model.toml";

/// Creates a folder with the scene.
fn folder(scene: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("my scene.toml"), scene).expect("written");
    folder
}

/// Runs a command with `--json` and returns its results, also if a requirement does not hold.
fn results(place: &Path, words: &[&str]) -> Value {
    let run = flexbody(place, &[words, &["--json"]].concat());
    let printed: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    assert!(matches!(run.status.code(), Some(0 | 1)), "{printed:#}");
    printed["results"].clone()
}

/// Runs a printed command in a shell, as a user would, and returns the body that it makes.
fn run_printed(place: &Path, command: &str) -> FlexBody {
    let folder = program().parent().expect("a folder").to_owned();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let run = Command::new("sh").args(["-c", command]).current_dir(place).env("PATH", path).output();
    let run = run.expect("a shell");
    assert!(run.status.success(), "{command}\n{}", String::from_utf8_lossy(&run.stderr));
    flexbody_file::read(place.join("body.flex.h5")).expect("a body")
}

/// Asserts that two bodies have the same modes and invariants, bit by bit.
fn assert_same(made: &FlexBody, wanted: &FlexBody, command: &str) {
    assert_eq!(made.modes(), wanted.modes(), "{command}");
    assert_eq!(made.invariants(), wanted.invariants(), "{command}");
    assert_eq!(made.groups(), wanted.groups(), "{command}");
    assert_eq!(made.nodes().positions, wanted.nodes().positions, "{command}");
}

fn trade_command_makes_the_candidate(model: &str, scene: &str, options: &[&str]) {
    let folder = folder(scene);
    let place = folder.path();
    let model = fixtures().join(model);
    let trade = [
        "trade",
        model.to_str().expect("a path"),
        "--scene",
        "my scene.toml",
        "--modes",
        "4",
        "--repeat",
        "1",
        "--bodies",
        ".",
    ];
    let facts = results(place, &[&trade, options].concat());
    let number = facts["recommended"].as_u64().expect("a recommended row");
    let command = facts["command"].as_str().expect("a command");
    let told = facts["verdict"].as_array().expect("lines");
    assert!(told.iter().any(|line| line["label"] == "Command" && line["text"] == command), "{told:?}");
    let wanted = flexbody_file::read(place.join(format!("candidate_{number:03}.flex.h5"))).expect("a body");
    assert_same(&run_printed(place, command), &wanted, command);
}

#[test]
#[ignore = "slow"]
fn command_of_a_trade_makes_the_recommended_candidate() {
    trade_command_makes_the_candidate(MODEL, SHAKEN, &[]);
}

#[test]
#[ignore = "slow"]
fn command_of_a_trade_with_a_fine_reference_makes_the_recommended_candidate() {
    trade_command_makes_the_candidate(MODEL, SHAKEN, &["--reference", "fine"]);
}

#[test]
#[ignore = "slow"]
fn command_of_a_trade_of_a_carried_body_makes_the_recommended_candidate() {
    trade_command_makes_the_candidate(BLADE, CARRIED, &[]);
}

#[test]
#[ignore = "slow"]
fn command_of_a_selection_makes_the_selected_body() {
    let folder = folder(SHAKEN);
    let place = folder.path();
    let model = fixtures().join(MODEL);
    let model = model.to_str().expect("a path");
    // From a model: the command keeps the modes and terms of the selection.
    let facts = results(place, &["select", model, "--scene", "my scene.toml", "--modes", "6"]);
    let made = run_printed(place, facts["command"].as_str().expect("a command"));
    let kept = facts["modes"]["kept"].as_array().expect("modes").len();
    assert_eq!(made.n_modes(), kept);
    let converted = [
        "convert",
        model,
        "--scene",
        "my scene.toml",
        "--modes",
        "6",
        "-o",
        "own.flex.h5",
        "--allow-unjudged",
        "--quiet",
    ];
    assert!(flexbody(place, &converted).status.success());
    let own = flexbody_file::read(place.join("own.flex.h5")).expect("a body");
    assert_eq!(made.frequencies_hz(), own.frequencies_hz(), "{facts:#}");
    // From a flex-body file.
    let whole = ["convert", model, "--modes", "6", "-o", "whole.flex.h5", "--quiet"];
    assert!(flexbody(place, &whole).status.success());
    let facts = results(place, &["select", "whole.flex.h5", "--scene", "my scene.toml"]);
    let command = facts["command"].as_str().expect("a command");
    let made = run_printed(place, command);
    let whole = flexbody_file::read(place.join("whole.flex.h5")).expect("a body");
    let numbers = facts["modes"]["kept"].as_array().expect("modes").iter();
    let modes: Vec<usize> = numbers.map(|number| number.as_u64().expect("a number") as usize - 1).collect();
    let wanted = whole
        .subset(&Subset { modes: Some(modes), groups: made.groups(), ..Subset::default() })
        .expect("a body");
    assert_same(&made, &wanted, command);
}

#[test]
fn a_missing_folder_of_bodies_is_refused_before_the_study() {
    let folder = folder(SHAKEN);
    let model = fixtures().join(MODEL);
    let words = [
        "trade",
        model.to_str().expect("a path"),
        "--scene",
        "my scene.toml",
        "--bodies",
        "missing",
        "--modes",
        "99999",
    ];
    let run = flexbody(folder.path(), &words);
    let told = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(!run.status.success() && told.contains("missing") && !told.contains("--modes"), "{told}");
}

/// In the scene one mode is enough; a load near the fourth natural frequency needs another one.
const STATIC_AND_FAST: &str = "[run]\nduration = 2e-3\noutputs = 20\n[initial]\ndeformation = \"static\"\n\
    [[load]]\nnode = 99\nforce = [300, 0, 0]\naxes = \"body\"\nhistory = { amplitude = 1, frequency = 500 }\n\
    [[variation]]\nname = \"fast load\"\n\
    [[variation.load]]\nnode = 99\nforce = [300, 0, 0]\naxes = \"body\"\nhistory = { amplitude = 1, frequency = 20000 }\n\
    [tolerance]\ndeflection = 0.3\nstress = 0.3\n";

#[test]
fn reason_of_a_trade_names_the_cheaper_candidate_that_fails_in_a_variation() {
    let folder = folder(STATIC_AND_FAST);
    let place = folder.path();
    let model = fixtures().join(MODEL);
    let made = flexbody(place, &["convert", model.to_str().unwrap(), "--modes", "5", "-o", "five.flex.h5"]);
    assert!(made.status.success());
    let study = results(place, &["trade", "five.flex.h5", "--scene", "my scene.toml"]);
    let lines = study["verdict"].as_array().expect("lines");
    let why = lines.iter().find(|line| line["label"] == "Why").expect("a reason");
    let why = why["text"].as_str().expect("a text");
    assert!(
        why.contains(
            "within the tolerances, in the scene and in its variations; the next cheaper one, 1 mode"
        ),
        "{why}"
    );
    assert!(
        why.contains("holds in the scene and takes") && why.ends_with("times the tolerances where fast load"),
        "{why}"
    );
}

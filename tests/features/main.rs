//! The program with any of its features: a command of a feature works or names the feature that the build leaves out, and
//! a model becomes a body that a scene selects from and moves. `.ci/run` runs these tests with the features on and off.

use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Features with a command line that needs each, and that fails for want of files where the feature is on.
const LINES: [(&str, bool, &str); 7] = [
    ("cluster", cfg!(feature = "cluster"), "prepare absent.toml -o folder"),
    ("cluster", cfg!(feature = "cluster"), "assemble absent -o b.flex.h5"),
    ("cluster", cfg!(feature = "cluster"), "batch absent.toml"),
    ("cluster", cfg!(feature = "cluster"), "convert absent.toml -o b.flex.h5 --engine slepc"),
    ("embedded-c", cfg!(feature = "embedded-c"), "export absent.flex.h5 --to embedded -o b.bin"),
    ("import", cfg!(feature = "import"), "convert absent.fem --from mbdyn -o b.flex.h5"),
    ("response", cfg!(feature = "response"), "response absent.toml --band 0..9 --from 1 --to 2"),
];

fn flexbody(folder: &Path, line: &str) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_flexbody"));
    program.args(line.split_whitespace()).current_dir(folder).output().expect("the program runs")
}

/// Runs a command line that must succeed.
fn done(folder: &Path, line: &str) {
    let run = flexbody(folder, line);
    assert!(run.status.success(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
}

#[test]
fn a_word_of_a_feature_works_or_the_error_names_the_feature() {
    let folder = tempfile::tempdir().expect("a folder");
    for (feature, is_on, line) in LINES {
        let run = flexbody(folder.path(), line);
        assert_eq!(run.status.code(), Some(2), "{line}");
        let said = String::from_utf8(run.stderr).expect("UTF-8");
        let names = said.contains(&format!("needs the feature `{feature}`, which this build leaves out"));
        assert_eq!(names, !is_on, "{line}: {said}");
        let run = flexbody(folder.path(), &format!("{line} --json"));
        let json: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        let message = json["diagnostics"][0]["message"].as_str().expect("a message");
        assert_eq!(message.contains("needs the feature"), !is_on, "{line}: {json}");
    }
}

#[test]
fn doctor_lists_the_features_that_are_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = flexbody(folder.path(), "doctor --json");
    let json: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    let listed: Vec<&str> = json["results"]["features_left_out"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    let mut off: Vec<&str> = LINES.iter().filter(|(_, is_on, _)| !is_on).map(|(name, ..)| *name).collect();
    off.dedup();
    assert_eq!(listed, off);
}

#[test]
fn any_build_converts_selects_simulates_and_exports() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let scene = "[run]\nduration = 0.004\noutputs = 200\n[spin]\naxis = [0, 0, 1]\nrate = { to = 400, duration = 0.003 }\n\
        [[load]]\ninterface = \"bolt_wall\"\nforce = [0, 20, 0]\naxes = \"body\"\n\
        history = { amplitude = 1, frequency = 300 }\n[[watch]]\ninterface = \"bolt_base\"\n[damping]\nratio = 0.02\n";
    fs::write(place.join("scene.toml"), scene).expect("written");
    let model = fixtures().join("models/bracket_hex20/model.toml");
    done(place, &format!("convert {} --modes 8 -o b.flex.h5 --lumped none --report b.html", model.display()));
    done(place, "check b.flex.h5");
    done(place, "select b.flex.h5 --scene scene.toml --report selection.html");
    done(place, "simulate b.flex.h5 --scene scene.toml -o motion.h5 --report motion.html");
    done(place, "view b.flex.h5 --simulation motion.h5 -o view.html");
    done(place, "export b.flex.h5 --to json -o b.json --allow-loss");
}

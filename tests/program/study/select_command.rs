//! Commands `select` and `convert --scene`.

use crate::program::flexbody;
use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Writes `whole.flex.h5` and `scene.toml` of a bracket that is spun up and shaken into the folder `place`;
/// returns the manifest.
fn prepare(place: &Path, more: &str) -> String {
    let manifest = fixtures().join("models/bracket_hex20/model.toml");
    let manifest = manifest.to_str().expect("a path").to_owned();
    let words = ["convert", &manifest, "--modes", "8", "-o", "whole.flex.h5", "--lumped", "none", "--quiet"];
    assert!(flexbody(place, &words).status.success());
    let text = format!(
        "[run]\nduration = 0.004\noutputs = 200\n[spin]\naxis = [0, 0, 1]\nrate = {{ to = 400, duration = 0.003 }}\n\
         [[load]]\ninterface = \"bolt_wall\"\nforce = [0, 20, 0]\naxes = \"body\"\n\
         history = {{ amplitude = 1, frequency = 300 }}\n[[watch]]\ninterface = \"bolt_base\"\n{more}"
    );
    fs::write(place.join("scene.toml"), text).expect("written");
    manifest
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).expect("JSON")
}

#[test]
fn a_selection_is_what_its_schema_says_and_a_body_is_made_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let manifest = prepare(place, "[damping]\nratio = 0.02\n");
    let words = [
        "select",
        "whole.flex.h5",
        "--scene",
        "scene.toml",
        "--json",
        "--report",
        "s.html",
        "--report",
        "s.txt",
    ];
    let run = flexbody(place, &words);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let told = json(&run.stdout)["results"].take();
    let schema = json(include_bytes!("../../../schemas/selection-report.schema.json"));
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let wrong: Vec<String> = schema.iter_errors(&told).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let page = fs::read_to_string(place.join("s.html")).expect("a page");
    assert!(page.contains("Sizes of the terms") && !page.contains("NaN"), "{page}");
    let text = fs::read_to_string(place.join("s.txt")).expect("a text");
    let (verdict, details) = text.split_once("\nDetails\n").expect("the verdict, then the details");
    let labels =
        verdict.lines().filter_map(|line| line.get(..12)).map(str::trim).filter(|label| !label.is_empty());
    let expected =
        ["Selection", "Asked", "Recommended", "Why", "Its modes", "Error", "Saves", "Variations", "Command"];
    assert_eq!(labels.collect::<Vec<_>>(), expected, "{verdict}");
    // The words agree with the numbers; tiers are shown in the details only.
    let words = |key: &str| told["verdict"][key].as_str().expect("a sentence");
    let kept = told["modes"]["kept"].as_array().expect("a list").len();
    let counts = [format!("{kept} of "), format!("all {kept} mode")];
    assert!(counts.iter().any(|count| words("take").starts_with(count)), "{}", words("take"));
    assert!(!verdict.contains("tier") && details.contains("tier"), "{text}");
    for term in told["terms"].as_array().expect("terms") {
        let group = term["group"].as_str().expect("a name");
        assert!(words("why").contains(&format!("{group} (")), "{}", words("why"));
        assert_eq!(words("take").contains(group), term["kept"] == true, "{}", words("take"));
    }
    let chosen = &told["chosen"];
    assert!(chosen["worst"].as_f64().expect("a number") <= 1.0, "{chosen}");

    // The conversion from the matrices, with the modes and residual vectors requested by the scene.
    let words = ["convert", &manifest, "--scene", "scene.toml", "-o", "small.flex.h5", "--quiet"];
    assert!(flexbody(place, &words).status.success());
    assert!(flexbody(place, &["check", "small.flex.h5"]).status.success());
    let small = flexbody_file::read(place.join("small.flex.h5")).expect("a body");
    assert!(small.source().files.iter().any(|file| file.role == "scene" && file.name == "scene.toml"));
    assert_eq!(small.terms().len(), 3);
    let again = flexbody(place, &["select", &manifest, "--scene", "scene.toml", "--json"]);
    let again = json(&again.stdout)["results"].take();
    assert_eq!(again["modes"]["kept"].as_array().expect("a list").len(), small.n_modes());
    for term in again["terms"].as_array().expect("terms") {
        let group = term["group"].as_str().expect("a name");
        let of_file = small.terms().iter().find(|decision| decision.group.name() == group);
        assert_eq!(term["kept"], of_file.expect("a decision").kept, "{group}");
    }
}

#[test]
fn a_cost_that_nothing_meets_is_a_check_that_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    prepare(place, "[cost]\nmultiplications = 5\n");
    let run = flexbody(place, &["select", "whole.flex.h5", "--scene", "scene.toml"]);
    assert_eq!(run.status.code(), Some(1));
    let text = String::from_utf8_lossy(&run.stdout);
    assert!(text.contains("no model needs 5 multiplications") && text.contains("\nBest found  "), "{text}");
    prepare(place, "[cost]\nmultiplications = 900\n");
    let run = flexbody(place, &["select", "whole.flex.h5", "--scene", "scene.toml", "--json"]);
    assert!(run.status.success());
    assert!(json(&run.stdout)["results"]["chosen"]["multiplications"].as_u64().expect("a number") <= 900);
}

/// `convert --scene` judges like `select`: the exit codes agree, and no file is written if the selection
/// fails.
#[test]
fn a_body_for_a_scene_is_written_where_the_selection_holds_and_only_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let tight = "[run]\nduration = 2e-4\noutputs = 4\n[initial]\nangular_velocity = [0, 0, 1]\n\
                 [tolerance]\nattitude = 1\nstress = 1e-7\n";
    let cube = fixtures().join("models/cube_hex8/model.toml").to_str().expect("a path").to_owned();
    let bracket = prepare(place, "");
    let scene = fs::read_to_string(place.join("scene.toml")).expect("written");
    let dear = format!("{scene}[cost]\nmultiplications = 5\n");
    for (manifest, scene, holds, said) in [
        (&bracket, scene.as_str(), true, ""),
        (&bracket, dear.as_str(), false, "do not meet the tolerances of the scene"),
        (&cube, tight, false, "the selection cannot be judged"),
    ] {
        fs::write(place.join("scene.toml"), scene).expect("written");
        let of_scene = |command: &str, rest: &[&str]| {
            let words =
                [&[command, manifest, "--scene", "scene.toml", "--modes", "5", "--quiet"], rest].concat();
            flexbody(place, &words)
        };
        let selected = of_scene("select", &[]);
        let outputs = ["-o", "made.flex.h5", "--report", "made.txt"];
        let made = of_scene("convert", &outputs);
        let code = if holds { 0 } else { 1 };
        let errors = String::from_utf8_lossy(&made.stderr).into_owned();
        assert_eq!(
            (selected.status.code(), made.status.code()),
            (Some(code), Some(code)),
            "{scene}: {errors}"
        );
        let there = |name: &str| place.join(name).exists();
        assert_eq!((there("made.flex.h5"), there("made.txt")), (holds, holds), "{scene}");
        if !holds {
            assert!(errors.contains("error[FB557]") && errors.contains(said), "{errors}");
            let allowed = of_scene("convert", &[&outputs[..], &["--allow-unjudged"]].concat());
            assert_eq!(allowed.status.code(), Some(0), "{}", String::from_utf8_lossy(&allowed.stderr));
            assert!(there("made.flex.h5") && there("made.txt"));
        }
        for name in ["made.flex.h5", "made.txt"] {
            std::fs::remove_file(place.join(name)).expect("written");
        }
    }
}

#[test]
fn contradictions_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let manifest = prepare(place, "");
    for (words, said) in [
        (
            &["select", "whole.flex.h5", "--scene", "scene.toml", "--modes", "3"][..],
            "--modes applies to a model",
        ),
        (&["select", "whole.flex.h5", "--scene", "scene.toml", "--report", "scene.toml"], "scene.toml"),
        (&["convert", &manifest, "--scene", "none.toml", "-o", "x.flex.h5"], "does not exist"),
    ] {
        let run = flexbody(place, words);
        assert_eq!(run.status.code(), Some(2), "{words:?}");
        assert!(String::from_utf8_lossy(&run.stderr).contains(said), "{words:?}");
    }
    assert!(!place.join("x.flex.h5").exists());
}

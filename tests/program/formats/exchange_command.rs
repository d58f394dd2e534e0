//! Commands `flexbody export`, `audit` and `convert --from`.

use crate::program::flexbody;
use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// Makes `body.flex.h5` in the folder `place`, from a bracket with interfaces.
fn prepare(place: &Path) {
    let manifest = fixtures().join("models/bracket_hex20/model.toml");
    let manifest = manifest.to_str().expect("a path");
    let words = ["convert", manifest, "--modes", "6", "-o", "body.flex.h5", "--lumped", "none", "--quiet"];
    assert!(flexbody(place, &words).status.success());
}

fn run(place: &Path, words: &str) -> Output {
    flexbody(place, &words.split(' ').collect::<Vec<_>>())
}

fn code(run: &Output) -> i32 {
    run.status.code().expect("an exit code")
}

fn errors(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

fn names(place: &Path) -> Vec<String> {
    let entries = fs::read_dir(place).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_lossy_export_is_refused_whole_and_allowed_with_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    prepare(place);
    let refused = run(place, "export body.flex.h5 --to mbdyn --dialect level13 -o body.fem");
    assert_eq!(code(&refused), 2);
    assert!(errors(&refused).starts_with("error[FB720]: mbdyn cannot hold"), "{}", errors(&refused));
    assert_eq!(names(place), ["body.flex.h5"]);
    let allowed = run(place, "export body.flex.h5 --to mbdyn --dialect level13 -o body.fem --allow-loss");
    assert_eq!(code(&allowed), 0);
    assert!(errors(&allowed).starts_with("warning[FB721]"), "{}", errors(&allowed));
    assert_eq!(names(place), ["body.fem", "body.flex.h5"]);
    let told: Value = {
        let run =
            run(place, "export body.flex.h5 --to mbdyn --dialect level13 -o body.fem --allow-loss --json");
        serde_json::from_slice(&run.stdout).expect("JSON")
    };
    assert_eq!(told["warnings"], 1);
    let size = fs::metadata(place.join("body.fem")).expect("a file").len();
    assert_eq!(told["results"]["files"][0]["bytes"].as_u64(), Some(size));
}

#[test]
fn files_that_belong_beside_appear_with_it_and_replace_no_input() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    prepare(place);
    assert_eq!(code(&run(place, "export body.flex.h5 --to embedded -o body.bin")), 0);
    assert_eq!(names(place), ["body.bin", "body.flex.h5", "body.h"]);
    // The accompanying program has a name that Python can import.
    assert_eq!(code(&run(place, "export body.flex.h5 --to exudyn -o rod.v2.hdf5")), 0);
    assert_eq!(names(place), ["body.bin", "body.flex.h5", "body.h", "rod.v2.hdf5", "rod.v2_exudyn.py"]);
    let before = fs::read(place.join("body.flex.h5")).expect("a body");
    for words in [
        "export body.flex.h5 --to json -o body.flex.h5",
        // The header would have the name of the output.
        "export body.flex.h5 --to embedded -o body.h",
    ] {
        let refused = run(place, words);
        assert_eq!(code(&refused), 2, "{words}");
        assert!(errors(&refused).contains("FB801"), "{}", errors(&refused));
    }
    assert_eq!(fs::read(place.join("body.flex.h5")).expect("a body"), before);
}

#[test]
fn what_a_format_does_not_have_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    prepare(place);
    for (words, told) in [
        ("--to fmu", "possible values"),
        ("--to sid --dialect simpack", "`simpack` is not a dialect of sid"),
        ("--to json --dialect double", "`double` is not a dialect of json"),
        ("--to sid --mbdyn-level 13", "`level13` is not a dialect of sid"),
        ("--to json --points nodes", "json writes all nodes or none: --points does not apply"),
        ("--to sid --points 999999", "the body has no node 999999"),
        ("--to sid --points here", "`here` is not a set of points"),
        ("--to json --to-units m,kg", "`m,kg`"),
        ("--to json --to-units m,kg,fortnight", "fortnight"),
    ] {
        let refused = run(place, &format!("export body.flex.h5 {words} -o out"));
        assert_eq!(code(&refused), 2, "{words}");
        assert!(errors(&refused).contains(told), "{words}: {}", errors(&refused));
        assert_eq!(names(place), ["body.flex.h5"], "{words}");
    }
}

#[test]
fn a_body_goes_out_and_comes_back_in_other_units() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    prepare(place);
    let words = "export body.flex.h5 --to sid --points nodes --to-units mm,tonne,s --allow-loss -o body.sid";
    assert_eq!(code(&run(place, words)), 0);
    let audited = run(place, "audit body.sid --json");
    let told: Value = serde_json::from_slice::<Value>(&audited.stdout).expect("JSON")["results"].take();
    let schema: Value =
        serde_json::from_slice(include_bytes!("../../../schemas/audit.schema.json")).expect("a schema");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let wrong: Vec<String> = schema.iter_errors(&told).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    assert_eq!(
        (code(&audited), told["passed"].as_bool(), &told["dialect"]),
        (0, Some(true), &"fembs".into())
    );

    let back = run(place, "convert --from sid body.sid -o back.flex.h5 --report back.txt --quiet");
    assert_eq!(code(&back), 0, "{}", errors(&back));
    assert!(fs::read_to_string(place.join("back.txt")).expect("a report").contains("nodes or frames"));
    assert_eq!(code(&run(place, "check back.flex.h5")), 0);
    // Other units are no error of the body: conversion back into them gives the body again.
    assert_eq!(
        code(&run(
            place,
            "export back.flex.h5 --to sid --to-units m,kg,s --points nodes --allow-loss -o m.sid"
        )),
        0
    );
    assert_eq!(
        code(&run(
            place,
            "export body.flex.h5 --to sid --to-units m,kg,s --points nodes --allow-loss -o n.sid"
        )),
        0
    );
    for name in ["m", "n"] {
        let words = format!("convert --from sid {name}.sid -o {name}.flex.h5 --units m,kg,s --quiet");
        assert_eq!(code(&run(place, &words)), 0);
    }
    for words in ["compare m.flex.h5 n.flex.h5", "compare body.flex.h5 back.flex.h5"] {
        let compared = run(place, words);
        assert_eq!(code(&compared), 0, "{words}: {}", String::from_utf8_lossy(&compared.stdout));
    }
}

#[test]
fn an_audit_says_what_is_wrong_and_exits_with_1() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    prepare(place);
    assert_eq!(
        code(&run(place, "export body.flex.h5 --to mbdyn --mbdyn-level 13 --allow-loss -o body.fem")),
        0
    );
    let found = run(place, "audit body.fem");
    let text = String::from_utf8_lossy(&found.stdout).into_owned();
    assert_eq!(code(&found), 1);
    assert!(text.contains("error[FB745]"), "{text}");
    for (bytes, told) in [("", "FB106"), ("no file of any program\n", "FB730")] {
        fs::write(place.join("strange"), bytes).expect("a file");
        let refused = run(place, "audit strange");
        assert_eq!(code(&refused), 2);
        assert!(errors(&refused).contains(told), "{}", errors(&refused));
    }
    assert!(errors(&run(place, "audit missing")).contains("FB101"));
    let refused = run(place, "convert --from sid body.fem -o b.flex.h5");
    assert_eq!(code(&refused), 2);
    assert_eq!(names(place), ["body.fem", "body.flex.h5", "strange"]);
}

#[test]
fn every_format_has_its_page_and_its_line() {
    let docs = oracle::root().join("docs/reference");
    let table = fs::read_to_string(docs.join("exports.md")).expect("docs/reference/exports.md");
    for format in flexbody_formats::FORMATS {
        let name = format.name();
        assert!(table.contains(&format!("(formats/{name}.md)")), "docs/reference/exports.md: {name}");
        let page = fs::read_to_string(docs.join(format!("formats/{name}.md"))).expect("a page");
        for dialect in format.dialects() {
            assert!(
                table.contains(&format!("`{dialect}`")) && page.contains(&format!("`{dialect}`")),
                "{dialect}"
            );
        }
    }
}

//! Load cases of one scene: each equals a scene of its own, and one body serves all of them.

use crate::program::flexbody;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{LoadCases, Measure, Scene, trace, trace_at};
use flexbody_study::selection::{Selection, select};
use oracle::{fixtures, members};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Settings of all cases of the rod.
const COMMON: &str = "[run]\nduration = 0.002\noutputs = 50\n\
    [[watch]]\ninterface = \"small_end\"\n\
    [tolerance]\ndeflection = 0.05\nstress = 0.05\nreaction = 0.05\n";

/// A load common to all cases.
const PULL: &str = "interface = \"small_end\"\nforce = [2000, 0, 0]\naxes = \"body\"\nhistory = { to = 1, duration = 0.002 }\n";

/// A slow rotation, for which bounds rule out all terms.
const SLOW: &str = "name = \"slow\"\nspin = { axis = [0, 0, 1], rate = { to = 5, duration = 0.02 }, hold = true }\n\
    run.duration = 0.004\ntolerance.reaction = 0.2\n";

/// A rotation so fast that centrifugal loads matter; `SHAKE` is its transverse load.
const FAST: &str =
    "name = \"fast\"\nspin = { axis = [0, 0, 1], rate = { to = 900, duration = 0.002 }, hold = true }\n";
const SHAKE: &str = "interface = \"small_end\"\nforce = [0, 200, 0]\naxes = \"body\"\nhistory = { amplitude = 1, frequency = 2000 }\n";

/// A case without motion.
const IDLE: &str = "name = \"idle\"\n";

/// Creates a folder with the connecting rod with six modes, for a scene of several cases.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let model = fixtures().join("models/connecting_rod/model.toml");
    let model = model.to_str().expect("a path");
    let words = ["convert", model, "--modes", "6", "-o", "rod.flex.h5", "--lumped", "none", "--quiet"];
    assert!(flexbody(folder.path(), &words).status.success());
    folder
}

/// Writes a scene of these cases, and a scene of its own for each of them.
fn written(place: &Path) {
    let load = |key: &str, load: &str| format!("[[{key}]]\n{load}");
    let pull = load("load", PULL);
    let cases =
        format!("name = \"rod\"\n{COMMON}{pull}[[case]]\n{SLOW}[[case]]\n{FAST}{}", load("case.load", SHAKE));
    fs::write(place.join("cases.toml"), cases).expect("written");
    let slow = COMMON.replace("0.002", "0.004").replace("reaction = 0.05", "reaction = 0.2");
    let own = |case: &str| case.split_once('\n').expect("the name").1.to_owned();
    let slow = format!(
        "name = \"rod: slow\"\n{}\n{slow}{pull}",
        own(SLOW).replace("run.duration = 0.004\ntolerance.reaction = 0.2\n", "")
    );
    fs::write(place.join("slow.toml"), slow).expect("written");
    let fast = format!("name = \"rod: fast\"\n{}\n{COMMON}{pull}{}", own(FAST), load("load", SHAKE));
    fs::write(place.join("fast.toml"), fast).expect("written");
}

fn body(place: &Path) -> FlexBody {
    flexbody_file::read(place.join("rod.flex.h5")).expect("a body")
}

fn scenes(text: &str) -> LoadCases {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("written");
    LoadCases::read(path, None).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the largest error over its tolerance of the selected body, from a separate simulation.
fn measured(whole: &FlexBody, selection: &Selection, scene: &Scene) -> f64 {
    let own = whole.reduced(&selection.modes, selection.groups, selection.terms.clone()).expect("a body");
    let (reference, _) = trace(whole, scene, &Context::QUIET).expect("a motion");
    let motion = trace_at(&own, &scene.of_modes(&selection.modes), &reference.time, &Context::QUIET)
        .expect("a motion");
    let errors = Measure::new(whole, scene, &reference).of_subset(&motion, &selection.modes).largest();
    errors.worst(&scene.requirements.tolerance)
}

#[test]
fn a_case_is_what_a_scene_of_its_own_is() {
    let folder = folder();
    let place = folder.path();
    written(place);
    let cases = LoadCases::read(place.join("cases.toml"), None).expect("cases");
    for (mut case, own) in cases.iter().cloned().zip(["slow", "fast"]) {
        assert_eq!(case.case_name(), Some(own));
        let scene = LoadCases::read_single(place.join(own).with_extension("toml"), None).expect("a scene");
        (case.case, case.source) = (None, scene.source.clone());
        assert_eq!(case, scene, "{own}");
    }
    // All cases at once, one case, and the scene of its own give equal bytes.
    let run = |words: &[&str]| {
        let run = flexbody(place, &[&["simulate", "rod.flex.h5", "--quiet", "--scene"], words].concat());
        assert!(run.status.success(), "{words:?}: {}", String::from_utf8_lossy(&run.stderr));
    };
    run(&["cases.toml", "-o", "all.h5", "--csv", "all.csv", "--report", "all.html"]);
    for own in ["slow", "fast"] {
        let scene = format!("{own}.toml");
        run(&["cases.toml", "--case", own, "-o", "one.h5", "--csv", "one.csv"]);
        run(&[&scene, "-o", "own.h5", "--csv", "own.csv"]);
        let bytes = |name: &str| fs::read(place.join(name)).expect("a file");
        for extension in ["h5", "csv"] {
            let own_bytes = bytes(&format!("own.{extension}"));
            assert!(bytes(&format!("all-{own}.{extension}")) == own_bytes, "{own} {extension}");
            assert!(bytes(&format!("one.{extension}")) == own_bytes, "{own} {extension}");
        }
        assert!(place.join(format!("all-{own}.html")).exists());
    }
    assert!(!members(place).iter().any(|name| name.starts_with("all.")), "{:?}", members(place));
}

#[test]
fn one_body_serves_every_case_and_holds_what_any_of_them_needs() {
    let folder = folder();
    let place = folder.path();
    written(place);
    let whole = body(place);
    let cases = LoadCases::read(place.join("cases.toml"), None).expect("cases").without_variations();
    let both = select(&whole, &[], &cases, &Context::QUIET).expect("a selection");
    assert!(both.holds() && both.cases.len() == 2, "{both:#?}");
    let select_alone =
        |case: &Scene| select(&whole, &[], &case.clone().into(), &Context::QUIET).expect("a selection");
    let alone: Vec<Selection> = cases.iter().map(select_alone).collect();
    assert_ne!(alone[0].groups, alone[1].groups, "the cases need different terms");
    for (own, case) in alone.iter().zip(cases.iter()) {
        assert!(own.cases.is_empty());
        for group in TermGroup::ALL {
            assert!(both.groups.has(group) || !own.groups.has(group), "{group:?} of {:?}", case.case);
        }
        assert!(both.modes.len() >= own.modes.len(), "{:?} {:?}", both.modes, own.modes);
    }
    // The error reported for each case is the measured error.
    for (told, case) in both.cases.iter().zip(cases.iter()) {
        let worst = measured(&whole, &both, case);
        let chosen = told.chosen.as_ref().expect("measured");
        // The reported error is relative to a motion from which bounds may have dropped terms within half of
        // the tolerances, so that it may differ by as much.
        assert!(worst <= 1.0 && (chosen.worst - worst).abs() <= 0.5, "{}: {worst} {chosen:?}", told.name);
    }
    let fast = &both.cases[1];
    assert!(fast.binds_groups.contains(&TermGroup::W1) && both.cases[0].binds_groups.is_empty(), "{both:#?}");
    // Threads and repetitions change nothing.
    assert_eq!(both, select(&whole, &[], &cases, &Context::QUIET).expect("a selection"));
}

#[test]
fn a_case_that_needs_nothing_changes_nothing() {
    let folder = folder();
    let whole = body(folder.path());
    let shaken = format!("{COMMON}[[case]]\n{FAST}[[case.load]]\n{SHAKE}");
    let one = scenes(&shaken);
    let with_idle = scenes(&format!("{shaken}[[case]]\n{IDLE}"));
    let twice = scenes(&format!("{shaken}[[case]]\n{}[[case.load]]\n{SHAKE}", FAST.replace("fast", "again")));
    let alone = select(&whole, &[], &one, &Context::QUIET).expect("a selection");
    for cases in [with_idle, twice] {
        let both = select(&whole, &[], &cases, &Context::QUIET).expect("a selection");
        assert_eq!((both.groups, &both.modes), (alone.groups, &alone.modes), "{:?}", cases[1].case);
        let chosen = both.cases[0].chosen.as_ref().expect("measured");
        assert_eq!(Some(chosen), alone.chosen.as_ref());
    }
}

#[test]
fn a_case_beyond_its_tolerances_fails_all() {
    let folder = folder();
    let place = folder.path();
    let hard = format!(
        "{COMMON}[cost]\nmultiplications = 5\n[[case]]\n{SLOW}[[case]]\n{FAST}[[case.load]]\n{SHAKE}"
    );
    fs::write(place.join("scene.toml"), hard).expect("written");
    let run = flexbody(place, &["select", "rod.flex.h5", "--scene", "scene.toml"]);
    assert_eq!(run.status.code(), Some(1), "{}", String::from_utf8_lossy(&run.stderr));
}

#[test]
fn reports_tell_every_case() {
    let folder = folder();
    let place = folder.path();
    written(place);
    let words = [
        "select",
        "rod.flex.h5",
        "--scene",
        "cases.toml",
        "--json",
        "--report",
        "s.html",
        "--report",
        "s.txt",
    ];
    let run = flexbody(place, &words);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let told: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    let told = &told["results"];
    let schema =
        serde_json::from_str(include_str!("../../../schemas/selection-report.schema.json")).expect("JSON");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let wrong: Vec<String> = schema.iter_errors(told).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let names: Vec<&str> = told["cases"]
        .as_array()
        .expect("cases")
        .iter()
        .map(|case| case["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(names, ["slow", "fast"]);
    let words = |key: &str| told["verdict"][key].as_str().expect("a sentence");
    assert!(
        words("asked")
            .starts_with("rod in each of 2 load cases (slow, fast); the smallest tolerances of all cases"),
        "{told:#}"
    );
    assert!(words("why").contains("in case fast"), "{}", words("why"));
    let text = fs::read_to_string(place.join("s.txt")).expect("a text");
    assert!(text.contains("Load cases  slow: "), "{text}");
    assert!(fs::read_to_string(place.join("s.html")).expect("a page").contains("Load cases"));
    // A case selected by name equals a scene of its own, including reports.
    let report = |words: &[&str]| {
        let run = flexbody(place, &[&["select", "rod.flex.h5", "--scene"], words].concat());
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        String::from_utf8(run.stdout).expect("a text")
    };
    assert_eq!(report(&["cases.toml", "--case", "fast"]), report(&["fast.toml"]));
}

#[test]
fn a_trade_study_measures_candidates_in_every_case() {
    let folder = folder();
    let place = folder.path();
    written(place);
    let words = ["trade", "rod.flex.h5", "--repeat", "1", "--scene"];
    let told = |more: &[&str]| -> Value {
        let run = flexbody(place, &[&words[..], more, &["--json"]].concat());
        let told: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        assert!(run.status.success(), "{told:#}");
        told["results"].clone()
    };
    let both = told(&["cases.toml", "--report", "t.html", "--report", "t.txt", "--csv", "t.csv"]);
    let schema =
        serde_json::from_str(include_str!("../../../schemas/trade-report.schema.json")).expect("JSON");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let wrong: Vec<String> = schema.iter_errors(&both).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let cases = both["cases"].as_array().expect("cases");
    assert!(cases.iter().map(|case| &case["name"]).eq(["slow", "fast"]), "{cases:#?}");
    assert_eq!((&both["scene"], both["tolerance"]["reaction"].as_f64()), (&Value::from("rod"), Some(0.05)));
    let taken = &both["rows"][both["recommended"].as_u64().expect("a row") as usize - 1]["measured"];
    for (at, case) in cases.iter().enumerate() {
        assert_eq!(case["worst"], taken["by_case"][at], "{case:#}");
    }
    let text = fs::read_to_string(place.join("t.txt")).expect("a text");
    assert!(text.contains("Load cases  slow: ") && text.contains("in each of 2 load cases"), "{text}");
    let page = fs::read_to_string(place.join("t.html")).expect("a page");
    assert!(page.contains("Load cases") && page.contains("Worst case"));
    let table = fs::read_to_string(place.join("t.csv")).expect("a table");
    let columns = table.lines().next().expect("a head").split(',').count();
    assert!(table.lines().all(|line| line.split(',').count() == columns), "{table}");
    // A case selected by name equals a scene of its own, except for times.
    let (alone, own) = (told(&["cases.toml", "--case", "fast"]), told(&["fast.toml"]));
    assert!(alone.get("cases").is_none());
    assert_eq!((&alone["recommended"], &alone["front"]), (&own["recommended"], &own["front"]));
    for (a, b) in alone["rows"].as_array().expect("rows").iter().zip(own["rows"].as_array().expect("rows")) {
        let (a, b) = (&a["measured"], &b["measured"]);
        assert!(a["errors"] == b["errors"] && a["worst"] == b["worst"] && a.get("by_case").is_none());
    }
}

#[test]
#[ignore = "slow"]
fn a_body_is_made_for_all_cases_of_a_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let model = fixtures().join("models/bracket_hex20/model.toml");
    let model = model.to_str().expect("a path");
    let text = "[run]\nduration = 0.002\n[initial]\ndeformation = \"static\"\n[tolerance]\nstress = 0.05\ndeflection = 0.05\n\
        [[case]]\nname = \"spun\"\nspin = { axis = [0, 0, 1], rate = { from = 100, to = 400, duration = 0.002 } }\n\
        [[case]]\nname = \"shaken\"\n[[case.load]]\ninterface = \"bolt_wall\"\nforce = [0, 20, 0]\naxes = \"body\"\n\
        history = { amplitude = 1, frequency = 300 }\n";
    fs::write(place.join("scene.toml"), text).expect("written");
    let told = |words: &[&str]| -> Value {
        let scene = ["--scene", "scene.toml", "--modes", "4", "--json"];
        let run = flexbody(place, &[words, &scene].concat());
        let told: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        assert!(run.status.success(), "{told:#}");
        told["results"].clone()
    };
    let count = |told: &Value| told["modes"]["kept"].as_array().expect("a list").len();
    told(&["convert", model, "-o", "small.flex.h5", "--lumped", "none"]);
    let small = flexbody_file::read(place.join("small.flex.h5")).expect("a body");
    let sources = small.source().files.iter().filter(|file| file.role == "scene").count();
    assert_eq!(sources, 1, "all cases stand in one file");
    let both = told(&["select", model]);
    assert_eq!(count(&both), small.n_modes());
    for case in both["cases"].as_array().expect("cases") {
        assert!(
            case["passed"] == true && !case["reference"].as_array().expect("a list").is_empty(),
            "{case:#}"
        );
    }
    for case in ["spun", "shaken"] {
        let alone = told(&["select", model, "--case", case]);
        assert!(count(&alone) <= count(&both), "{case}");
        assert!(alone["scene"] == format!("scene: {case}") && alone.get("cases").is_none(), "{alone:#}");
    }
}

#[test]
fn keys_of_a_case_take_the_place_of_those_of_the_scene() {
    let text = "gravity = [0, 0, -9.81]\n[run]\nduration = 1\noutputs = 7\n[initial]\nrotation = [1, 0, 0]\n\
        [damping]\nratio = 0.01\n[spin]\naxis = [0, 0, 1]\nrate = 2\nhold = true\n\
        [[load]]\nnode = 1\nforce = [1, 0, 0]\n[[watch]]\nnode = 1\n\
        [[case]]\nname = \"as_it_is\"\n\
        [[case]]\nname = \"other\"\ngravity = [0, 9.81, 0]\nrun = { duration = 2 }\ninitial = { origin = [0, 1, 0] }\n\
        spin = { axis = [1, 0, 0], rate = 3 }\ndamping = { ratio = 0.02 }\n\
        [[case.load]]\nnode = 2\nforce = [0, 1, 0]\n[[case.watch]]\nnode = 3\n";
    let [first, other] = scenes(text).to_vec().try_into().expect("two cases");
    let (common, _) = text.split_once("[[case]]").expect("cases");
    let mut alone = scenes(common)[0].clone();
    assert_eq!(alone.case_name(), None);
    (alone.name, alone.source, alone.case) = (first.name.clone(), first.source.clone(), first.case.clone());
    assert_eq!(first, alone);

    assert_eq!(other.name, "scene: other");
    assert_eq!((other.run.duration, other.run.outputs), (Some(2.0), 7));
    assert_eq!((other.initial.origin.y, other.initial.rotation.x), (1.0, 1.0));
    assert_eq!(other.gravity.map(|gravity| gravity.y), Some(9.81));
    assert_eq!(other.requirements.damping, Some(0.02.into()));
    // A prescribed motion is replaced as a whole.
    assert!(!other.spin.as_ref().expect("a spin").hold && first.spin.as_ref().expect("a spin").hold);
    assert_eq!((other.loads.len(), other.watched.len()), (2, 2));
    assert_eq!(other.loads[0], first.loads[0]);
}

/// A standard variation whose simulation stops judges nothing, and the rest decides; a stated one is an error.
#[test]
fn a_standard_variation_that_stops_is_left_out() {
    let folder = folder();
    let place = folder.path();
    // So fast that the spin changes the steps: 10 % faster takes more than are allowed.
    let scene = |more: &str, rate: f64| {
        let spin = format!("[spin]\naxis = [0, 0, 1]\nrate = {rate}\nhold = true\n");
        COMMON.replace("[run]\n", &format!("[run]\n{more}")) + &spin
    };
    let told = |words: &[&str]| {
        let run = flexbody(place, words);
        let json: Value = serde_json::from_slice(&run.stdout).unwrap_or(Value::Null);
        (json, String::from_utf8_lossy(&run.stderr).into_owned())
    };
    let steps = |rate: f64| {
        fs::write(place.join("scene.toml"), scene("", rate)).expect("written");
        let (json, said) = told(&["simulate", "rod.flex.h5", "--scene", "scene.toml", "--json"]);
        json["results"]["steps"].as_u64().unwrap_or_else(|| panic!("{said}"))
    };
    let (own, faster) = (steps(3.0e4), steps(3.3e4));
    assert!(faster > own + 20, "{faster} and {own} steps");
    let few = format!("most_steps = {}\n", (own + 3 * faster) / 4);
    fs::write(place.join("scene.toml"), scene(&few, 3.0e4)).expect("written");
    let words = ["select", "rod.flex.h5", "--scene", "scene.toml", "--json"];
    let (json, said) = told(&words);
    let notes = json["diagnostics"].as_array().unwrap_or_else(|| panic!("{said}"));
    assert!(notes.iter().any(|note| note["code"] == "FB555"), "{notes:?}");
    // The trade leaves the same variation out.
    let (json, said) = told(&["trade", "rod.flex.h5", "--scene", "scene.toml", "--json"]);
    let notes = json["diagnostics"].as_array().unwrap_or_else(|| panic!("{said}"));
    assert!(notes.iter().any(|note| note["code"] == "FB555"), "{notes:?}");
    // Stated, it is an error that names it.
    let stated = scene(&few, 3.0e4) + "[[variation]]\nname = \"overspeed\"\nspeed = 1.1\n";
    fs::write(place.join("scene.toml"), stated).expect("written");
    let (_, said) = told(&words[..4]);
    assert!(said.contains("FB550") && said.contains("overspeed"), "{said}");
}

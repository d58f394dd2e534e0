//! Every broken input of `fixtures/cases/` gives exactly its recorded report and the exit code of the table,
//! and leaves no files. `fixtures/cases/README.md` describes the form of a case; a new one needs no code.
//! `FLEXBODY_BLESS=1 cargo test --test program bad_input` writes the reports; review the difference.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use oracle::cases::{Case, contents};
use oracle::{fixtures, members};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn subfolders(folder: &Path) -> Vec<PathBuf> {
    let paths = members(folder).into_iter().map(|name| folder.join(name));
    paths.filter(|path| path.is_dir()).collect()
}

/// Bodies of four modes, made on first use.
struct Bodies(TempDir);

impl Bodies {
    fn of(&self, model: &str) -> PathBuf {
        let body = self.0.path().join(format!("{model}.flex.h5"));
        if !body.exists() {
            let manifest = fixtures().join("models").join(model).join("model.toml");
            let (from, to) = (manifest.display().to_string(), body.display().to_string());
            let run =
                flexbody(self.0.path(), &["convert", "--quiet", "--modes", "4", &from, "--output", &to]);
            assert!(run.status.success(), "{model}: {}", String::from_utf8_lossy(&run.stderr));
        }
        body
    }
}

/// Result of the program for a case.
struct Run {
    report: String,
    exit: Option<i32>,
    /// Names of files at the place of the result.
    results: Vec<String>,
    /// True if the command writes its result to a file.
    writes: bool,
    changed_inputs: bool,
}

/// Returns the option for the result of a command and the name of its file; an audit prints its result.
fn result_option(command: &str) -> Option<(&'static str, &'static str)> {
    match command {
        "recover" => Some(("--output", "rows.csv")),
        "convert" | "assemble" | "simulate" | "view" | "export" => Some(("--output", "body.flex.h5")),
        "select" | "response" | "trade" | "batch" => Some(("--report", "report.json")),
        "audit" | "check" | "compare" => None,
        other => panic!("no case ran `{other}` before: name the option for its result here"),
    }
}

fn run(case: &Case, bodies: &Bodies) -> Run {
    let (inputs, outputs) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (name, content) in case.files() {
        fs::write(inputs.path().join(name), content).unwrap();
    }
    let body = case.body.iter().map(|model| ("body.flex.h5", model));
    for (name, model) in body.chain(case.bodies.iter().map(|(name, model)| (name.as_str(), model))) {
        fs::copy(bodies.of(model), inputs.path().join(name)).unwrap();
    }
    let before = contents(inputs.path());
    let mut words: Vec<&str> = case.command.split_whitespace().collect();
    let result = result_option(words[0]).map(|(option, file)| (option, outputs.path().join(file)));
    let result = result.map(|(option, file)| (option, file.display().to_string()));
    if let Some((option, file)) = &result {
        words.extend([*option, file]);
    }
    let run = flexbody(inputs.path(), &words);
    let mut report = String::from_utf8(run.stderr).unwrap();
    if result.is_none() {
        let told = String::from_utf8(run.stdout).unwrap();
        report.push_str(told.find("error[").map_or("", |at| &told[at..]));
    }
    Run {
        report,
        exit: run.status.code(),
        results: members(outputs.path()),
        writes: result.is_some(),
        changed_inputs: contents(inputs.path()) != before,
    }
}

/// Returns the exit code of the first error; a report without errors is a success with warnings.
fn promised_exit(report: &str) -> i32 {
    let first = report.lines().find_map(|line| line.strip_prefix("error[")).map(|rest| &rest[..5]);
    first.map_or(0, |id| {
        let code = Code::ALL.iter().find(|code| code.id() == id);
        code.unwrap_or_else(|| panic!("unknown code {id}")).exit_code() as i32
    })
}

/// Returns the defects of a run; empty if there are none.
fn problems(run: &Run, id: &str, expected: &str) -> Vec<String> {
    let Run { report, exit, results, .. } = run;
    let mut wrong = Vec::new();
    if !report.contains(&format!("[{id}]")) {
        wrong.push(format!("{id} is not in the report:\n{report}"));
    }
    if expected != report {
        wrong.push(format!("--- expected\n{expected}--- found\n{report}"));
    }
    let promised = promised_exit(report);
    if *exit != Some(promised) {
        wrong.push(format!("exit code {exit:?}, {promised} is promised"));
    }
    if results.len() != usize::from(promised == 0 && run.writes) {
        wrong.push(format!("left on disk: {results:?}"));
    }
    if run.changed_inputs {
        wrong.push("the folder of the inputs was changed".to_owned());
    }
    wrong
}

#[test]
fn every_broken_input_gives_the_report_that_stands_in_it() {
    let bless = std::env::var_os("FLEXBODY_BLESS").is_some();
    let bodies = Bodies(tempfile::tempdir().unwrap());
    let (cases, mut wrong) = (Case::all(), Vec::new());
    for case in &cases {
        let run = run(case, &bodies);
        if bless {
            case.bless(&run.report);
        }
        let expected = if bless { &run.report } else { &case.expected };
        let found = problems(&run, &case.code(), expected);
        wrong.extend(found.iter().map(|problem| format!("{} ({}): {problem}", case.name(), case.what)));
    }
    assert!(wrong.is_empty(), "{} problems:\n\n{}", wrong.len(), wrong.join("\n"));
}

/// Codes that no file and no command line triggers, with the test that does.
const ELSEWHERE: &[(&str, &str)] = &[
    ("FB563", "tests/program/stress_colours.rs"),
    ("FB104", "crates/file/tests/file/store_output.rs"),
    ("FB105", "tests/program/command_line.rs"),
    ("FB107", "tests/program/odd_files.rs"),
    ("FB121", "crates/file/tests/file/store_output.rs"),
    ("FB132", "tests/program/hostile_files.rs"),
    ("FB133", "tests/program/models/deck_warnings.rs"),
    ("FB134", "tests/program/models/deck_warnings.rs"),
    ("FB429", "crates/body/tests/body/soft_rotations.rs"),
    ("FB444", "crates/model/tests/model/uniform_strains.rs"),
    ("FB460", "crates/model/tests/model/uniform_strains.rs"),
    ("FB461", "crates/model/tests/model/uniform_strains.rs"),
    ("FB445", "crates/body/tests/body/answered_shapes.rs"),
    ("FB446", "crates/body/tests/body/answered_shapes.rs"),
    ("FB447", "crates/body/tests/body/answered_shapes.rs"),
    ("FB448", "crates/input/src/fe_results/tests.rs"),
    ("FB449", "crates/body/tests/body/answered_shapes.rs"),
    ("FB451", "tests/program/motion/stiffening.rs"),
    ("FB453", "crates/input/src/fe_results/tests/punch.rs"),
    ("FB454", "tests/program/bodies/checked_against.rs"),
    ("FB456", "crates/body/tests/body/node_inertia.rs"),
    ("FB458", "crates/model/tests/model/stress_components.rs"),
    ("FB459", "crates/model/tests/model/stress_components.rs"),
    ("FB501", "crates/body/tests/body/single_precision.rs"),
    ("FB505", "crates/body/tests/body/single_precision.rs"),
    ("FB506", "tests/program/cluster.rs"),
    ("FB513", "crates/body/tests/body/single_precision.rs"),
    ("FB553", "tests/program/motion/recovery.rs"),
    ("FB554", "crates/motion/tests/motion/settled_rates.rs"),
    ("FB555", "tests/program/study/load_cases.rs"),
    ("FB724", "crates/formats/tests/formats/stresses.rs"),
    ("FB725", "crates/formats/tests/formats/stresses.rs"),
    ("FB556", "crates/motion/tests/motion/recovery.rs"),
    ("FB560", "crates/motion/tests/motion/definiteness.rs"),
    ("FB561", "crates/study/tests/study/recovery_limits.rs"),
    ("FB547", "crates/motion/tests/motion/carried_stiffness.rs"),
    ("FB562", "crates/study/tests/study/named_loads.rs"),
    ("FB564", "tests/program/motion/recovery.rs"),
    ("FB602", "tests/program/limits.rs"),
    ("FB605", "tests/program/front_door.rs"),
    ("FB606", "python/tests/test_running.py"),
    ("FB702", "crates/file/tests/file/store_refusals.rs"),
    ("FB703", "crates/file/tests/file/store_refusals.rs"),
    ("FB704", "crates/file/tests/file/store_refusals.rs"),
    ("FB712", "crates/file/tests/file/store_digest.rs"),
    ("FB713", "crates/file/tests/file/store_digest.rs"),
    ("FB714", "crates/body/tests/body/accepted.rs"),
    ("FB735", "tests/program/view.rs"),
    ("FB763", "tests/program/cluster.rs"),
    ("FB764", "tests/program/cluster.rs"),
    ("FB765", "tests/program/cluster.rs"),
    ("FB767", "tests/program/cluster.rs"),
    ("FB771", "tests/program/cluster.rs"),
    ("FB999", "tests/program/ends.rs"),
    ("FB804", "tests/program/library_parity.rs"),
];

#[test]
fn every_code_has_a_case() {
    let codes: BTreeSet<String> = Case::all().iter().map(Case::code).collect();
    let known: BTreeSet<&str> = Code::ALL.iter().map(|code| code.id()).collect();
    let unknown: Vec<&String> = codes.iter().filter(|id| !known.contains(id.as_str())).collect();
    assert!(unknown.is_empty(), "no codes: {unknown:?}");
    let elsewhere = |id: &str| ELSEWHERE.iter().any(|(code, _)| *code == id);
    let missing: Vec<&str> =
        known.iter().copied().filter(|id| !codes.contains(*id) && !elsewhere(id)).collect();
    assert!(missing.is_empty(), "codes without a case: {missing:?}");
    for (id, file) in ELSEWHERE {
        let code = Code::ALL.iter().find(|code| code.id() == *id).expect("a code");
        let text = fs::read_to_string(oracle::root().join(file)).expect("a test");
        assert!(text.contains(id) || text.contains(&format!("Code::{code:?}")), "{id} is not in {file}");
    }
    let needless: Vec<_> = ELSEWHERE.iter().filter(|(id, _)| codes.contains(*id)).collect();
    assert!(needless.is_empty(), "codes that have a case: {needless:?}");
}

#[test]
fn no_case_repeats_a_file() {
    let mut places: BTreeMap<Vec<u8>, String> = BTreeMap::new();
    for base in subfolders(&fixtures().join("small")) {
        let files = contents(&base).into_iter();
        places.extend(files.map(|(name, content)| (content, base.join(name).display().to_string())));
    }
    for case in Case::all() {
        for (name, content) in case.own_files() {
            let place = format!("{} of {}", name, case.name());
            let same = places.insert(content, place.clone());
            assert!(same.is_none(), "{place} is a copy of {}", same.unwrap_or_default());
        }
    }
    // A folder without a case is a leftover.
    for folder in subfolders(&fixtures().join("cases/files")) {
        let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(fixtures().join("cases").join(format!("{name}.toml")).exists(), "{name} belongs to no case");
    }
}

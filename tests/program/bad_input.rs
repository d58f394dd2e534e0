//! Every broken input of `fixtures/codes/<code>/<case>/` gives exactly the report that lies beside it, the
//! exit code of the table, and leaves nothing behind.
//!
//! A case is a folder with two files: `case.toml`, and `expected.txt`, which is what the program then tells
//! on stderr (of `audit` also the findings on stdout), warnings of a case that succeeds included. A new case
//! needs no code:
//!
//! ```toml
//! what = "The damping ratio is given in percent."   # one sentence, shown when the case fails
//! command = "convert model.toml --modes 4"          # the words after `flexbody`; where the result goes is added
//! base = "small/brick"                              # a folder of fixtures/ whose files the case begins with
//! replace = [["nodes.csv", "8,0.0", "8,0.5"]]       # in this file this text, which is there once, by that one
//!
//! [append]                                          # texts at the end of files
//! "model.toml" = """
//! [damping]
//! ratio = 2
//! """
//! ```
//!
//! | key | meaning |
//! |---|---|
//! | `base` | without it the case begins with an empty folder |
//! | `body` | a model of `fixtures/models`: a body of four of its modes is there as `body.flex.h5` |
//! | `[take]` | other files of `fixtures/` by the names that they have here: `"K.h5" = "small/tet4_two_groups/K.h5"` |
//! | `[files]` | whole texts of files, for short ones: `"scene.toml" = """..."""` |
//!
//! Any other file beside `case.toml`, binary or long, is there too. Files come in the order base, `[take]`,
//! beside, `[files]`, and each replaces one of the same name; then texts are replaced, then appended. All of
//! it is put together in a folder of its own, in which the command runs. Keys that are not known are errors,
//! and so is a file that is that of the base. `FLEXBODY_BLESS=1 cargo test --test program bad_input` writes
//! the reports; read the difference.

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

/// Code and folder of every case.
fn cases() -> Vec<(String, PathBuf)> {
    let codes = subfolders(&fixtures().join("codes"));
    let id = |code: &Path| code.file_name().expect("a name").to_string_lossy().into_owned();
    codes.iter().flat_map(|code| subfolders(code).into_iter().map(|case| (id(code), case))).collect()
}

/// Bodies of four modes, each made when it is first asked for.
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

/// What the program did with a case.
struct Run {
    report: String,
    exit: Option<i32>,
    /// Names of what it wrote to the place of its result.
    results: Vec<String>,
    /// Whether a command writes its result to a file.
    writes: bool,
    changed_inputs: bool,
}

/// The option for the result of a command and the name of its file; an audit tells its result.
fn result_option(command: &str) -> Option<(&'static str, &'static str)> {
    match command {
        "convert" | "assemble" | "simulate" | "view" | "export" => Some(("--output", "body.flex.h5")),
        "select" | "response" | "trade" | "batch" => Some(("--report", "report.json")),
        "audit" => None,
        other => panic!("no case ran `{other}` before: name the option for its result here"),
    }
}

fn run(case: &Case, bodies: &Bodies) -> Run {
    let (inputs, outputs) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (name, content) in case.files() {
        fs::write(inputs.path().join(name), content).unwrap();
    }
    if let Some(model) = &case.body {
        fs::copy(bodies.of(model), inputs.path().join("body.flex.h5")).unwrap();
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

/// The exit code of the first error; a report without one is a success with warnings.
fn promised_exit(report: &str) -> i32 {
    let first = report.lines().find_map(|line| line.strip_prefix("error[")).map(|rest| &rest[..5]);
    first.map_or(0, |id| {
        let code = Code::ALL.iter().find(|code| code.id() == id);
        code.unwrap_or_else(|| panic!("unknown code {id}")).exit_code() as i32
    })
}

/// What is wrong with one run, empty when nothing is.
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
fn every_broken_input_gives_the_report_beside_it() {
    let bless = std::env::var_os("FLEXBODY_BLESS").is_some();
    let bodies = Bodies(tempfile::tempdir().unwrap());
    let (cases, mut wrong) = (cases(), Vec::new());
    for (id, folder) in &cases {
        let case = Case::read(folder);
        let run = run(&case, &bodies);
        let report = folder.join("expected.txt");
        if bless {
            fs::write(&report, &run.report).unwrap();
        }
        let expected = fs::read_to_string(&report).unwrap_or_default();
        let found = problems(&run, id, &expected);
        wrong.extend(found.iter().map(|problem| format!("{} ({}): {problem}", folder.display(), case.what)));
    }
    assert!(wrong.is_empty(), "{} problems:\n\n{}", wrong.len(), wrong.join("\n"));
    assert!(cases.len() >= 240, "{} cases", cases.len());
}

#[test]
fn every_code_about_inputs_and_models_has_a_case() {
    let codes: BTreeSet<String> = cases().into_iter().map(|(id, _)| id).collect();
    let known: BTreeSet<&str> = Code::ALL.iter().map(|code| code.id()).collect();
    let unknown: Vec<&String> = codes.iter().filter(|id| !known.contains(id.as_str())).collect();
    assert!(unknown.is_empty(), "no codes: {unknown:?}");
    // These need another state of the program; outputs are in crates/file/tests/file/store_output.rs and
    // tests/program/command_line.rs, files that change while they are read in tests/program/hostile_files.rs.
    let elsewhere = ["FB104", "FB105", "FB107", "FB121", "FB132"];
    let missing: Vec<&str> = known
        .into_iter()
        .filter(|id| *id < "FB5" && !codes.contains(*id) && !elsewhere.contains(id))
        .collect();
    assert!(missing.is_empty(), "codes without a case: {missing:?}");
}

#[test]
fn no_case_repeats_a_file() {
    let mut places: BTreeMap<Vec<u8>, PathBuf> = BTreeMap::new();
    for base in subfolders(&fixtures().join("small")) {
        places.extend(contents(&base).into_iter().map(|(name, content)| (content, base.join(name))));
    }
    for (_, folder) in cases() {
        for (name, content) in Case::read(&folder).own_files() {
            let place = folder.join(name);
            let same = places.insert(content, place.clone());
            assert!(
                same.is_none(),
                "{} is a copy of {}",
                place.display(),
                same.unwrap_or_default().display()
            );
        }
    }
}

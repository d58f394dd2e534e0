//! Every broken input of `fixtures/codes/<code>/<case>/` gives exactly the report that lies beside it, the exit code of
//! the table, and leaves nothing behind.
//!
//! A case is a folder with a `model.toml`, or with a file `args` (one command-line argument per line), and
//! `expected.txt`: what `flexbody convert` prints to stderr, warnings of a case that succeeds included. With a `scene.toml` it is what
//! `flexbody simulate` prints of it, for four modes of the model of `fixtures/models` that the file `body` names; with a file `select` too,
//! what `flexbody select` prints; with a file `export` (arguments) what `flexbody export` prints. With a file `audit` (arguments) it is what
//! `flexbody audit` finds. A new case needs no code. `FLEXBODY_BLESS=1 cargo test --test program bad_input` writes the reports; read the difference.

use flexbody::base::diagnostic::Code;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.sort();
    paths
}

fn subfolders(folder: &Path) -> Vec<PathBuf> {
    entries(folder).into_iter().filter(|p| p.is_dir()).collect()
}

/// A body of four modes.
fn convert(model: &str, body: &Path) {
    let manifest =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/models").join(model).join("model.toml");
    let run = Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(["convert", "--quiet", "--modes", "4"])
        .arg(manifest)
        .arg("--output")
        .arg(body)
        .output()
        .unwrap();
    assert!(run.status.success(), "{model}: {}", String::from_utf8_lossy(&run.stderr));
}

/// What is wrong with one case, empty when nothing is.
fn run_case(case: &Path, id: &str, bless: bool) -> Vec<String> {
    let (input_folder, output_folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let selects = case.join("select").exists();
    let exports = fs::read_to_string(case.join("export")).ok();
    let audits = fs::read_to_string(case.join("audit")).ok();
    let (option, file) = if selects { ("--report", "report.json") } else { ("--output", "body.flex.h5") };
    let output = output_folder.path().join(file);
    let before = entries(case);
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexbody"));
    if let Ok(model) = fs::read_to_string(case.join("body")) {
        let body = input_folder.path().join("body.flex.h5");
        convert(model.trim(), &body);
        match &exports {
            Some(arguments) => command.arg("export").arg(body).args(arguments.lines()),
            None => command
                .arg(if selects { "select" } else { "simulate" })
                .arg(body)
                .args(["--scene", "scene.toml"]),
        };
    } else if let Some(arguments) = &audits {
        command.arg("audit").args(arguments.lines());
    } else {
        let inputs = fs::read_to_string(case.join("args")).unwrap_or_else(|_| "model.toml".to_owned());
        command.arg("convert").args(inputs.lines());
    }
    if audits.is_none() {
        command.arg(option).arg(&output);
    }
    let run = command.current_dir(case).output().unwrap();
    // Bodies of a case have a folder of this run.
    let folder = format!("{}/", input_folder.path().display());
    let mut report = String::from_utf8(run.stderr).unwrap().replace(&folder, "");
    if audits.is_some() {
        // What an audit finds is its result.
        let found = String::from_utf8(run.stdout).unwrap();
        report.push_str(found.find("error[").map_or("", |at| &found[at..]));
    }
    if bless {
        fs::write(case.join("expected.txt"), &report).unwrap();
    }
    let mut wrong = Vec::new();
    if !report.contains(&format!("[{id}]")) {
        wrong.push(format!("{id} is not in the report:\n{report}"));
    }
    let expected = fs::read_to_string(case.join("expected.txt")).unwrap_or_default();
    if expected != report {
        wrong.push(format!("--- expected\n{expected}--- found\n{report}"));
    }
    // The first error decides; a report without one is a success with warnings.
    let first = report.lines().find_map(|line| line.strip_prefix("error[")).map(|rest| &rest[..5]);
    let promised = first.map_or(0, |id| {
        let code =
            Code::ALL.iter().find(|code| code.id() == id).unwrap_or_else(|| panic!("unknown code {id}"));
        code.exit_code() as i32
    });
    if run.status.code() != Some(promised) {
        wrong.push(format!("exit code {:?}, {promised} is promised", run.status.code()));
    }
    let left: Vec<PathBuf> = entries(output_folder.path());
    if left.len() != usize::from(promised == 0 && audits.is_none()) {
        wrong.push(format!("left on disk: {left:?}"));
    }
    if !bless && entries(case) != before {
        wrong.push("the folder of the model was changed".to_owned());
    }
    wrong
}

#[test]
fn every_broken_input_gives_the_report_beside_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/codes");
    let bless = std::env::var_os("FLEXBODY_BLESS").is_some();
    let (mut wrong, mut cases, mut codes) = (Vec::new(), 0, BTreeSet::new());
    for folder in subfolders(&root) {
        let id = folder.file_name().unwrap().to_string_lossy().into_owned();
        assert!(Code::ALL.iter().any(|c| c.id() == id), "{id} is not a code");
        for case in subfolders(&folder) {
            let found = run_case(&case, &id, bless);
            wrong.extend(found.iter().map(|problem| format!("{}: {problem}", case.display())));
            cases += 1;
            codes.insert(id.clone());
        }
    }
    assert!(wrong.is_empty(), "{} problems:\n\n{}", wrong.len(), wrong.join("\n"));
    assert!(cases >= 70, "{cases} cases");
    // Every code about inputs and models has a case, but those that need another program state.
    let elsewhere = ["FB104", "FB105", "FB107"]; // outputs: tests/formats/store_output.rs and tests/program/command_line.rs
    let missing: Vec<&str> = Code::ALL
        .iter()
        .map(|code| code.id())
        .filter(|id| *id < "FB5" && !codes.contains(*id) && !elsewhere.contains(id))
        .collect();
    assert!(missing.is_empty(), "codes without a case: {missing:?}");
}

//! Every broken input of `fixtures/codes/<code>/<case>/` gives exactly the report that lies beside it.
//!
//! A case is a folder with a `model.toml`, or with a file `args` (one command-line argument per line), and
//! `expected.txt`: all diagnostics as the program shows them, warnings of a case that succeeds included. A new
//! case needs no code. `FLEXBODY_BLESS=1 cargo test --test bad_input` writes the reports; read the difference.

use flexbody::diagnostic::{Code, Diagnostic};
use flexbody::error::Result;
use flexbody::input::{ModelFiles, read_manifest, read_model};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The files of the case in the current folder.
fn model_files() -> Result<ModelFiles> {
    let Ok(text) = fs::read_to_string("args") else {
        return read_manifest("model.toml");
    };
    let args: Vec<&str> = text.lines().collect();
    if let [manifest] = args.as_slice() {
        return read_manifest(manifest);
    }
    let option = |name: &str| {
        let at = args.iter().position(|arg| *arg == name)?;
        Some(*args.get(at + 1).unwrap_or_else(|| panic!("{name} without a value")))
    };
    let required = |name: &str| option(name).unwrap_or_else(|| panic!("{name} is missing"));
    ModelFiles::from_arguments(
        required("--stiffness"),
        required("--mass"),
        required("--nodes"),
        option("--dofs").map(PathBuf::from),
        option("--units"),
    )
}

fn subfolders(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut folders: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders
}

// One test, because it changes the current folder: reports then name files as users typed them.
#[test]
fn every_broken_input_gives_the_report_beside_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/codes");
    let bless = std::env::var_os("FLEXBODY_BLESS").is_some();
    let (mut wrong, mut cases, mut codes) = (Vec::new(), 0, BTreeSet::new());
    for code in subfolders(&root) {
        let id = code.file_name().unwrap().to_string_lossy().into_owned();
        assert!(Code::ALL.iter().any(|c| c.id() == id), "{id} is not a code");
        for case in subfolders(&code) {
            std::env::set_current_dir(&case).unwrap();
            let diagnostics: Vec<Diagnostic> = match model_files().and_then(|files| read_model(&files)) {
                Ok(model) => model.diagnostics,
                Err(error) => error.into_diagnostics(),
            };
            let report: String = diagnostics.iter().map(|d| format!("{d}\n")).collect();
            if !diagnostics.iter().any(|d| d.code().id() == id) {
                wrong.push(format!("{}: {id} is not in the report:\n{report}", case.display()));
            }
            if bless {
                fs::write("expected.txt", &report).unwrap();
            }
            let expected = fs::read_to_string("expected.txt").unwrap_or_default();
            if expected != report {
                wrong.push(format!("{}:\n--- expected\n{expected}--- found\n{report}", case.display()));
            }
            cases += 1;
            codes.insert(id.clone());
        }
    }
    assert!(wrong.is_empty(), "{} cases are wrong:\n\n{}", wrong.len(), wrong.join("\n"));
    assert!(cases >= 40, "{cases} cases");
    // Codes of this room that no input file can trigger through the readers alone are left to their own rooms.
    let readers: BTreeSet<&str> = Code::ALL.iter().map(|c| c.id()).filter(|id| *id < "FB4").collect();
    let elsewhere = ["FB104", "FB105", "FB209", "FB308"];
    let missing: Vec<&&str> =
        readers.iter().filter(|id| !codes.contains(**id) && !elsewhere.contains(id)).collect();
    assert!(missing.is_empty(), "codes without a case: {missing:?}");
}

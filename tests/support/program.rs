//! The program as a user runs it, and the files that it is shipped with.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

/// The program: that of this build, or the one that `FLEXBODY` names.
pub fn program() -> PathBuf {
    std::env::var_os("FLEXBODY").map_or_else(|| env!("CARGO_BIN_EXE_flexbody").into(), PathBuf::from)
}

/// Runs `flexbody` with `words` in `folder`.
pub fn flexbody(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(words)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

/// Names of what a folder holds, sorted.
pub fn members(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("an entry").file_name().into_string().expect("our own names")).collect();
    names.sort();
    names
}

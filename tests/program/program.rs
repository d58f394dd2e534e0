//! The built program and the files that it is shipped with.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Returns the path of the program: of this build, or named by `FLEXBODY`.
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

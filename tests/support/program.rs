//! The program as a user runs it, and the files that it is shipped with.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

/// Runs `flexbody` with `words` in `folder`.
pub fn flexbody(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(words)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

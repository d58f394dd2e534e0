//! Little memory, small files, few open files: the program succeeds or ends with exit code 4 and a message,
//! and leaves no files. It never ends by a signal or a panic.
#![cfg(target_os = "linux")]

use flexbody_base::error::ExitCode;
use oracle::members;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn fixture(name: &str) -> PathBuf {
    oracle::fixtures().join("models").join(name).join("model.toml")
}

/// Runs the program in `folder` under `limit`, which the shell sets.
fn run(folder: &Path, limit: &str, arguments: &[&str]) -> Output {
    Command::new("sh")
        .arg("-c")
        .arg(format!("{limit} && exec \"$@\""))
        .arg("sh")
        .arg(env!("CARGO_BIN_EXE_flexbody"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("a shell")
}

/// Creates a folder with a body and a scene.
fn folder_with_body() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let model = fixture("cube_hex8");
    let output =
        run(folder.path(), "true", &["convert", model.to_str().expect("our path"), "-o", "body.flex.h5"]);
    assert!(output.status.success(), "{output:?}");
    let scene = "[run]\nduration = 1e-3\noutputs = 10\n[initial]\nangular_velocity = [1.0, 2.0, 3.0]\n";
    std::fs::write(folder.path().join("scene.toml"), scene).expect("a scene");
    folder
}

#[test]
#[ignore = "slow"]
fn a_limit_of_address_space_gives_a_result_or_exit_code_4() {
    let folder = folder_with_body();
    let model = fixture("cube_hex8");
    let model = model.to_str().expect("our path");
    let commands: [&[&str]; 8] = [
        &["convert", model, "-o", "new.flex.h5", "--report", "new.html"],
        &["convert", model, "-o", "new.flex.h5", "--threads", "16"],
        &["check", "body.flex.h5", "--against", model],
        &["inspect", "body.flex.h5"],
        &["simulate", "body.flex.h5", "--scene", "scene.toml", "-o", "motion.h5"],
        &["select", "body.flex.h5", "--scene", "scene.toml"],
        &["trade", "body.flex.h5", "--scene", "scene.toml", "--repeat", "1"],
        &["export", "body.flex.h5", "--to", "exudyn", "-o", "new.hdf5", "--allow-loss"],
    ];
    for arguments in commands {
        for kilobytes in [60_000, 110_000, 160_000, 300_000, 1_000_000, 3_000_000] {
            let output = run(folder.path(), &format!("ulimit -v {kilobytes}"), arguments);
            let said = String::from_utf8_lossy(&output.stderr);
            let code = output.status.code();
            let left = members(folder.path());
            assert!(!left.iter().any(|name| name.starts_with(".flexbody-")), "{arguments:?}: {left:?}");
            let enough = kilobytes >= 1_000_000;
            // `select` and `trade` may report an inaccurate body.
            if code == Some(ExitCode::Resources as i32) && !enough {
                assert!(said.contains("error[FB601]"), "{arguments:?}, {kilobytes}: {said}");
            } else {
                assert!(
                    matches!(code, Some(0 | 1)),
                    "{arguments:?}, {kilobytes}: {:?} {said}",
                    output.status
                );
            }
            for made in ["new.flex.h5", "new.html", "motion.h5", "new.hdf5"] {
                let _ = std::fs::remove_file(folder.path().join(made));
            }
        }
    }
}

#[test]
#[ignore = "slow"]
fn a_limit_of_file_size_is_a_short_disk_and_leaves_nothing() {
    let folder = folder_with_body();
    let model = fixture("cube_hex8");
    let model = model.to_str().expect("our path");
    std::fs::write(folder.path().join("old.html"), "old").expect("a file");
    let before = members(folder.path());
    let commands: [&[&str]; 3] = [
        &["convert", model, "-o", "new.flex.h5"],
        &["convert", model, "-o", "new.flex.h5", "--report", "old.html", "--modes", "2"],
        &["simulate", "body.flex.h5", "--scene", "scene.toml", "-o", "motion.h5"],
    ];
    for arguments in commands {
        for blocks in [0, 1, 8] {
            let output = run(folder.path(), &format!("ulimit -f {blocks}"), arguments);
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(
                output.status.code(),
                Some(ExitCode::Resources as i32),
                "{arguments:?} {blocks}: {said}"
            );
            assert!(said.contains("error[FB602]"), "{arguments:?} {blocks}: {said}");
            assert_eq!(members(folder.path()), before, "{arguments:?} {blocks}");
        }
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("old.html")).expect("text"), "old");
}

#[test]
#[ignore = "slow"]
fn few_open_files_give_a_message() {
    let folder = folder_with_body();
    let before = members(folder.path());
    // With three open files the system cannot load the program.
    for files in [4, 5, 6, 8] {
        let output = run(
            folder.path(),
            &format!("ulimit -n {files}"),
            &["convert", fixture("cube_hex8").to_str().expect("our path"), "-o", "new.flex.h5"],
        );
        let said = String::from_utf8_lossy(&output.stderr);
        match output.status.code() {
            Some(0) => std::fs::remove_file(folder.path().join("new.flex.h5")).expect("the new body"),
            Some(2 | 4) => assert!(said.contains("error[FB"), "{files}: {said}"),
            code => panic!("{files}: {code:?} {said}"),
        }
        assert_eq!(members(folder.path()), before, "{files}");
    }
}

#[test]
fn results_that_cannot_be_printed_are_not_success() {
    let folder = folder_with_body();
    let run = |redirection: &str| {
        Command::new("sh")
            .arg("-c")
            .arg(format!("\"$0\" inspect body.flex.h5 {redirection}"))
            .arg(env!("CARGO_BIN_EXE_flexbody"))
            .current_dir(folder.path())
            .output()
            .expect("a shell")
    };
    let output = run("> /dev/full");
    assert_eq!(output.status.code(), Some(ExitCode::Resources as i32), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot be printed"), "{output:?}");
    assert_eq!(run(">&- 2>&-").status.code(), Some(0), "nobody listens");
}

#[test]
fn so_many_modes_that_it_takes_hours_are_refused_before_the_search() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = fixture("connecting_rod"); // 6924 degrees of freedom
    let model = model.to_str().expect("our path");
    let ask = ["convert", model, "-o", "b.h5", "--memory-limit", "1T", "--modes", "1000000000"];
    let output = run(folder.path(), "true", &ask);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(ExitCode::BadInput as i32), "{said}");
    assert!(said.contains("error[FB604]: 6918 modes of a model with 6924 degrees"), "{said}");
    assert!(said.contains("--allow-long"), "{said}");
    assert!(members(folder.path()).is_empty());
    // Requests beyond the memory are refused even with `--allow-long`.
    let output = run(
        folder.path(),
        "true",
        &["convert", model, "-o", "b.h5", "--memory-limit", "1G", "--modes", "6000", "--allow-long"],
    );
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(ExitCode::Resources as i32), "{said}");
    assert!(said.contains("error[FB601]"), "{said}");
    // A small model has few modes, which are found quickly.
    let output = run(
        folder.path(),
        "true",
        &[
            "convert",
            fixture("frame_beams").to_str().expect("our path"),
            "-o",
            "b.h5",
            "--modes",
            "1000000000",
        ],
    );
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("FB509"), "{said}");
}

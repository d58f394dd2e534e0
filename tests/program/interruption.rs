//! An interrupted program ends at once, reports it, and leaves the folder unchanged.
#![cfg(unix)]

use flexbody_base::error::ExitCode;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::members;
use oracle::mesh::Mesh;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Waits until `count` outputs are reserved; the signal handler is installed before that.
fn wait_for_temporary_files(folder: &Path, count: usize, child: &mut Child) {
    let began = Instant::now();
    while members(folder).iter().filter(|name| name.starts_with(".flexbody-")).count() < count {
        assert!(child.try_wait().expect("a child").is_none(), "the program ended before it was interrupted");
        assert!(began.elapsed() < Duration::from_secs(60), "no temporary file appeared");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_signal_during_convert_leaves_the_folder_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let (model, out) = (folder.path().join("model"), folder.path().join("out"));
    std::fs::create_dir(&model).expect("a folder");
    std::fs::create_dir(&out).expect("a folder");
    let raw = Mesh::block(ElementKind::Hex8, [18; 3], [1.0; 3])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model();
    let manifest = write_model(&model, &raw, Triangle::Lower);
    let body = out.join("body.flex.h5");
    std::fs::write(&body, "what was there before").expect("a file");
    for signal in ["INT", "TERM"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_flexbody"))
            .arg("convert")
            .arg(&manifest)
            .arg("--output")
            .arg(&body)
            .arg("--report")
            .arg(out.join("report.html"))
            .args(["--modes", "100"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program");
        wait_for_temporary_files(&out, 2, &mut child);
        let sent = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).status();
        assert!(sent.expect("kill").success());
        let status = child.wait().expect("a child");
        let mut said = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
        assert_eq!(status.code(), Some(ExitCode::Interrupted as i32), "SIG{signal}: {said}");
        assert_eq!(said, "interrupted: no unfinished file is left\n");
        let mut printed = String::new();
        child.stdout.take().expect("piped").read_to_string(&mut printed).expect("text");
        assert_eq!(printed, "");
        assert_eq!(members(&out), ["body.flex.h5"]);
        assert_eq!(std::fs::read_to_string(&body).expect("text"), "what was there before");
    }
}

/// `nohup` and background jobs of the shell start programs that ignore signals, so that a long run survives
/// its terminal.
#[test]
fn signals_that_are_ignored_from_the_start_stay_ignored() {
    let folder = tempfile::tempdir().expect("a folder");
    let (model, out) = (folder.path().join("model"), folder.path().join("out"));
    std::fs::create_dir(&model).expect("a folder");
    std::fs::create_dir(&out).expect("a folder");
    let raw = Mesh::block(ElementKind::Hex8, [12; 3], [1.0; 3])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model();
    let manifest = write_model(&model, &raw, Triangle::Lower);
    for signal in ["HUP", "INT", "TERM"] {
        let mut child = Command::new("sh")
            .args(["-c", "trap '' $0; exec \"$@\"", signal, env!("CARGO_BIN_EXE_flexbody"), "convert"])
            .arg(&manifest)
            .args(["--modes", "30", "--output", "body.flex.h5"])
            .current_dir(&out)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program");
        wait_for_temporary_files(&out, 1, &mut child);
        let sent = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).status();
        assert!(sent.expect("kill").success());
        assert_eq!(child.wait().expect("a child").code(), Some(0), "SIG{signal}");
        assert_eq!(members(&out), ["body.flex.h5"]);
        std::fs::remove_file(out.join("body.flex.h5")).expect("a body");
    }
}

/// A queue ends the program that it started, not the children of that program.
#[test]
fn programs_that_it_waits_for_end_with_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    std::fs::create_dir(place.join("model")).expect("a folder");
    let raw = Mesh::block(ElementKind::Hex8, [18; 3], [1.0; 3])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model();
    write_model(&place.join("model"), &raw, Triangle::Lower);
    let list = "[[body]]\nmodel = \"model/model.toml\"\noutput = \"new.flex.h5\"\noptions = [\"--modes\", \"100\"]\n";
    std::fs::write(place.join("list.toml"), list).expect("a list");
    let mut batch = Command::new(env!("CARGO_BIN_EXE_flexbody"));
    batch.args(["batch", "list.toml"]).current_dir(place).stdout(Stdio::null()).stderr(Stdio::null());
    let mut batch = batch.spawn().expect("the program");
    wait_for_temporary_files(place, 1, &mut batch);
    let sent = Command::new("kill").arg("-TERM").arg(batch.id().to_string()).status();
    assert!(sent.expect("kill").success());
    assert_eq!(batch.wait().expect("a child").code(), Some(ExitCode::Interrupted as i32));
    // An interrupted conversion removes its temporary file; an uninterrupted one would make the body.
    let began = Instant::now();
    while members(place).iter().any(|name| name.starts_with(".flexbody-")) {
        assert!(began.elapsed() < Duration::from_secs(180), "the conversion went on");
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_eq!(members(place), ["list.toml", "model"]);
}

/// Returns the command that converts the cube of the fixtures to `new.flex.h5` with a report, over older
/// files of these names.
fn small_convert(out: &Path) -> Command {
    let model = oracle::fixtures().join("models/cube_hex8/model.toml");
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexbody"));
    command.arg("convert").arg(model).args(["--output", "new.flex.h5", "--report", "new.json"]);
    command.current_dir(out).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Kills runs at times spread over their length; `FLEXBODY_KILLS` is the number of runs for each signal.
#[test]
#[ignore = "slow"]
fn whenever_it_is_killed_outputs_are_whole_and_the_next_run_leaves_nothing_else() {
    let kills: u32 = std::env::var("FLEXBODY_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path();
    let (body, report) = (out.join("new.flex.h5"), out.join("new.json"));
    let began = Instant::now();
    assert!(small_convert(out).status().expect("the program").success());
    let whole = began.elapsed();
    let is_old = |path: &Path| std::fs::read(path).expect("an output") == b"old";
    for signal in ["KILL", "INT", "TERM"] {
        for kill in 0..kills {
            std::fs::write(&body, "old").expect("a file");
            std::fs::write(&report, "old").expect("a file");
            let mut child = small_convert(out).spawn().expect("the program");
            // Kill times are concentrated near the end, where files are replaced.
            let part = 1.0 - 0.7 * (f64::from(kill) / f64::from(kills)).powi(2);
            std::thread::sleep(whole.mul_f64(part));
            // The run may already have ended.
            let _ = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).output();
            let status = child.wait().expect("a child");
            if !is_old(&body) {
                flexbody_file::read(&body).expect("a whole body");
            }
            if !is_old(&report) {
                let text = std::fs::read_to_string(&report).expect("text");
                serde_json::from_str::<serde_json::Value>(&text).expect("a whole report");
            }
            if signal != "KILL" {
                // Before the handler is installed the system ends the program, which has written nothing yet.
                let handled = matches!(status.code(), Some(0 | 130));
                assert!(handled || (status.signal().is_some() && is_old(&body)), "SIG{signal}: {status:?}");
                assert_eq!(is_old(&body), is_old(&report), "SIG{signal}: one of two outputs");
                assert_eq!(members(out), ["new.flex.h5", "new.json"], "SIG{signal}");
            }
        }
        assert!(small_convert(out).status().expect("the program").success());
        assert_eq!(members(out), ["new.flex.h5", "new.json"], "after SIG{signal} and another run");
    }
}

//! Every end of a run leaves no unfinished file, and the exit code shows if the outputs are in place.
//!
//! `FLEXBODY` names another program to test; scripts/release.sh passes the released one.
#![cfg(unix)]

use flexbody_base::error::ExitCode;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::mesh::Mesh;
use oracle::{fixtures, members};
use std::io::{Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Returns a command for the program in `folder`, without core dumps.
fn program(folder: &Path) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -c 0; exec \"$@\"", "sh"]).current_dir(folder);
    command.arg(crate::program::program());
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Sends the signal of that name or number.
fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).status();
    assert!(sent.expect("a shell").success(), "{signal}");
}

/// Waits for `done`, and asserts that the program still runs.
fn wait_for(child: &mut Child, what: &str, done: impl Fn() -> bool) {
    let began = Instant::now();
    while !done() {
        assert!(child.try_wait().expect("a child").is_none(), "the program ended before {what}");
        assert!(began.elapsed() < Duration::from_secs(60), "{what} does not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Returns the number of temporary files in a folder.
fn unfinished(folder: &Path) -> usize {
    members(folder).iter().filter(|name| name.starts_with(".flexbody-")).count()
}

/// Processor time, in hundredths of a second, after which a run has reserved its outputs, whatever else the machine does.
#[cfg(target_os = "linux")]
const TICKS_OF_RESERVATION: u64 = 20;

/// Returns the processor time of a process in hundredths of a second; zero if the process has ended.
#[cfg(target_os = "linux")]
fn processor_ticks(process: u32) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // The fields after the name in parentheses begin with the third one; times of user and system are the 14th and 15th.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<u64>().ok()).sum()
}

/// Writes a model whose hundred modes take seconds.
fn long_model(folder: &Path) -> PathBuf {
    let place = folder.join("model");
    std::fs::create_dir(&place).expect("a folder");
    let block =
        Mesh::block(ElementKind::Hex8, [18; 3], [1.0; 3]).assemble(&Material::STEEL, MassRule::Consistent);
    write_model(&place, &block.raw_model(), Triangle::Lower)
}

/// Creates a folder with a small body, a scene for it, and old files with the names of outputs.
fn folder_with_outputs(outputs: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let made = program(folder.path()).arg("convert").arg(cube()).args(["-o", "body.flex.h5"]).output();
    assert!(made.expect("the program").status.success());
    let scene = "[run]\nduration = 1e-3\noutputs = 10\n[initial]\nangular_velocity = [1.0, 2.0, 3.0]\n";
    std::fs::write(folder.path().join("scene.toml"), scene).expect("a scene");
    for output in outputs {
        std::fs::write(folder.path().join(output), "old").expect("a file");
    }
    folder
}

fn cube() -> PathBuf {
    fixtures().join("models/cube_hex8/model.toml")
}

fn is_old(path: &Path) -> bool {
    std::fs::read(path).expect("an output") == b"old"
}

/// Names and Linux numbers of signals of crashes.
const CRASHES: [(&str, i32); 7] =
    [("SEGV", 11), ("BUS", 7), ("ILL", 4), ("FPE", 8), ("ABRT", 6), ("TRAP", 5), ("SYS", 31)];

const INTERRUPTIONS: [&str; 3] = ["HUP", "INT", "TERM"];

/// Names and Linux numbers of signals of limits, timers, queues and users.
const OTHERS: [(&str, i32); 12] = [
    ("QUIT", 3),
    ("USR1", 10),
    ("USR2", 12),
    ("ALRM", 14),
    ("STKFLT", 16),
    ("XCPU", 24),
    ("VTALRM", 26),
    ("PROF", 27),
    ("IO", 29),
    ("PWR", 30),
    ("35", 35),
    ("64", 64),
];

#[cfg(target_os = "linux")]
#[test]
fn every_signal_that_ends_a_run_leaves_the_folder_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = long_model(folder.path());
    let out = folder.path().join("out");
    std::fs::create_dir(&out).expect("a folder");
    std::fs::write(out.join("body.flex.h5"), "old").expect("a file");
    let interruptions = INTERRUPTIONS.map(|name| (name, None));
    let others = OTHERS.iter().chain(&CRASHES).map(|&(name, number)| (name, Some(number)));
    for (name, number) in interruptions.into_iter().chain(others) {
        let mut command = program(&out);
        command.arg("convert").arg(&manifest).args([
            "--modes",
            "100",
            "-o",
            "body.flex.h5",
            "--report",
            "b.html",
        ]);
        let mut child = command.spawn().expect("the program");
        wait_for(&mut child, "its temporary files", || unfinished(&out) == 2);
        // A crash while the second file is being reserved cannot remove it: the thread that crashes holds the list.
        let process = child.id();
        wait_for(&mut child, "its work", || processor_ticks(process) > TICKS_OF_RESERVATION);
        send(&number.map_or(name.to_owned(), |number| number.to_string()), &child);
        let Output { status, stdout, stderr } = child.wait_with_output().expect("a child");
        let said = String::from_utf8_lossy(&stderr);
        let expected =
            number.map_or((Some(ExitCode::Interrupted as i32), None), |number| (None, Some(number)));
        assert_eq!((status.code(), status.signal()), expected, "SIG{name}: {said}");
        let is_crash = CRASHES.iter().any(|(crash, _)| *crash == name);
        assert!(is_crash || said.ends_with(": no unfinished file is left\n"), "SIG{name}: {said}");
        assert!(stdout.is_empty(), "SIG{name}");
        assert_eq!(members(&out), ["body.flex.h5"], "SIG{name}");
        assert!(is_old(&out.join("body.flex.h5")), "SIG{name}");
    }
}

/// A signal that is ignored from the start is ignored by the child programs too.
#[test]
fn other_signals_that_are_ignored_from_the_start_stay_ignored() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = program(folder.path());
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' QUIT USR1 XCPU ALRM; exec \"$@\"", "sh"]);
    command.arg(program.get_program()).args(program.get_args()).arg("convert").arg(cube());
    command.args(["--modes", "40", "-o", "body.flex.h5"]).current_dir(folder.path());
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
    wait_for(&mut child, "its temporary file", || unfinished(folder.path()) == 1);
    for signal in ["QUIT", "USR1", "XCPU", "ALRM"] {
        send(signal, &child);
    }
    assert_eq!(child.wait().expect("a child").code(), Some(0));
    assert_eq!(members(folder.path()), ["body.flex.h5"]);
}

/// Starts a batch that makes two bodies in parallel; the folder has their temporary files.
fn batch_in_work() -> (TempDir, Child) {
    let folder = tempfile::tempdir().expect("a folder");
    long_model(folder.path());
    let body = |name: &str| {
        format!(
            "[[body]]\nmodel = \"model/model.toml\"\noutput = \"{name}.h5\"\nmemory = 1_000_000_000\noptions = [\"--modes\", \"100\"]\n"
        )
    };
    let list = format!("parallel = 2\n{}{}{}", body("a"), body("b"), body("c"));
    std::fs::write(folder.path().join("list.toml"), list).expect("a list");
    let mut command = program(folder.path());
    command.args(["batch", "list.toml", "--report", "all.json", "--memory-limit", "4G"]);
    let mut child = command.spawn().expect("the program");
    // One of the three temporary files is the report of the batch.
    wait_for(&mut child, "the files of its programs", || unfinished(folder.path()) == 3);
    (folder, child)
}

/// An interrupted batch reports that no unfinished file is left when that is true, and starts no further
/// body.
#[test]
fn a_batch_that_is_interrupted_has_ended_its_programs() {
    for (signal, code) in [("TERM", Some(130)), ("INT", Some(130)), ("USR1", None)] {
        let (folder, child) = batch_in_work();
        send(signal, &child);
        let ended = child.wait_with_output().expect("a child");
        // The files are gone immediately, not after a delay.
        assert_eq!(members(folder.path()), ["list.toml", "model"], "SIG{signal}");
        assert_eq!(ended.status.code(), code, "SIG{signal}");
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(said.ends_with(": no unfinished file is left\n"), "SIG{signal}: {said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn programs_of_a_batch_that_is_killed_end_and_leave_nothing() {
    let (folder, mut child) = batch_in_work();
    child.kill().expect("killed");
    child.wait().expect("a child");
    let began = Instant::now();
    // The batch itself was killed: its own temporary file remains, those of its child programs disappear.
    while unfinished(folder.path()) > 1 {
        assert!(began.elapsed() < Duration::from_secs(20), "the programs go on");
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(100));
    assert!(!members(folder.path()).iter().any(|name| name.ends_with(".h5")), "a body was made");
}

/// Returns commands whose outputs exist already, for the body and the scene of [`folder_with_outputs`].
fn commands() -> Vec<(String, Vec<&'static str>)> {
    let cube = cube().display().to_string();
    vec![
        (format!("convert {cube} -o a.h5 --report a.html --report a.json"), vec!["a.h5", "a.html", "a.json"]),
        ("simulate body.flex.h5 --scene scene.toml -o a.h5 --csv a.csv".to_owned(), vec!["a.h5", "a.csv"]),
        ("select body.flex.h5 --scene scene.toml --report a.json".to_owned(), vec!["a.json"]),
        ("trade body.flex.h5 --scene scene.toml --repeat 1 --csv a.csv".to_owned(), vec!["a.csv"]),
        ("inspect body.flex.h5 --report a.html".to_owned(), vec!["a.html"]),
        ("compare body.flex.h5 body.flex.h5 --report a.xml".to_owned(), vec!["a.xml"]),
        ("export body.flex.h5 --to npz -o a.npz".to_owned(), vec!["a.npz"]),
        ("view body.flex.h5 -o a.html".to_owned(), vec!["a.html"]),
        (format!("prepare {cube} -o job"), vec![]),
    ]
}

/// Exit code 4 means that no output is in place, even if only the results on stdout cannot be printed.
#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_printed_leave_the_outputs_as_they_were() {
    for (line, outputs) in commands() {
        for json in [&[][..], &["--json"]] {
            let folder = folder_with_outputs(&outputs);
            let before = members(folder.path());
            let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
            let mut command = program(folder.path());
            let ended = command.args(line.split(' ')).args(json).stdout(full).output().expect("the program");
            let said = String::from_utf8_lossy(&ended.stderr);
            // `select` and `trade` may report a failed check.
            let code = ended.status.code().expect("no signal");
            assert!(
                matches!(code, 1 | 4) && said.contains("the results cannot be printed"),
                "{line}: {code} {said}"
            );
            if code == 4 {
                assert!(outputs.iter().all(|output| is_old(&folder.path().join(output))), "{line}");
                let left = members(folder.path()).into_iter().filter(|name| name != "job");
                assert_eq!(left.collect::<Vec<_>>(), before, "{line}");
            }
        }
    }
}

/// A run whose stdout is not read has its outputs in place and waits; a signal makes it restore the old
/// outputs.
#[test]
fn a_signal_while_the_results_are_printed_takes_the_outputs_back() {
    for signal in ["INT", "QUIT"] {
        let folder = folder_with_outputs(&["a.html", "b.json"]);
        let before = members(folder.path());
        let (reader, mut writer) = std::io::pipe().expect("a pipe");
        let own = writer.try_clone().expect("a pipe");
        // Fills the pipe, and ends when its reader closes.
        let filler = std::thread::spawn(move || while writer.write_all(&[b'x'; 4096]).is_ok() {});
        std::thread::sleep(Duration::from_millis(100));
        let mut command = program(folder.path());
        command.args([
            "inspect",
            "body.flex.h5",
            "--report",
            "a.html",
            "--report",
            "b.json",
            "--report",
            "new.txt",
        ]);
        let mut child = command.stdout(own).spawn().expect("the program");
        drop(command);
        wait_for(&mut child, "its outputs", || folder.path().join("new.txt").exists());
        std::thread::sleep(Duration::from_millis(50));
        assert!(!is_old(&folder.path().join("a.html")));
        send(signal, &child);
        let status = child.wait().expect("a child");
        assert_eq!(status.code(), (signal == "INT").then_some(130), "SIG{signal}: {status:?}");
        assert!(
            is_old(&folder.path().join("a.html")) && is_old(&folder.path().join("b.json")),
            "SIG{signal}"
        );
        assert_eq!(members(folder.path()), before, "SIG{signal}");
        drop(reader);
        filler.join().expect("a thread");
    }
}

/// A deliberate panic at the beginning of the phase that the variable names.
#[test]
fn a_panic_ends_with_exit_code_70_and_leaves_nothing() {
    for (phase, json) in [("checks", false), ("writing", false), ("writing", true)] {
        let folder = folder_with_outputs(&["new.flex.h5"]);
        let before = members(folder.path());
        let mut command = program(folder.path());
        command.arg("convert").arg(cube()).args(["-o", "new.flex.h5", "--report", "new.html"]);
        command.args(json.then_some("--json")).env("FLEXBODY_TEST_PANIC", phase);
        let ended = command.output().expect("the program");
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(ExitCode::Bug as i32), "{phase}: {:?} {said}", ended.status);
        assert!(said.contains("panicked at"), "{said}");
        assert_eq!(members(folder.path()), before, "{phase}");
        assert!(is_old(&folder.path().join("new.flex.h5")), "{phase}");
        if json {
            let told: serde_json::Value = serde_json::from_slice(&ended.stdout).expect("JSON");
            assert_eq!((&told["exit_code"], &told["passed"]), (&70.into(), &false.into()), "{told}");
        } else {
            assert!(said.contains("error[FB999]"), "{said}");
        }
    }
}

/// Kills runs at times spread over their length: 130 and other signals mean that the old outputs are in
/// place, 0 that the new ones are. `FLEXBODY_KILLS` is the number of runs for each signal.
#[test]
#[ignore = "slow"]
fn whenever_a_signal_comes_the_exit_code_tells_which_outputs_are_there() {
    let kills: u32 = std::env::var("FLEXBODY_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(12);
    let folder = folder_with_outputs(&[]);
    let outputs = ["a.html", "b.json", "c.txt"].map(|name| folder.path().join(name));
    let start = || {
        let mut command = program(folder.path());
        command.args(["inspect", "body.flex.h5"]);
        for output in &outputs {
            command.arg("--report").arg(output);
        }
        command.stdout(Stdio::null()).spawn().expect("the program")
    };
    let began = Instant::now();
    assert!(start().wait().expect("a child").success());
    let whole = began.elapsed();
    for signal in ["INT", "TERM", "QUIT", "XCPU", "USR1", "ALRM"] {
        for kill in 0..kills {
            outputs.iter().for_each(|output| std::fs::write(output, "old").expect("a file"));
            let mut child = start();
            let part = 1.05 - 0.5 * (f64::from(kill) / f64::from(kills)).powi(2);
            std::thread::sleep(whole.mul_f64(part));
            // The run may already have ended.
            let _ = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).output();
            let status: ExitStatus = child.wait().expect("a child");
            let mut said = String::new();
            child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
            let are_old = outputs.each_ref().map(|output| is_old(output));
            let is_done = status.code() == Some(0);
            assert!(is_done || status.code() == Some(130) || status.signal().is_some(), "{status:?} {said}");
            assert_eq!(are_old, [!is_done; 3], "SIG{signal}: {status:?} {said}");
            assert_eq!(unfinished(folder.path()), 0, "SIG{signal}: {status:?} {said}");
        }
    }
}

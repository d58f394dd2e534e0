//! Pipes, devices and folders in place of files, names that are too long, and permissions of replaced files:
//! the program reports them before the work, never waits, and keeps the permissions.
#![cfg(unix)]

use crate::program::program;
use oracle::{fixtures, members};
use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Time limit of a run; the models are a brick and a cube.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs `flexbody` with these words in `folder`, with 2 GiB of address space.
fn run(folder: &Path, words: &str) -> Output {
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -v 2097152; exec \"$@\"", "sh"]).arg(program());
    command.args(words.split(' ')).current_dir(folder);
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program");
    let began = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if began.elapsed() > PATIENCE {
            child.kill().expect("killed");
            panic!("{words}: it waits");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    child.wait_with_output().expect("a child")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Creates a folder with the brick as `model.toml`, its body, a scene, a list for a batch, and a pipe.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, brick) = (folder.path(), fixtures().join("small/brick"));
    for file in members(&brick) {
        fs::copy(brick.join(&file), path.join(&file)).expect("copied");
    }
    assert!(run(path, "convert model.toml --modes 4 -o body.h5").status.success());
    let scene = "[run]\nduration = 1e-4\noutputs = 2\n[initial]\nangular_velocity = [1, 2, 3]\n";
    fs::write(path.join("scene.toml"), scene).expect("written");
    let list = "[[body]]\nmodel = \"model.toml\"\noutput = \"b.h5\"\noptions = [\"--modes\", \"4\"]\n";
    fs::write(path.join("list.toml"), list).expect("written");
    assert!(Command::new("mkfifo").arg(path.join("pipe")).status().expect("mkfifo").success());
    folder
}

/// Command lines with `@` in place of the file under test.
const INPUTS: &[&str] = &[
    "convert @ -o new.h5",
    "convert @ --units m,kg,s --format abaqus -o new.h5",
    "convert @ --units m,kg,s --format nastran -o new.h5",
    "convert --stiffness @ --mass M.mtx --nodes nodes.csv --dofs dofs.csv --units m,kg,s -o new.h5",
    "convert --stiffness K.mtx --mass @ --nodes nodes.csv --dofs dofs.csv --units m,kg,s -o new.h5",
    "convert --stiffness K.mtx --mass M.mtx --nodes @ --dofs dofs.csv --units m,kg,s -o new.h5",
    "convert --stiffness K.mtx --mass M.mtx --nodes nodes.csv --dofs @ --units m,kg,s -o new.h5",
    "convert model.toml --scene @ -o new.h5",
    "convert model.toml --modes 4 --basis imported --shapes @ -o new.h5",
    "convert model.toml --modes 4 --lumped @ -o new.h5",
    "convert --from sid @ --units m,kg,s -o new.h5",
    "simulate body.h5 --scene @ -o new.h5",
    "simulate @ --scene scene.toml -o new.h5",
    "select @ --scene scene.toml",
    "trade body.h5 --scene @",
    "response model.toml @ --band 0..100 --from 1 --to 1",
    "inspect @",
    "check @",
    "check body.h5 --against @",
    "compare body.h5 @",
    "view @ -o new.html",
    "view body.h5 --simulation @ -o new.html",
    "export @ --to npz -o new.npz",
    "audit @",
    "batch @",
];

/// Pipes would wait for a writer, and devices may never end.
#[test]
fn pipes_devices_and_folders_are_no_inputs() {
    let folder = folder();
    fs::create_dir(folder.path().join("folder")).expect("a folder");
    for file in ["pipe", "/dev/zero", "folder", "/dev/null"] {
        for line in INPUTS {
            let words = line.replace('@', file);
            let ended = run(folder.path(), &words);
            assert_eq!(ended.status.code(), Some(2), "{words}: {}", said(&ended));
        }
    }
    assert!(
        !members(folder.path()).iter().any(|name| name.starts_with("new") || name.starts_with(".flexbody"))
    );
}

/// Pipes and devices referred to by other files are refused too.
#[test]
fn pipes_and_devices_that_files_name_are_no_inputs() {
    let folder = folder();
    let path = folder.path();
    let brick =
        "[files]\nstiffness = \"K.mtx\"\nmass = \"M.mtx\"\nnodes = \"nodes.csv\"\ndofs = \"dofs.csv\"\n";
    let history = |file: &str| {
        format!(
            "[run]\nduration = 1e-4\n[[load]]\nnode = 1\nforce = [1, 0, 0]\nhistory = {{ file = \"{file}\", time = \"time\", value = \"f\" }}\n"
        )
    };
    for file in ["pipe", "/dev/zero"] {
        for (name, text, words) in [
            ("m.toml", brick.replace("K.mtx", file), "convert m.toml -o new.h5"),
            ("m.toml", brick.replace("M.mtx", file), "convert m.toml -o new.h5"),
            ("m.toml", brick.replace("nodes.csv", file), "convert m.toml -o new.h5"),
            ("m.toml", brick.replace("dofs.csv", file), "convert m.toml -o new.h5"),
            ("m.toml", format!("{brick}mesh = \"{file}\"\n"), "convert m.toml -o new.h5"),
            ("s.toml", history(file), "simulate body.h5 --scene s.toml -o new.h5"),
            (
                "job.inp",
                format!("*INCLUDE, INPUT={file}\n"),
                "convert job.inp --format abaqus --units m,kg,s -o new.h5",
            ),
            (
                "job.bdf",
                format!("BEGIN BULK\nINCLUDE '{file}'\nENDDATA\n"),
                "convert job.bdf --format nastran --units m,kg,s -o new.h5",
            ),
        ] {
            fs::write(path.join(name), text).expect("written");
            let ended = run(path, words);
            assert_eq!(ended.status.code(), Some(2), "{words} with {file}: {}", said(&ended));
        }
        // A body of the list fails, and the batch continues.
        let list = format!("[[body]]\nmodel = \"{file}\"\noutput = \"new.h5\"\n");
        fs::write(path.join("l.toml"), list).expect("written");
        let ended = run(path, "batch l.toml");
        assert!(matches!(ended.status.code(), Some(1 | 2)), "batch of {file}: {}", said(&ended));
    }
    assert!(!members(path).iter().any(|name| name.starts_with("new") || name.starts_with(".flexbody")));
}

/// The files that a batch and a prepared folder keep for themselves may be pipes, too.
#[test]
fn pipes_in_the_places_of_files_that_the_program_keeps_are_refused() {
    let folder = folder();
    let path = folder.path();
    fs::rename(path.join("pipe"), path.join("list.toml.done")).expect("renamed");
    let ended = run(path, "batch list.toml");
    assert_eq!(ended.status.code(), Some(2), "{}", said(&ended));
    assert!(said(&ended).contains("error[FB107]"), "{}", said(&ended));
    assert!(!path.join("b.h5").exists());
    assert!(run(path, "prepare model.toml --modes 4 -o job").status.success());
    for name in ["prepared.jsonl", "result.jsonl"] {
        let _ = fs::remove_file(path.join("job").join(name));
        assert!(Command::new("mkfifo").arg(path.join("job").join(name)).status().expect("mkfifo").success());
        let ended = run(path, "assemble job -o new.h5");
        assert_eq!(ended.status.code(), Some(2), "{name}: {}", said(&ended));
    }
}

/// The temporary file has a short name, so that the name of the output is checked before the work. The model
/// is invalid, but the error of the name comes first.
#[test]
fn names_that_are_too_long_are_refused_before_the_work() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("K.mtx"), "nothing to read").expect("written");
    let long = "n".repeat(252);
    std::os::unix::fs::symlink(format!("{long}.target"), path.join("link.h5")).expect("a link");
    for words in [
        format!("convert model.toml -o {long}.flex.h5"),
        "convert model.toml -o link.h5".to_owned(),
        format!("convert model.toml -o {}/b.h5", "d".repeat(300)),
        format!("convert model.toml -o new.h5 --report {long}.html"),
        format!("simulate nothing.h5 --scene scene.toml -o {long}.motion.h5"),
        format!("simulate nothing.h5 --scene scene.toml --csv {long}.motion.csv"),
        format!("select nothing.h5 --scene scene.toml --report {long}.json"),
        format!("trade body.h5 --scene scene.toml --csv {long}.trade.csv"),
        format!("response model.toml body.h5 --band 0..100 --from 1 --to 1 --csv {long}.answer.csv"),
        format!("inspect body.h5 --report {long}.html"),
        format!("compare body.h5 body.h5 --report {long}.html"),
        format!("view body.h5 -o {long}.html"),
        format!("export body.h5 --to npz -o {long}.archive"),
        format!("batch list.toml --report {long}.json"),
    ] {
        let ended = run(path, &words);
        assert_eq!(ended.status.code(), Some(2), "{words}: {}", said(&ended));
        let told = said(&ended);
        assert!(told.contains("error[FB107]") && told.contains("too long"), "{words}: {told}");
    }
    // The ledger of a batch has a longer name than its list.
    let list = format!("{}.toml", "l".repeat(247));
    fs::copy(path.join("list.toml"), path.join(&list)).expect("copied");
    let ended = run(path, &format!("batch {list}"));
    assert!(said(&ended).contains("error[FB107]"), "{}", said(&ended));
    assert!(!members(path).iter().any(|name| name.starts_with(".flexbody")));
}

/// An output without write permission ends a run with the exit code of a full disk.
#[test]
fn outputs_that_may_not_be_written_are_refused_before_the_work() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("K.mtx"), "nothing to read").expect("written");
    fs::write(path.join("old.h5"), "old").expect("written");
    fs::set_permissions(path.join("old.h5"), Permissions::from_mode(0o444)).expect("a mode");
    for (output, code) in [("old.h5", "FB121"), ("/proc/new.h5", "FB1"), ("/dev/stdout", "FB107")] {
        let ended = run(path, &format!("convert model.toml -o {output}"));
        assert!(said(&ended).contains(&format!("error[{code}")), "{output}: {}", said(&ended));
        assert!(code != "FB121" || ended.status.code() == Some(4), "{output}");
    }
    // A stream that is a deleted file.
    let words = "exec \"$0\" convert model.toml -o /dev/stdout > gone; ";
    let ended = Command::new("sh")
        .args(["-c", &format!("exec 3> gone; rm gone; {}", words.replace("> gone", ">&3"))])
        .arg(program())
        .current_dir(path)
        .output()
        .expect("the program");
    assert_eq!(ended.status.code(), Some(2), "{}", said(&ended));
    assert!(said(&ended).contains("error[FB107]"), "{}", said(&ended));
}

#[test]
fn an_output_keeps_the_mode_of_the_file_that_it_replaces() {
    let folder = folder();
    let path = folder.path();
    for mode in [0o600, 0o640, 0o664, 0o755] {
        for name in ["new.h5", "new.html"] {
            fs::write(path.join(name), "old").expect("written");
            fs::set_permissions(path.join(name), Permissions::from_mode(mode)).expect("a mode");
        }
        assert!(run(path, "convert model.toml --modes 4 -o new.h5 --report new.html").status.success());
        for name in ["new.h5", "new.html"] {
            let meta = fs::metadata(path.join(name)).expect("an output");
            assert_eq!(meta.mode() & 0o7777, mode, "{name}");
            assert!(meta.len() > 3, "{name}");
        }
    }
    // A new file has the mode given by the umask.
    let made = Command::new("sh")
        .args(["-c", "umask 027; exec \"$0\" inspect body.h5 --report made.html"])
        .arg(program())
        .current_dir(path)
        .output()
        .expect("the program");
    assert!(made.status.success());
    assert_eq!(fs::metadata(path.join("made.html")).expect("an output").mode() & 0o7777, 0o640);
}

/// Only root can give a file away; a test as another user checks the own user only.
#[test]
fn an_output_keeps_the_owner_of_the_file_that_it_replaces() {
    let folder = folder();
    let old = folder.path().join("new.html");
    fs::write(&old, "old").expect("written");
    let _ = std::os::unix::fs::chown(&old, Some(1234), Some(1234));
    let before = fs::metadata(&old).expect("a file");
    assert!(run(folder.path(), "inspect body.h5 --report new.html").status.success());
    let after = fs::metadata(&old).expect("a file");
    assert!(after.len() > 3);
    assert_eq!((after.uid(), after.gid(), after.mode()), (before.uid(), before.gid(), before.mode()));
}

/// A run with an unreasonable number of threads succeeds without exhausting the memory.
#[test]
fn so_many_threads_that_no_machine_has_them_are_no_fault() {
    let folder = folder();
    let path = folder.path();
    let ended = run(path, "convert model.toml --modes 4 --threads 65535 -o new.h5");
    assert!(ended.status.success(), "{}", said(&ended));
    assert_eq!(
        fs::read(path.join("new.h5")).expect("a body"),
        fs::read(path.join("body.h5")).expect("a body")
    );
    let list = fs::read_to_string(path.join("list.toml")).expect("a list");
    fs::write(path.join("list.toml"), format!("threads = 65535\nparallel = 1000000000\n{list}"))
        .expect("written");
    let ended = run(path, "batch list.toml");
    assert!(ended.status.success(), "{}", said(&ended));
    let ended = Command::new(program())
        .args(["convert", "model.toml", "--modes", "4", "-o", "other.h5"])
        .env("RAYON_NUM_THREADS", "1000000")
        .current_dir(path)
        .output()
        .expect("the program");
    assert!(ended.status.success(), "{}", said(&ended));
}

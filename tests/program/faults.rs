//! Every single failure of the system while outputs are written: the n-th write, sync, rename, close, open or truncation
//! fails, for n = 1, 2, ... until a run meets no failure. The program ends with exit code 4 and all old files, or with 0
//! and all new files whole.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use flexbody_base::error::ExitCode;
use flexbody_base::provenance::sha256_hex;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Kinds of calls that fail, without `close`.
const CALLS: [&str; 5] = ["write", "fsync", "rename", "open", "truncate"];

/// SHA-256 of the files of a folder, by name.
type Contents = BTreeMap<String, String>;

/// A folder with inputs, and the library that makes calls fail.
struct Bench {
    folder: tempfile::TempDir,
    library: PathBuf,
}

impl Bench {
    /// Makes the body of a cube and a scene.
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let library = folder.path().join("faults.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/faults/faults.c");
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
        let compiled = Command::new(compiler)
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .args([&library, &source])
            .arg("-ldl")
            .status();
        assert!(compiled.expect("a C compiler").success());
        let scene = "[run]\nduration = 1e-3\noutputs = 10\n[initial]\nangular_velocity = [1.0, 2.0, 3.0]\n";
        std::fs::write(folder.path().join("scene.toml"), scene).expect("a scene");
        let bench = Self { folder, library };
        let model = oracle::fixtures().join("models/cube_hex8/model.toml");
        let model = model.to_str().expect("our path");
        bench.succeed(&["convert", model, "--modes", "3", "-o", "cube.flex.h5"]);
        bench
    }

    fn place(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().expect("our path").to_owned()
    }

    /// Makes a body with a recovery, and its motion.
    fn recover(&self) {
        let folder = self.folder.path();
        for entry in
            std::fs::read_dir(oracle::fixtures().join("models/cube_hex8")).expect("a model").flatten()
        {
            std::fs::copy(entry.path(), folder.join(entry.file_name())).expect("a copy");
        }
        let manifest = folder.join("model.toml");
        let cut = "\n[[recovery]]\nname = \"section\"\nabout = [0, 0, 0]\n\
                   box = { min = [-1e3, -1e3, -1e3], max = [1e-3, 1e3, 1e3] }\n";
        let text = std::fs::read_to_string(&manifest).expect("a manifest") + cut;
        std::fs::write(&manifest, text).expect("a manifest");
        self.succeed(&["convert", "model.toml", "--modes", "3", "-o", "rows.flex.h5"]);
        self.succeed(&["simulate", "rows.flex.h5", "--scene", "scene.toml", "--csv", "run.csv"]);
    }

    fn succeed(&self, arguments: &[&str]) {
        let run = program(self.folder.path(), arguments, &[]);
        assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    }

    /// Runs `arguments`, whose outputs have names without folders, with every single fault of the kinds `calls`, and
    /// returns the number of runs.
    fn try_all(&self, arguments: &[&str], calls: &[&str], errors: &[i32]) -> usize {
        let outputs = tempfile::tempdir().expect("a folder");
        let outputs = outputs.path();
        let run = program(outputs, arguments, &[]);
        assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
        let new = contents(outputs);
        // What holds the time of the run differs from run to run.
        let again = program(outputs, arguments, &[]);
        assert!(again.status.success());
        let same: Contents = contents(outputs).into_iter().filter(|(name, sum)| new[name] == *sum).collect();
        assert!(!same.is_empty(), "{arguments:?}: no output is the same in two runs");
        let mut runs = 0;
        for (call, error) in calls.iter().flat_map(|call| errors.iter().map(move |error| (call, error))) {
            for number in 1.. {
                runs += 1;
                if !self.try_one(outputs, arguments, (call, *error, number), &new, &same) {
                    break;
                }
            }
        }
        runs
    }

    /// Returns true if the run has met its fault.
    fn try_one(
        &self,
        outputs: &Path,
        arguments: &[&str],
        (call, error, number): (&str, i32, usize),
        new: &Contents,
        same: &Contents,
    ) -> bool {
        for entry in std::fs::read_dir(outputs).expect("a folder").flatten() {
            std::fs::remove_file(entry.path()).expect("a file");
        }
        for name in new.keys() {
            std::fs::write(outputs.join(name), format!("what {name} was before")).expect("a file");
        }
        let old = contents(outputs);
        let (counts, wanted, errno) = (self.place("counts"), number.to_string(), error.to_string());
        let library = self.library.to_str().expect("our path");
        let variables = [
            ("LD_PRELOAD", library),
            ("FAULT_CALL", call),
            ("FAULT_N", &wanted),
            ("FAULT_ERROR", &errno),
            ("FAULT_COUNTS", &counts),
        ];
        let run = program(outputs, arguments, &variables);
        let said = String::from_utf8_lossy(&run.stderr);
        let case = format!("{arguments:?}, {call} {number} gives {error}: {:?} {said}", run.status);
        let found = contents(outputs);
        match run.status.code() {
            Some(code) if code == ExitCode::Resources as i32 => assert_eq!(found, old, "{case}"),
            Some(0) => {
                assert!(found.keys().eq(new.keys()), "{case}: {found:?}");
                assert!(
                    found.iter().all(|(name, sum)| same.get(name).is_none_or(|same| same == sum)),
                    "{case}"
                );
                assert!(found.iter().all(|(name, sum)| old[name] != *sum), "{case}");
            }
            _ => panic!("{case}"),
        }
        let seen: usize = std::fs::read_to_string(&counts).expect("counts").trim().parse().expect("a number");
        seen >= number
    }
}

fn program(folder: &Path, arguments: &[&str], variables: &[(&str, &str)]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(arguments)
        .arg("--quiet")
        .envs(variables.iter().copied())
        .current_dir(folder)
        .output()
        .expect("the program")
}

fn contents(folder: &Path) -> Contents {
    let files = std::fs::read_dir(folder).expect("a folder").flatten();
    let named = files.map(|file| {
        let bytes = std::fs::read(file.path()).expect("a file");
        (file.file_name().to_string_lossy().into_owned(), sha256_hex(&bytes))
    });
    named.collect()
}

/// A body with a report, and an export.
#[test]
fn one_failed_call_gives_the_old_files_or_whole_new_ones() {
    let bench = Bench::new();
    let model = oracle::fixtures().join("small/tet4/model.toml");
    let model = model.to_str().expect("our path");
    let convert = ["convert", model, "--modes", "2", "-o", "new.flex.h5", "--report", "new.json"];
    assert!(bench.try_all(&convert, &CALLS, &[libc::ENOSPC]) > 20);
    let cube = bench.place("cube.flex.h5");
    let export = ["export", &cube, "--to", "exudyn", "-o", "new.hdf5", "--allow-loss"];
    assert!(bench.try_all(&export, &CALLS, &[libc::EIO]) > 5);
}

/// Motions and recoveries; with `FLEXBODY_FAULTS=all`, some minutes, every command and every error of a disk.
#[test]
#[ignore = "slow"]
fn one_failed_call_of_any_command_gives_the_old_files_or_whole_new_ones() {
    let bench = Bench::new();
    let model = oracle::fixtures().join("small/tet4/model.toml");
    let model = model.to_str().expect("our path");
    let cube_model = oracle::fixtures().join("models/cube_hex8/model.toml");
    let cube_model = cube_model.to_str().expect("our path");
    bench.recover();
    let [cube, rows, scene, run] =
        ["cube.flex.h5", "rows.flex.h5", "scene.toml", "run.csv"].map(|name| bench.place(name));
    let export = |to: &'static str, file: &'static str| {
        vec!["export", cube.as_str(), "--to", to, "-o", file, "--allow-loss"]
    };
    let commands = [
        vec!["convert", model, "--modes", "3", "-o", "new.flex.h5", "--report", "new.html"],
        vec!["reduce", &cube, "--keep-modes", "1,2", "-o", "new.flex.h5"],
        vec!["simulate", &cube, "--scene", &scene, "-o", "new.h5", "--csv", "new.csv"],
        vec!["recover", &rows, "--history", &run, "-o", "new.h5"],
        vec!["shapes", &cube, "--model", cube_model, "--to", "csv", "-o", "new.csv"],
        export("exudyn", "new.hdf5"),
        export("mbsim", "new.h5"),
        export("mbdyn", "new.fem"),
        export("sid", "new.SID_FEM"),
        export("json", "new.json"),
    ];
    let all = std::env::var_os("FLEXBODY_FAULTS").is_some_and(|value| value == "all");
    let few = [2, 3].map(|k| commands[k].clone());
    for arguments in if all { &commands[..] } else { &few[..] } {
        assert!(bench.try_all(arguments, &CALLS, &[libc::ENOSPC]) > 10, "{arguments:?}");
    }
    if all {
        for arguments in [&commands[0], &commands[2]] {
            assert!(bench.try_all(arguments, &["write"], &[libc::EIO, libc::EDQUOT]) > 10, "{arguments:?}");
        }
        // A run closes hundreds of files and descriptors; one command stands for all.
        assert!(bench.try_all(&commands[0], &["close"], &[libc::EIO]) > 10);
    }
}

/// Variables that HDF5 obeys change nothing: neither how a file is written, nor what code is loaded.
#[test]
fn variables_of_hdf5_change_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = oracle::fixtures().join("small/tet4/model.toml");
    let convert = ["convert", model.to_str().expect("our path"), "--modes", "2", "-o", "new.flex.h5"];
    let run = |variables: &[(&str, &str)]| {
        let ended = program(folder.path(), &convert, variables);
        assert!(ended.status.success(), "{variables:?}: {ended:?}");
        contents(folder.path())
    };
    let expected = run(&[]);
    for (name, value) in [
        ("HDF5_DRIVER", "split"),
        ("HDF5_DRIVER", "family"),
        ("HDF5_DRIVER", "evil"),
        ("HDF5_VOL_CONNECTOR", "evil under_vol=0;under_info={}"),
        ("HDF5_PLUGIN_PATH", "/nowhere"),
        ("HDF5_PLUGIN_PRELOAD", "::"),
    ] {
        assert_eq!(run(&[(name, value)]), expected, "{name}={value}");
    }
}

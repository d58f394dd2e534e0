//! Hostile files: changed while they are read, loading code, sending commands to the terminal, referring to
//! other files.

use crate::program::flexbody;
use oracle::{fixtures, members};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// Creates a folder with a tetrahedron and its manifest.
fn tet4() -> TempDir {
    copied("small/tet4")
}

fn copied(name: &str) -> TempDir {
    let (folder, from) = (tempfile::tempdir().expect("a folder"), fixtures().join(name));
    for file in members(&from) {
        fs::copy(from.join(&file), folder.path().join(&file)).expect("copied");
    }
    folder
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Replaces a text that occurs once in a file.
fn edit(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).expect("a text");
    assert_eq!(text.matches(from).count(), 1, "{from}");
    fs::write(path, text.replace(from, to)).expect("written");
}

/// Creates a folder with the connecting rod and uncompressed matrices.
fn unpacked_rod() -> TempDir {
    let folder = copied("models/connecting_rod");
    for name in ["K", "M"] {
        let packed = folder.path().join(format!("{name}.mtx.gz"));
        let mut text = Vec::new();
        let file = fs::File::open(&packed).expect("a file");
        std::io::copy(&mut flate2::read::GzDecoder::new(file), &mut text).expect("unpacked");
        fs::write(folder.path().join(format!("{name}.mtx")), text).expect("written");
        fs::remove_file(packed).expect("removed");
    }
    let manifest = folder.path().join("model.toml");
    let text = fs::read_to_string(&manifest).expect("a manifest").replace(".mtx.gz", ".mtx");
    fs::write(manifest, text).expect("written");
    folder
}

/// An FE program restarts while its matrices are read: the files are truncated and written again.
#[cfg(unix)]
#[test]
#[ignore = "slow"]
fn matrices_that_are_cut_off_while_they_are_read_end_no_run() {
    use std::os::unix::process::ExitStatusExt;
    let mut refused = 0;
    for run in 0..16u64 {
        let folder = unpacked_rod();
        let matrix = folder.path().join(["K.mtx", "M.mtx"][run as usize % 2]);
        let program = Command::new(env!("CARGO_BIN_EXE_flexbody"))
            .args(["convert", "model.toml", "--modes", "4", "-o", "b.flex.h5", "--quiet"])
            .current_dir(folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program");
        std::thread::sleep(std::time::Duration::from_millis(8 * run));
        let text = fs::read(&matrix).expect("a matrix");
        fs::write(&matrix, b"").expect("cut off");
        if run % 4 < 2 {
            fs::write(&matrix, text).expect("written");
        }
        let output = program.wait_with_output().expect("an end");
        let said = told(&output);
        assert_eq!(output.status.signal(), None, "run {run}: {said}");
        let left = members(folder.path());
        assert!(left.iter().all(|name| !name.starts_with(".flexbody")), "run {run}: {left:?}");
        match output.status.code() {
            Some(0) => {}
            // Before the matrix was opened it was empty, or partially written.
            Some(2) if said.contains("FB132") => refused += 1,
            code => assert!(code == Some(2), "run {run}: {code:?} {said}"),
        }
    }
    assert!(refused > 0, "no run met the change");
}

/// Builds a library that writes a file beside it when it is loaded; `None` without a C compiler.
#[cfg(target_os = "linux")]
fn telling_library(folder: &Path) -> Option<PathBuf> {
    let mark = folder.join("loaded");
    let source = format!(
        "#include <stdio.h>\n__attribute__((constructor)) static void tell(void) \
         {{ FILE *f = fopen(\"{}\", \"w\"); if (f) fclose(f); }}\n",
        mark.display()
    );
    fs::write(folder.join("tell.c"), source).expect("written");
    let built = Command::new("cc")
        .args(["-shared", "-fPIC", "-o", "libtell.so", "tell.c"])
        .current_dir(folder)
        .status();
    built.is_ok_and(|status| status.success()).then_some(mark)
}

/// The number of an unknown filter makes HDF5 search for a plugin, which loads every library of the folder.
#[cfg(target_os = "linux")]
#[test]
fn no_file_makes_hdf5_load_libraries() {
    let (folder, plugins) = (tet4(), tempfile::tempdir().expect("a folder"));
    let Some(mark) = telling_library(plugins.path()) else { return };
    let of = fixtures().join("cases/files/FB101-hdf5_unknown_filter/K.h5");
    fs::copy(of, folder.path().join("K.h5")).expect("copied");
    edit(&folder.path().join("model.toml"), "K.mtx", "K.h5");
    let run = Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(["convert", "model.toml", "-o", "b.h5"])
        .env("HDF5_PLUGIN_PATH", plugins.path())
        .current_dir(folder.path())
        .output()
        .expect("the program");
    assert!(run.status.code() == Some(2) && told(&run).contains("FB101"), "{}", told(&run));
    assert!(!mark.exists(), "a library was loaded");
}

/// Python files beside the model or the driver are data and are not executed.
#[cfg(unix)]
#[test]
fn python_packages_are_not_taken_from_folders_of_data() {
    let folder = tet4();
    let mark = folder.path().join("loaded");
    for package in ["slepc4py", "petsc4py", "numpy", "argparse"] {
        let text = format!("open({:?}, 'w').close()\n", mark.display().to_string());
        fs::write(folder.path().join(format!("{package}.py")), text).expect("written");
    }
    let slepc = "convert model.toml --modes 2 -o b.h5 --engine slepc --mpiexec true --python python3";
    let words: Vec<&str> = slepc.split_whitespace().collect();
    let run = flexbody(folder.path(), &words);
    assert!([Some(2), Some(3)].contains(&run.status.code()), "{}", told(&run));
    assert!(!mark.exists(), "a file of the current folder was run");
    let prepared = flexbody(folder.path(), &["prepare", "model.toml", "--modes", "2", "-o", "job"]);
    assert!(prepared.status.success(), "{}", told(&prepared));
    for package in ["slepc4py", "argparse"] {
        let name = format!("{package}.py");
        fs::copy(folder.path().join(&name), folder.path().join("job").join(&name)).expect("copied");
    }
    // The driver may fail for missing packages.
    let _ = Command::new("python3").args(["job/driver.py", "--probe"]).current_dir(folder.path()).output();
    assert!(!mark.exists(), "a file beside the driver was run");
}

#[cfg(unix)]
#[test]
fn a_list_of_bodies_starts_no_program_that_the_command_line_does_not_allow() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tet4();
    let (program, mark) = (folder.path().join("started.sh"), folder.path().join("mark"));
    fs::write(&program, format!("#!/bin/sh\n: > '{}'\nexit 1\n", mark.display())).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("may be started");
    for option in ["--mpiexec", "--python"] {
        let options =
            format!("[\"--modes\", \"2\", \"--engine\", \"slepc\", \"{option}={}\"]", program.display());
        let list = format!("[[body]]\nmodel = \"model.toml\"\noutput = \"b.flex.h5\"\noptions = {options}\n");
        fs::write(folder.path().join("list.toml"), list).expect("written");
        let run = flexbody(folder.path(), &["batch", "list.toml"]);
        let said = told(&run);
        assert!(run.status.code() == Some(2) && said.contains("FB770") && said.contains(option), "{said}");
        assert!(!mark.exists(), "{option}: the program of the list was started");
    }
    let _ = flexbody(folder.path(), &["batch", "list.toml", "--allow-programs"]);
    let says = flexbody(folder.path(), &["batch", "--help"]);
    assert!(String::from_utf8_lossy(&says.stdout).contains("--allow-programs"));
}

/// Names of groups in a file appear in messages, names of interfaces in summaries.
#[test]
fn no_text_of_a_file_is_a_command_to_the_terminal() {
    let folder = tet4();
    let file = hdf5_metno::File::create(folder.path().join("K.h5")).expect("a file");
    for name in ["\u{1b}[31mK1", "\u{1b}]0;t\u{7}K2"] {
        let group = file.create_group(name).expect("a group");
        for dataset in ["data", "indices", "indptr"] {
            group.new_dataset_builder().with_data(&[0_i32]).create(dataset).expect("a dataset");
        }
    }
    file.close().expect("closed");
    edit(&folder.path().join("model.toml"), "K.mtx", "K.h5");
    let run = flexbody(folder.path(), &["convert", "model.toml", "-o", "b.h5"]);
    let said = told(&run);
    assert!(run.status.code() == Some(2) && said.contains("K1") && said.contains("\\u{1b}[31m"), "{said}");
    assert!(!said.contains(['\u{1b}', '\u{7}']), "{said:?}");
}

/// A manifest may name any file of the machine.
#[test]
fn files_outside_of_the_folder_of_a_manifest_are_not_quoted() {
    let secret = "root:$6$salt$hash:19000:0:99999:7:::";
    let outside = tempfile::NamedTempFile::new().expect("a file");
    fs::write(outside.path(), format!("{secret}\n{secret}\n")).expect("written");
    for (name, key) in [("nodes.csv", "nodes"), ("dofs.csv", "dofs"), ("K.mtx", "stiffness")] {
        let folder = tet4();
        let manifest = folder.path().join("model.toml");
        edit(
            &manifest,
            &format!("{key} = \"{name}\""),
            &format!("{key} = {:?}", outside.path().display().to_string()),
        );
        let run = flexbody(folder.path(), &["convert", "model.toml", "-o", "b.h5"]);
        let said = told(&run);
        assert!(run.status.code() == Some(2) && said.contains("...`"), "{key}: {said}");
        assert!(!said.contains("root") && !said.contains("salt"), "{key}: {said}");
        // The text of a file beside the manifest is quoted, because that helps the user.
        fs::write(folder.path().join(name), secret).expect("written");
        edit(&manifest, &format!("{:?}", outside.path().display().to_string()), &format!("{name:?}"));
        let run = flexbody(folder.path(), &["convert", "model.toml", "-o", "b.h5"]);
        assert!(told(&run).contains("root:$6"), "{key}: {}", told(&run));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn names_that_are_not_utf_8_are_written_and_read() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = tet4();
    let strange = folder.path().join(OsStr::from_bytes(b"\xff\xfe folder"));
    fs::create_dir(&strange).expect("a folder");
    let body = strange.join(OsStr::from_bytes(b"\xff body.flex.h5"));
    let run = |words: &[&OsStr]| {
        let program =
            Command::new(env!("CARGO_BIN_EXE_flexbody")).args(words).current_dir(folder.path()).output();
        let run = program.expect("the program");
        assert!(run.status.success(), "{}", told(&run));
    };
    let word = OsStr::new;
    run(&[word("convert"), word("model.toml"), word("--modes"), word("2"), word("-o"), body.as_os_str()]);
    run(&[word("inspect"), body.as_os_str()]);
    // A UTF-8 name gives equal bytes.
    run(&[word("convert"), word("model.toml"), word("--modes"), word("2"), word("-o"), word("b.flex.h5")]);
    assert!(fs::read(&body).expect("a body") == fs::read(folder.path().join("b.flex.h5")).expect("a body"));
}

/// Each file includes the next one four times: 4^8 files, none of which includes itself.
#[test]
fn a_deck_includes_no_more_than_a_thousand_files() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("l0.inp"), "*NODE\n1, 0, 0, 0\n").expect("written");
    for level in 1..9 {
        let text = format!("*INCLUDE, INPUT=l{}.inp\n", level - 1).repeat(4);
        fs::write(folder.path().join(format!("l{level}.inp")), text).expect("written");
    }
    let words = ["convert", "l8.inp", "--format", "abaqus", "--units", "m,kg,s", "-o", "b.h5"];
    fs::write(folder.path().join("l8_STIF1.mtx"), "1 1 1\n").expect("written");
    fs::write(folder.path().join("l8_MASS1.mtx"), "1 1 1\n").expect("written");
    let run = flexbody(folder.path(), &words);
    let said = told(&run);
    assert!(
        run.status.code() == Some(2) && said.contains("FB110") && said.contains("more than 1000"),
        "{said}"
    );
}

/// Repeated mistakes in a manifest are listed a few times, and no more interfaces are read than a body can
/// have.
#[test]
fn a_manifest_with_very_many_interfaces_is_refused_in_short() {
    let folder = tet4();
    let manifest = folder.path().join("model.toml");
    let text = fs::read_to_string(&manifest).expect("a manifest");
    for (count, words) in [(5000, "4799 more findings are not shown"), (100_000, "a body has at most 6000")] {
        let interfaces = "[[interface]]\nname = 'a'\nnodes = [1]\n".repeat(count);
        fs::write(&manifest, format!("{text}\n{interfaces}")).expect("written");
        let run = flexbody(folder.path(), &["convert", "model.toml", "-o", "b.h5"]);
        let said = told(&run);
        assert!(run.status.code() == Some(2) && said.contains(words), "{said}");
        assert!(said.lines().count() < 1000);
    }
}

/// The address space is limited, so that the program knows the available memory.
#[cfg(target_os = "linux")]
#[test]
fn what_a_head_announces_is_held_to_the_memory_that_is_left() {
    let folder = tet4();
    let head = "%%MatrixMarket matrix coordinate real symmetric\n1000000 1000000 200000000\n1 1 1\n";
    let packed =
        ruzstd::encoding::compress_to_vec(head.as_bytes(), ruzstd::encoding::CompressionLevel::Fastest);
    fs::write(folder.path().join("K.mtx.zst"), packed).expect("written");
    edit(&folder.path().join("model.toml"), "K.mtx", "K.mtx.zst");
    let run = Command::new("sh")
        .args(["-c", "ulimit -v 3000000 && exec \"$@\"", "sh", env!("CARGO_BIN_EXE_flexbody")])
        .args(["convert", "model.toml", "-o", "b.h5"])
        .current_dir(folder.path())
        .output()
        .expect("a shell");
    let said = told(&run);
    assert!(
        run.status.code() == Some(4) && said.contains("a matrix of 200000000 entries takes 5.600 GB"),
        "{said}"
    );
}

/// Each of 40000 lines places a part once more: its nodes are refused before there are any.
#[test]
fn instances_of_parts_are_held_to_the_memory_that_is_left() {
    let folder = tet4();
    let nodes: String = (1..=20_000).map(|id| format!("{id},{id}.,0.,0.\n")).collect();
    let instances: String =
        (0..40_000).map(|k| format!("*INSTANCE,NAME=I{k},PART=P\n*END INSTANCE\n")).collect();
    let deck = format!("*PART,NAME=P\n*NODE\n{nodes}*END PART\n*ASSEMBLY,NAME=A\n{instances}*END ASSEMBLY\n");
    fs::write(folder.path().join("nodes.inp"), deck).expect("written");
    edit(&folder.path().join("model.toml"), "nodes.csv", "nodes.inp");
    let run = Command::new("sh")
        .args(["-c", "ulimit -v 3000000 && exec \"$@\"", "sh", env!("CARGO_BIN_EXE_flexbody")])
        .args(["convert", "model.toml", "-o", "b.h5"])
        .current_dir(folder.path())
        .output()
        .expect("a shell");
    let said = told(&run);
    assert!(run.status.code() == Some(4) && said.contains("nodes and elements of instances takes"), "{said}");
}

//! No output replaces a file that a command reads, even if no argument names it: included or assigned files
//! of a deck, a history of a scene, a file under the name of a link.

use crate::program::flexbody;
use oracle::{fixtures, members};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Copies the small job `name` into a folder of its own.
fn job(name: &str) -> TempDir {
    let (folder, from) = (tempfile::tempdir().expect("a folder"), fixtures().join("small").join(name));
    for file in members(&from) {
        fs::copy(from.join(&file), folder.path().join(&file)).expect("copied");
    }
    folder
}

/// Returns every file below a folder with its contents.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for name in members(folder) {
        let path = folder.join(name);
        if path.is_dir() {
            all.extend(contents(&path));
        } else {
            all.push((path.clone(), fs::read(&path).expect("a file")));
        }
    }
    all
}

/// Asserts that the command is refused for its output and leaves every file unchanged.
fn refuses(folder: &Path, line: &str) {
    let before = contents(folder);
    let words: Vec<&str> = line.split_whitespace().collect();
    let run = flexbody(folder, &words);
    let told = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{line}: {told}");
    assert!(told.contains("is an input or another output of this run"), "{line}: {told}");
    assert!(contents(folder) == before, "{line}");
}

/// All files of these jobs are inputs; some are included or assigned under unrelated names.
#[test]
fn files_of_a_job_are_not_replaced_whatever_they_are_called() {
    for (name, deck) in [
        ("calculix", "job.inp"),
        ("nastran", "job.bdf"),
        ("nastran_op4", "job.bdf"),
        ("abaqus_substructure", "job.inp"),
    ] {
        let folder = job(name);
        if name == "nastran_op4" {
            let deck = folder.path().join(deck);
            let text = fs::read_to_string(&deck).expect("a deck");
            fs::write(&deck, format!("ASSIGN OUTPUT4='out/matrices.f12',UNIT=12\n{text}")).expect("written");
            fs::create_dir(folder.path().join("out")).expect("a folder");
            fs::rename(folder.path().join("job.op4"), folder.path().join("out/matrices.f12")).expect("moved");
        }
        for (path, _) in contents(folder.path()) {
            let file = path.strip_prefix(folder.path()).expect("below").display().to_string();
            refuses(folder.path(), &format!("convert {deck} --units m,kg,s --modes 4 -o {file}"));
        }
        let run =
            flexbody(folder.path(), &["convert", deck, "--units", "m,kg,s", "--modes", "4", "-o", "b.h5"]);
        assert!(run.status.success(), "{name}: {}", String::from_utf8_lossy(&run.stderr));
    }
}

#[cfg(unix)]
#[test]
fn links_to_included_files_and_other_spellings_are_inputs_for_every_command() {
    let folder = job("calculix");
    let path = folder.path();
    fs::create_dir(path.join("sub")).expect("a folder");
    std::os::unix::fs::symlink("../nodes.inp", path.join("sub/link.json")).expect("a link");
    fs::hard_link(path.join("nodes.inp"), path.join("hard.csv")).expect("a link");
    fs::hard_link(path.join("nodes.inp"), path.join("hard.json")).expect("a link");
    fs::write(path.join("s.toml"), "[run]\nduration = 0.001\n[spin]\nrate = 1\n").expect("written");
    let model = "job.inp --units m,kg,s --interface RIGHT";
    for line in [
        format!("convert {model} -o sub/../nodes.inp"),
        format!("convert {model} -o sub/link.json"),
        format!("convert {model} -o b.h5 --report hard.json"),
        format!("select {model} --scene s.toml --report hard.json"),
        format!("trade {model} --scene s.toml --csv hard.csv"),
        format!("response {model} --band 0..100 --from 11 --to 11 --csv hard.csv"),
        format!("response {model} --band 0..100 --from 11 --to 11 --report sub/link.json"),
    ] {
        refuses(path, &line);
    }
    // The output files of `prepare` have fixed names.
    fs::hard_link(path.join("nodes.inp"), path.join("sub/driver.py")).expect("a link");
    refuses(path, "prepare job.inp --units m,kg,s -o sub");
}

/// An output of the list must not replace an input of another body, and a report must not replace any input.
#[test]
fn a_batch_replaces_no_input_of_any_body() {
    let folder = job("calculix");
    let path = folder.path();
    fs::copy(path.join("job.inp"), path.join("other.inp")).expect("copied");
    for (list, report) in [
        ("[[body]]\nmodel = \"job.inp\"\noutput = \"nodes.inp\"\n", ""),
        (
            "[[body]]\nmodel = \"job.inp\"\noutput = \"a.h5\"\n[[body]]\nmodel = \"other.inp\"\noutput = \"job.inp\"\n",
            "",
        ),
        ("[[body]]\nmodel = \"job.inp\"\noutput = \"a.json\"\n", "--report a.json"),
    ] {
        fs::write(path.join("list.toml"), format!("options = [\"--units\", \"m,kg,s\"]\n{list}"))
            .expect("written");
        refuses(path, &format!("batch list.toml {report}"));
    }
}

/// The history of an unselected load case belongs to the scene too.
#[test]
fn histories_of_every_case_are_inputs() {
    let folder = job("brick");
    let path = folder.path();
    let made = flexbody(path, &["convert", "model.toml", "--modes", "4", "-o", "body.h5"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let column = "time,f\n0,0\n1,1\n";
    fs::write(path.join("a.csv"), column).expect("written");
    fs::write(path.join("b.csv"), column).expect("written");
    let case = |name: &str| {
        format!(
            "[[case]]\nname = \"{name}\"\n[[case.load]]\nnode = 1\nforce = [1, 0, 0]\nhistory = {{ file = \"{name}.csv\", time = \"time\", value = \"f\" }}\n"
        )
    };
    fs::write(path.join("s.toml"), format!("[run]\nduration = 1e-4\n{}{}", case("a"), case("b")))
        .expect("written");
    for line in [
        "simulate body.h5 --scene s.toml --case a --csv b.csv",
        "simulate body.h5 --scene s.toml --case a -o b.csv",
        "export body.h5 --to json -o b.csv --scene s.toml",
        "response body.h5 --scene s.toml --case a --band 0..100 --to 1 --csv b.csv",
    ] {
        refuses(path, line);
    }
}

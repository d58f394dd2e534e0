//! Answers of FE programs to shapes in every format that knows nodes, written by other libraries.

use crate::program::flexbody;
use flexbody_body::flex_body::Recovery;
use oracle::fixtures;
use std::fs;
use std::path::Path;

/// Converts the tetrahedron with answers. Returns its recovery, or what the program says about it.
fn converted(folder: &Path, answers: &Path) -> Result<Recovery, String> {
    let small = fixtures().join("small");
    for name in ["K.mtx", "M.mtx", "nodes.csv", "dofs.csv"] {
        fs::copy(small.join("tet4").join(name), folder.join(name)).expect("copied");
    }
    let manifest = fs::read_to_string(small.join("tet4/model.toml")).expect("a manifest");
    let ask = small.join("answers/ask.npz");
    let recovery = format!(
        "\n[[recovery]]\nname = \"skin\"\nshapes = '{}'\ndisplacements = '{}'\n",
        answers.display(),
        ask.display()
    );
    fs::write(folder.join("model.toml"), manifest + &recovery).expect("written");
    let line = "convert model.toml --modes 3 -o body.flex.h5";
    let run = flexbody(folder, &line.split(' ').collect::<Vec<_>>());
    match run.status.success() {
        true => {
            let body = flexbody_file::read(folder.join("body.flex.h5")).expect("a body");
            Ok(body.recoveries()[0].clone())
        }
        false => Err(String::from_utf8_lossy(&run.stderr).into_owned()),
    }
}

#[test]
fn answers_in_all_formats_give_the_same_stresses() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| fixtures().join("small/answers").join(name);
    let read =
        |name: &str| converted(folder.path(), &at(name)).unwrap_or_else(|said| panic!("{name}: {said}"));
    let expected = read("answers.h5");
    assert!(expected.modes.norm_max() > 1e3 && expected.rows.len() == 24);
    for name in ["answers.csv", "raw.vtu", "base64.vtu", "answers.e"] {
        assert_eq!(read(name), expected, "{name}");
    }
    // Text has fewer digits: nine, and the seven of a punch file.
    for (name, limit) in [("text.vtu", 1e-8), ("corners.pch", 1e-6), ("volume.pch", 1e-6)] {
        let text = read(name);
        let apart = (&text.modes - &expected.modes).norm_max() / expected.modes.norm_max();
        assert!(text.rows == expected.rows && apart < limit, "{name}: {apart:e}");
    }
}

#[test]
fn answers_of_other_files_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = fixtures().join("small/answers");
    let text = fs::read_to_string(place.join("text.vtu")).expect("a mesh");
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("written");
    put("gap.vtu", text.replace("\"stress 2\"", "\"other\"").as_bytes());
    put("numbers.vtu", text.replace("\"node\"", "\"id\"").as_bytes());
    put("none.vtu", text.replace("\"displacement ", "\"u ").replace("\"stress ", "\"s ").as_bytes());
    put("classic.e", b"CDF\x01 and more");
    let punched = fs::read_to_string(place.join("corners.pch")).expect("a punch file");
    put("shells.pch", punched.replace("39   (CTETRA)", "33   (CQUAD4)").as_bytes());
    for name in ["raw.vtu", "base64.vtu", "answers.e", "corners.pch", "volume.pch"] {
        let whole = fs::read(place.join(name)).expect("a file");
        put(&format!("cut_{name}"), &whole[..whole.len() / 2]);
    }
    for (name, code, part) in [
        ("gap.vtu", "FB327", "array `stress 2` is missing"),
        ("numbers.vtu", "FB327", "no array `node`"),
        ("none.vtu", "FB327", "no arrays `displacement 1` and `stress 1`"),
        ("classic.e", "FB327", "netCDF in its classic form"),
        ("cut_raw.vtu", "FB327", ""),
        ("cut_base64.vtu", "FB327", ""),
        ("cut_answers.e", "FB", ""),
        ("cut_corners.pch", "FB327", ""),
        ("cut_volume.pch", "FB327", ""),
        ("shells.pch", "FB327", "stresses of CQUAD4 elements"),
    ] {
        let said = converted(folder.path(), &folder.path().join(name)).expect_err(name);
        assert!(said.contains(code) && said.contains(part), "{name}: {said}");
    }
}

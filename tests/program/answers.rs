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
    if run.status.success() {
        let body = flexbody_file::read(folder.join("body.flex.h5")).expect("a body");
        Ok(body.recoveries()[0].clone())
    } else {
        Err(String::from_utf8_lossy(&run.stderr).into_owned())
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
    for name in ["answers.csv", "raw.vtu", "base64.vtu", "answers.e", "binary.vtk", "answers.pvd"]
        .into_iter()
        .chain(["classic.e", "offset64.e", "data64.e", "one_variable.e", "one_variable_classic.e"])
    {
        assert_eq!(read(name), expected, "{name}");
    }
    // One of the pieces is text.
    let pieces = read("pieces.pvtu");
    let apart = (&pieces.modes - &expected.modes).norm_max() / expected.modes.norm_max();
    assert!(pieces.rows == expected.rows && apart < 1e-8, "{apart:e}");
    // Text has fewer digits: nine, and the seven of a punch file.
    for (name, limit) in [("text.vtu", 1e-8), ("text.vtk", 1e-8), ("corners.pch", 1e-6), ("volume.pch", 1e-6)]
    {
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
    put("other.e", b"CDF\x01 and more");
    let classic = fs::read(place.join("classic.e")).expect("Exodus");
    let at = classic.windows(6).position(|bytes| bytes == b"disp_y").expect("a name");
    put("names.e", &[&classic[..at], b"part_y", &classic[at + 6..]].concat());
    let punched = fs::read_to_string(place.join("corners.pch")).expect("a punch file");
    put("shells.pch", punched.replace("39   (CTETRA)", "33   (CQUAD4)").as_bytes());
    for name in [
        "raw.vtu",
        "base64.vtu",
        "answers.e",
        "classic.e",
        "data64.e",
        "corners.pch",
        "volume.pch",
        "text.vtk",
        "binary.vtk",
    ] {
        let whole = fs::read(place.join(name)).expect("a file");
        put(&format!("cut_{name}"), &whole[..whole.len() / 2]);
    }
    for (name, code, part) in [
        ("gap.vtu", "FB327", "array `stress 2` is missing"),
        ("numbers.vtu", "FB327", "no array `node`"),
        ("none.vtu", "FB327", "no arrays `displacement 1` and `stress 1`"),
        ("other.e", "FB327", "the header"),
        ("names.e", "FB327", "no variable of the nodes is `disp_y`"),
        ("cut_classic.e", "FB327", "the file ends before the values of"),
        ("cut_data64.e", "FB327", "the file ends before the values of"),
        ("cut_raw.vtu", "FB327", ""),
        ("cut_base64.vtu", "FB327", ""),
        ("cut_answers.e", "FB", ""),
        ("cut_text.vtk", "FB327", ""),
        ("cut_binary.vtk", "FB327", "file ends before"),
        ("cut_corners.pch", "FB327", ""),
        ("cut_volume.pch", "FB327", ""),
        ("shells.pch", "FB327", "stresses of CQUAD4 elements"),
    ] {
        let said = converted(folder.path(), &folder.path().join(name)).expect_err(name);
        assert!(said.contains(code) && said.contains(part), "{name}: {said}");
    }
}

/// A parallel file has the points of all pieces, each once; pieces that do not fit each other are refused.
#[test]
fn pieces_are_refused_where_they_do_not_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = fixtures().join("small/answers");
    let list = fs::read_to_string(place.join("pieces.pvtu")).expect("a list");
    let text = fs::read_to_string(place.join("pieces_1.vtu")).expect("a piece");
    fs::copy(place.join("pieces_0.vtu"), folder.path().join("pieces_0.vtu")).expect("copied");
    let with = |name: &str, list: &str, second: &str| {
        fs::write(folder.path().join("pieces_1.vtu"), second).expect("written");
        fs::write(folder.path().join(name), list).expect("written");
        converted(folder.path(), &folder.path().join(name))
    };
    let whole = with("whole.pvtu", &list, &text).unwrap_or_else(|said| panic!("{said}"));
    assert_eq!(whole.rows.len(), 24);
    let first = "pieces_0.vtu";
    for (name, list, second, code, part) in [
        ("other.txt", list.clone(), text.clone(), "FB327", "its own name does not end with .pvtu"),
        ("missing.pvtu", list.replace("pieces_1.vtu", "gone.vtu"), text.clone(), "FB101", "gone.vtu"),
        (
            "arrays.pvtu",
            list.clone(),
            text.replace("\"stress 2\"", "\"other\""),
            "FB327",
            "piece has the arrays",
        ),
        ("numbers.pvtu", list.clone(), text.replace("\"node\"", "\"id\""), "FB327", "no array `node`"),
        // Without the mark of the ghost both pieces own the point, with the same values.
        ("source.pvtu", list.replace("Source=", "File="), text.clone(), "FB327", "piece 1 names no file"),
        (
            "alone.pvtu",
            list.replace(first, "pieces_1.vtu"),
            text.clone(),
            "FB327",
            "is a ghost in every piece",
        ),
        ("cut.pvtu", list[..list.len() / 2].to_owned(), text.clone(), "FB327", ""),
        ("piece.pvtu", list.clone(), text[..text.len() / 2].to_owned(), "FB327", ""),
    ] {
        let said = with(name, &list, &second).expect_err(name);
        assert!(said.contains(code) && said.contains(part), "{name}: {said}");
    }
    let unmarked = text.replace("\"vtkGhostType\"", "\"other_type\"");
    with("unmarked.pvtu", &list, &unmarked).unwrap_or_else(|said| panic!("{said}"));
    // Another displacement of the point that both pieces own.
    let at = unmarked.find("\"displacement 1\"").expect("an array");
    let begin = at + unmarked[at..].find('>').expect("its values") + 1;
    let number = begin + unmarked[begin..].find(|c: char| !c.is_whitespace()).expect("a number");
    let end = number + unmarked[number..].find(char::is_whitespace).expect("its end");
    let changed = format!("{}1e3{}", &unmarked[..number], &unmarked[end..]);
    let said = with("changed.pvtu", &list, &changed).expect_err("other values");
    assert!(said.contains("FB327") && said.contains("in an earlier piece"), "{said}");
}

#[test]
fn collections_are_refused_where_a_step_is_not_a_mesh_with_answers() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = fixtures().join("small/answers");
    let list = fs::read_to_string(place.join("answers.pvd")).expect("a collection");
    for step in 1..10 {
        let name = format!("step{step}.vtu");
        fs::copy(place.join(&name), folder.path().join(&name)).expect("copied");
    }
    fs::copy(place.join("raw.vtu"), folder.path().join("raw.vtu")).expect("copied");
    let listed = |name: &str, text: String| {
        fs::write(folder.path().join(name), text).expect("written");
        converted(folder.path(), &folder.path().join(name))
    };
    listed("whole.pvd", list.clone()).unwrap_or_else(|said| panic!("{said}"));
    for (name, text, code, part) in [
        ("other.txt", list.clone(), "FB327", "its own name does not end with .pvd"),
        ("missing.pvd", list.replace("step4.vtu", "gone.vtu"), "FB101", "gone.vtu"),
        (
            "arrays.pvd",
            list.replace("step4.vtu", "raw.vtu"),
            "FB327",
            "no array at the points is `displacement`",
        ),
        ("itself.pvd", list.replace("step4.vtu", "itself.pvd"), "FB327", "`Collection`"),
        ("twice.pvd", list.replace("\"3.5\"", "\"4.5\""), "FB327", "time 4.5 has several files"),
        (
            "same.pvd",
            list.replace("step4.vtu", "step3.vtu"),
            "FB327",
            "step3.vtu is the file of several times",
        ),
        ("time.pvd", list.replace("\"3.5\"", "\"later\""), "FB327", "no time or no file"),
        ("order.pvd", list.replace("\"3.5\"", "\"10\""), "FB326", "displacements of step 4 differ"),
        ("fewer.pvd", list.replace("<DataSet timestep=\"3.5\"", "<Other"), "FB326", "8 steps"),
        ("cut.pvd", list[..list.len() / 2].to_owned(), "FB327", ""),
    ] {
        let said = listed(name, text).expect_err(name);
        assert!(said.contains(code) && said.contains(part), "{name}: {said}");
    }
    // The meshes of a collection are inputs, although no argument names them.
    fs::write(folder.path().join("whole.pvd"), list).expect("written");
    let manifest = fs::read_to_string(folder.path().join("model.toml")).expect("a manifest");
    fs::write(folder.path().join("model.toml"), manifest.replace("cut.pvd", "whole.pvd")).expect("written");
    let run = flexbody(folder.path(), &["convert", "model.toml", "--modes", "3", "-o", "step3.vtu"]);
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(said.contains("step3.vtu is an input or another output of this run"), "{said}");
}

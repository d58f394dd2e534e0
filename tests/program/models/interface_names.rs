//! Names of interfaces are arbitrary text that the file returns unchanged.

use flexbody_base::diagnostic::Code;
use std::path::Path;
use std::process::{Command, Output};

const NAMES: [&str; 7] = ["left/right", "50%", "%2F", "..", ".", "Lager außen", "a.b c"];

/// Creates a folder with a manifest of the cube of the fixtures, with an interface of each name.
fn model(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let cube = oracle::fixtures().join("models/cube_hex8");
    for entry in std::fs::read_dir(&cube).expect("the fixture") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("a copy");
    }
    let manifest = folder.path().join("model.toml");
    let mut text = std::fs::read_to_string(&manifest).expect("the manifest");
    let nodes = std::fs::read_to_string(folder.path().join("nodes.csv")).expect("nodes");
    let ids: Vec<&str> = nodes.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    for (i, name) in names.iter().enumerate() {
        // The nodes are far apart and not on a line.
        let ids: Vec<&str> = ids.iter().skip(i).step_by(ids.len() / 5).take(4).copied().collect();
        text += &format!("\n[[interface]]\nname = {name:?}\nnodes = [{}]\n", ids.join(", "));
    }
    std::fs::write(&manifest, text).expect("a manifest");
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program")
}

#[test]
fn any_name_comes_back_from_the_file_and_from_exports() {
    let folder = model(&NAMES);
    let output = run(folder.path(), &["convert", "model.toml", "-o", "b.flex.h5", "--modes", "4"]);
    assert!(output.status.success(), "{output:?}");
    let body = flexbody_file::read(folder.path().join("b.flex.h5")).expect("a body");
    let names: Vec<&str> = body.interfaces().iter().map(|interface| interface.name.as_str()).collect();
    assert_eq!(names, NAMES);
    assert_eq!(flexbody_file::validate(folder.path().join("b.flex.h5")), vec![]);
    for format in flexbody_formats::FORMATS.iter().map(|format| format.name()) {
        let file = match format {
            "vtk" => "b.vtu".to_owned(),
            "gltf" => "b.glb".to_owned(),
            _ => format!("b.{format}"),
        };
        let output =
            run(folder.path(), &["export", "b.flex.h5", "--to", format, "-o", &file, "--allow-loss"]);
        let said = String::from_utf8_lossy(&output.stderr);
        // Formats with matrices in interface motions refuse a body of free modes.
        let refused =
            output.status.code() == Some(2) && said.contains("needs K and M in the motions of interfaces");
        assert!(output.status.success() || refused, "{format}: {said}");
    }
    let scene = "[run]\nduration = 1e-3\noutputs = 5\n[[watch]]\ninterface = \"left/right\"\n";
    std::fs::write(folder.path().join("scene.toml"), scene).expect("a scene");
    let output = run(
        folder.path(),
        &["simulate", "b.flex.h5", "--scene", "scene.toml", "-o", "m.h5", "--csv", "m.csv"],
    );
    assert!(output.status.success(), "{output:?}");
    let bytes = std::fs::read(folder.path().join("m.h5")).expect("the motion");
    assert!(bytes.windows(12).any(|w| w == b"left%2Fright"), "one group of this name");
}

#[test]
fn names_that_no_text_can_hold_are_refused() {
    for name in ["", "a\nb", "\u{7f}"] {
        let folder = model(&[name]);
        let error = flexbody_input::read_manifest(folder.path().join("model.toml")).expect_err("refused");
        assert!(error.has(Code::ManifestSyntax), "{name:?}: {error}");
    }
}

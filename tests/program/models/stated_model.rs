//! Models whose interfaces and damping are stated on the command line instead of in a manifest.

use crate::program::flexbody;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::mesh::{Assembly, Mesh};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const FILES: [&str; 9] =
    ["--stiffness", "K.mtx", "--mass", "M.mtx", "--nodes", "nodes.csv", "--units", "m,kg,s", "--basis"];

fn block() -> Assembly {
    Mesh::block(ElementKind::Hex8, [4, 2, 2], [0.4, 0.15, 0.1])
        .assemble(&Material::STEEL, MassRule::Consistent)
}

/// Creates a folder with a small steel block, a table of nodes and a damping matrix (the mass matrix).
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_model(folder.path(), &block().raw_model(), Triangle::Lower);
    fs::copy(folder.path().join("M.mtx"), folder.path().join("D.mtx")).expect("a copy");
    let first: Vec<String> = fs::read_to_string(folder.path().join("nodes.csv"))
        .expect("nodes")
        .lines()
        .skip(1)
        .take(6)
        .map(|line| line.split(',').next().expect("a number").to_owned())
        .collect();
    fs::write(folder.path().join("some.csv"), format!("node\n{}\n", first.join("\n"))).expect("a table");
    folder
}

/// Runs `flexbody`, which must succeed.
fn done(folder: &Path, words: &[&str]) {
    let run = flexbody(folder, words);
    let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{words:?}: {out}{err}");
}

/// Returns all numbers and names of a body, without the fingerprint of the manifest.
fn content(folder: &Path, body: &str) -> String {
    let json = folder.join("content.json");
    done(folder, &["export", body, "--to", "json", "--quiet", "-o", "content.json"]);
    let text = fs::read_to_string(json).expect("a text");
    // Only a body of a manifest names one.
    let manifest = r#"{\"role\":\"manifest\""#;
    match text.split_once(manifest) {
        None => text,
        Some((before, rest)) => before.to_owned() + rest.split_once("},").expect("more files").1,
    }
}

/// One interface or damping in both forms: tables of the manifest, words of the command line.
const SAME: [(&str, &str, &[&str]); 9] = [
    (
        "free",
        "[[interface]]\nname = \"end\"\nnodes_file = \"some.csv\"",
        &["--interface", "end=file:some.csv"],
    ),
    (
        "craig-bampton",
        "[[interface]]\nname = \"end\"\nbox = { min = [0.0, 0.0, 0.0], max = [0.0, 1.0, 1.0] }\ncoupling = \"rigid\"\nreference = [-0.1, 0.0, 0.0]",
        &["--interface", "end=box:0/0/0:0/1/1,rigid,-0.1/0/0"],
    ),
    (
        "craig-chang",
        "[[interface]]\nname = \"end\"\ncylinder = { from = [-0.1, 0.075, 0.05], to = [0.1, 0.075, 0.05], radius = [0.04, 0.2] }\ncoupling = \"averaging\"",
        &["--interface", "end=cylinder:-0.1/0.075/0.05:0.1/0.075/0.05:0.04/0.2,averaging"],
    ),
    (
        "craig-bampton",
        "[[interface]]\nname = \"far\"\nplane = { point = [0.4, 0.0, 0.0], normal = [2.0, 0.0, 0.0], within = 0.001 }\ncoupling = \"free\"",
        &["--interface", "far=plane:0.4/0/0:2/0/0:0.001,free"],
    ),
    (
        "free",
        "[[interface]]\nname = \"near\"\nnearest = { point = [0.4, 0.0, 0.0], count = 5 }\ncoupling = \"averaging\"\nreference_node = 1",
        &["--interface", "near=nearest:0.4/0/0:5,averaging,node:1"],
    ),
    (
        "free",
        "[[interface]]\nname = \"a\"\nnodes = [3, 1, 7]\n[[interface]]\nname = \"b\"\nnodes = [2]\n[damping]\nratio = 0.02",
        &["--interface", "a=nodes:3/1/7", "--interface", "b=nodes:2", "--damping", "0.02"],
    ),
    ("free", "[damping]\nrayleigh = { alpha = 1.5, beta = 2e-6 }", &["--damping", "rayleigh=1.5,2e-6"]),
    (
        "free",
        "[damping]\nbands = [{ to_hz = 3000.0, ratio = 0.01 }, { ratio = 0.1 }]",
        &["--damping", "bands=3000:0.01,0.1"],
    ),
    ("free", "[damping]\nmatrix = \"D.mtx\"", &["--damping", "matrix=D.mtx"]),
];

#[test]
fn the_command_line_states_what_a_manifest_does() {
    let folder = folder();
    let folder = folder.path();
    let files =
        "[files]\nstiffness = \"K.mtx\"\nmass = \"M.mtx\"\nnodes = \"nodes.csv\"\n[model]\nname = \"K\"\n";
    let units = "[model.units]\nlength = \"m\"\nmass = \"kg\"\ntime = \"s\"\n";
    let mut bodies = Vec::new();
    for (basis, tables, words) in SAME {
        fs::write(folder.join("model.toml"), format!("{files}{units}{tables}\n")).expect("a manifest");
        let common = ["--modes", "6", "--quiet", "-o"];
        done(
            folder,
            &[&["convert", "model.toml", "--basis", basis], &common[..], &["stated.flex.h5"]].concat(),
        );
        let line = [&["convert"], &FILES[..], &[basis], words, &common, &["line.flex.h5"]].concat();
        done(folder, &line);
        let [stated, line] = ["stated.flex.h5", "line.flex.h5"].map(|body| content(folder, body));
        assert_eq!(stated, line, "{words:?}");
        done(folder, &["check", "line.flex.h5", "--against", "model.toml"]);
        bodies.push(line);
    }
    // Every statement changes the body.
    bodies.dedup();
    assert_eq!(bodies.len(), SAME.len());
}

#[test]
fn interfaces_and_damping_that_cannot_be_are_refused_by_name() {
    let folder = folder();
    for (words, part) in [
        (&["--interface", "a=nodes:1/2/900"][..], "FB209"),
        (&["--interface", "a=box:9/9/9:10/10/10"], "no node of the model lies in the region"),
        (&["--interface", "a=END"], "the model has no node set `END`"),
        (&["--interface", "a=nodes:1", "--interface", "a=nodes:2"], "interface `a` is given twice"),
        (&["--interface", "a=ball:0/0/0:1"], "the model has no node set `ball:0/0/0:1`"),
        (&["--damping", "-0.1"], "is not a finite number from 0"),
        (&["--damping", "viscous=1"], "expected a ratio"),
        (&["--damping", "matrix=missing.mtx"], "FB101"),
    ] {
        let line = [&["convert"], &FILES[..], &["free", "--modes", "4", "-o", "b.flex.h5"], words].concat();
        let run = flexbody(folder.path(), &line);
        let err = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{words:?}: {err}");
        assert!(err.contains(part), "{words:?}: {err}");
        assert!(!folder.path().join("b.flex.h5").exists());
    }
    let model = ["convert", "model.toml", "-o", "b.flex.h5"];
    for (words, part) in [
        (["--damping", "0.1"], "add [damping] to the manifest instead"),
        (["--interface", "a=nodes:1"], "add [[interface]] to the manifest instead"),
    ] {
        let run = flexbody(folder.path(), &[&model[..], &words].concat());
        let err = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(2) && err.contains(part), "{words:?}: {err}");
    }
}

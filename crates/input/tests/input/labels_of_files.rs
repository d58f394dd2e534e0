//! Rows of DMIG matrices are those that the file names: beside tables in any order, and beside a job.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{MatrixLocation, ModelFiles, StressStiffnessSource, read_manifest, read_model};
use flexbody_model::{Damping, DofLabel, GeometricStiffness, LoadKind, RawModel, UnitLoad};
use oracle::fixtures;
use std::fs;
use std::path::{Path, PathBuf};

/// Nodes of the job, ascending, as its matrices name them.
const NODES: [i64; 12] = [11, 14, 17, 20, 23, 26, 29, 32, 35, 38, 41, 44];

fn punch_file() -> String {
    fs::read_to_string(fixtures().join("small/nastran/job.pch")).expect("a punch file")
}

/// Reads the matrices of the job beside a table of these nodes.
fn beside_table(nodes: impl Iterator<Item = i64>, damping: Option<&str>) -> Result<RawModel, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");
    write("job.pch", &punch_file());
    let lines: Vec<String> = nodes.map(|node| format!("{node},{node},0,1\n")).collect();
    write("nodes.csv", &format!("node,x,y,z\n{}", lines.concat()));
    let damping = damping.map_or(String::new(), |text| {
        write("d.pch", text);
        "[damping]\nmatrix = \"d.pch:/BAAX\"\n".to_owned()
    });
    let manifest = format!(
        "[model]\nname = \"bricks\"\n[files]\nstiffness = \"job.pch:/KAAX\"\nmass = \"job.pch:/MAAX\"\nnodes = \"nodes.csv\"\n{damping}"
    );
    write("model.toml", &manifest);
    read_model(&read_manifest(folder.path().join("model.toml"))?)
}

/// Returns K of the job with another name, and 45 in place of node 44 if `moved`.
fn other_matrix(name: &str, moved: bool) -> String {
    let text = punch_file().replace("KAAX", name);
    let lines = text.lines().take_while(|line| !line.contains("MAAX"));
    let moved = |line: &str| {
        if moved { line.replace("                44  ", "                45  ") } else { line.to_owned() }
    };
    lines.map(moved).map(|line| line + "\n").collect()
}

fn job(change: impl FnOnce(&mut ModelFiles, PathBuf), text: &str) -> Result<RawModel, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("d.pch");
    fs::write(&path, text).expect("written");
    let deck: &Path = &fixtures().join("small/nastran/job.bdf");
    let mut files = ModelFiles::from_job(deck, None, Vec::new(), Some("m,kg,s")).expect("files");
    change(&mut files, path);
    read_model(&files)
}

fn labels() -> Vec<DofLabel> {
    NODES.iter().flat_map(|&node| (1..=3).map(move |direction| DofLabel { node, direction })).collect()
}

#[test]
fn the_order_of_the_table_of_nodes_is_not_that_of_the_rows() {
    for reversed in [false, true] {
        let nodes = NODES.iter().copied();
        let nodes: Vec<i64> = if reversed { nodes.rev().collect() } else { nodes.collect() };
        let model = beside_table(nodes.into_iter(), None).expect("a model");
        assert_eq!(model.dofs, Some(labels()));
    }
}

#[test]
fn rows_of_damping_beside_tables_are_compared() {
    let damped = |moved| beside_table(NODES.into_iter(), Some(&other_matrix("BAAX", moved)));
    damped(false).expect("the same rows");
    assert!(damped(true).expect_err("rows of another node").has(Code::DofCount));
}

#[test]
fn rows_of_matrices_beside_a_job_are_compared() {
    let location = |path: PathBuf, group: &str| MatrixLocation { path, group: Some(group.to_owned()) };
    let damping = |files: &mut ModelFiles, path| {
        files.damping = Some(Damping::Matrix(location(path, "/BAAX")));
    };
    job(damping, &other_matrix("BAAX", false)).expect("the same rows");
    assert!(job(damping, &other_matrix("BAAX", true)).expect_err("another node").has(Code::DofCount));
    let stress = |files: &mut ModelFiles, path| {
        let matrix = StressStiffnessSource { location: location(path, "/KDAA"), with_stress: None };
        let load = UnitLoad { kind: LoadKind::Acceleration, component: 0 };
        files.geometric_stiffness.push(GeometricStiffness { load, matrix });
    };
    job(stress, &other_matrix("KDAA", false)).expect("the same rows");
    assert!(job(stress, &other_matrix("KDAA", true)).expect_err("another node").has(Code::DofCount));
}

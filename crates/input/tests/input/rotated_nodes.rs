//! Rotated nodes of Ansys: the rows of K and M, and of further data, are along axes whose angles are in the
//! archive or the list of nodes.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{ModelFiles, ModelSource, TableFiles, read_manifest, read_model};
use flexbody_model::RawModel;
use nalgebra::{Matrix3, Rotation3, Vector3};
use oracle::fixtures;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Angles THXY, THYZ, THZX of the nodes of the brick. Unit: degrees.
const ANGLES: [[f64; 3]; 8] = [
    [30.0, 0.0, 0.0],
    [0.0; 3],
    [-45.0, 20.0, 0.0],
    [10.0, -70.0, 35.0],
    [0.0, 0.0, 15.0],
    [0.0; 3],
    [90.0, 90.0, 90.0],
    [5.0, 6.0, 7.0],
];

fn model(folder: &Path) -> RawModel {
    let _ = folder;
    let raw = read_model(&read_manifest(fixtures().join("small/brick/model.toml")).expect("a manifest"));
    raw.expect("a model")
}

/// Returns the axes after three successive rotations about current axes.
fn axes([xy, yz, zx]: [f64; 3]) -> Matrix3<f64> {
    let about = |axis, degrees: f64| Rotation3::from_axis_angle(&axis, degrees.to_radians());
    let first = about(Vector3::z_axis(), xy);
    let second = about(nalgebra::Unit::new_normalize(first * Vector3::x()), yz) * first;
    let third = about(nalgebra::Unit::new_normalize(second * Vector3::y()), zx) * second;
    *third.matrix()
}

fn write_matrix(path: &Path, matrix: &Mat<f64>) {
    let n = matrix.nrows();
    let mut text = format!("%%MatrixMarket matrix coordinate real general\n{n} {n} {}\n", n * n);
    for j in 0..n {
        for i in 0..n {
            writeln!(text, "{} {} {:?}", i + 1, j + 1, matrix[(i, j)]).expect("memory");
        }
    }
    fs::write(path, text).expect("written");
}

/// Writes K, M and D = 1e-5 K of the brick with rows along the axes of its nodes.
fn write_rotated(folder: &Path, raw: &RawModel, labels: &[(usize, usize)]) {
    let n = labels.len();
    // u_file = A u.
    let a = Mat::from_fn(n, n, |i, j| {
        if labels[i].0 == labels[j].0 { axes(ANGLES[labels[i].0])[(labels[j].1, labels[i].1)] } else { 0.0 }
    });
    for (name, own, scale) in
        [("K.mtx", &raw.stiffness, 1.0), ("M.mtx", &raw.mass, 1.0), ("D.mtx", &raw.stiffness, 1e-5)]
    {
        let own = Mat::from_fn(n, n, |i, j| scale * own.matrix.get(i, j));
        let rotated = &a * own * a.transpose();
        let even = Mat::from_fn(n, n, |i, j| 0.5 * (rotated[(i, j)] + rotated[(j, i)]));
        write_matrix(&folder.join(name), &even);
    }
}

#[test]
fn rows_of_rotated_nodes_are_turned_by_their_angles() {
    let folder = tempfile::tempdir().expect("a folder");
    let raw = model(folder.path());
    assert_eq!(raw.nodes.len(), 8);
    let index = |node: i64| raw.nodes.ids.iter().position(|id| *id == node).expect("a node");
    let labels: Vec<(usize, usize)> = raw
        .dofs
        .as_ref()
        .expect("labels")
        .iter()
        .map(|own| (index(own.node), usize::from(own.direction) - 1))
        .collect();
    write_rotated(folder.path(), &raw, &labels);
    let dofs: String = raw
        .dofs
        .as_ref()
        .expect("labels")
        .iter()
        .map(|own| format!("{},{}\n", own.node, own.direction))
        .collect();
    fs::write(folder.path().join("dofs.csv"), format!("node,dir\n{dofs}")).expect("written");
    let (mut archive, mut list) = (
        String::from("/COM,ANSYS\n/PREP7\nNBLOCK,6,SOLID,8,8\n(3i9,6e24.16e3)\n"),
        String::from("   NODE  X  Y  Z  THXY  THYZ  THZX\n"),
    );
    for ((id, x), angles) in raw.nodes.ids.iter().zip(&raw.nodes.positions).zip(ANGLES) {
        write!(archive, "{id:9}{:9}{:9}", 0, 0).expect("memory");
        x.iter().chain(&angles).for_each(|value| write!(archive, "{value:24.16E}").expect("memory"));
        archive += "\n";
        let all: Vec<String> = x.iter().chain(&angles).map(f64::to_string).collect();
        writeln!(list, "{id} {}", all.join(" ")).expect("memory");
    }
    fs::write(folder.path().join("part.cdb"), archive + "N,R5.3,LOC,-1,\n").expect("written");
    fs::write(folder.path().join("nodes.txt"), list).expect("written");
    for nodes in ["part.cdb", "nodes.txt"] {
        let manifest = folder.path().join("model.toml");
        let text = format!(
            "[files]\nstiffness = \"K.mtx\"\nmass = \"M.mtx\"\nnodes = \"{nodes}\"\ndofs = \"dofs.csv\"\n[damping]\nmatrix = \"D.mtx\"\n"
        );
        fs::write(&manifest, text).expect("written");
        let own = read_model(&read_manifest(&manifest).expect("a manifest")).expect("a model");
        let Some(flexbody_model::Damping::Matrix(damping)) = &own.data.damping else { panic!("damping") };
        for (matrix, expected, scale) in [
            (&own.stiffness, &raw.stiffness, 1.0),
            (&own.mass, &raw.mass, 1.0),
            (damping, &raw.stiffness, 1e-5),
        ] {
            let largest = expected.matrix.values().iter().fold(0.0f64, |m, v| m.max(v.abs()));
            for i in 0..labels.len() {
                for j in 0..labels.len() {
                    let difference = matrix.matrix.get(i, j) - scale * expected.matrix.get(i, j);
                    assert!(
                        difference.abs() < 1e-14 * scale * 10.0 * largest,
                        "{nodes} {i} {j} {difference}"
                    );
                }
            }
        }
    }
    // The third direction of a rotated node is missing.
    let text = fs::read_to_string(folder.path().join("dofs.csv")).expect("a table");
    let first = raw.nodes.ids[0];
    fs::write(folder.path().join("dofs.csv"), text.replacen(&format!("{first},3\n"), "999,1\n", 1))
        .expect("written");
    let files = ModelFiles::from_arguments(
        folder.path().join("K.mtx"),
        folder.path().join("M.mtx"),
        folder.path().join("part.cdb"),
        Some(folder.path().join("dofs.csv")),
        None,
    );
    let files = files.expect("files");
    assert!(matches!(&files.source, ModelSource::Tables(TableFiles { dofs: Some(_), .. })));
    let error: Error = read_model(&files).expect_err("a direction is missing");
    assert!(error.has(Code::DofIncomplete), "{error}");
}

//! Matrices of CalculiX along the axes of `*TRANSFORM` (GLOBAL=NO).

use flexbody_base::diagnostic::Code;
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use oracle::jobs::{job, small};
use oracle::reference::dense;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Copies the job with the rows of the matrices `turned` along the axes that `axes` returns for a node, and with these
/// cards in the deck.
fn write(folder: &Path, cards: &str, turned: &[&str], axes: impl Fn(i64) -> Option<Matrix3<f64>>) {
    let from = small("calculix_distributing");
    let text = |name: &str| fs::read_to_string(from.with_file_name(name)).expect("a text");
    let labels: Vec<(i64, usize)> = text("job.dof")
        .split_whitespace()
        .map(|label| label.split_once('.').expect("a label"))
        .map(|(node, k)| (node.parse().expect("a node"), k.parse::<usize>().expect("a direction") - 1))
        .collect();
    let n = labels.len();
    // Row of the file: the component of the node along its axis.
    let turn = DMatrix::from_fn(n, n, |row, column| {
        let ((node, k), (other, l)) = (labels[row], labels[column]);
        if node == other { axes(node).map_or(f64::from(k == l), |axes| axes[(l, k)]) } else { 0.0 }
    });
    for name in ["job.sti", "job.mas"] {
        let mut matrix = DMatrix::zeros(n, n);
        for line in text(name).lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [i, j] = [0, 1].map(|k| words[k].parse::<usize>().expect("an index") - 1);
            let value: f64 = words[2].parse().expect("a number");
            (matrix[(i, j)], matrix[(j, i)]) = (value, value);
        }
        let is_turned = turned.contains(&name);
        let matrix = if is_turned { &turn * matrix * turn.transpose() } else { matrix };
        let mut written = String::new();
        for (column, row) in (0..n).flat_map(|column| (0..=column).map(move |row| (column, row))) {
            if matrix[(row, column)] != 0.0 {
                writeln!(written, "{} {} {:.17e}", row + 1, column + 1, matrix[(row, column)])
                    .expect("memory");
            }
        }
        fs::write(folder.join(name), written).expect("written");
    }
    fs::copy(from.with_file_name("job.dof"), folder.join("job.dof")).expect("copied");
    let deck = text("job.inp").replace("*STEP", &format!("{cards}*STEP"));
    assert!(deck.contains("SOLVER=MATRIXSTORAGE"));
    let deck = deck.replace("SOLVER=MATRIXSTORAGE", "SOLVER=MATRIXSTORAGE, GLOBAL=NO");
    fs::write(folder.join("job.inp"), deck).expect("written");
}

fn assert_is_the_job_along_the_model(folder: &Path) {
    let expected = job(&small("calculix_distributing"), Vec::new());
    let raw = job(&folder.join("job.inp"), Vec::new());
    assert_eq!(raw.dofs, expected.dofs);
    for (own, expected) in [(&raw.stiffness, &expected.stiffness), (&raw.mass, &expected.mass)] {
        let (own, expected) = (dense(&own.matrix), dense(&expected.matrix));
        let largest = expected.norm_max();
        // Sums of nine products of numbers with 17 digits.
        assert!(
            (&own - &expected).norm_max() < 1e-14 * largest,
            "{:e}",
            (&own - &expected).norm_max() / largest
        );
    }
}

#[test]
fn rows_along_rectangular_and_cylindrical_axes_are_turned_to_those_of_the_model() {
    let raw = job(&small("calculix_distributing"), Vec::new());
    let complete = |node: i64| {
        let labels = raw.dofs.as_deref().expect("labels");
        (1..=3).all(|k| labels.iter().any(|label| (label.node, label.direction) == (node, k)))
    };
    let chosen: Vec<i64> = raw.nodes.ids.iter().copied().filter(|node| complete(*node)).take(5).collect();
    let set =
        format!("*NSET, NSET=LOCAL\n{}\n", chosen.iter().map(i64::to_string).collect::<Vec<_>>().join(",\n"));
    let is_chosen = |node: i64| chosen.contains(&node);

    let turned = Rotation3::from_euler_angles(0.4, -0.7, 1.1).into_inner();
    let a: Vector3<f64> = turned.column(0) * 2.0;
    let b: Vector3<f64> = turned.column(1) * 0.5 - turned.column(0) * 0.3;
    let numbers = |a: Vector3<f64>, b: Vector3<f64>| {
        a.iter().chain(&b).map(|x| format!("{x:.17e}")).collect::<Vec<_>>().join(",")
    };
    let cards = format!("{set}*TRANSFORM, NSET=LOCAL\n{}\n", numbers(a, b));
    // CalculiX 2.20 turns K alone.
    for files in [&["job.sti", "job.mas"][..], &["job.sti"]] {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), &cards, files, |node| is_chosen(node).then_some(turned));
        assert_is_the_job_along_the_model(folder.path());
    }

    let folder = tempfile::tempdir().expect("a folder");
    let (from, axis) = (Vector3::new(-0.3, 0.2, 0.1), Vector3::new(0.1, 0.2, 1.0));
    let cards = format!("{set}*TRANSFORM, TYPE=C, NSET=LOCAL\n{}\n", numbers(from, from + axis));
    write(folder.path(), &cards, &["job.sti", "job.mas"], |node| {
        let at = raw.nodes.ids.iter().position(|id| *id == node).filter(|_| is_chosen(node))?;
        let z = axis.normalize();
        let arm = Vector3::from(raw.nodes.positions[at]) - from;
        let r = (arm - z * arm.dot(&z)).normalize();
        Some(Matrix3::from_columns(&[r, z.cross(&r), z]))
    });
    assert_is_the_job_along_the_model(folder.path());

    // Without GLOBAL=NO the card changes nothing.
    let deck = fs::read_to_string(folder.path().join("job.inp")).expect("a text");
    fs::write(folder.path().join("job.inp"), deck.replace(", GLOBAL=NO", "")).expect("written");
    let raw = job(&folder.path().join("job.inp"), Vec::new());
    assert!(raw.given_rows.counts().next().is_none());
    assert!(raw.diagnostics.iter().all(|note| note.code() != Code::DeckUnsupported));
}

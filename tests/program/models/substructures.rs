//! Substructures of Abaqus: the condensed block of the Nastran superelement, and invalid files.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{ModelFiles, read_model};
use flexbody_model::{DofLabel, RawModel};
use oracle::jobs::{assert_has_inertia_of_the_block, body, job, set, small};
use std::fs;

const FOLDER: &str = "abaqus_substructure";

/// Reads the job after a change of one of its files.
fn changed(file: &str, change: impl Fn(&str) -> String) -> Result<RawModel, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["job.inp", "ends.mtx"] {
        let text = fs::read_to_string(small(FOLDER).with_file_name(name)).expect("a file");
        let text = if name == file { change(&text) } else { text };
        fs::write(folder.path().join(name), text).expect("written");
    }
    read_model(&ModelFiles::from_job(folder.path().join("job.inp"), None, Vec::new(), None).expect("files"))
}

/// Replaces a text that occurs once.
fn replaced(file: &str, old: &str, new: &str) -> Result<RawModel, Error> {
    changed(file, |text| {
        assert_eq!(text.matches(old).count(), 1, "{old}");
        text.replace(old, new)
    })
}

#[test]
fn a_substructure_of_abaqus_is_the_superelement_of_nastran() {
    let raw = job(&small(FOLDER), vec![set("left", "LEFT")]);
    let codes: Vec<Code> = raw.diagnostics.iter().map(|diagnostic| diagnostic.code()).collect();
    assert_eq!(codes, [Code::JobCondensed]);
    assert_eq!(raw.data.interfaces[0].nodes, [11, 14, 17, 20]);
    let names: Vec<&str> = raw.data.sources.iter().map(|source| source.name.as_str()).collect();
    assert_eq!(names, ["job.inp", "ends.mtx"]);
    assert_eq!(raw.stiffness.digits, 14);
    let punched = job(&small("nastran_superelement").with_file_name("job.pch"), Vec::new());
    assert_eq!(raw.dofs, punched.dofs);
    let [own, other] = [raw, punched].map(|raw| body(raw, 8));
    assert_has_inertia_of_the_block(&own, 1e-10);
    for (own, other) in own.modes().eigenvalue.iter().zip(&other.modes().eigenvalue) {
        assert!((own / other - 1.0).abs() < 1e-9, "{own} {other}");
    }
}

/// The directions of a row list hold for the following nodes until they change.
#[test]
fn directions_hold_until_they_change() {
    // The file has 24 rows in another order: two of the second node, four of the fourth, and three of each
    // later node.
    let lines = "         1,          2,          3\n         2,          1,          2\n         3,          1,          2,          3\n\
                 \x20        4,          1,          2,          3,          6\n         5,          1,          2,          3\n";
    let raw = changed("ends.mtx", |text| text.replace("         1,          2,          3\n", lines));
    let labels = raw.expect("readable").dofs.expect("labels");
    let of = |node: i64| -> Vec<u8> {
        let own = labels.iter().filter(|label| label.node == node);
        own.map(|DofLabel { direction, .. }| *direction).collect()
    };
    assert_eq!([11, 14, 17, 20, 35, 44].map(of).map(|own| own.len()), [3, 2, 3, 4, 3, 3]);
    assert_eq!(of(20), [1, 2, 3, 6]);
}

/// Unsymmetric files have the whole stiffness, row by row, and the lower triangle of the mass.
#[test]
fn unsymmetric_files_have_the_whole_stiffness() {
    let plain = read_model(&ModelFiles::from_job(small(FOLDER), None, Vec::new(), None).expect("files"));
    let plain = plain.expect("readable");
    let full = changed("ends.mtx", |text| {
        let (head, rest) = text.split_once("*MATRIX,TYPE=STIFFNESS\n").expect("a stiffness");
        let (_, mass) = rest.split_once("*MATRIX,TYPE=MASS\n").expect("a mass");
        let row = |i: usize| {
            let words = (0..24).map(|j| format!("{:e}", plain.stiffness.matrix.get(i, j)));
            words.collect::<Vec<_>>().join(", ") + "\n"
        };
        let stiffness: String = (0..24).map(row).collect();
        let head = head.replace(", LINEAR", ", LINEAR, UNSYM");
        format!("{head}*MATRIX,TYPE=STIFFNESS\n{stiffness}*MATRIX,TYPE=MASS\n{mass}")
    });
    let full = full.expect("readable");
    assert_eq!(full.stiffness.matrix, plain.stiffness.matrix);
    assert_eq!(full.mass.matrix, plain.mass.matrix);
}

#[test]
fn of_several_substructures_the_last_is_taken() {
    let raw = replaced("job.inp", "*END STEP", "*END STEP\n*SUBSTRUCTURE MATRIX OUTPUT, FILE NAME=ends\n");
    let codes: Vec<Code> = raw.expect("readable").diagnostics.iter().map(|d| d.code()).collect();
    assert_eq!(codes, [Code::JobStep, Code::JobCondensed]);
}

#[test]
fn what_is_no_substructure_is_refused_with_its_place() {
    let transform = "*TRANSFORM, NSET=LEFT\n0,1,0, -1,0,0\n*NSET, NSET=ENDS\n";
    let cases = [
        (
            "ends.mtx",
            "*MATRIX,TYPE=MASS",
            "*MATRIX,TYPE=SLOAD",
            Code::JobIncomplete,
            None,
            "TYPE=MASS is missing",
        ),
        (
            "ends.mtx",
            "NODES=         8",
            "NODES=         9",
            Code::DeckSyntax,
            Some(3),
            "so many node numbers",
        ),
        ("ends.mtx", "** ELEMENT NODES", "** NODES", Code::DeckSyntax, Some(3), "ELEMENT NODES"),
        (
            "ends.mtx",
            "1,          2,          3\n",
            "1, 2, 11\n",
            Code::DeckUnsupported,
            Some(7),
            "freedom 11",
        ),
        (
            "ends.mtx",
            "1,          2,          3\n",
            "1, 2, 3\n 9, 1, 2\n",
            Code::DeckSyntax,
            Some(8),
            "found `9, 1, 2`",
        ),
        (
            "ends.mtx",
            "1,          2,          3\n",
            "1, 2\n",
            Code::DeckSyntax,
            Some(8),
            "expected 136 values for 16 rows, found 300",
        ),
        (
            "ends.mtx",
            "STIFFNESS\n 2266613907.0045     ,\n",
            "STIFFNESS\n",
            Code::DeckSyntax,
            Some(8),
            "found 299",
        ),
        (
            "ends.mtx",
            "NESS\n 2266613907.0045     ,\n 538478088.04599     , 3295414224.1577",
            "NESS\n 2266613907.0045     ,\n nan, 3295414224.1577",
            Code::DeckSyntax,
            Some(10),
            "found `nan",
        ),
        ("ends.mtx", "**         11,", "**        911,", Code::DeckUnsupported, None, "node 911"),
        ("job.inp", "FILE NAME=ends", "FILE NAME=middle", Code::FileUnreadable, None, ""),
        ("job.inp", "*NSET, NSET=ENDS\n", transform, Code::DeckUnsupported, Some(16), "rows of node 11"),
    ];
    for (file, old, new, code, line, part) in cases {
        let error = replaced(file, old, new).expect_err(new);
        let found = &error.diagnostics()[0];
        assert_eq!((found.code(), found.line()), (code, line), "{error}");
        assert!(found.message().contains(part), "{error}");
    }
}

#[test]
fn no_output_replaces_the_file_of_the_substructure() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["job.inp", "ends.mtx"] {
        fs::copy(small(FOLDER).with_file_name(name), folder.path().join(name)).expect("copied");
    }
    let run = flexbody(folder.path(), &["convert", "job.inp", "--modes", "2", "-o", "ends.mtx"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("is an input"));
}

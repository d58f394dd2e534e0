//! Operators of recoveries in every format of matrices, written by other programs.

use crate::program::flexbody;
use flexbody_body::flex_body::FlexBody;
use oracle::fixtures;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Creates a folder with the model of braced springs.
fn model() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["K.mtx.gz", "M.mtx.gz", "nodes.csv", "dofs.csv", "model.toml"] {
        fs::copy(fixtures().join("models/spring_ends").join(name), folder.path().join(name)).expect("copied");
    }
    folder
}

/// Converts the model with an operator. Returns the body, or what the program says about it.
fn converted(folder: &Path, operator: &str, rows: &str) -> Result<FlexBody, String> {
    let manifest = fs::read_to_string(fixtures().join("models/spring_ends/model.toml")).expect("a manifest");
    let recovery =
        format!("\n[[recovery]]\nname = \"gauges\"\noperator = \"{operator}\"\nrows = \"{rows}\"\n");
    fs::write(folder.join("model.toml"), manifest + &recovery).expect("written");
    let run = flexbody(folder, &["convert", "model.toml", "--modes", "5", "-o", "body.flex.h5"]);
    if run.status.success() {
        Ok(flexbody_file::read(folder.join("body.flex.h5")).expect("a body"))
    } else {
        Err(String::from_utf8_lossy(&run.stderr).into_owned())
    }
}

#[test]
fn operators_in_all_formats_give_the_same_bits() {
    let folder = model();
    let place = fixtures().join("small/operators");
    let rows = place.join("rows.csv").display().to_string();
    let body = |operator: &str| {
        let path = place.join(operator).display().to_string();
        converted(folder.path(), &path, &rows).unwrap_or_else(|said| panic!("{operator}: {said}"))
    };
    let expected = body("csr.npz").recoveries().to_vec();
    assert!(expected[0].modes.norm_max() > 1.0 && expected[0].spin.norm_max() > 0.0);
    for operator in [
        "sparse.mtx",
        "full.npz:/R",
        "full.csv",
        "rows.rua",
        "sparse.mat",
        "dense.mat:R",
        "dense.mat:/R",
        "sparse_73.mat",
        "dense_73.mat:/R",
        "groups.h5:/csr",
        "groups.h5:/coo",
        "groups.h5:/other/gauges",
        "rows.petsc",
        "text.op4:MES1",
        "binary.op4:/MES1",
        "binary.op4:mes1",
        "gauges.pch",
        "gauges.pch:GAUGES",
    ] {
        assert_eq!(body(operator).recoveries(), expected, "{operator}");
    }
}

#[test]
fn operators_that_do_not_fit_are_refused_by_name() {
    let folder = model();
    let place = fixtures().join("small/operators");
    let rows = place.join("rows.csv").display().to_string();
    let punch = fs::read_to_string(place.join("gauges.pch")).expect("a file");
    for (name, text) in [
        ("square.pch", punch.replacen("       9       2", "       6       2", 1)),
        (
            "elsewhere.pch",
            punch.replacen(
                "*                      1               3",
                "*                   7777               3",
                1,
            ),
        ),
        (
            "beyond.pch",
            punch.replacen(
                "DMIG*   GAUGES                         5",
                "DMIG*   GAUGES                         6",
                1,
            ),
        ),
    ] {
        assert_ne!(text, punch, "{name}");
        fs::write(folder.path().join(name), text).expect("written");
    }
    let op4 = fs::read(place.join("binary.op4")).expect("a file");
    fs::write(folder.path().join("cut.op4"), &op4[..op4.len() / 2]).expect("written");
    let mat = fs::read(place.join("dense.mat")).expect("a file");
    fs::write(folder.path().join("cut.mat"), &mat[..mat.len() / 2]).expect("written");
    let rows_petsc = fs::read(place.join("rows.petsc")).expect("a file");
    fs::write(folder.path().join("cut.petsc"), &rows_petsc[..rows_petsc.len() - 8]).expect("written");
    let at = |name: &str| place.join(name).display().to_string();
    for (operator, code, part) in [
        // A matrix of another set of degrees of freedom: by its size.
        (at("binary.op4:MEF1"), "FB322", "its operator is 5 x 108, the matrices have 109 rows"),
        (at("binary.op4:GONE"), "FB310", "the file has no matrix"),
        (at("binary.op4"), "FB310", "the file has 2 matrices; which is the operator?"),
        (at("dense.mat"), "", ""),
        (at("groups.h5"), "FB310", ""),
        (at("groups.h5:/gone"), "FB310", ""),
        ("square.pch".to_owned(), "FB302", "form 6 is not that of a rectangular matrix"),
        ("elsewhere.pch".to_owned(), "FB322", "node 7777, component 3, which is no row of the matrices"),
        ("beyond.pch".to_owned(), "FB303", "column 6, component 0"),
        ("cut.op4".to_owned(), "FB304", ""),
        ("cut.mat".to_owned(), "FB304", ""),
        ("cut.petsc".to_owned(), "FB304", ""),
    ] {
        match converted(folder.path(), &operator, &rows) {
            Ok(_) => assert!(code.is_empty(), "{operator}"),
            Err(said) => {
                assert!(!code.is_empty() && said.contains(code) && said.contains(part), "{operator}: {said}");
            }
        }
    }
}

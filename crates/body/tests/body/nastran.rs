//! Jobs of Nastran: DMIG and OUTPUT4, grids and rows in other systems, sets, supports, superelements.

use flexbody_base::diagnostic::{Code, Severity};
use flexbody_base::error::Error;
use flexbody_body::verification::body_identities;
use flexbody_input::{MatrixLocation, MatrixRole, ModelFiles, read_matrix, read_model};
use flexbody_linalg::CscMatrix;
use flexbody_model::{FeModel, RawModel};
use oracle::fixtures;
use oracle::jobs::{assert_has_inertia_of_the_block, body, job, set, small};
use std::fs;
use std::path::{Path, PathBuf};

fn main_file(name: &str) -> PathBuf {
    small(name).with_file_name(if name == "nastran_superelement" { "job.pch" } else { "job.bdf" })
}

fn said(raw: &RawModel) -> Vec<Code> {
    raw.diagnostics.iter().map(|diagnostic| diagnostic.code()).collect()
}

/// The block with grids and rows in cylindrical, rotated and three-grid systems, in a punch file with ten
/// digits, compared with the block from OUTPUT4.
#[test]
fn both_forms_of_nastran_are_one_model() {
    let punched = job(&main_file("nastran"), vec![set("left", "set5"), set("right", "6")]);
    assert_eq!(punched.data.interfaces[0].nodes, [11, 17, 20]);
    assert_eq!(punched.data.interfaces[1].nodes, [35, 38, 41, 44]);
    assert_eq!(said(&punched), []);
    let names: Vec<&str> = punched.data.sources.iter().map(|source| source.name.as_str()).collect();
    assert_eq!(names, ["job.bdf", "grids.bdf", "job.pch"]);
    let output = job(&main_file("nastran_op4"), Vec::new());
    assert_eq!(said(&output), [Code::RowsEmpty], "empty rotations of solids, and a scalar point");
    assert_eq!(output.dofs.as_ref().map(Vec::len), Some(36));
    assert_eq!(punched.dofs, output.dofs);
    for (a, b) in punched.nodes.positions.iter().flatten().zip(output.nodes.positions.iter().flatten()) {
        assert!((a - b).abs() < 1e-16, "{a} {b}");
    }
    for (a, b) in [(&punched.stiffness, &output.stiffness), (&punched.mass, &output.mass)] {
        let largest = b.matrix.values().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for j in 0..36 {
            for i in 0..36 {
                let (a, b) = (a.matrix.get(i, j), b.matrix.get(i, j));
                assert!((a - b).abs() < 1e-9 * largest, "({i}, {j}): {a} {b}");
            }
        }
    }
    assert_eq!(punched.stiffness.digits, 10);
    let [punched, output] = [punched, output].map(|raw| body(raw, 8));
    assert_has_inertia_of_the_block(&punched, 1e-8);
    assert_has_inertia_of_the_block(&output, 1e-11);
    let pairs = punched.modes().eigenvalue.iter().zip(&output.modes().eigenvalue);
    assert!(pairs.clone().all(|(a, b)| (a / b - 1.0).abs() < 1e-7), "{pairs:?}");
}

/// Grids and matrices in one file: the block condensed to its ends. Rigid motion, and thus mass and moments,
/// are exact; a message states that the rest is not.
#[test]
fn a_superelement_keeps_the_inertia_of_its_body() {
    let raw = job(&main_file("nastran_superelement"), Vec::new());
    assert_eq!(said(&raw), [Code::JobCondensed]);
    assert_has_inertia_of_the_block(&body(raw, 6), 1e-10);
}

/// Condensed matrices add large entries to the mass, so that directions agree on it to eleven digits only: an
/// external superelement of NX Nastran with six or more modes was once refused for that.
#[test]
fn a_superelement_whose_directions_differ_in_the_last_digits_of_the_mass_is_a_body() {
    let mut raw = job(&main_file("nastran_superelement"), Vec::new());
    let mass: f64 = raw.mass.matrix.values().iter().sum::<f64>() / 3.0;
    let entries: Vec<(u32, u32, f64)> = (0..raw.mass.matrix.n_cols())
        .flat_map(|j| {
            let (rows, values) = raw.mass.matrix.column(j);
            rows.iter().zip(values).map(move |(&i, &v)| (i, j as u32, v)).collect::<Vec<_>>()
        })
        .chain([(0, 0, 2e-11 * mass)])
        .collect();
    let n = raw.mass.matrix.n_cols();
    raw.mass.matrix = CscMatrix::from_triplets(n, n, &entries);
    let identities = body_identities(&body(raw, 14));
    let gram = identities.iter().find(|check| check.name == "velocity_gram_psd").expect("a general mass");
    assert!(gram.value > 1e-12, "the case is one: {gram:?}");
    assert!(identities.iter().all(|check| check.passed), "{identities:?}");
}

/// Returns a changed copy of a small job.
fn changed(name: &str, change: impl Fn(&str, String) -> String) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let main = main_file(name);
    for entry in fs::read_dir(main.parent().expect("a folder")).expect("a folder") {
        let path = entry.expect("a file").path();
        let file = path.file_name().and_then(|name| name.to_str()).expect("a name").to_owned();
        let to = folder.path().join(&file);
        match fs::read_to_string(&path) {
            Ok(text) => fs::write(to, change(&file, text)).expect("written"),
            Err(_) => fs::copy(&path, to).map(drop).expect("copied"),
        }
    }
    let path = folder.path().join(main.file_name().expect("a name"));
    (folder, path)
}

fn read(path: &Path) -> Result<RawModel, Error> {
    read_model(&ModelFiles::from_job(path, None, Vec::new(), None).expect("files"))
}

/// Replaces a text that occurs once in the file of this name.
fn replaced(name: &str, file: &str, old: &str, new: &str) -> Result<RawModel, Error> {
    let (_folder, path) = changed(name, |own, text| {
        if own != file {
            return text;
        }
        assert_eq!(text.matches(old).count(), 1, "{old}");
        text.replace(old, new)
    });
    read(&path)
}

#[test]
fn what_a_deck_says_of_masses_and_supports_is_told() {
    let raw =
        replaced("nastran_op4", "job.bdf", "PARAM,COUPMASS,1\n", "SPC1,1,123456,11,THRU,14\n").expect("read");
    assert_eq!(said(&raw), [Code::DeckLumps, Code::DeckSupports, Code::RowsEmpty]);
    assert!(raw.diagnostics.iter().all(|found| found.severity() != Severity::Error));
    let lumped = replaced("nastran_op4", "job.bdf", "COUPMASS,1", "COUPMASS,-1").expect("read");
    assert_eq!(said(&lumped)[0], Code::DeckLumps);
    let held = replaced("nastran_op4", "job.bdf", "GRID,11,,0.0,0.0,0.0", "GRID,11,,0.0,0.0,0.0,,456")
        .expect("read");
    assert_eq!(said(&held)[0], Code::DeckSupports);
}

#[test]
fn decks_that_cannot_be_read_are_refused_where_they_cannot() {
    let cases = [
        ("grids.bdf", "CORD2R,1,,0.", "CORD2R,1,1,0.", Code::DeckSyntax, "refers to itself"),
        (
            "grids.bdf",
            "CORD1R  3       11      14      17",
            "CORD1R  3       11      14      35",
            Code::DeckSyntax,
            "refers to itself",
        ),
        ("grids.bdf", ",0.6,0.8,0.", ",0.,0.,7.", Code::DeckSyntax, "on one line"),
        ("grids.bdf", "grid,35,3,", "grid,35,9,", Code::DeckSyntax, "system 9 is not in the deck"),
        ("grids.bdf", "grid,35,3,", "grid,38,3,", Code::NodeDuplicate, "grid 38"),
        ("grids.bdf", "grid,35,3,0.0", "grid,35,3,zero", Code::DeckSyntax, "GRID cannot be read"),
        (
            "grids.bdf",
            "*C2                  0.0",
            "*C7                  0.0",
            Code::DeckSyntax,
            "continues another card",
        ),
        (
            "grids.bdf",
            "grid,35,3,0.0,-0.2,0.0\n",
            "grid,35,3,0.0,-0.2,0.0,1,,,,5\n",
            Code::DeckSyntax,
            "more than 8 fields",
        ),
        ("job.bdf", "INCLUDE 'grids.bdf'", "INCLUDE 'mesh.bdf'", Code::FileUnreadable, "is included"),
        ("job.bdf", "INCLUDE 'grids.bdf'", "INCLUDE 'job.bdf'", Code::DeckSyntax, "levels deep"),
        (
            "job.bdf",
            "MAT1    1",
            "BEGIN SUPER=3\nGRID,900\nBEGIN SUPER=4\nMAT1    1",
            Code::DeckUnsupported,
            "several sections",
        ),
        (
            "job.pch",
            "DMIG    KAAX           0       6",
            "DMIG    KAAX           0       1",
            Code::MatrixAsymmetric,
            "KAAX",
        ),
        (
            "job.pch",
            "DMIG    KAAX           0       6       2",
            "DMIG    KAAX           0       6       4",
            Code::MatrixKind,
            "type 4",
        ),
        ("job.pch", "DMIG    MAAX ", "DMIG    XAAX ", Code::MatrixSyntax, "before its header"),
        (
            "job.pch",
            "$TITLE",
            "DMIG    KGG            0       6       2\nDMIG,KGG,11,1,,11,1,1.0\nDMIG    MGG            0       6       2\nDMIG,MGG,11,1,,11,1,1.0\n$TITLE",
            Code::DeckUnsupported,
            "2 pairs",
        ),
    ];
    for (file, old, new, code, part) in cases {
        let error = replaced("nastran", file, old, new).expect_err(part);
        let found = error.diagnostics().iter().find(|found| found.code() == code);
        assert!(found.is_some_and(|found| found.message().contains(part)), "{part}: {error}");
    }
}

#[test]
fn rows_of_output4_have_to_be_those_of_a_set() {
    let error = replaced("nastran_op4", "job.bdf", "SPOINT,999\n", "").expect_err("73 rows");
    assert!(error.has(Code::DeckRows), "{error}");
    assert!(
        error.to_string().contains("73 rows, the deck gives other numbers: 12 grids and 0 scalar points 72"),
        "{error}"
    );
    let error = replaced("nastran_op4", "job.bdf", "SPOINT,999\n", "SEQGP,11,4\nSPOINT,999\n")
        .expect_err("another order");
    assert!(error.has(Code::DeckUnsupported), "{error}");
}

/// The matrices are in files of any name given by the deck, or under that name beside it.
#[test]
fn files_that_the_deck_assigns_are_found() {
    let (folder, path) = changed("nastran_op4", |file, text| match file {
        "job.bdf" => format!("ASSIGN OUTPUT4='out/matrices.f12',UNIT=12,\n FORM=UNFORMATTED\n{text}"),
        _ => text,
    });
    let expected = job(&main_file("nastran_op4"), Vec::new());
    fs::create_dir(folder.path().join("out")).expect("a folder");
    let places = ["job.op4", "out/matrices.f12", "matrices.f12"].map(|place| folder.path().join(place));
    for pair in places.windows(2) {
        fs::rename(&pair[0], &pair[1]).expect("moved");
        let raw = read(&path).expect("read");
        assert_eq!(
            (&raw.stiffness.matrix, &raw.mass.matrix),
            (&expected.stiffness.matrix, &expected.mass.matrix)
        );
        let name = pair[1].file_name().and_then(|name| name.to_str()).expect("a name");
        assert!(raw.data.sources.iter().any(|source| source.name == name), "{name}");
    }
    fs::remove_file(&places[2]).expect("removed");
    let error = read(&path).expect_err("no matrices");
    assert!(error.has(Code::JobIncomplete) && error.to_string().contains("matrices.f12"), "{error}");
}

/// A string of K that begins one row too low reaches empty rows of rotations: they count as rows of the
/// model, whose matrices are then not symmetric.
#[test]
fn entries_of_one_side_alone_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    for name in ["job.bdf", "job.op4"] {
        let mut bytes = fs::read(main_file("nastran_op4").with_file_name(name)).expect("a file");
        if name == "job.op4" {
            // Length 7 and row 25 of a string.
            let string = [0, 0, 0, 7, 0, 0, 0, 25];
            let at = bytes.windows(8).position(|own| own == string).expect("a string");
            bytes[at + 7] = 26;
        }
        fs::write(place.path().join(name), bytes).expect("written");
    }
    let files = ModelFiles::from_job(place.path().join("job.bdf"), None, vec![], None).expect("files");
    let error = FeModel::from_raw(read_model(&files).expect("matrices")).expect_err("one side");
    assert!(error.diagnostics().iter().any(|own| own.code() == Code::MatrixAsymmetric), "{error}");
}

/// A scalar point with mass is a modal coordinate whose motion is unknown.
#[test]
fn modal_coordinates_without_shapes_are_refused() {
    let (_folder, path) = changed("nastran_superelement", |_, text| {
        let text = text.replace("ASET1,123", "SPOINT,901\nASET1,123");
        text + "DMIG,MAAX,901,0,,901,0,1.0\nDMIG,KAAX,901,0,,901,0,4.0E6\n"
    });
    let error = read(&path).expect_err("refused");
    assert!(error.has(Code::DeckUnsupported) && error.to_string().contains("modal coordinates"), "{error}");
    // Without mass it is an internal row.
    let (_folder, path) = changed("nastran_superelement", |_, text| {
        text.replace("ASET1,123", "SPOINT,901\nASET1,123") + "DMIG,KAAX,901,0,,901,0,4.0E6\n"
    });
    let raw = read(&path).expect("read");
    assert_eq!(raw.dofs.expect("labels").last().map(|label| label.node), Some(901));
}

/// A DMIG entry given twice, or in both triangles of a symmetric matrix, is an error, and a file that ends
/// within a line may have lost digits.
#[test]
fn punch_files_that_contradict_themselves_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.pch");
    let read = |text: &str| {
        fs::write(&path, text).expect("written");
        read_matrix(&MatrixLocation { path: path.clone(), group: None }, MatrixRole::Stiffness)
    };
    let good = "DMIG,K,0,6,2,0\nDMIG,K,1,1,,1,1,1.5-3\n,2,1,-2.D+1\nDMIG,K,2,1,,2,1,.5E1\n";
    let matrix = read(good).expect("a matrix").matrix;
    assert_eq!(
        [matrix.get(0, 0), matrix.get(0, 1), matrix.get(1, 0), matrix.get(1, 1)],
        [1.5e-3, -20.0, -20.0, 5.0]
    );
    for (text, code) in [
        (good.to_owned() + "DMIG,K,2,1,,1,1,3.\n", Code::MatrixTriangles),
        (good.to_owned() + "DMIG,K,2,1,,2,1,3.\n", Code::MatrixTriangles),
        (good.trim_end().to_owned(), Code::MatrixSyntax),
        (good.replace("1.5-3", "1.5-3-"), Code::MatrixSyntax),
        (good.replace(",2,1,.5E1", ",2,7,.5E1"), Code::MatrixSyntax),
        (good.replace(",2,1,.5E1", ",2,1,.5E1,2."), Code::MatrixSyntax),
        (good.replace("0,6,2,0", "0,5,2,0"), Code::MatrixKind),
        (good.to_owned() + good, Code::MatrixSyntax),
        ("DMIG,M,0,6,2,0\nDMIG,M,1,1,,1,1,1.\n".to_owned(), Code::Hdf5Layout),
        (format!("+,1.\n{good}"), Code::DeckSyntax),
    ] {
        let error = read(&text).expect_err(&text);
        assert!(error.has(code), "{code:?}: {error}\n{text}");
    }
}

/// Matrices of OUTPUT4 are found by name and by role.
#[test]
fn matrices_of_a_file_are_named_or_found_by_their_role() {
    let path = fixtures().join("readers/output4/text_sparse.op4");
    let read = |group: Option<&str>, role| {
        let location = MatrixLocation { path: path.clone(), group: group.map(str::to_owned) };
        read_matrix(&location, role).map(|raw| raw.matrix.get(0, 0))
    };
    assert_eq!(read(None, MatrixRole::Stiffness), Ok(1.0 / 7.0));
    assert_eq!(read(None, MatrixRole::Mass), Ok(2.0 / 7.0));
    assert_eq!(read(Some("/k4gg"), MatrixRole::Damping), Ok(3.0 / 7.0));
    assert!(read(None, MatrixRole::Damping).is_err_and(|error| error.has(Code::Hdf5Layout)));
}

/// Files of another writer with rectangular matrices: found, named, and refused as K.
#[test]
fn public_files_are_understood() {
    let folder = oracle::shared().join("samples/nastran");
    if !folder.exists() {
        return;
    }
    for name in ["double_dense_ascii.op4", "double_nonbigmat_ascii.op4"] {
        let read = |group: &str| {
            let location = MatrixLocation { path: folder.join(name), group: Some(group.to_owned()) };
            read_matrix(&location, MatrixRole::Stiffness).expect_err("no stiffness")
        };
        let error = read("/rmat");
        assert!(error.has(Code::MatrixNotSquare), "{error}");
        assert!(error.to_string().contains("RMAT: matrix has 25 rows and 31 columns"), "{error}");
        assert!(read("/cmat").has(Code::MatrixKind));
    }
    let error = read(&folder.join("extseout_inboard.pch")).expect_err("no matrices");
    assert!(error.has(Code::JobIncomplete), "{error}");
}

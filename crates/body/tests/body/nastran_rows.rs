//! Rows of a Nastran deck: dependent rows of rigid elements and MPCs for matrices of the g-set, and data
//! given by rows, or along the axes of grids, in addition to K and M.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{
    ImportedColumns, MatrixLocation, MatrixRole, ModelFiles, read_imported, read_manifest, read_matrix,
    read_model,
};
use flexbody_linalg::CscMatrix;
use flexbody_model::{Damping, DofLabel, FeModel, RawMatrix, RawModel};
use oracle::fixtures;
use oracle::jobs::{body, job};
use std::collections::HashMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

fn small(name: &str) -> PathBuf {
    fixtures().join("small").join(name)
}

/// Copies a small job to a folder, with `cards` in its bulk data and `control` before it.
fn job_with(name: &str, cards: &str, control: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(small(name)).expect("a folder") {
        let path = entry.expect("a file").path();
        fs::copy(&path, folder.path().join(path.file_name().expect("a name"))).expect("copied");
    }
    let path = folder.path().join("job.bdf");
    let text = fs::read_to_string(&path).expect("a deck");
    let text = text.replace("METHOD = 1\n", &format!("METHOD = 1\n{control}"));
    fs::write(&path, text.replace("ENDDATA", &format!("{cards}ENDDATA"))).expect("written");
    (folder, path)
}

fn read(path: &Path) -> Result<RawModel, Error> {
    read_model(&ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("files"))
}

fn with_cards(cards: &str, control: &str) -> Result<RawModel, Error> {
    let (_folder, path) = job_with("nastran_op4", cards, control);
    read(&path)
}

fn labels(raw: &RawModel) -> Vec<(i64, u8)> {
    raw.dofs.as_ref().expect("labels").iter().map(|own| (own.node, own.direction)).collect()
}

fn dense(matrix: &CscMatrix) -> Mat<f64> {
    Mat::from_fn(matrix.n_rows(), matrix.n_cols(), |i, j| matrix.get(i, j))
}

/// Returns the solid without constraints, with empty rotations of its grids, and its positions.
fn whole() -> (RawModel, HashMap<i64, [f64; 3]>) {
    let raw = with_cards("", "").expect("a job");
    let positions = raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied()).collect();
    (raw, positions)
}

/// Returns the displacement of a point at x that is rigidly attached to a grid at o; `column` is a
/// displacement or rotation of the grid.
fn follows(x: [f64; 3], o: [f64; 3], direction: usize, column: usize) -> f64 {
    let r = [0, 1, 2].map(|k| x[k] - o[k]);
    let k = direction;
    match column {
        0..3 => f64::from(u8::from(k == column)),
        // Component k of e x r for the axis e.
        _ => match (k + 3 - (column - 3)) % 3 {
            1 => -r[(k + 1) % 3],
            2 => r[(k + 2) % 3],
            _ => 0.0,
        },
    }
}

/// Compares T'AT with a matrix, row by row.
fn assert_is_reduced(raw: &RawModel, from: &RawModel, t: impl Fn((i64, u8), (i64, u8)) -> f64) {
    assert_is_reduced_beside(&[], raw, from, t);
}

/// Compares T'AT with a matrix in which the rows `dependent` have come back, each held to its sum: motions that follow the
/// constraints strain no more than before.
fn assert_is_reduced_beside(
    dependent: &[(i64, u8)],
    raw: &RawModel,
    from: &RawModel,
    t: impl Fn((i64, u8), (i64, u8)) -> f64,
) {
    let (rows, old) = (labels(raw), labels(from));
    let free: Vec<_> = rows.iter().copied().filter(|row| !dependent.contains(row)).collect();
    assert_eq!(free.len() + dependent.len(), rows.len());
    let of = |all: &[(i64, u8)]| Mat::from_fn(all.len(), free.len(), |i, j| t(all[i], free[j]));
    let (t, lift) = (of(&old), of(&rows));
    for (own, whole) in [(&raw.stiffness, &from.stiffness), (&raw.mass, &from.mass)] {
        let expected = t.transpose() * dense(&whole.matrix) * &t;
        let own = lift.transpose() * dense(&own.matrix) * &lift;
        let largest = expected.norm_max();
        assert!((own - &expected).norm_max() < 1e-12 * largest, "{largest}");
    }
}

/// RBE2 with its rotations, and equivalent RBAR, RBAR1, RBE1, MPC: T'KT of the closed form, no rows for
/// dependent grids, and the mass of the body.
#[test]
fn rigid_elements_and_sums_are_applied_to_matrices_of_the_g_set() {
    let (from, x) = whole();
    let group = [35i64, 38, 41, 44];
    let t = |(node, direction): (i64, u8), (own, column): (i64, u8)| match group.contains(&node) {
        true if own == 29 => follows(x[&node], x[&29], usize::from(direction) - 1, usize::from(column) - 1),
        true => 0.0,
        false => f64::from(u8::from((node, direction) == (own, column))),
    };
    let mut sums = String::new();
    for &node in &group {
        for k in 1..=3u8 {
            write!(sums, "MPC,7,{node},{k},-2.0,29,{k},2.0").expect("memory");
            let others = (4..=6u8)
                .map(|c| (c, 2.0 * follows(x[&node], x[&29], usize::from(k) - 1, usize::from(c) - 1)));
            for (at, (column, factor)) in others.filter(|(_, factor)| *factor != 0.0).enumerate() {
                sums += if at % 2 == 0 { "\n,," } else { "," };
                write!(sums, "29,{column},{factor:?}").expect("memory");
            }
            sums += "\n";
        }
    }
    let bars = |text: &dyn Fn(i64) -> String| group.iter().map(|node| text(*node)).collect::<String>();
    let ways = [
        ("RBE2,901,29,123456,35,38,41,44\n".to_owned(), "", 24),
        ("RBE2,901,29,123,35,38,41,44\n,1.2-5\n".to_owned(), "", 12),
        (bars(&|node| format!("RBAR,{node},29,{node},123456,,,\n")), "", 24),
        (bars(&|node| format!("RBAR,{node},{node},29,,123456,123,,6.5-6\n")), "", 12),
        (bars(&|node| format!("RBAR1,{node},29,{node},123,0.0\n")), "", 12),
        (bars(&|node| format!("RBE1,{node},29,123456,\n,UM,{node},123\n")), "", 12),
        (sums.clone(), "MPC = 7\n", 12),
        (sums + "MPCADD,8,7\n", "SUBCASE 1\n  MPC=8\n", 12),
    ];
    for (cards, control, followers) in ways {
        let raw = with_cards(&cards, control).unwrap_or_else(|error| panic!("{cards}{error}"));
        assert!(group.iter().all(|node| labels(&raw).iter().all(|(own, _)| own != node)), "{cards}");
        assert_eq!(labels(&raw).iter().filter(|(node, _)| *node == 29).count(), 6, "{cards}");
        assert_is_reduced(&raw, &from, t);
        let told = raw.diagnostics.iter().find(|found| found.code() == Code::DeckConstrained).expect("told");
        assert!(told.message().starts_with(&format!("{followers} rows depend")), "{}", told.message());
        let (own, free) = (body(raw, 2), body(from.clone(), 2));
        assert!((own.invariants().mass() / free.invariants().mass() - 1.0).abs() < 1e-12);
        assert!(own.modes().eigenvalue[0] > 1.01 * free.modes().eigenvalue[0], "{cards}");
    }
}

/// RBE3 with equal weights: the mean of the displacements, and their best-fit rotation.
#[test]
fn averages_are_those_of_least_squares() {
    let (from, x) = whole();
    let group = [11i64, 17, 35, 41, 26];
    let centre = [0, 1, 2].map(|k| group.iter().map(|node| x[node][k]).sum::<f64>() / 5.0);
    let arms: HashMap<i64, [f64; 3]> =
        group.iter().map(|node| (*node, [0, 1, 2].map(|k| x[node][k] - centre[k]))).collect();
    let spread = nalgebra::Matrix3::from_fn(|k, l| {
        arms.values()
            .map(|d| {
                let square: f64 = d.iter().map(|d| d * d).sum();
                f64::from(u8::from(k == l)) * square - d[k] * d[l]
            })
            .sum::<f64>()
    });
    let inverse = spread.try_inverse().expect("no line");
    let unit = |k: usize| nalgebra::Vector3::ith(k, 1.0);
    let t = |(node, direction): (i64, u8), (own, column): (i64, u8)| {
        if node != 29 {
            return f64::from(u8::from((node, direction) == (own, column)));
        }
        if !group.contains(&own) {
            return 0.0;
        }
        let (k, c) = (usize::from(direction) - 1, usize::from(column) - 1);
        let rotation = inverse * nalgebra::Vector3::from(arms[&own]).cross(&unit(c));
        let arm = nalgebra::Vector3::from([0, 1, 2].map(|k| x[&29][k] - centre[k]));
        f64::from(u8::from(k == c)) / 5.0 + rotation.cross(&arm)[k]
    };
    for cards in [
        "RBE3,901,,29,123,1.0,123,11,17\n,35,41,26\n",
        "RBE3,901,,29,123456,3.0,123,11,17\n,35,41,3.,123,26,ALPHA,1.-5\n",
    ] {
        let raw = with_cards(cards, "").expect("a job");
        assert_is_reduced(&raw, &from, t);
    }
}

/// Dependent grids may depend on dependent grids; a rod keeps its length.
#[test]
fn constraints_follow_one_another() {
    let chain = with_cards("RBAR,1,38,44,123456\nRBAR,2,29,38,123456\n", "").expect("a job");
    let both = with_cards("RBE2,1,29,123456,38,44\n", "").expect("a job");
    assert_eq!(labels(&chain), labels(&both));
    let (chain, both) = (dense(&chain.stiffness.matrix), dense(&both.stiffness.matrix));
    assert!((chain - &both).norm_max() < 1e-12 * both.norm_max());
    let (from, x) = whole();
    let rod = with_cards("RROD,1,11,44,,3\n", "").expect("a job");
    let line = [0, 1, 2].map(|k| x[&44][k] - x[&11][k]);
    assert_is_reduced_beside(&[(44, 3)], &rod, &from, |(node, direction), (own, column)| {
        if (node, direction) != (44, 3) {
            return f64::from(u8::from((node, direction) == (own, column)));
        }
        let along = line[usize::from(column) - 1] / line[2];
        match own {
            11 => along,
            44 => -along,
            _ => 0.0,
        }
    });
}

#[test]
fn constraints_that_cannot_be_applied_are_named() {
    for (cards, parts) in [
        ("MPC,7,35,1,1.0,38,1,-1.0\n", ["MPC 7", "does not select the set"]),
        ("RSPLINE,5,0.1,11,17,123,35\n", ["RSPLINE 5", "not supported"]),
        ("RBE3,6,,29,123,1.0,123,11,17\n,35,UM,11,1,17\n,1,35,1\n", ["RBE3 6", "not supported"]),
        ("RBE2,1,29,123456,38\nRBE2,2,11,123,38\n", ["RBE2 2", "is also dependent by RBE2 1"]),
        ("RBE2,1,29,123456,38\nRBE2,2,38,123456,29\n", ["RBE2 2", "depends on itself"]),
        ("RBAR,3,29,38,123,45\n", ["RBAR 3", "5 independent components"]),
        ("RBAR,3,29,38,123,123,4,\n", ["RBAR 3", "all rigid motions"]),
        ("RBE3,6,,29,123,1.0,123,11,23\n,35\n", ["RBE3 6", "all rigid motions"]),
        ("RBE2,1,77,123456,38\n", ["RBE2 1", "grid 77 is not in the deck"]),
    ] {
        let error = with_cards(cards, "").expect_err(cards);
        let is_named =
            error.has(Code::DeckUnsupported) && parts.iter().all(|part| error.to_string().contains(part));
        assert!(is_named, "{cards}{error}");
    }
    let error = with_cards("RBE2,1,29,12x,38\n", "").expect_err("no components");
    assert!(error.has(Code::DeckSyntax), "{error}");
}

/// Matrices after the constraints have no dependent rows, so that constraints are applied once. Individually
/// named matrices with dependent rows are refused together with the deck that defines their nodes.
#[test]
fn constraints_are_applied_once() {
    let (folder, path) = job_with("nastran", "RBE2,901,29,123456,35\n", "");
    let punch = folder.path().join("job.pch");
    let text = fs::read_to_string(&punch).expect("a punch file");
    // KAAX without the rows of grid 35.
    let mut kept = String::new();
    let mut left_out = false;
    for line in text.lines() {
        let word = |at: usize| line.split_whitespace().nth(at);
        if line.starts_with("DMIG*") {
            left_out = word(2) == Some("35");
        }
        let of_35 = left_out || line.starts_with("*  ") && word(1) == Some("35");
        if !of_35 || line.starts_with("DMIG  ") {
            kept += line;
            kept += "\n";
        }
    }
    let applied = read(&path).expect("a job");
    assert!(applied.diagnostics.iter().any(|found| found.code() == Code::DeckConstrained));
    fs::write(&punch, kept).expect("written");
    let raw = read(&path).expect("a job");
    assert!(raw.diagnostics.iter().all(|found| found.code() != Code::DeckConstrained));
    assert_eq!(raw.stiffness.matrix.n_cols(), 33);
    let (folder, _) = job_with("nastran_op4", "RBE2,901,29,123456,35\n", "");
    let place = |name: &str| folder.path().join(name);
    let raw = with_cards("", "").expect("a job");
    for (name, own) in [("K.mtx", &raw.stiffness), ("M.mtx", &raw.mass)] {
        fs::write(place(name), matrix_market(&own.matrix)).expect("written");
    }
    let files = ModelFiles::from_arguments(place("K.mtx"), place("M.mtx"), place("job.bdf"), None, None);
    let error = read_model(&files.expect("files")).expect_err("constraints");
    assert!(error.has(Code::DeckUnsupported) && error.to_string().contains("RBE2 901"), "{error}");
}

fn matrix_market(matrix: &CscMatrix) -> String {
    let mut text = format!(
        "%%MatrixMarket matrix coordinate real general\n{} {} {}\n",
        matrix.n_rows(),
        matrix.n_cols(),
        matrix.nnz()
    );
    for column in 0..matrix.n_cols() {
        let (rows, values) = matrix.column(column);
        for (row, value) in rows.iter().zip(values) {
            writeln!(text, "{} {} {value:?}", row + 1, column + 1).expect("memory");
        }
    }
    text
}

/// Returns K of the small job along the axes of its grids, as stored in its punch file.
fn of_the_file(scale: f64) -> CscMatrix {
    let location = MatrixLocation::parse(
        small("nastran").join("job.pch").to_str().expect("a path").to_owned() + ":/KAAX",
    );
    let RawMatrix { matrix, .. } = read_matrix(&location, MatrixRole::Stiffness).expect("a matrix");
    let values: Vec<f64> = matrix.values().iter().map(|value| scale * value).collect();
    CscMatrix::from_parts(36, 36, matrix.col_ptr().to_vec(), matrix.row_idx().to_vec(), values)
}

/// For a job with CD, damping and geometric stiffness are rotated like K, shapes by rows like the
/// displacements of K, and modes by nodes along the axes of their grids.
#[test]
fn what_is_given_by_rows_is_turned_with_k() {
    let (folder, path) = job_with("nastran", "", "");
    fs::write(folder.path().join("D.mtx"), matrix_market(&of_the_file(2e-5))).expect("written");
    let manifest = folder.path().join("model.toml");
    fs::write(&manifest, "[files]\njob = \"job.bdf\"\n[damping]\nmatrix = \"D.mtx\"\n").expect("written");
    let raw = read_model(&read_manifest(&manifest).expect("a manifest")).expect("a model");
    let Some(Damping::Matrix(damping)) = &raw.data.damping else { panic!("a damping matrix") };
    let difference = dense(&damping.matrix) - 2e-5 * dense(&raw.stiffness.matrix);
    assert!(difference.norm_max() < 1e-13 * dense(&damping.matrix).norm_max(), "{}", difference.norm_max());

    let model = FeModel::from_raw(job(&path, Vec::new())).expect("a model").model;
    let shapes = Mat::from_fn(36, 2, |i, j| ((7 * i + 11 * j) % 13) as f64 - 5.5 + 0.1 * i as f64);
    let own = dense(&of_the_file(1.0));
    let turned = model.in_internal_order(model.given_rows().motions(shapes.clone()));
    let energy = |shapes: &Mat<f64>, k: &Mat<f64>| shapes.transpose() * k * shapes;
    let (given, expected) = (energy(&turned, &dense(model.stiffness().as_csc())), energy(&shapes, &own));
    assert!((&given - &expected).norm_max() < 1e-12 * expected.norm_max());
    // The work of forces is that of the file.
    let forces =
        model.in_internal_order(model.given_rows().forces(&own * &shapes).expect("rows of the model"));
    let work = turned.transpose() * forces;
    assert!((work - &expected).norm_max() < 1e-12 * expected.norm_max());

    let labels: Vec<DofLabel> = model_labels(&path);
    let punch = folder.path().join("modes.pch");
    fs::write(&punch, punched(&labels, &shapes)).expect("written");
    let location = MatrixLocation { path: punch, group: None };
    let ImportedColumns::Modes(modes) = read_imported(&location, &[36], "shapes").expect("modes") else {
        panic!("modes by nodes")
    };
    let mut modes = modes;
    assert!(modes.along_nodes);
    model.given_rows().turn(&modes.labels, &mut modes.matrix).expect("whole nodes");
    for (row, label) in modes.labels.iter().enumerate().filter(|(_, label)| label.direction <= 3) {
        let at = (0..36).find(|at| model.label(*at) == *label).expect("a row");
        for mode in 0..2 {
            let (own, expected) = (modes.matrix[(row, mode)], turned[(at, mode)]);
            assert!((own - expected).abs() < 1e-5, "{label}: {own} {expected}");
        }
    }
}

/// Returns the labels of the rows of the punch file, ascending.
fn model_labels(path: &Path) -> Vec<DofLabel> {
    let mut labels = job(path, Vec::new()).dofs.expect("labels");
    labels.sort_unstable();
    labels
}

/// Returns a punch file with modes.
fn punched(labels: &[DofLabel], shapes: &Mat<f64>) -> String {
    let mut text = String::new();
    for mode in 0..shapes.ncols() {
        writeln!(
            text,
            "$TITLE   = MODES\n$EIGENVECTOR\n$REAL OUTPUT\n$EIGENVALUE =  {:.7E}  MODE = {}",
            1e6,
            mode + 1
        )
        .expect("memory");
        for (node, own) in labels.chunks(3).enumerate() {
            let value = |k: usize| shapes[(3 * node + k, mode)];
            writeln!(
                text,
                "{:10}       G{:18.6E}{:18.6E}{:18.6E}",
                own[0].node,
                value(0),
                value(1),
                value(2)
            )
            .expect("memory");
            writeln!(text, "-CONT-            {:18.6E}{:18.6E}{:18.6E}", 0.0, 0.0, 0.0).expect("memory");
        }
    }
    text
}

/// Matrices of all rows of the g-set fit a model without its empty rows.
#[test]
fn matrices_of_the_g_set_fit_beside_reduced_rows() {
    let (folder, _) = job_with("nastran_op4", "RBE2,901,29,123456,35\n", "");
    let location =
        MatrixLocation::parse(folder.path().join("job.op4").to_str().expect("a path").to_owned() + ":/KGG");
    let whole = read_matrix(&location, MatrixRole::Stiffness).expect("a matrix");
    fs::write(folder.path().join("D.mtx"), matrix_market(&whole.matrix)).expect("written");
    let manifest = folder.path().join("model.toml");
    fs::write(&manifest, "[files]\njob = \"job.bdf\"\n[damping]\nmatrix = \"D.mtx\"\n").expect("written");
    let raw = read_model(&read_manifest(&manifest).expect("a manifest")).expect("a model");
    let Some(Damping::Matrix(damping)) = &raw.data.damping else { panic!("a damping matrix") };
    assert_eq!(damping.matrix.n_cols(), raw.stiffness.matrix.n_cols());
    let difference = dense(&damping.matrix) - dense(&raw.stiffness.matrix);
    assert!(difference.norm_max() < 1e-12 * dense(&damping.matrix).norm_max());
    // An entry in a row that is empty in K and M has no effect.
    let mut lost = matrix_market(&whole.matrix).replacen(
        &format!(" {}\n", whole.matrix.nnz()),
        &format!(" {}\n", whole.matrix.nnz() + 1),
        1,
    );
    lost += "4 4 1e9\n";
    fs::write(folder.path().join("D.mtx"), lost).expect("written");
    let error = read_model(&read_manifest(&manifest).expect("a manifest")).expect_err("an empty row");
    assert!(error.to_string().contains("rows that K and M leave empty"), "{error}");
}

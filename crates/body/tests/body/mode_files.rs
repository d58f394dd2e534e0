//! Modes written by FE programs: every format gives the same body, missing rows are completed, and mismatches
//! are reported.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, ImportedShapes, ModeSettings};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_eigen::Wanted;
use flexbody_input::{ImportedColumns, MatrixLocation, ModelFiles, read_imported, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModes};
use oracle::damage::{apply, damage};
use oracle::fixtures;
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

fn file(name: &str) -> PathBuf {
    fixtures().join("small/modes").join(name)
}

/// Returns the files of modes of every format, without the job that computed them.
fn mode_files() -> Vec<String> {
    let entries = fs::read_dir(file("")).expect("fixtures").map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
    names.retain(|name| !name.starts_with("job."));
    names.sort();
    names
}

fn model(job: &str) -> FeModel {
    let path = fixtures().join("small").join(job).join("job.inp");
    let files = ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("units");
    FeModel::from_raw(read_model(&files).expect("readable")).expect("a sound model").model
}

fn read(model: &FeModel, path: &Path) -> Result<RawModes> {
    let location = MatrixLocation { path: path.to_path_buf(), group: None };
    match read_imported(&location, &[model.stiffness().n()], "shapes")? {
        ImportedColumns::Modes(modes) => Ok(modes),
        ImportedColumns::Rows(_) => panic!("{} is a file of modes", path.display()),
    }
}

fn converted(model: &FeModel, basis: BasisChoice, count: usize) -> Conversion {
    let modes = ModeSettings { wanted: Wanted::Lowest(count), ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, basis, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
}

fn imported(model: &FeModel, modes: RawModes) -> Conversion {
    let shapes = ImportedShapes::of_modes(model, modes).expect("modes of this model");
    converted(model, BasisChoice::Imported(shapes), usize::MAX)
}

fn codes(conversion: &Conversion) -> Vec<Code> {
    conversion.diagnostics.iter().map(|d| d.code()).collect()
}

/// Compares the flexible eigenvalues with computed ones.
#[track_caller]
fn assert_are_free_modes(model: &FeModel, imported: &Conversion, limit: f64) {
    let own = &imported.body.modes().eigenvalue;
    let free = converted(model, BasisChoice::default(), own.len()).body;
    for (a, b) in own.iter().zip(&free.modes().eigenvalue) {
        assert!((a / b - 1.0).abs() < limit, "{a} {b}");
    }
}

/// CalculiX computed the modes of the block; the other files hold them in formats of other programs.
#[test]
fn every_format_has_the_modes_of_the_free_body() {
    let model = model("modes");
    for (name, digits, limit) in
        [("block.frd", 6, 1e-7), ("block.pch", 7, 1e-7), ("block.op2", 7, 1e-7), ("block.txt", 5, 1e-6)]
    {
        let modes = read(&model, &file(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((modes.matrix.ncols(), modes.digits), (10, digits), "{name}");
        let done = imported(&model, modes);
        assert_eq!(done.body.modes().eigenvalue.len(), 4, "{name}: four of ten modes deform the block");
        assert_eq!(codes(&done), [Code::ShapesRigid, Code::ShapesSpan], "{name}: {:?}", done.diagnostics);
        assert_are_free_modes(&model, &done, limit);
    }
}

/// Words of 64 bits hold the modes with all digits: they are eigenvectors without correction.
#[test]
fn results_in_double_precision_are_eigenvectors() {
    let model = model("modes");
    let modes = read(&model, &file("block64.op2")).expect("modes");
    assert_eq!((modes.matrix.ncols(), modes.digits), (10, 15));
    let done = imported(&model, modes);
    assert_eq!(codes(&done), [Code::ShapesRigid], "{:?}", done.diagnostics);
    assert_are_free_modes(&model, &done, 1e-12);
}

/// Bricks with internal rows and a rigid body whose reference node rotates: the file has the nodes of the
/// bricks, some of which belong to the rigid body and have no rows.
#[test]
fn rows_that_a_file_lacks_follow_from_the_others() {
    let model = model("calculix");
    let modes = read(&model, &file("rigid.frd")).expect("modes");
    assert!(modes.labels.len() < model.stiffness().n());
    let done = imported(&model, modes);
    assert_eq!(codes(&done)[0], Code::ModesCompleted, "{:?}", done.diagnostics);
    assert!(!codes(&done).contains(&Code::ModesDiffer), "{:?}", done.diagnostics);
    assert_eq!(done.body.modes().eigenvalue.len(), 3);
    assert_are_free_modes(&model, &done, 1e-6);
}

/// The file of another body is detected by its frequencies, that of other nodes by the node numbers.
#[test]
fn modes_of_another_model_are_told() {
    let model = model("modes");
    let modes = read(&model, &file("block.frd")).expect("modes");
    let told = |modes: RawModes| {
        let done = imported(&model, modes);
        done.diagnostics.into_iter().find(|d| d.code() == Code::ModesDiffer).map(|d| d.message().to_owned())
    };
    assert_eq!(told(modes.clone()), None);
    let mut softer = modes.clone();
    softer.eigenvalues[8] = softer.eigenvalues[8].map(|value| 0.9 * value);
    let message = told(softer).expect("a difference");
    assert!(message.starts_with("1 of 4 flexible modes differ: mode 9 has "), "{message}");
    // Two mixed modes have neither the eigenvalues nor the shapes of the originals.
    let mut mixed = modes.clone();
    for row in 0..mixed.matrix.nrows() {
        let sum = mixed.matrix[(row, 6)] + mixed.matrix[(row, 8)];
        mixed.matrix[(row, 6)] = sum;
    }
    assert!(told(mixed).expect("a difference").contains("MAC 0."));
    let mut elsewhere = modes;
    elsewhere.labels.iter_mut().for_each(|label| label.node += 1000);
    let error = ImportedShapes::of_modes(&model, elsewhere).expect_err("no node is one of the model");
    assert!(error.has(Code::ShapesSize), "{error}");
}

/// Two digits are too few for a mesh that is stiff relative to its first mode, and this is reported as such.
#[test]
fn too_few_digits_are_told_from_another_model() {
    let model = model("modes");
    let mut modes = read(&model, &file("block.frd")).expect("modes");
    let round = |value: f64| {
        if value == 0.0 {
            0.0
        } else {
            let unit = 10f64.powi(value.abs().log10().floor() as i32 - 1);
            (value / unit).round() * unit
        }
    };
    for j in 0..modes.matrix.ncols() {
        modes.matrix.col_mut(j).iter_mut().for_each(|value| *value = round(*value));
    }
    modes.digits = 2;
    let done = imported(&model, modes);
    let told = done.diagnostics.iter().find(|d| d.code() == Code::ModesDiffer).expect("a difference");
    assert!(told.help().starts_with("write the shapes with more than 2 digits"), "{}", told.help());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_of_modes_never_panic(
        name in prop::sample::select(mode_files()),
        damages in proptest::collection::vec(damage(), 1..4),
    ) {
        let mut bytes = fs::read(file(&name)).expect("a file");
        damages.iter().for_each(|damage| apply(&mut bytes, damage));
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join(&name);
        fs::write(&path, bytes).expect("written");
        if let Ok(ImportedColumns::Modes(modes)) = read_imported(&MatrixLocation { path, group: None }, &[54], "shapes") {
            prop_assert_eq!(modes.matrix.nrows(), modes.labels.len());
            prop_assert_eq!(modes.matrix.ncols(), modes.eigenvalues.len());
        }
    }
}

//! Matrices kept in files instead of memory: equal bodies, and equal files for a cluster.

use crate::program::flexbody;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel};
use hdf5_metno as hdf5;
use oracle::{fixtures, members};
use std::fs;
use std::path::Path;

/// Storage of a matrix.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Layout {
    Plain,
    LongIndices,
    Chunked,
    SinglePrecision,
    WithZero,
    Unsorted,
    OneTriangle,
}

const LAYOUTS: [Layout; 7] = [
    Layout::Plain,
    Layout::LongIndices,
    Layout::Chunked,
    Layout::SinglePrecision,
    Layout::WithZero,
    Layout::Unsorted,
    Layout::OneTriangle,
];

/// Writes compressed columns in the layout of h5py.
fn write_group(file: &hdf5::File, name: &str, matrix: &CscMatrix, layout: Layout) {
    let (mut pointers, mut rows, mut values) = (vec![0_i64], Vec::new(), Vec::new());
    for j in 0..matrix.n_cols() {
        let (own_rows, own_values) = matrix.column(j);
        let mut column: Vec<(i32, f64)> =
            own_rows.iter().zip(own_values).map(|(&row, &value)| (row as i32, value)).collect();
        match layout {
            Layout::OneTriangle => column.retain(|(row, _)| *row as usize >= j),
            Layout::Unsorted => column.reverse(),
            // Adds an explicit zero in a row that the column does not couple.
            Layout::WithZero if j == 0 => {
                let free = (0..).find(|row| column.iter().all(|(own, _)| own != row)).expect("a free row");
                column.push((free, 0.0));
                column.sort_by_key(|(row, _)| *row);
            }
            _ => {}
        }
        rows.extend(column.iter().map(|(row, _)| *row));
        values.extend(column.iter().map(|(_, value)| *value));
        pointers.push(rows.len() as i64);
    }
    let group = file.create_group(name).expect("a group");
    group.new_dataset_builder().with_data(&pointers).create("indptr").expect("pointers");
    match layout {
        Layout::LongIndices => {
            let rows: Vec<i64> = rows.iter().map(|&row| i64::from(row)).collect();
            group.new_dataset_builder().with_data(&rows).create("indices").expect("rows");
        }
        _ => {
            group.new_dataset_builder().with_data(&rows).create("indices").expect("rows");
        }
    }
    let builder = group.new_dataset_builder();
    match layout {
        Layout::Chunked => builder.chunk(64).with_data(&values).create("data").map(drop),
        Layout::SinglePrecision => {
            let values: Vec<f32> = values.iter().map(|&value| value as f32).collect();
            builder.with_data(&values).create("data").map(drop)
        }
        _ => builder.with_data(&values).create("data").map(drop),
    }
    .expect("values");
    if layout == Layout::OneTriangle {
        group.new_attr::<bool>().create("symmetric").and_then(|yes| yes.write_scalar(&true)).expect("a mark");
    }
}

/// Replaces a written file by an unlocked copy: child programs of other tests inherit open files of this one
/// with their locks until they run.
fn unlock(path: &Path) {
    let copied = path.with_extension("copy");
    fs::copy(path, &copied).expect("a copy");
    fs::rename(&copied, path).expect("renamed");
}

/// Writes the cube into a folder, with matrices in HDF5.
fn model_in(folder: &Path, layout: Layout) {
    let own = fixtures().join("models/cube_hex8");
    let read = read_model(&read_manifest(own.join("model.toml")).expect("a manifest")).expect("a model");
    let path = folder.join("matrices.h5");
    let file = hdf5::File::create(&path).expect("a file");
    write_group(&file, "K", &read.stiffness.matrix, layout);
    write_group(&file, "M", &read.mass.matrix, layout);
    drop(file);
    unlock(&path);
    for table in ["nodes.csv", "dofs.csv"] {
        fs::copy(own.join(table), folder.join(table)).expect("a copy");
    }
    let text = fs::read_to_string(own.join("model.toml")).expect("text");
    let text = text.replace("K.mtx.gz", "matrices.h5:/K").replace("M.mtx.gz", "matrices.h5:/M");
    fs::write(folder.join("model.toml"), text).expect("written");
}

fn read(folder: &Path, keep: bool) -> RawModel {
    let mut files = read_manifest(folder.join("model.toml")).expect("a manifest");
    files.keep_in = keep.then(|| folder.to_owned());
    read_model(&files).expect("a model")
}

/// Every storage gives the same matrix; it is kept in files if its columns are sorted and complete. No file
/// remains.
#[test]
fn matrices_are_kept_in_files_where_columns_are_sorted() {
    for layout in LAYOUTS {
        let folder = tempfile::tempdir().expect("a folder");
        model_in(folder.path(), layout);
        let (read_in, stayed) = (read(folder.path(), false), read(folder.path(), true));
        assert!(!read_in.stiffness.matrix.is_lent(), "{layout:?}");
        let is_kept = !matches!(layout, Layout::Unsorted | Layout::OneTriangle);
        assert_eq!(stayed.stiffness.matrix.is_lent(), is_kept, "{layout:?}");
        assert_eq!(stayed.mass.matrix.is_lent(), is_kept, "{layout:?}");
        assert_eq!(stayed, read_in, "{layout:?}");
        drop(stayed);
        assert_eq!(
            members(folder.path()),
            ["dofs.csv", "matrices.h5", "model.toml", "nodes.csv"],
            "{layout:?}"
        );
    }
}

/// Damaged files are refused with equal messages.
#[test]
fn damage_is_told_alike() {
    for (dataset, at, wrong) in [("indices", 5, 1e6), ("data", 7, f64::NAN), ("indptr", 3, 1e6)] {
        let folder = tempfile::tempdir().expect("a folder");
        model_in(folder.path(), Layout::Plain);
        let path = folder.path().join("matrices.h5");
        {
            let file = hdf5::File::open_rw(&path).expect("a file");
            let numbers = file.dataset(&format!("K/{dataset}")).expect("a dataset");
            let mut values = numbers.read_raw::<f64>().expect("numbers");
            values[at] = wrong;
            numbers.write(&values).expect("written");
        }
        unlock(&path);
        let told = [false, true].map(|keep| {
            let mut files = read_manifest(folder.path().join("model.toml")).expect("a manifest");
            files.keep_in = keep.then(|| folder.path().to_owned());
            format!("{:?}", read_model(&files).expect_err("damaged").into_diagnostics())
        });
        assert_eq!(told[0], told[1], "{dataset}");
    }
}

/// `prepare` reads the matrices in place, and writes the same files for a cluster as from text.
#[test]
fn a_cluster_gets_the_same_files() {
    let folder = tempfile::tempdir().expect("a folder");
    model_in(folder.path(), Layout::Plain);
    let text = fixtures().join("models/cube_hex8/model.toml").display().to_string();
    for (model, job) in [(text.as_str(), "text.job"), ("model.toml", "hdf5.job")] {
        let output = flexbody(folder.path(), &["prepare", model, "-o", job, "--quiet"]);
        assert!(output.status.success(), "{output:?}");
    }
    for name in ["stiffness.petsc", "mass.petsc", "rigid.petsc"] {
        let [text, hdf5] =
            ["text.job", "hdf5.job"].map(|job| fs::read(folder.path().join(job).join(name)).expect("a file"));
        assert!(text == hdf5, "{name}");
    }
}

/// `assemble` and `convert --engine slepc` make bodies from matrices kept in files.
#[test]
fn a_body_of_kept_matrices_is_that_of_others() {
    let folder = tempfile::tempdir().expect("a folder");
    model_in(folder.path(), Layout::Plain);
    let [held, kept] = [false, true].map(|keep| {
        let model = FeModel::from_raw(read(folder.path(), keep)).expect("a model").model;
        assert_eq!(model.stiffness().as_csc().is_lent(), keep);
        convert(&model, &ConvertSettings::default(), &Context::QUIET).expect("a body").body
    });
    assert_eq!(held, kept);
}

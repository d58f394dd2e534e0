//! Damaged files: any change of a valid file ends in a model or in a report, never in a panic.

use flexbody_base::diagnostic::Severity;
use flexbody_input::{ModelFiles, ModelSource, READERS, read_manifest, read_model};
use oracle::cases::Case;
use oracle::damage::{Damage, apply, damage};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn fixture(path: &str) -> PathBuf {
    oracle::fixtures().join(path)
}

/// Reads a model in which one file is replaced by `bytes`.
fn read(role: &str, name: &str, bytes: &[u8]) -> Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let result = if role == "manifest" {
        read_manifest(&path).and_then(|files| read_model(&files)).map(|model| model.diagnostics)
    } else {
        let small = |name: &str| fixture("small/tet4").join(name);
        let mut files = ModelFiles::from_arguments(
            small("K.mtx"),
            small("M.mtx"),
            small("nodes.csv"),
            Some(small("dofs.csv")),
            None,
        )
        .unwrap();
        let ModelSource::Tables(tables) = &mut files.source else { unreachable!("made of tables") };
        match role {
            "stiffness" => tables.stiffness.path = path,
            "nodes" => tables.nodes = path,
            _ => tables.dofs = Some(path),
        }
        read_model(&files).map(|model| {
            let n = model.stiffness.matrix.n_rows();
            assert!(model.stiffness.matrix.values().iter().all(|v| v.is_finite() && *v != 0.0), "{n} rows");
            model.diagnostics
        })
    };
    match result {
        Ok(diagnostics) => prop_assert!(diagnostics.iter().all(|d| d.severity() != Severity::Error)),
        Err(error) => prop_assert!(error.diagnostics().iter().all(|d| !d.message().is_empty())),
    }
    Ok(())
}

/// Damages a fixture and reads it.
fn survives(role: &str, file: &Path, damages: &[Damage]) -> Result<(), TestCaseError> {
    survives_as(role, file.file_name().unwrap().to_str().unwrap(), std::fs::read(file).unwrap(), damages)
}

/// Damages the bytes of a file and reads it under the name `name`.
fn survives_as(role: &str, name: &str, mut bytes: Vec<u8>, damages: &[Damage]) -> Result<(), TestCaseError> {
    for damage in damages {
        apply(&mut bytes, damage);
    }
    read(role, name, &bytes)
}

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    proptest::collection::vec(damage(), 1..4)
}

fn cases(default: u32) -> ProptestConfig {
    // The variable PROPTEST_CASES sets the number of cases.
    let cases = std::env::var("PROPTEST_CASES").ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Returns the files of a folder of the fixtures.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(fixture(folder)).unwrap();
    let mut all: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    all.sort();
    all
}

/// Returns true if a file is HDF5, of any format.
fn is_hdf5(path: &Path) -> bool {
    std::fs::read(path).unwrap().starts_with(b"\x89HDF")
}

/// Returns the files of every matrix format: those in HDF5, or the others.
fn matrices(hdf5: bool) -> Vec<PathBuf> {
    let folders = READERS.iter().map(|reader| reader.name().to_lowercase().replace(' ', "-"));
    let all = folders.flat_map(|folder| files(&format!("readers/{folder}")));
    all.filter(|path| is_hdf5(path) == hdf5).collect()
}

/// Returns the files of nodes of every mesh format: those in HDF5, or the others.
fn meshes(hdf5: bool) -> Vec<PathBuf> {
    files("small/meshes").into_iter().filter(|path| is_hdf5(path) == hdf5).collect()
}

proptest! {
    #![proptest_config(cases(600))]

    #[test]
    fn damaged_meshes(file in prop::sample::select(meshes(false)), damages in damages()) {
        survives("nodes", &file, &damages)?;
    }

    #[test]
    fn damaged_zstd(damages in damages()) {
        let text = std::fs::read(fixture("readers/matrix-market/scipy.mtx")).unwrap();
        let mut bytes = ruzstd::encoding::compress_to_vec(&text[..], ruzstd::encoding::CompressionLevel::Fastest);
        for damage in &damages {
            apply(&mut bytes, damage);
        }
        read("stiffness", "K.mtx.zst", &bytes)?;
    }

    #[test]
    fn damaged_tables(table in prop::sample::select(vec!["nodes", "dofs"]), damages in damages()) {
        survives(table, &fixture(&format!("small/tet4/{table}.csv")), &damages)?;
    }

    #[test]
    fn damaged_manifest(
        case in prop::sample::select(vec!["FB201-interfaces", "FB201-mistyped", "FB202-units", "FB205-interface_list"]),
        damages in damages(),
    ) {
        let manifest = Case::read(case).files().remove("model.toml").unwrap();
        survives_as("manifest", "model.toml", manifest, &damages)?;
    }
}

proptest! {
    // The cases are fixed, because the behaviour of the HDF5 library on damaged files should not fail the
    // test at random.
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(20), ..cases(600) })]

    #[test]
    fn damaged_hdf5(file in prop::sample::select(matrices(true)), damages in damages()) {
        survives("stiffness", &file, &damages)?;
    }

    #[test]
    fn damaged_exodus(file in prop::sample::select(meshes(true)), damages in damages()) {
        survives("nodes", &file, &damages)?;
    }
}

proptest! {
    #![proptest_config(cases(2400))]

    #[test]
    fn damaged_matrices(file in prop::sample::select(matrices(false)), damages in damages()) {
        survives("stiffness", &file, &damages)?;
    }
}

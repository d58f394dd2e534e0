//! Damaged files: whatever is changed in a valid file, reading it ends in a model or in a report, never in a
//! panic.

use flexbody_base::diagnostic::Severity;
use flexbody_input::{ModelFiles, ModelSource, read_manifest, read_model};
use oracle::cases::Case;
use oracle::damage::{Damage, apply, damage};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn fixture(path: &str) -> PathBuf {
    oracle::fixtures().join(path)
}

/// Reads a model of which one file is replaced by `bytes`.
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
    // PROPTEST_CASES asks for more.
    let cases = std::env::var("PROPTEST_CASES").ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(600))]

    #[test]
    fn damaged_matrix_market(
        file in prop::sample::select(vec!["scipy.mtx", "scipy_general.mtx", "gzip.mtx.gz"]),
        damages in damages(),
    ) {
        survives("stiffness", &fixture("readers/matrix-market").join(file), &damages)?;
    }

    #[test]
    fn damaged_npz(
        file in prop::sample::select(vec!["csc.npz", "csr_stored.npz", "coo.npz"]),
        damages in damages(),
    ) {
        survives("stiffness", &fixture("readers/scipy-npz").join(file), &damages)?;
    }

    #[test]
    fn damaged_mat5(
        file in prop::sample::select(vec![
            "scipy.mat", "scipy_compressed.mat", "scipy_full.mat", "octave_v7.mat", "big_endian.mat",
        ]),
        damages in damages(),
    ) {
        survives("stiffness", &fixture("readers/matlab").join(file), &damages)?;
    }

    #[test]
    fn damaged_petsc(file in prop::sample::select(vec!["aij.petsc", "aij_64.dat"]), damages in damages()) {
        survives("stiffness", &fixture("readers/petsc").join(file), &damages)?;
    }

    #[test]
    fn damaged_meshes(
        file in prop::sample::select(vec![
            "tet4_ascii.vtu", "tet4_zlib.vtu", "tet4_plain.vtu", "tet4_inline.vtu", "tet4_raw.vtu", "tet4_base64.vtu",
            "tet4_raw_big_endian_64.vtu", "tet4_51.vtk", "tet4_51_ascii.vtk", "tet4_ascii.vtk", "tet4_binary.vtk",
        ]),
        damages in damages(),
    ) {
        survives("nodes", &fixture("small/meshes").join(file), &damages)?;
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
    // Always the same cases: what the HDF5 library itself does with a damaged file is not ours to find by
    // chance.
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(20), ..cases(600) })]

    #[test]
    fn damaged_hdf5(
        file in prop::sample::select(vec![
            "scipy_csc.h5", "anndata_csr.h5", "matlab.mat", "coo_matlab_doubles.h5",
            "at_root_compressed_chunks.h5", "triangle_declared.h5",
        ]),
        damages in damages(),
    ) {
        survives("stiffness", &fixture("readers/hdf5").join(file), &damages)?;
    }

    #[test]
    fn damaged_exodus(
        file in prop::sample::select(vec!["tet4.exo", "tet4_named.exo"]),
        damages in damages(),
    ) {
        survives("nodes", &fixture("small/meshes").join(file), &damages)?;
    }
}

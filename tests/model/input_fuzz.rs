//! Damaged files: whatever is changed in a valid file, reading it ends in a model or in a report, never in a
//! panic.

use crate::support::cases::Case;
use flexbody::base::diagnostic::Severity;
use flexbody::input::{ModelFiles, ModelSource, read_manifest, read_model};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(path)
}

/// One change of the bytes, at a place given as a fraction of the length.
#[derive(Debug, Clone)]
pub enum Damage {
    Flip(f64, u8),
    Set(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Repeat(f64, usize),
    CutOff(f64),
}

pub fn damage() -> impl Strategy<Value = Damage> {
    let at = 0.0..1.0f64;
    prop_oneof![
        3 => (at.clone(), 0..8u8).prop_map(|(at, bit)| Damage::Flip(at, bit)),
        3 => (at.clone(), prop_oneof![any::<u8>(), prop::sample::select(b"0123456789 \n,;-+.eEnN%#\"[]=\x00\xff".to_vec())])
            .prop_map(|(at, byte)| Damage::Set(at, byte)),
        2 => (at.clone(), proptest::collection::vec(any::<u8>(), 1..6)).prop_map(|(at, b)| Damage::Insert(at, b)),
        2 => (at.clone(), prop::sample::select(vec![&b"\n"[..], b"99999999999999999999", b"-", b"nan", b"1e999", b"\"", b"[["]))
            .prop_map(|(at, b)| Damage::Insert(at, b.to_vec())),
        1 => (at.clone(), 1..40usize).prop_map(|(at, length)| Damage::Remove(at, length)),
        1 => (at.clone(), 1..40usize).prop_map(|(at, length)| Damage::Repeat(at, length)),
        1 => at.prop_map(Damage::CutOff),
    ]
}

pub fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    let len = bytes.len();
    if len == 0 {
        return;
    }
    let place = |at: f64| ((at * len as f64) as usize).min(len - 1);
    match damage {
        Damage::Flip(at, bit) => bytes[place(*at)] ^= 1 << bit,
        Damage::Set(at, byte) => bytes[place(*at)] = *byte,
        Damage::Insert(at, new) => {
            let at = place(*at);
            bytes.splice(at..at, new.iter().copied());
        }
        Damage::Remove(at, length) => {
            let at = place(*at);
            bytes.drain(at..(at + length).min(len));
        }
        Damage::Repeat(at, length) => {
            let at = place(*at);
            let piece = bytes[at..(at + length).min(len)].to_vec();
            bytes.splice(at..at, piece);
        }
        Damage::CutOff(at) => bytes.truncate(place(*at)),
    }
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
        case in prop::sample::select(vec!["FB201/interfaces", "FB201/mistyped", "FB202/units", "FB205/interface_list"]),
        damages in damages(),
    ) {
        let manifest = Case::read(&fixture("codes").join(case)).files().remove("model.toml").unwrap();
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

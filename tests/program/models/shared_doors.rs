//! Cases of `../shared/cases/doors`, if that folder exists, with their correct values: a block of twelve
//! skewed hexahedra. Further tests cover the same features with inputs of this package.

use crate::program::flexbody;
use std::fs;
use std::path::{Path, PathBuf};

/// First flexible frequencies of the block. Unit: Hz.
const BLOCK: [f64; 4] = [5005.576, 5296.268, 6116.486, 9072.517];

fn case(name: &str) -> Option<PathBuf> {
    let folder = oracle::shared().join("cases/doors").join(name);
    folder.is_dir().then_some(folder)
}

/// Runs `convert` on a case; returns the report, or the messages of a failure.
fn convert(folder: &Path, words: &[&str]) -> Result<serde_json::Value, String> {
    let place = tempfile::tempdir().expect("a folder");
    let output = place.path().join("b.flex.h5");
    let end = ["-o", output.to_str().expect("a path"), "--json"];
    let words: Vec<&str> = ["convert"].iter().chain(words).chain(&end).copied().collect();
    let done = flexbody(folder, &words);
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    if !done.status.success() {
        return Err(text);
    }
    let report: serde_json::Value = serde_json::from_str(&text).expect("a report");
    Ok(report["results"].clone())
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().expect("numbers").iter().map(|own| own.as_f64().expect("a number")).collect()
}

fn assert_frequencies(name: &str, report: &serde_json::Value, expected: &[f64]) {
    let own = numbers(&report["modes"]["frequency_hz"]);
    assert!(own.len() >= expected.len(), "{name}: {own:?}");
    for (own, expected) in own.iter().zip(expected) {
        assert!((own - expected).abs() < 6e-4, "{name}: {own} {expected}");
    }
}

#[test]
fn blocks_have_their_frequencies() {
    const UNITS: &[&str] = &["--units", "m,kg,s"];
    let cases: &[(&str, &[&str], &[f64])] = &[
        ("02_rbe2_with_kgg", &["job.bdf", "--modes", "4"], &[5219.703, 5331.356, 6241.009, 9180.424]),
        ("04b_cd_modes_punch", &["job.bdf", "--basis", "imported", "--shapes", "job.pch"], &BLOCK),
        ("05a_ccx_dotted_set", &["job.inp", "--modes", "4", "--interface", "SUP"], &BLOCK),
        ("07_op4_ilp64_names", &["job.bdf", "--modes", "4"], &BLOCK),
        ("08_kasmx", &["job.bdf", "--modes", "4"], &BLOCK),
        ("09_nested_include", &["job.inp", "--modes", "4"], &BLOCK),
        ("10a_node_input", &["job.inp", "--modes", "4"], &BLOCK),
        ("10b_steps_apart", &["job.inp", "--modes", "4"], &BLOCK),
        ("13_continuation_case", &["job.bdf", "--modes", "4"], &BLOCK),
        (
            "16_ansys_rotated_nodes",
            &[
                "--stiffness",
                "K.mtx",
                "--mass",
                "M.mtx",
                "--nodes",
                "part.cdb",
                "--dofs",
                "map.txt",
                "--modes",
                "4",
            ],
            &BLOCK,
        ),
        ("17_rigidbody_one_word", &["job.inp", "--modes", "1"], &[5088.273]),
        (
            "18_punch_with_loads",
            &[
                "--stiffness",
                "job.pch:/KAAX",
                "--mass",
                "job.pch:/MAAX",
                "--nodes",
                "job.bdf",
                "--modes",
                "4",
            ],
            &BLOCK,
        ),
        ("19_nul_name", &["job.bdf", "--modes", "4"], &BLOCK),
    ];
    for (name, words, expected) in cases {
        let Some(folder) = case(name) else { continue };
        let words: Vec<&str> = words.iter().chain(UNITS).copied().collect();
        let report = convert(&folder, &words).unwrap_or_else(|told| panic!("{name}: {told}"));
        assert_frequencies(name, &report, expected);
    }
}

#[test]
fn other_cases_have_their_values() {
    if let Some(folder) = case("03_job_takes_job2") {
        assert!(convert(&folder, &["job.bdf"]).expect_err("matrices of job2").contains("FB109"));
    }
    if let Some(folder) = case("06_shellsection_offset") {
        let report = convert(&folder, &["job.inp", "--units", "m,kg,s"]).expect("a body");
        let z = numbers(&report["body"]["centre_of_mass"])[2];
        assert!((z + 0.002).abs() < 1e-12, "{z}");
    }
    if let Some(folder) = case("21_replication") {
        let report = convert(&folder, &["job.bdf", "--units", "m,kg,s"]).expect("a body");
        let mass = report["body"]["mass"].as_f64().expect("a mass");
        assert!((mass / (7850.0 * 0.3 * 0.1 * 0.06) - 1.0).abs() < 1e-12, "{mass}");
    }
    // D = beta K has the ratios omega beta / 2, along any axes, for all rows and for the reduced rows.
    for name in ["04a_cd_damping_geometric", "11_bgg_damping"] {
        let Some(folder) = case(name) else { continue };
        let place = tempfile::tempdir().expect("a folder");
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("a file").path();
            fs::copy(&path, place.path().join(path.file_name().expect("a name"))).expect("copied");
        }
        for matrix in ["D108.mtx", "D216.mtx", "job.op4:/BGG"] {
            let text = format!("[files]\njob = \"job.bdf\"\n[damping]\nmatrix = \"{matrix}\"\n");
            fs::write(place.path().join("own.toml"), text).expect("written");
            let report = convert(place.path(), &["own.toml", "--modes", "4"]).expect("a body");
            let ratios = numbers(&report["modes"]["damping_ratio"]);
            for (ratio, hertz) in ratios.iter().zip(BLOCK) {
                let expected = 0.5 * 1e-7 * std::f64::consts::TAU * hertz;
                assert!((ratio / expected - 1.0).abs() < 1e-6, "{name} {matrix}: {ratio} {expected}");
            }
        }
    }
}

/// Dotted names of the assembly select nodes 1 and 101.
#[test]
fn sets_of_the_assembly_are_those_of_its_instances() {
    let Some(folder) = case("05b_assembly_dotted") else { return };
    let nodes = |name: &str| {
        let interface = oracle::jobs::set("a", name);
        let mut raw = oracle::jobs::job(&folder.join("job.inp"), vec![interface]);
        raw.data.interfaces.remove(0).nodes
    };
    assert_eq!(nodes("DOTTED"), [1, 101]);
    assert_eq!(nodes("ONE"), [136]);
    assert_eq!(nodes("A.TIP"), [34, 35, 36]);
    assert_eq!(nodes("B.TIP"), [134, 135, 136]);
    if let Some(folder) = case("05a_ccx_dotted_set") {
        let raw = oracle::jobs::job(&folder.join("job.inp"), vec![oracle::jobs::set("a", "SUP")]);
        assert_eq!(raw.data.interfaces[0].nodes, [28, 29, 30, 31]);
    }
}

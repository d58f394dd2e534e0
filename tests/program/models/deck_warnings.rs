//! Warnings about parts of a deck that its matrices do not show: dashpots, the stress of an earlier step, and elements whose
//! rows are those of no body in space.

use flexbody_base::diagnostic::Code;
use flexbody_input::{ModelFiles, read_model};
use oracle::fixtures;
use std::fs;
use std::path::Path;

/// Returns the codes and messages of the deck of a small job with `old` replaced by `new`: those of its diagnostics, or of
/// its errors.
fn told(job: &str, deck: &str, old: &str, new: &str) -> Vec<(Code, String)> {
    let folder = tempfile::tempdir().expect("a folder");
    for file in fs::read_dir(fixtures().join("small").join(job)).expect("a folder") {
        let path = file.expect("a file").path();
        fs::copy(&path, folder.path().join(path.file_name().expect("a name"))).expect("copied");
    }
    let path = folder.path().join(deck);
    let text = fs::read_to_string(&path).expect("a text");
    assert!(text.contains(old), "{job}: {old}");
    fs::write(&path, text.replacen(old, new, 1)).expect("written");
    codes(&path)
}

fn codes(path: &Path) -> Vec<(Code, String)> {
    let files = ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("files");
    let found = read_model(&files).map_or_else(|error| error.into_diagnostics(), |raw| raw.diagnostics);
    found.into_iter().map(|own| (own.code(), own.message().to_owned())).collect()
}

fn has(told: &[(Code, String)], code: Code, part: &str) -> bool {
    told.iter().any(|(own, message)| *own == code && message.contains(part))
}

#[test]
fn dashpots_and_dampers_of_a_deck_get_a_warning() {
    const DASHPOTS: &str = "*ELEMENT, TYPE=DASHPOTA, ELSET=D\n9001, 11, 14\n9002, 14, 17\n*MATERIAL";
    let with = told("calculix_distributing", "job.inp", "*MATERIAL", DASHPOTS);
    assert!(has(&with, Code::DeckDamping, "2 dashpots"), "{with:?}");
    let with = told("nastran", "job.bdf", "ENDDATA", "CDAMP1,9001,9,11,1,14,1\nCVISC,9002,9,11,14\nENDDATA");
    assert!(has(&with, Code::DeckDamping, "2 damping elements"), "{with:?}");
    let without = told("calculix_distributing", "job.inp", "*MATERIAL", "*MATERIAL");
    assert!(!has(&without, Code::DeckDamping, ""), "{without:?}");
}

#[test]
fn a_stiffness_with_the_stress_of_an_earlier_step_gets_a_warning() {
    const STRESSED: &str = "*STEP\n*STATIC\n*END STEP\n*STEP, PERTURBATION";
    assert!(has(
        &told("calculix_distributing", "job.inp", "*STEP", STRESSED),
        Code::DeckStressed,
        "another step"
    ));
    for plain in ["*STEP", "*STEP, PERTURBATION", "*STEP\n*STATIC\n*END STEP\n*STEP"] {
        let told = told("calculix_distributing", "job.inp", "*STEP", plain);
        assert!(!has(&told, Code::DeckStressed, ""), "{plain}: {told:?}");
    }
}

/// CalculiX continues after some errors; what it printed is read where it was kept.
#[test]
fn errors_that_calculix_reported_are_not_passed_over() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["job.inp", "job.sti", "job.mas", "job.dof"] {
        let from = fixtures().join("small/calculix_distributing").join(name);
        fs::copy(from, folder.path().join(name)).expect("copied");
    }
    let log = folder.path().join("job.log");
    fs::write(&log, " *WARNING in allocation: none\n Job finished\n").expect("written");
    assert!(!has(&codes(&folder.path().join("job.inp")), Code::DeckSyntax, ""));
    fs::write(&log, " *INFO\n *ERROR in mastruct: mass of node 900 is left out\n").expect("written");
    let told = codes(&folder.path().join("job.inp"));
    assert!(has(&told, Code::DeckSyntax, "*ERROR in mastruct: mass of node 900"), "{told:?}");
}

#[test]
fn axisymmetric_elements_and_beams_of_calculix_are_refused_by_their_types() {
    for (kind, nodes, part) in [
        ("CAX8R", "11, 14, 17, 20, 23, 26, 29, 32", "axisymmetric"),
        ("B31", "11, 14", "expands beams into solids"),
    ] {
        let cards = format!("*ELEMENT, TYPE={kind}, ELSET=D\n9001, {nodes}\n*MATERIAL");
        let told = told("calculix_distributing", "job.inp", "*MATERIAL", &cards);
        assert!(
            has(&told, Code::DeckUnsupported, part) && has(&told, Code::DeckUnsupported, kind),
            "{told:?}"
        );
    }
}

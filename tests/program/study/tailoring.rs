//! Command `flexbody convert --scene`: the file holds the terms that the scene needs, with reasons, and terms
//! ruled out by bounds are never computed.

use flexbody_base::provenance::{SourceFile, sha256_hex};
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::ConvertSettings;
use flexbody_body::flex_body::{TermGroup, TermGroups};
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::LoadCases;
use flexbody_study::tailoring::{Tailoring, convert_for};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A stiff connecting rod that rotates slowly under a smooth pull.
const MILD: &str = "[run]\nduration = 0.02\noutputs = 100\n\
    [spin]\naxis = [0, 0, 1]\nrate = { to = 5, duration = 0.02 }\nhold = true\n\
    [[load]]\ninterface = \"small_end\"\nforce = [2000, 0, 0]\naxes = \"body\"\nhistory = { to = 1, duration = 0.02 }\n\
    [[watch]]\ninterface = \"small_end\"\n\
    [tolerance]\ndeflection = 0.05\nstress = 0.05\nreaction = 0.2\n";

/// The rod in a rotation so fast that centrifugal loads matter, with a transverse shake.
const FAST: &str = "[run]\nduration = 0.002\noutputs = 100\n\
    [spin]\naxis = [0, 0, 1]\nrate = { to = 900, duration = 0.002 }\nhold = true\n\
    [[load]]\ninterface = \"small_end\"\nforce = [0, 200, 0]\naxes = \"body\"\nhistory = { amplitude = 1, frequency = 2000 }\n\
    [[watch]]\ninterface = \"small_end\"\n\
    [tolerance]\ndeflection = 0.05\nstress = 0.05\nreaction = 0.05\n";

const MODES: usize = 6;

fn manifest() -> PathBuf {
    oracle::fixtures().join("models/connecting_rod/model.toml")
}

fn folder_with(scene: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("scene.toml"), scene).expect("written");
    folder
}

fn flexbody(folder: &Path, words: &[&str]) -> Output {
    let run = Command::new(env!("CARGO_BIN_EXE_flexbody")).args(words).current_dir(folder).output();
    let run = run.expect("the program runs");
    assert!(run.status.success(), "{words:?}: {}", String::from_utf8_lossy(&run.stderr));
    run
}

#[test]
fn a_mild_scene_never_forms_w() {
    let folder = folder_with(MILD);
    let raw = read_model(&read_manifest(manifest()).expect("manifest")).expect("readable");
    let model = FeModel::from_raw(raw).expect("a body").model;
    let scene = LoadCases::read_single(folder.path().join("scene.toml"), None).expect("a scene");
    let modes = ModeSettings { wanted: Wanted::Lowest(MODES), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, ..ConvertSettings::default() };
    let (conversion, selection) = convert_for(
        &model,
        &Tailoring { settings, by_band: false, of_motion: false },
        &scene.clone().into(),
        &Context::QUIET,
    )
    .expect("converts");
    assert_eq!(conversion.condensed_columns, 4, "the columns of rigid motion");
    assert_eq!((selection.groups, conversion.body.groups()), (TermGroups::NONE, TermGroups::NONE));
    let terms = conversion.body.terms();
    assert_eq!(terms.iter().map(|term| term.group).collect::<Vec<_>>(), TermGroup::ALL);
    assert!(terms.iter().all(|term| !term.kept && term.tier == 0 && term.bound <= term.limit), "{terms:?}");
    assert!(conversion.body.n_modes() < MODES, "a smooth pull needs few modes");
    assert_eq!(conversion.body.source().files.last(), scene.source.as_ref());
}

#[test]
fn files_hold_what_is_selected_and_say_why() {
    for (scene, groups_dropped) in [(MILD, true), (FAST, false)] {
        let folder = folder_with(scene);
        let model = manifest();
        let convert = |threads: &str, file: &str| {
            let words = ["convert", model.to_str().expect("a path"), "--modes", "6", "--quiet", "--scene"];
            flexbody(
                folder.path(),
                &[&words[..], &["scene.toml", "-o", file, "--threads", threads]].concat(),
            );
            fs::read(folder.path().join(file)).expect("a file")
        };
        let one = convert("1", "one.flex.h5");
        if groups_dropped {
            assert!(one == convert("2", "two.flex.h5"), "equal bytes");
        }
        let check = ["check", "one.flex.h5", "--against", model.to_str().expect("a path")];
        flexbody(folder.path(), &check);

        let body = flexbody_file::read(folder.path().join("one.flex.h5")).expect("a body");
        assert_eq!(body.groups() == TermGroups::NONE, groups_dropped);
        let invariants = body.invariants();
        let held = [invariants.w1().is_some(), invariants.w2().is_some(), invariants.w3().is_some()];
        for (group, held) in TermGroup::ALL.into_iter().zip(held) {
            let term = body.terms().iter().find(|term| term.group == group).expect("every group is decided");
            assert_eq!((term.kept, body.groups().has(group)), (held, held), "{term:?}");
            assert!(!term.reason.is_empty());
            assert!(term.kept || term.bound <= term.limit, "{term:?}");
        }
        let file = hdf5_metno::File::open(folder.path().join("one.flex.h5")).expect("HDF5");
        let datasets = file.group("invariants").expect("a group").member_names().expect("names");
        for (name, held) in ["W1", "W2", "W3"].into_iter().zip(held) {
            assert_eq!(datasets.iter().any(|dataset| dataset == name), held, "{name} in {datasets:?}");
        }
        let path = folder.path().join("scene.toml");
        let own =
            body.source().files.iter().find(|file| file.role == "scene").expect("the scene is a source");
        assert_eq!(*own, SourceFile::new("scene", &path, sha256_hex(scene.as_bytes())));
    }
}

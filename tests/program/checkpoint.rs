//! A search for modes that goes on from a checkpoint gives what a fresh one gives, with less work; a file
//! that is no checkpoint of the model is refused.

use flexbody_body::basis::{ModalBasis, ModeSettings, free_surface, free_surface_resumed};
use flexbody_eigen::{Accuracy, Method, Proof, Resume, Snapshot, Wanted};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::gram;
use flexbody_linalg::progress::SILENT;
use flexbody_model::FeModel;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

fn manifest(name: &str) -> PathBuf {
    oracle::fixtures().join("models").join(name).join("model.toml")
}

fn model(name: &str) -> FeModel {
    let raw = read_model(&read_manifest(manifest(name)).expect("a manifest")).expect("readable files");
    FeModel::from_raw(raw).expect("a sound model").model
}

fn settings(count: usize, method: Method) -> ModeSettings {
    ModeSettings {
        wanted: Wanted::Lowest(count),
        accuracy: Accuracy::Standard,
        method,
        ..ModeSettings::default()
    }
}

/// Modes, and every snapshot that was taken on the way.
fn modes(model: &FeModel, settings: &ModeSettings, start: Option<&Snapshot>) -> (ModalBasis, Vec<Snapshot>) {
    let taken = Mutex::new(Vec::new());
    let save = |snapshot: &Snapshot| taken.lock().expect("one thread").push(snapshot.clone());
    let resume = Resume { start, save: Some(&save) };
    let found = free_surface_resumed(model, settings, resume, SILENT).expect("modes");
    (found, taken.into_inner().expect("one thread"))
}

/// Same eigenvalues, same shapes, and every promise of the level kept.
fn assert_same(model: &FeModel, a: &ModalBasis, b: &ModalBasis) {
    let (a, b) = (&a.solution, &b.solution);
    assert_eq!(a.eigenvalues.len(), b.eigenvalues.len());
    for (x, y) in a.eigenvalues.iter().zip(&b.eigenvalues) {
        assert!((x - y).abs() <= 1e-11 * x, "{x:e} {y:e}");
    }
    let pencil = model.pencil();
    let cross = gram(a.vectors.as_ref(), pencil.apply_mass(b.vectors.as_ref()).as_ref());
    for j in 0..cross.ncols() {
        assert!((cross[(j, j)] - 1.0).abs() <= 1e-9, "mode {j}: {}", cross[(j, j)]);
    }
    for (residual, floor) in b.residuals.iter().zip(&b.rounding_floors) {
        assert!(*residual <= floor.max(1e-9), "K-residual {residual:e}, floor {floor:e}");
    }
    assert_eq!(b.completeness.proof, Proof::InertiaCount);
    assert_eq!(b.completeness.negative_pivots, Some(6 + b.completeness.modes_below));
}

#[test]
#[ignore = "slow"]
fn more_modes_cost_less_from_a_checkpoint_and_the_same_modes_nothing() {
    let model = model("connecting_rod");
    let (first, snapshots) = modes(&model, &settings(20, Method::Lanczos), None);
    let last = snapshots.last().expect("the end is saved");
    assert!(last.converged >= 20 && snapshots.len() >= 2, "{} snapshots", snapshots.len());

    let (again, saved) = modes(&model, &settings(20, Method::Lanczos), Some(last));
    assert_same(&model, &first, &again);
    assert_eq!(again.solution.counters.solved_columns, 0);
    assert!(saved.is_empty(), "nothing new is there to save");

    let fresh = free_surface(&model, &settings(60, Method::Lanczos), SILENT).expect("modes");
    let (extended, _) = modes(&model, &settings(60, Method::Lanczos), Some(last));
    assert_same(&model, &fresh, &extended);
    let (whole, rest, before) = (
        fresh.solution.counters.solved_columns,
        extended.solution.counters.solved_columns,
        first.solution.counters.solved_columns,
    );
    assert!(rest + before <= whole, "{whole} columns fresh, {rest} from a checkpoint of {before}");
}

#[test]
#[ignore = "slow"]
fn an_interrupted_search_goes_on_where_it_was_saved() {
    let model = model("cube_hex8");
    let wanted = settings(40, Method::Lanczos);
    let (whole, snapshots) = modes(&model, &wanted, None);
    let halfway = &snapshots[snapshots.len() / 2 - 1];
    assert!((1..40).contains(&halfway.converged));
    let (rest, _) = modes(&model, &wanted, Some(halfway));
    assert_same(&model, &whole, &rest);
    assert!(rest.solution.counters.solved_columns < whole.solution.counters.solved_columns / 2);
    // Fewer modes than are stored, and a start from the dense path.
    let (few, _) = modes(&model, &settings(5, Method::Lanczos), snapshots.last());
    assert_same(&model, &free_surface(&model, &settings(5, Method::Lanczos), SILENT).expect("modes"), &few);
    let (dense, snapshots) = modes(&model, &settings(40, Method::Dense), None);
    let (from_dense, _) = modes(&model, &wanted, snapshots.last());
    assert_same(&model, &dense, &from_dense);
}

#[test]
fn a_resumed_search_has_the_same_bits_on_any_number_of_threads() {
    let model = model("connecting_rod");
    let (_, snapshots) = modes(&model, &settings(10, Method::Lanczos), None);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| modes(&model, &settings(20, Method::Lanczos), snapshots.last()).0.solution)
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.counters, three.counters);
    assert_eq!(one.eigenvalues, three.eigenvalues);
    assert!(one.vectors == three.vectors, "vectors differ");
}

#[test]
fn a_start_that_does_not_fit_changes_nothing() {
    let model = model("bar_c3d8r");
    let wanted = settings(12, Method::Lanczos);
    let (fresh, snapshots) = modes(&model, &wanted, None);
    let good = snapshots.last().expect("the end is saved");
    let spoilt = |spoil: &dyn Fn(&mut Snapshot)| {
        let mut bad = good.clone();
        spoil(&mut bad);
        bad
    };
    for bad in [
        spoilt(&|s| s.basis[(7, 3)] += 1e-3),
        spoilt(&|s| s.basis[(7, 3)] = f64::NAN),
        spoilt(&|s| s.shift = f64::INFINITY),
        spoilt(&|s| s.shift = -s.shift),
        spoilt(&|s| s.eigenvalues[0] *= 0.5),
        spoilt(&|s| s.eigenvalues.truncate(3)),
        spoilt(&|s| s.converged = usize::MAX),
        spoilt(&|s| s.eigenvalues.clear()),
        Snapshot { basis: good.basis.as_ref().subrows(0, 30).to_owned(), ..good.clone() },
    ] {
        let (found, _) = modes(&model, &wanted, Some(&bad));
        assert_eq!(found.solution.eigenvalues, fresh.solution.eigenvalues);
        assert_eq!(found.solution.counters.solved_columns, fresh.solution.counters.solved_columns);
    }
    // A mode is withheld: the count finds out, and the search starts elsewhere.
    let without_the_second = spoilt(&|s| {
        let keep = |from: usize, to: usize| (0..to).filter(move |&j| j != from);
        let (k, columns) = (s.eigenvalues.len(), s.basis.ncols());
        let kept: Vec<usize> = keep(1, columns).collect();
        s.basis = faer::Mat::from_fn(s.basis.nrows(), columns - 1, |i, j| s.basis[(i, kept[j])]);
        s.coupling = faer::Mat::from_fn(s.coupling.nrows(), k - 1, |i, j| s.coupling[(i, kept[j])]);
        s.eigenvalues.remove(1);
        s.converged -= 1;
    });
    let (found, _) = modes(&model, &wanted, Some(&without_the_second));
    assert_same(&model, &fresh, &found);
}

fn convert(folder: &Path, model: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .arg("convert")
        .arg(model)
        .args(["--output", "body.flex.h5", "--checkpoint", "search.h5", "--json"])
        .args(more)
        .current_dir(folder)
        .output()
        .expect("the program")
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {output:?}"))
}

/// The code that a run was refused with; the exit code is that of bad input, and no body was written.
fn refused(folder: &Path, model: &Path) -> (String, String) {
    let output = convert(folder, model, &[]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(!folder.join("body.flex.h5").exists());
    let first = &json(&output)["diagnostics"][0];
    let part = |key: &str| first[key].as_str().expect("text").to_owned();
    (part("code"), part("message"))
}

#[test]
#[ignore = "slow"]
fn the_program_keeps_and_takes_up_a_checkpoint() {
    let folder = tempfile::tempdir().expect("a folder");
    let rod = manifest("connecting_rod");
    let columns = |output: &Output| {
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        json(output)["results"]["run"]["counters"]["solved_columns"].as_u64().expect("a count")
    };
    let first = columns(&convert(folder.path(), &rod, &["--modes", "20"]));
    let again = convert(folder.path(), &rod, &["--modes", "20"]);
    assert!(first > 0 && columns(&again) == 0);
    assert!(String::from_utf8_lossy(&again.stdout).contains("FB711"), "{again:?}");
    let more = columns(&convert(folder.path(), &rod, &["--modes", "30"]));
    assert!(more > 0 && more < first, "{more} columns after {first}");
    // The file now holds the thirty.
    assert_eq!(columns(&convert(folder.path(), &rod, &["--modes", "30", "--threads", "1"])), 0);
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .map(|e| e.expect("an entry").file_name())
        .collect();
    left.sort();
    assert_eq!(left, ["body.flex.h5", "search.h5"]);
}

#[test]
fn checkpoints_that_do_not_belong_here_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (bar, cube) = (manifest("bar_c3d8r"), manifest("cube_hex8"));
    assert!(convert(folder.path(), &bar, &[]).status.success());
    std::fs::remove_file(folder.path().join("body.flex.h5")).expect("a body");
    let file = folder.path().join("search.h5");
    let sound = std::fs::read(&file).expect("a checkpoint");

    let (code, message) = refused(folder.path(), &cube);
    assert_eq!(code, "FB710");
    assert!(message.contains("stiffness, mass, nodes"), "{message}");
    assert_eq!(std::fs::read(&file).expect("a checkpoint"), sound, "a refused file stays as it is");

    // Every kind of damage that leaves a file: cut off, other text, a byte of the data, of the header.
    let mut cases: Vec<Vec<u8>> = [0, 1, 100, sound.len() / 2, sound.len() - 1]
        .iter()
        .map(|&length| sound[..length].to_vec())
        .collect();
    cases.push(b"not a checkpoint".to_vec());
    for at in [0, 9, sound.len() / 2, sound.len() / 3] {
        let mut bytes = sound.clone();
        bytes[at] ^= 0x10;
        cases.push(bytes);
    }
    for bytes in cases {
        std::fs::write(&file, &bytes).expect("a file");
        assert_eq!(refused(folder.path(), &bar).0, "FB708", "{} bytes", bytes.len());
    }
}

//! Work of the eigensolver on the fixture models in counts: a slower algorithm fails here without timing.
//! `FLEXBODY_BLESS=1 cargo test -p flexbody-body work_counters` writes the table after an intended change.

use flexbody_body::basis::{ModeSettings, free_surface};
use flexbody_eigen::{Accuracy, EigenSolution, Method, Wanted};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Work;
use flexbody_model::{FeModel, RawModel};
use oracle::counted::counted;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

const MODELS: [&str; 4] = ["bar_c3d8r", "bracket_hex20", "connecting_rod", "cube_hex8"];

fn root() -> PathBuf {
    oracle::root().to_path_buf()
}

fn raw(name: &str) -> RawModel {
    let manifest = root().join("fixtures/models").join(name).join("model.toml");
    read_model(&read_manifest(&manifest).expect("a manifest")).expect("readable files")
}

fn model(name: &str) -> FeModel {
    FeModel::from_raw(raw(name)).expect("a sound model").model
}

fn modes(model: &FeModel, count: usize, accuracy: Accuracy) -> (EigenSolution, Work) {
    let settings = ModeSettings {
        wanted: Wanted::Lowest(count),
        accuracy,
        method: Method::Lanczos,
        ..ModeSettings::default()
    };
    let (found, work) = counted(|context| free_surface(model, &settings, context));
    (found.expect("modes").solution, work)
}

#[test]
#[ignore = "slow"]
fn work_is_what_it_was() {
    let mut table = format!(
        "{:<16}{:>6} {:<10}{:>8}{:>7}{:>6}{:>6}{:>10}{:>12}\n",
        "model", "modes", "accuracy", "factors", "solves", "K", "M", "restarts", "factor_len"
    );
    for name in MODELS {
        let model = model(name);
        for (count, accuracy) in [
            (20, Accuracy::Fast),
            (20, Accuracy::Standard),
            (20, Accuracy::Certified),
            (60, Accuracy::Standard),
        ] {
            let (_, work) = modes(&model, count, accuracy);
            writeln!(
                table,
                "{name:<16}{count:>6} {:<10}{:>8}{:>7}{:>6}{:>6}{:>10}{:>12}",
                accuracy.name(),
                work.factorizations,
                work.solved_columns,
                work.stiffness_columns,
                work.mass_columns,
                work.restarts,
                work.factor_len
            )
            .expect("a string takes all text");
        }
    }
    let file = root().join("tests/golden/work_counters.txt");
    if std::env::var_os("FLEXBODY_BLESS").is_some_and(|v| v == "1") {
        std::fs::write(&file, &table).expect("a writable table");
    }
    let stored = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(stored == table, "the work has changed; stored:\n{stored}\nnow:\n{table}");
}

#[test]
#[ignore = "slow"]
fn twenty_modes_take_at_most_six_solved_columns_each() {
    for name in MODELS {
        let (found, work) = modes(&model(name), 20, Accuracy::Standard);
        assert!(work.solved_columns <= 120, "{name}: {work:?}");
        for (residual, floor) in found.residuals.iter().zip(&found.rounding_floors) {
            assert!(*residual <= floor.max(1e-9), "{name}: K-residual {residual:e}, floor {floor:e}");
        }
    }
}

#[test]
fn modes_and_work_have_the_same_bits_on_any_number_of_threads() {
    let model = model("cube_hex8");
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| modes(&model, 20, Accuracy::Standard))
    };
    let ((one, one_work), (three, three_work)) = (on(1), on(3));
    assert_eq!(one_work, three_work);
    assert_eq!(one.eigenvalues, three.eigenvalues);
    assert!(one.vectors == three.vectors, "vectors differ");
}

/// Solids, nodes with rotations in space and in the plane, and internal rows: the elimination order is
/// computed once per model, and a search that reuses it gives equal bits.
#[test]
fn searches_of_one_model_share_one_order_and_give_the_same_bits() {
    for name in ["cube_hex8", "shell_folded", "frame_beams", "plane_frame", "hex8_bubbles"] {
        let model = model(name);
        let order = || model.elimination().of(&model.pencil()).expect("enough memory");
        let (one, one_work) = modes(&model, 8, Accuracy::Standard);
        let first = order();
        let (other, other_work) = modes(&model, 8, Accuracy::Standard);
        assert!(Arc::ptr_eq(&first, &order()), "{name}");
        assert_eq!(one_work, other_work, "{name}");
        assert_eq!(one.eigenvalues, other.eigenvalues, "{name}");
        assert!(one.vectors == other.vectors, "{name}: vectors differ");
    }
}

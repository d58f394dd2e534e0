//! Bodies with large arrays in 32-bit floats: measurements apply to the stored numbers, and checks allow for
//! their rounding only.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, Storage, TermGroups};
use flexbody_body::invariants::{BodyFrame, CauchySchwarz, primary_differences};
use flexbody_body::verification::verify;
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use hdf5_metno as hdf5;
use oracle::file_bodies::wild_body;
use oracle::flexible::{moving_state, soft_block};
use oracle::general::quasi_velocities;
use oracle::partial::{combinations, with_groups};
use oracle::random::Random;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Half of the spacing of 32-bit floats.
const UNIT: f64 = 0.5 * f32::EPSILON as f64;

fn manifest(name: &str) -> PathBuf {
    oracle::fixtures().join("models").join(name).join("model.toml")
}

fn converted(name: &str, modes: usize) -> (FeModel, FlexBody) {
    let raw = read_model(&read_manifest(manifest(name)).expect("manifest")).expect("readable");
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, ..ConvertSettings::default() };
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    (model, body)
}

fn written(body: &FlexBody) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(body, &path).expect("writes");
    (folder, path)
}

#[test]
fn rounded_bodies_are_read_bit_for_bit_and_pass_their_checks() {
    let schema: Value = serde_json::from_str(&flexbody_file::format_schema()).expect("JSON");
    let validator = jsonschema::validator_for(&schema).expect("a schema");
    for (name, modes) in
        [("connecting_rod", 12), ("shell_folded", 8), ("hex8_bubbles", 6), ("plane_frame", 6)]
    {
        let (model, body) = converted(name, modes);
        let short = body.rounded_to_f32().expect("a body");
        assert_eq!((body.storage(), short.storage()), (Storage::F64, Storage::F32));
        assert_eq!(short.rounded_to_f32().expect("a body"), short, "rounded once is rounded");
        for (what, difference) in primary_differences(body.invariants(), short.invariants()) {
            // Entries of m_ff and similar matrices are sums of rounded entries.
            assert!(difference <= 3.0 * UNIT, "{name}: {what} {difference:e}");
        }
        for groups in combinations() {
            let partial = with_groups(&short, groups);
            let (_folder, path) = written(&partial);
            assert_eq!(
                flexbody_file::read(&path).unwrap_or_else(|e| panic!("{name}: {groups:?}: {e}")),
                partial
            );
            let structure = flexbody_file::structure(&path).expect("a structure");
            let errors: Vec<_> = validator.iter_errors(&structure).map(|e| e.to_string()).collect();
            assert!(errors.is_empty(), "{name}: {groups:?}: {errors:#?}");
            assert_eq!(structure["attributes"]["storage"], "f32");
            let kind = |path: &str| structure.pointer(&format!("/groups/{path}/type")).cloned();
            assert_eq!(kind("modes/datasets/shape"), Some(Value::from("float32")));
            assert_eq!(kind("invariants/datasets/W1"), groups.w1.then(|| Value::from("float32")));
            assert_eq!(kind("invariants/datasets/modal_stiffness"), Some(Value::from("float64")));
        }
        let checks = short.identities(BodyFrame::Com);
        let failed: Vec<_> = checks
            .iter()
            .chain(&verify(&short, &model).expect("comparable"))
            .filter(|check| !check.passed)
            .cloned()
            .collect();
        assert!(failed.is_empty(), "{name}: {failed:?}");
        // Undeclared rounding fails.
        let mut parts = short.into_parts();
        parts.storage = Storage::F64;
        let unsaid = FlexBody::new(parts).expect("a body");
        assert!(verify(&unsaid, &model).expect("comparable").iter().any(|check| !check.passed), "{name}");
    }
}

#[test]
fn a_file_of_short_floats_takes_little_more_than_half() {
    let (_, body) = converted("connecting_rod", 20);
    let (_a, whole) = written(&body);
    let (_b, short) = written(&body.rounded_to_f32().expect("a body"));
    let bytes = |path: &Path| std::fs::metadata(path).expect("a file").len() as f64;
    assert!(bytes(&short) < 0.65 * bytes(&whole), "{} of {}", bytes(&short), bytes(&whole));
}

#[test]
fn equations_of_rounded_bodies_cost_the_same_and_differ_by_rounding() {
    let body = soft_block(10);
    let short = body.rounded_to_f32().expect("a body");
    let (whole, rounded) =
        (EquationsOfMotion::new(&body, Terms::ALL), EquationsOfMotion::new(&short, Terms::ALL));
    assert_eq!(whole.multiplications(), rounded.multiplications(), "m_ff is the identity in both");
    let state = moving_state(&mut Random(4), &body);
    let rates = |equations: &EquationsOfMotion| {
        let mut evaluation = Evaluation::new(equations);
        evaluation.set(state.q.as_slice(), quasi_velocities(&state).as_slice());
        let mut rates = vec![0.0; 16];
        evaluation.accelerations(&[0.0; 16], &mut rates).expect("a body");
        rates
    };
    let (a, b) = (rates(&whole), rates(&rounded));
    let size = a.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let apart = a.iter().zip(&b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / size;
    assert!(apart > 1e-12 && apart < 1e-5, "{apart:e}");
}

#[test]
fn what_32_bits_cannot_hold_is_refused() {
    let mut parts = soft_block(3).into_parts();
    parts.modes.shape[(4, 1)] = 1e39;
    let error = FlexBody::new(parts).expect("a body").rounded_to_f32().expect_err("too large");
    assert_eq!(error.diagnostics()[0].code(), Code::BodySchema);
    assert!(error.to_string().contains("`modes.shape` has the value inf"), "{error}");
    // The guarantee of certified bodies applies to the unrounded numbers.
    let certified = oracle::file_bodies::body(1, 3, 3, 0, 1);
    assert!(certified.certificate().guarantee.is_some());
    let short = certified.rounded_to_f32().expect("moderate numbers");
    assert_eq!(short.certificate().guarantee, None);
    assert!(wild_body(3, 4, 3, 1, 1).rounded_to_f32().is_err(), "every kind of number");
}

fn refused(body: &FlexBody, damage: impl FnOnce(&hdf5::File)) -> String {
    let (_folder, path) = written(body);
    let file = hdf5::File::open_rw(&path).expect("opens");
    damage(&file);
    file.close().expect("closes");
    flexbody_file::read(&path).expect_err("the file contradicts itself").to_string()
}

fn say(file: &hdf5::File, storage: &str) {
    file.delete_attr("storage").ok();
    let text: hdf5::types::VarLenUnicode = storage.parse().expect("text");
    file.new_attr::<hdf5::types::VarLenUnicode>()
        .create("storage")
        .expect("new")
        .write_scalar(&text)
        .expect("set");
}

#[test]
fn files_must_be_stored_as_they_say() {
    let body = soft_block(3);
    let short = body.rounded_to_f32().expect("a body");
    let says = |error: String, text: &str| assert!(error.contains(text), "no {text:?} in\n{error}");
    says(refused(&body, |f| say(f, "f32")), "/modes/shape: expected 32-bit floats, found type float64");
    says(refused(&short, |f| say(f, "f64")), "/modes/shape: expected 64-bit floats, found type float32");
    says(refused(&short, |f| say(f, "f16")), "/@storage: expected `f64` or `f32`, found \"f16\"");
    // Derived arrays may differ by their own rounding only.
    let error = refused(&short, |f| {
        let w2 = f.dataset("invariants/W2").expect("a dataset");
        let mut values: Vec<f32> = w2.read_raw().expect("values");
        let largest = values.iter().fold(0.0f32, |m, v| m.max(v.abs()));
        values[0] += 4.0 * f32::EPSILON * largest;
        w2.write_raw(&values).expect("written");
    });
    says(error, "/invariants/W2: found ");
    let partial = with_groups(&short, TermGroups { w3: true, ..TermGroups::NONE });
    let bound = CauchySchwarz::of(partial.invariants());
    assert!((bound.mode(0) - 1.0).abs() < 1e-6, "m_ff stays known");
}

#[test]
fn the_program_writes_what_check_accepts() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_flexbody")).args(arguments).output().expect("runs");
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned(), output.stderr)
    };
    let (model, body) = (manifest("cube_hex8"), path.to_str().expect("UTF-8").to_owned());
    let model = model.to_str().expect("UTF-8");
    let (code, text, _) =
        run(&["convert", model, "-o", &body, "--modes", "8", "--storage", "f32", "--quiet"]);
    assert_eq!(code, Some(0), "{text}");
    let (code, text, _) = run(&["inspect", &body]);
    assert!(code == Some(0) && text.contains("rounded to 32-bit floats"), "{text}");
    let (code, text, _) = run(&["check", &body, "--against", model]);
    assert_eq!(code, Some(0), "{text}");
    let certified = ["convert", model, "-o", &body, "--accuracy", "certified", "--storage", "f32"];
    let (code, _, stderr) = run(&certified);
    assert!(code == Some(2) && String::from_utf8_lossy(&stderr).contains("use --storage f64"));
}

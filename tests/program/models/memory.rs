//! Memory estimates before the work, and the behaviour with too little memory.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::ExitCode;
use flexbody_body::basis::{ModeSettings, free_surface};
use flexbody_body::convert::{Conversion, ConvertSettings, convert as convert_model};
use flexbody_eigen::{Accuracy, FactorChoice, Method, Precision, Wanted};
use flexbody_linalg::context::{Context, Event};
use flexbody_model::check;
use flexbody_report::{Facts, Format, RunData, render};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::members;
use oracle::mesh::{Assembly, Mesh};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;

fn block(cells: [i32; 3], size: [f64; 3]) -> Assembly {
    Mesh::block(ElementKind::Hex8, cells, size).assemble(&Material::STEEL, MassRule::Consistent)
}

/// Creates a folder with a cube of 20 577 degrees of freedom, whose factor is larger than its modes.
fn cube() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_model(folder.path(), &block([18; 3], [1.0; 3]).raw_model(), Triangle::Lower);
    folder
}

/// Runs `flexbody convert model.toml -o b.h5` on one thread, so that memory does not depend on the
/// scheduling.
fn convert(folder: &Path, options: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(["convert", "model.toml", "-o", "b.h5", "--threads", "1"])
        .args(options.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program")
}

/// Returns the report of a successful run.
fn report(folder: &Path, options: &str) -> Value {
    let output = convert(folder, &format!("{options} --json"));
    assert!(output.status.success(), "{options}: {output:?}");
    serde_json::from_slice::<Value>(&output.stdout).expect("JSON")["results"].take()
}

fn estimate(report: &Value) -> f64 {
    report["run"]["memory_estimate_bytes"].as_f64().expect("an estimate")
}

/// Returns the peak memory of a run over its estimate.
fn peak_over_estimate(report: &Value) -> f64 {
    report["run"]["peak_memory_bytes"].as_f64().expect("a peak") / estimate(report)
}

#[cfg(target_os = "linux")] // elsewhere the peak is not told
#[test]
#[ignore = "slow"]
fn the_peak_is_within_15_percent_of_the_estimate() {
    let folder = tempfile::tempdir().expect("a folder");
    let raw = block([60, 9, 9], [1.0, 0.2, 0.2]).raw_model(); // 18 300 degrees of freedom
    write_model(folder.path(), &raw, Triangle::Lower);
    for options in ["", "--factor f32"] {
        let ratio = peak_over_estimate(&report(folder.path(), options));
        assert!((0.85..1.15).contains(&ratio), "`{options}`: {ratio} of the estimate");
    }
}

/// Overestimates would refuse bodies that fit.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "slow"]
fn the_peak_of_a_search_without_a_factor_is_within_a_quarter_of_the_estimate() {
    let folder = tempfile::tempdir().expect("a folder");
    write_model(folder.path(), &block([31; 3], [1.0; 3]).raw_model(), Triangle::Lower); // 98 304 rows
    for options in ["--accuracy fast", "--accuracy fast --modes 8"] {
        let report = report(folder.path(), options);
        let phases = report["run"]["phases"].to_string();
        assert!(phases.contains("multigrid"), "`{options}`: {phases}");
        let ratio = peak_over_estimate(&report);
        assert!((0.75..1.0).contains(&ratio), "`{options}`: {ratio} of the estimate");
    }
}

#[test]
#[ignore = "slow"]
fn where_nothing_fits_the_numbers_are_told_before_any_work() {
    let folder = cube();
    let before = members(folder.path());
    let output = convert(folder.path(), "--memory-limit 60M");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(ExitCode::Resources as i32), "{said}");
    assert!(said.contains("error[FB601]: the factor and the vectors need 0."), "{said}");
    assert!(said.contains(" GB on top of the matrices, 0.") && said.contains(" GB are available"), "{said}");
    assert_eq!(members(folder.path()), before);

    let model = check(block([9; 3], [1.0; 3]).raw_model()).expect("a sound model").model;
    let phases = Mutex::new(Vec::new());
    let watch = |event: Event<'_>| {
        if let Event::Phase(name) = event {
            phases.lock().expect("one thread").push(name.to_owned());
        }
    };
    let settings = ModeSettings { method: Method::Lanczos, ..ModeSettings::default() };
    let little = Context { memory: Some(1_000_000), ..Context::with_listener(&watch) };
    let error = free_surface(&model, &settings, &little).expect_err("too little memory");
    assert_eq!(error.diagnostics()[0].code(), Code::MemoryShort);
    assert_eq!(*phases.lock().expect("one thread"), ["ordering"], "nothing was factored");
}

/// Runs in the library, where only the plan decides; the memory left over from reading varies between runs of
/// the program.
#[test]
#[ignore = "slow"]
fn a_factor_that_does_not_fit_is_taken_in_single_precision() {
    let model = check(block([15; 3], [1.0; 3]).raw_model()).expect("a sound model").model;
    let run = |factor, memory| {
        let modes = ModeSettings {
            wanted: Wanted::Lowest(4),
            accuracy: Accuracy::Fast,
            method: Method::Lanczos,
            factor,
            ..ModeSettings::default()
        };
        let settings = ConvertSettings { modes, ..ConvertSettings::default() };
        convert_model(&model, &settings, &Context { memory, ..Context::QUIET }).expect("a body")
    };
    let plan = |found: &Conversion| found.plan.clone().expect("a sparse factor");
    let (double, single) =
        (run(FactorChoice::Auto, None), run(FactorChoice::Always(Precision::Single), None));
    let limit = (plan(&double).bytes() + plan(&single).bytes()) / 2;
    assert!(plan(&single).bytes() < limit && limit < plan(&double).bytes(), "room for one of them");
    let limited = run(FactorChoice::Auto, Some(limit));
    let told =
        |found: &Conversion| found.diagnostics.iter().filter(|d| d.code() == Code::FactorPrecision).count();
    assert_eq!((told(&limited), told(&double)), (1, 0), "{:?}", limited.diagnostics);
    assert_eq!(
        (plan(&limited).precision(), plan(&double).precision()),
        (Precision::Single, Precision::Double)
    );
    assert_eq!(2 * plan(&limited).current().needs.factor_bytes, plan(&double).current().needs.factor_bytes);
    for (a, b) in limited.body.modes().eigenvalue.iter().zip(&double.body.modes().eigenvalue) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
#[ignore = "slow"]
fn a_proof_that_does_not_fit_is_left_out_and_that_is_said_everywhere() {
    let model = check(block([26; 3], [1.0; 3]).raw_model()).expect("a sound model").model;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
    let run = |accuracy, memory| {
        // A search without a factor needs less memory than any count.
        let modes = ModeSettings {
            wanted: Wanted::Lowest(2),
            accuracy,
            multigrid_pays: 0.0,
            ..ModeSettings::default()
        };
        let settings = ConvertSettings { modes, ..ConvertSettings::default() };
        threads
            .install(|| convert_model(&model, &settings, &Context { memory, ..Context::QUIET }))
            .expect("a body")
    };
    let bytes = |found: &Conversion| found.plan.as_ref().expect("a sparse factor").bytes();
    let (search, all) = (run(Accuracy::Fast, None), run(Accuracy::Standard, None));
    assert!(all.body.certificate().proved_modes.is_some());
    let limit = bytes(&search) + bytes(&search) / 50;
    assert!(limit < bytes(&all), "room for the search only: {limit} {}", bytes(&all));
    let found = run(Accuracy::Standard, Some(limit));
    assert_eq!(bytes(&found), bytes(&search));
    // The modes keep their accuracy.
    assert_eq!(found.body.modes().eigenvalue, all.body.modes().eigenvalue);
    let why = "the count needs ";
    let warning =
        found.diagnostics.iter().find(|d| d.code() == Code::CompletenessUnproved).expect("a warning");
    assert!(warning.message().contains(why) && warning.help().contains("--memory-limit"), "{warning}");
    let folder = tempfile::tempdir().expect("a folder");
    flexbody_file::write(&found.body, folder.path().join("b.h5")).expect("a file");
    let body = flexbody_file::read(folder.path().join("b.h5")).expect("a body");
    assert_eq!(body.certificate().proved_modes, None);
    assert!(body.certificate().remark.starts_with(why), "{}", body.certificate().remark);
    let run = RunData { diagnostics: found.diagnostics, ..RunData::default() };
    for format in [Format::Text, Format::Json, Format::Html] {
        assert!(render(&Facts::new(&body, &run), format).contains(why), "{format:?}");
    }
    let inspect = Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(["inspect", "b.h5"])
        .current_dir(folder.path())
        .output()
        .expect("the program");
    let text = String::from_utf8_lossy(&inspect.stdout).into_owned();
    assert!(text.contains("NOT PROVED") && text.contains(why), "{text}");
}

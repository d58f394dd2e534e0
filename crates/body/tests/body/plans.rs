//! Planned attempts of the search for modes for each kind of model: a changed threshold is detected here.
//! `FLEXBODY_BLESS=1 cargo test -p flexbody-body plans -- --ignored` writes the table after an intended
//! change.

use flexbody_body::basis::{ModeSettings, search_plan};
use flexbody_eigen::{Accuracy, Plan, Wanted};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, check};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use std::fmt::Write;

/// Returns fixtures of every kind, and the blocks timed by `benches/performance.py`.
fn models() -> Vec<(String, FeModel)> {
    let fixture = |name: &str| {
        let manifest = oracle::fixtures().join("models").join(name).join("model.toml");
        let raw = read_model(&read_manifest(&manifest).expect("a manifest")).expect("readable files");
        (name.to_owned(), FeModel::from_raw(raw).expect("a sound model").model)
    };
    let names = ["cube_hex8", "connecting_rod", "shell_folded", "frame_beams", "satellite"];
    let blocks = [
        ("block 30k", ElementKind::Hex8, [50, 16, 10], [1.0, 0.3, 0.2]),
        ("block 100k", ElementKind::Hex8, [75, 25, 16], [1.0, 0.3, 0.2]),
        ("cube 30k", ElementKind::Hex8, [21; 3], [1.0; 3]),
        ("cube 100k", ElementKind::Hex8, [31; 3], [1.0; 3]),
        ("tet10 50k", ElementKind::Tet10, [16, 12, 8], [1.0, 0.7, 0.5]),
        ("plate 50k", ElementKind::Hex8, [92, 92, 1], [1.0, 1.0, 0.01]),
    ];
    let block = |(name, kind, cells, lengths): (&str, ElementKind, [i32; 3], [f64; 3])| {
        let raw =
            Mesh::block(kind, cells, lengths).assemble(&Material::STEEL, MassRule::Consistent).raw_model();
        (name.to_owned(), check(raw).expect("a sound model").model)
    };
    names.iter().map(|name| fixture(name)).chain(blocks.map(block)).collect()
}

/// Returns the attempts of a plan in their order.
fn attempts(plan: &Plan) -> String {
    plan.attempts.iter().map(|attempt| attempt.way.name()).collect::<Vec<_>>().join(", then ")
}

#[test]
#[ignore = "slow"]
fn plans_are_what_they_were() {
    let mut table = String::new();
    for (name, model) in models() {
        writeln!(table, "{name}, {} rows", model.pencil().n()).expect("a string takes all text");
        for (count, accuracy) in [
            (20, Accuracy::Fast),
            (20, Accuracy::Standard),
            (20, Accuracy::Certified),
            (200, Accuracy::Standard),
        ] {
            let settings =
                ModeSettings { wanted: Wanted::Lowest(count), accuracy, ..ModeSettings::default() };
            let found = search_plan(&model, &settings, &Context::QUIET).expect("a plan");
            writeln!(table, "  {count:>3} modes, {:<10} {}", accuracy.name(), attempts(&found))
                .expect("a string takes all text");
        }
    }
    let file = oracle::root().join("tests/golden/plans.txt");
    if std::env::var_os("FLEXBODY_BLESS").is_some_and(|v| v == "1") {
        std::fs::write(&file, &table).expect("a writable table");
    }
    let stored = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(stored == table, "the attempts have changed; stored:\n{stored}\nnow:\n{table}");
}

/// Attempts that do not fit the memory are excluded; if none fits, the error states the smallest requirement.
#[test]
fn memory_and_time_limit_the_attempts() {
    let raw = Mesh::block(ElementKind::Hex8, [12; 3], [1.0; 3]);
    let model =
        check(raw.assemble(&Material::STEEL, MassRule::Consistent).raw_model()).expect("a sound model").model;
    let settings = ModeSettings { multigrid_pays: 0.0, ..ModeSettings::default() };
    let with = |context: &Context<'_>| search_plan(&model, &settings, context);
    let free = with(&Context::QUIET).expect("no limits");
    assert_eq!(attempts(&free), "cycles, then double precision");
    let most = free.attempts.iter().map(|attempt| attempt.needs.bytes).max().expect("attempts");
    let short = with(&Context { memory: Some(most - 1), ..Context::QUIET }).expect("others fit");
    assert!(short.attempts.iter().all(|attempt| attempt.needs.bytes < most), "{}", attempts(&short));
    let error = with(&Context { memory: Some(1_000_000), ..Context::QUIET }).expect_err("nothing fits");
    assert!(error.has(flexbody_base::diagnostic::Code::MemoryShort), "{error:?}");
    let hasty = Context { longest: Some(1e-9), ..Context::QUIET };
    assert_eq!(attempts(&with(&hasty).expect("cycles")), "cycles");
}

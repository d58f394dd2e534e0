//! Losses reported by each format; equal bodies give equal bytes.

use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use flexbody_formats::export::{AllowedLosses, ExportOptions};
use flexbody_formats::{FORMATS, export, find_format};
use oracle::exported::{bodies, exported, losses};
use oracle::file_bodies::wild_body;

fn named(name: &str) -> &'static FlexBody {
    &bodies().iter().find(|(own, _)| own == name).unwrap_or_else(|| panic!("{name}")).1
}

/// Asserts the beginnings of all reported losses in their order.
fn assert_losses(body: &str, format: &str, beginnings: &[&str]) {
    let told = losses(named(body), format);
    let fits = told.len() == beginnings.len()
        && told.iter().zip(beginnings).all(|(told, beginning)| told.starts_with(beginning));
    assert!(fits, "{body} as {format}: {told:#?}");
}

#[test]
fn losses_are_those_of_the_format_and_the_body() {
    const SPRUNG: &str = "the geometric stiffness for ";
    const INERTIA: &str =
        "the change of the inertia with the deformation (W1 except its centrifugal load, W2, W3; OpenRadioss";
    const SMALL: &str = "the change of the inertia with the deformation (W1, W2, W3; K and M";
    const TURNS: &str = "the stiffness of inertia of turning nodes, which changes deflections by 1 % and frequencies by 0.5 % at a spin";
    const WEIGHT: &str = "the point of action of gravity on the deformed body: Chrono distributes";
    const PLANE: &str = "the restriction to the plane z = 0";
    for (name, _) in bodies() {
        assert_losses(name, "json", &[]);
        assert_losses(name, "npz", &[]);
    }
    assert_losses("cube_hex8", "adams-invariants", &[]);
    assert_losses("turbine_blade", "adams-invariants", &[SPRUNG]);
    assert_losses("plane_frame", "adams-invariants", &[PLANE, TURNS]);
    assert_losses("frame_beams", "adams-invariants", &[TURNS]);
    assert_losses("hex8_edges", "adams-invariants", &["153 rows of the modes that belong to no node"]);
    assert_losses("cube_hex8", "openradioss", &[INERTIA]);
    assert_losses("turbine_blade", "openradioss", &[INERTIA, SPRUNG]);
    assert_losses("plane_frame", "openradioss", &[PLANE, INERTIA, TURNS]);
    assert_losses("frame_beams, Rayleigh, not at its centre", "openradioss", &[INERTIA, TURNS]);
    assert_losses("robot_link, averaging, Rayleigh", "openradioss", &[INERTIA]);
    assert_losses(
        "satellite, ratio",
        "openradioss",
        &[INERTIA, "damping of the modes other than alpha M + beta K"],
    );
    assert_losses("satellite, ratio", "simscape", &[SMALL]);
    assert_losses("satellite, ratio", "chrono", &[SMALL, WEIGHT]);
    assert_losses("car_frame, jointed", "chrono", &[SMALL, TURNS, WEIGHT]);
    let partial = |groups: &str| format!("soft block with TermGroups {{ {groups} }}");
    assert_losses(&partial("w1: false, w2: false, w3: false"), "openradioss", &[]);
    let of_w3 = "the change of the inertia with the deformation (W3; OpenRadioss";
    assert_losses(&partial("w1: false, w2: false, w3: true"), "openradioss", &[of_w3]);
}

#[test]
fn a_loss_needs_a_word_and_is_told_either_way() {
    let (body, format) = (named("turbine_blade"), find_format("openradioss").expect("a format"));
    let error = export(body, format, &ExportOptions::default(), false).expect_err("a large loss");
    let [only] = error.diagnostics() else { panic!("{error}") };
    assert_eq!(only.code(), Code::ExportLoses);
    let (_, told) = export(body, format, &ExportOptions::default(), true).expect("allowed");
    assert_eq!(told.iter().map(|diagnostic| diagnostic.code()).collect::<Vec<Code>>(), [Code::ExportLost; 2]);
    assert!(told[1].message().starts_with("openradioss cannot hold the geometric stiffness"));
    // With names only these properties may be lost; each message ends with its name.
    let losses = format.checklist(body, &ExportOptions::default()).losses();
    let names: Vec<String> = losses.iter().map(|loss| loss.property.to_owned()).collect();
    let allowed = |names: &[String]| AllowedLosses::named(names.to_vec()).expect("known names");
    let error = export(body, format, &ExportOptions::default(), allowed(&names[..1])).expect_err("another");
    let [only] = error.diagnostics() else { panic!("{error}") };
    assert!(only.message().ends_with(&format!("({})", names[1])), "{only}");
    let (_, told) = export(body, format, &ExportOptions::default(), allowed(&names)).expect("both");
    assert_eq!(told.len(), 2);
    let unknown = AllowedLosses::named(vec!["mass".to_owned()]).expect_err("no such property");
    assert!(unknown.has(Code::Usage) && unknown.to_string().contains("damping"), "{unknown}");
}

/// Valid but unphysical bodies are written or refused in every dialect, and never cause a panic.
#[test]
#[ignore = "slow"]
fn every_body_in_every_dialect_is_written_or_refused_and_always_the_same() {
    let wild: Vec<(String, FlexBody)> =
        (0..20).map(|seed| (format!("seed {seed}"), wild_body(seed, 3, 4, 1, 2))).collect();
    for (name, body) in bodies().iter().chain(&wild) {
        for (format, dialects) in FORMATS.iter().map(|format| (format.name(), format.dialects())) {
            let dialects =
                if dialects.is_empty() { vec![None] } else { dialects.iter().copied().map(Some).collect() };
            for dialect in dialects {
                let first = exported(body, format, dialect);
                match &first {
                    Ok(_) => {}
                    Err(error) => {
                        assert!(error.diagnostics().iter().all(|d| d.code() == Code::ExportLoses), "{name}")
                    }
                }
                assert!(
                    first.ok() == exported(&body.clone(), format, dialect).ok(),
                    "{name} as {format} {dialect:?}"
                );
            }
        }
    }
}

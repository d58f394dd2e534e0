//! Bodies with a frame at an interface, compared with dense solutions of the model held there, with the body
//! in mean axes, and after a round trip through files.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, CraigBampton};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, ReferenceConditions};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, NodeSet, RawModel};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::fixtures;
use oracle::general::raw_fixture;
use oracle::held::HeldModel;
use oracle::mesh::Mesh;
use oracle::plane::rectangle;
use oracle::random::Random;

const SOFT: Material = Material { youngs: 1e7, poisson: 0.0, density: 1000.0 };
const ALL: usize = 54;

/// Returns a rotated bar with the interfaces `root` and `tip` at its ends.
fn bar() -> RawModel {
    let straight = Mesh::block(ElementKind::Hex8, [4, 1, 1], [1.0, 0.2, 0.16]);
    let turned = straight.moved(&Random(7).rotation(), [3.0, -1.0, 0.5]);
    let mut raw = turned.assemble(&SOFT, MassRule::Consistent).raw_model();
    let end = |x: f64| -> Vec<i64> {
        let nodes = straight.nodes.iter().enumerate().filter(|(_, node)| (node[0] - x).abs() < 1e-9);
        nodes.map(|(i, _)| i as i64 + 1).collect()
    };
    raw.data.interfaces = [("root", 0.0), ("tip", 1.0)]
        .map(|(name, x)| NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, end(x)) })
        .to_vec();
    raw
}

fn on_interface(model: &FeModel, name: &str, basis: BasisChoice, modes: usize) -> Result<Conversion> {
    let mut settings = ConvertSettings {
        basis,
        frame: FrameChoice::Interface(name.to_owned()),
        ..ConvertSettings::default()
    };
    settings.modes.wanted = Wanted::Lowest(modes);
    convert(model, &settings, &Context::QUIET)
}

fn checked(raw: RawModel) -> FeModel {
    FeModel::from_raw(raw).expect("a body").model
}

fn failed(checks: Vec<flexbody_body::invariants::IdentityCheck>) -> Vec<String> {
    checks.into_iter().filter(|check| !check.passed).map(|check| format!("{check:?}")).collect()
}

#[test]
fn with_all_modes_the_eigenvalues_are_those_of_the_held_model() {
    let raw = bar();
    let model = checked(raw.clone());
    let conversion = on_interface(&model, "root", BasisChoice::default(), ALL).expect("a body");
    let body = conversion.body;
    assert_eq!(*body.conditions(), ReferenceConditions::Interface("root".to_owned()));
    let held = HeldModel::new(&raw, &raw.data.interfaces[0].nodes);
    for (own, expected) in body.modes().eigenvalue.iter().zip(held.eigenvalues()) {
        assert!((own / expected - 1.0).abs() < 1e-8, "{own:e}, {expected:e}");
    }
    assert_eq!(failed(body_identities(&body)), Vec::<String>::new());
    assert_eq!(failed(verify(&body, &model).expect("comparable")), Vec::<String>::new());
    let names: Vec<&str> = body_identities(&body).iter().map(|check| check.name).collect();
    assert!(names.contains(&"frame_on_interface") && !names.contains(&"c1_zero"), "{names:?}");
}

/// Covers every kind of model: solids, shells, beams with rotary inertia, the plane; free modes and
/// Craig-Bampton.
#[test]
fn every_identity_holds_for_every_kind_of_model() {
    let mut plane = rectangle(5, 2, 0.7, [1.0, 2.0]);
    let ids: Vec<i64> = plane.nodes.ids.iter().copied().take(3).collect();
    plane.data.interfaces = vec![NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new("foot", ids) }];
    let models = [
        ("bracket_hex20", raw_fixture("bracket_hex20")),
        ("robot_link", raw_fixture("robot_link")),
        ("satellite", raw_fixture("satellite")),
        ("car_frame", raw_fixture("car_frame")),
        ("plane", plane),
    ];
    for (name, mut raw) in models {
        for interface in &mut raw.data.interfaces {
            interface.coupling = interface.coupling.or(Some(Coupling::Rigid));
        }
        let interface = raw.data.interfaces[0].name.clone();
        let model = checked(raw);
        for basis in [BasisChoice::default(), BasisChoice::CraigBampton(CraigBampton)] {
            let what = format!("{name}, {basis:?}");
            let body = on_interface(&model, &interface, basis.clone(), 8).expect(&what).body;
            assert_eq!(failed(body_identities(&body)), Vec::<String>::new(), "{what}");
            assert_eq!(failed(verify(&body, &model).expect("comparable")), Vec::<String>::new(), "{what}");
            is_the_body_in_mean_axes(&body, &model, basis, &what);
            // The file stores the body bit by bit.
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("body.flex.h5");
            flexbody_file::write(&body, &path).expect("written");
            assert_eq!(flexbody_file::read(&path).expect("readable"), body, "{what}");
        }
    }
}

/// Asserts that the body transformed to mean axes has the eigenvalues of a body converted in mean axes.
fn is_the_body_in_mean_axes(body: &FlexBody, model: &FeModel, basis: BasisChoice, what: &str) {
    let mut settings = ConvertSettings { basis, frame: BodyFrame::Com.into(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(8);
    let expected = convert(model, &settings, &Context::QUIET).expect("a body").body;
    let mean = body.in_mean_axes_at(BodyFrame::Com).expect(what);
    assert_eq!(failed(mean.identities(BodyFrame::Com)), Vec::<String>::new(), "{what}");
    // Free modes are the lowest of their span in any frame; the rounding of rigid motion in K affects the
    // modes of the held body.
    let limit = 1e-8 + 10.0 * expected.certificate().rigid_noise;
    for (own, expected) in mean.modes().eigenvalue.iter().zip(&expected.modes().eigenvalue) {
        assert!((own / expected - 1.0).abs() < limit, "{what}: {own:e}, {expected:e}");
    }
}

#[test]
fn what_no_frame_can_stand_on_is_refused() {
    let mut raw = bar();
    let line = raw.data.interfaces[0].nodes[..2].to_vec();
    raw.data
        .interfaces
        .push(NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("line", line.clone()) });
    raw.data.interfaces.push(NodeSet { coupling: Some(Coupling::Free), ..NodeSet::new("free", line) });
    let model = checked(raw);
    for (name, code, words) in [
        ("nowhere", Code::SceneBody, "root, tip, line, free"),
        ("line", Code::CarrierImpossible, "lie on one line"),
        ("free", Code::CarrierImpossible, "is free"),
    ] {
        let error = on_interface(&model, name, BasisChoice::default(), 6).expect_err(name);
        assert!(error.has(code) && error.to_string().contains(words), "{name}: {error}");
    }
    let mut settings =
        ConvertSettings { frame: FrameChoice::Interface("root".to_owned()), ..ConvertSettings::default() };
    settings.modes.accuracy = Accuracy::Certified;
    assert!(convert(&model, &settings, &Context::QUIET).expect_err("bounds").has(Code::Usage));
}

/// The count of the fixed-interface modes proves the basis in any frame, which the terminal, the report and the file
/// state. With the basis as a fact, a motion of the carried interface needs no warning about truncated modes, also if
/// the modes were requested by a frequency.
#[test]
fn a_body_on_an_interface_states_its_fixed_interface_modes() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |words: &[&str]| {
        let run = flexbody(folder.path(), words);
        let [out, err] = [&run.stdout, &run.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
        assert_eq!(run.status.code(), Some(0), "{out}{err}");
        out + &err
    };
    let model = fixtures().join("models/bracket_hex20/model.toml");
    let basis = ["--basis", "craig-bampton", "--max-frequency", "30000", "--frame", "interface=bolt_base"];
    let convert = |more: &[&str]| {
        let model = model.to_str().expect("a path");
        run(&[&["convert", model], &basis[..], more].concat())
    };
    let said = convert(&["-o", "held.flex.h5", "--report", "report.html"]);
    let report = std::fs::read_to_string(folder.path().join("report.html")).expect("a report");
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let follows = "the modes of the body held at `bolt_base` follow from them and the interface motions";
    for text in [&said, &report, &run(&["inspect", "held.flex.h5"])] {
        let text = words(text);
        assert!(text.contains(follows) && text.contains("17 fixed-interface modes below 30 kHz"), "{text}");
        assert!(!text.to_lowercase().contains("not proved"), "{text}");
    }
    assert!(words(&said).contains("Hz (fixed-interface modes)") && !said.contains("free body"), "{said}");
    assert!(report.contains("No fixed-interface mode is missing.") && report.contains("held, "), "{report}");
    assert!(!report.contains("Too high by about"), "{report}");
    let said: serde_json::Value =
        serde_json::from_str(&run(&["inspect", "held.flex.h5", "--json"])).expect("JSON");
    let json = &said["results"];
    let schema: serde_json::Value =
        serde_json::from_str(include_str!("../../../schemas/report.schema.json")).expect("a schema");
    let problems: Vec<String> = jsonschema::validator_for(&schema)
        .expect("a schema")
        .iter_errors(json)
        .map(|problem| problem.to_string())
        .collect();
    assert_eq!(problems, Vec::<String>::new());
    let own = &json["modes"]["craig_bampton"];
    let hertz = own["fixed_interface_hz"].as_array().expect("a list");
    assert!(hertz.len() == 17 && hertz.iter().all(|hz| hz.as_f64().is_some_and(|hz| hz < 30000.0)), "{own}");
    assert!(own["free_hz"].is_null() && own["within_one_percent"].is_null(), "{own}");
    assert_eq!(json["completeness"]["verdict"], "proved");

    let scene = "gravity = [0, 0, -9810]\n[run]\nduration = 0.0002\n[carried]\ninterface = \"bolt_base\"\n";
    std::fs::write(folder.path().join("scene.toml"), scene).expect("written");
    let said = run(&["simulate", "held.flex.h5", "--scene", "scene.toml"]);
    assert!(!said.contains("FB546"), "{said}");
}

/// Collects all numbers of a JSON value in order.
fn numbers(value: &serde_json::Value, into: &mut Vec<f64>) {
    match value {
        serde_json::Value::Number(number) => into.push(number.as_f64().expect("a float")),
        serde_json::Value::Array(all) => all.iter().for_each(|one| numbers(one, into)),
        serde_json::Value::Object(all) => {
            let told = all.iter().filter(|(name, _)| !name.ends_with("_seconds"));
            told.for_each(|(_, one)| numbers(one, into));
        }
        _ => {}
    }
}

/// The command, and the use of its body by other commands.
#[test]
fn the_command_makes_a_body_on_an_interface() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |words: &[&str]| {
        let run = flexbody(folder.path(), words);
        let [out, err] = [&run.stdout, &run.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
        (run.status.code(), out, err)
    };
    let model = fixtures().join("models/bracket_hex20/model.toml");
    let model = model.to_str().expect("UTF-8");
    let craig_bampton = ["--modes", "6", "--basis", "craig-bampton"];
    let convert = |more: &[&str]| run(&[&["convert", model], &craig_bampton[..], more].concat());
    let (code, out, err) = convert(&["--frame", "interface=bolt_base", "-o", "held.flex.h5"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("the frame stands on interface `bolt_base`"), "{out}");
    assert_eq!(convert(&["-o", "mean.flex.h5"]).0, Some(0));
    // Against the model all identities of invariants and modes hold.
    let (code, out, _) = run(&["check", "held.flex.h5", "--against", model]);
    assert!(code == Some(0) && out.contains("frame_on_interface") && !out.contains("c1_zero"), "{out}");
    // The response does not depend on the frame of the body.
    let response = |body: &str| {
        let places = ["--from", "bolt_wall:x", "--to", "bolt_base:z", "--band", "100..2000", "--json"];
        let (code, out, err) = run(&[&["response", body], &places[..]].concat());
        assert_eq!(code, Some(0), "{err}");
        let mut all = Vec::new();
        numbers(&serde_json::from_str(&out).expect("JSON"), &mut all);
        all
    };
    let [held, mean] = ["held.flex.h5", "mean.flex.h5"].map(response);
    let size = mean.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    assert!(held.len() == mean.len() && held.len() > 100 && size > 0.0, "{}, {}", held.len(), mean.len());
    for (a, b) in held.iter().zip(&mean) {
        assert!((a - b).abs() <= 1e-6 * a.abs().max(b.abs()), "{a} {b}");
    }
    // The motion does not depend on the frame either.
    let scene = "[run]\nduration = 0.0005\n[initial]\nangular_velocity = [30.0, 10.0, 0.0]\n[[load]]\ninterface = \"bolt_wall\"\nforce = [5.0, 0.0, 1.0]\n[[watch]]\ninterface = \"bolt_base\"\n";
    std::fs::write(folder.path().join("scene.toml"), scene).expect("written");
    let motion = |body: &str| {
        let (code, out, err) = run(&["simulate", body, "--scene", "scene.toml", "--json"]);
        assert_eq!(code, Some(0), "{err}");
        let json: serde_json::Value = serde_json::from_str(&out).expect("JSON");
        serde_json::json!([json["results"]["points"], json["results"]["last"], json["results"]["reaction"]])
    };
    let [held, mean] = ["held.flex.h5", "mean.flex.h5"].map(|body| {
        let mut all = Vec::new();
        numbers(&motion(body), &mut all);
        all
    });
    assert!(held.len() == mean.len() && held.len() > 12, "{held:?}, {mean:?}");
    for (a, b) in held.iter().zip(&mean) {
        assert!((a - b).abs() <= 1e-6 * a.abs().max(b.abs()) + 1e-12, "{held:?}, {mean:?}");
    }
    // Selections and trade studies need modes of free bodies; unsupported exports are refused.
    for words in [
        &["select", "held.flex.h5", "--scene", "scene.toml"][..],
        &["trade", "held.flex.h5", "--scene", "scene.toml"],
        &["export", "held.flex.h5", "--to", "simscape", "--allow-loss", "-o", "held.mat"],
        &["export", "held.flex.h5", "--to", "chrono", "--allow-loss", "-o", "held.csv"],
        &[
            "export",
            "held.flex.h5",
            "--to",
            "mbdyn",
            "--dialect",
            "level13",
            "--allow-loss",
            "-o",
            "held.fem",
        ],
    ] {
        let (code, _, err) = run(words);
        assert!(code == Some(2) && err.contains("stands on interface `bolt_base`"), "{words:?}: {err}");
    }
    // Exported and imported again: with the frame kept, in mean axes, and at the node of the other interface.
    let words = |line: &str| run(&line.split(' ').collect::<Vec<_>>());
    for line in [
        "export held.flex.h5 --to sid -o held.SID_FEM",
        "convert --from sid held.SID_FEM --units mm,t,s -o kept.flex.h5",
        "check kept.flex.h5",
        "convert --from sid held.SID_FEM --units mm,t,s --frame com -o again.flex.h5",
        "check again.flex.h5",
        "compare again.flex.h5 mean.flex.h5",
        "convert --from sid held.SID_FEM --units mm,t,s --frame interface=21010 -o wall.flex.h5",
        "check wall.flex.h5",
    ] {
        let (code, out, err) = words(line);
        assert_eq!(code, Some(0), "{line}: {out}{err}");
    }
    let (code, _, err) = words("compare kept.flex.h5 mean.flex.h5");
    assert!(code == Some(2) && err.contains("different reference conditions"), "{err}");
    let (code, _, err) = convert(&["--frame", "interface=nobody", "-o", "none.flex.h5"]);
    assert!(code == Some(2) && err.contains("bolt_base, bolt_wall"), "{err}");
    let (code, _, err) = convert(&["--frame", "sideways", "-o", "none.flex.h5"]);
    assert!(code == Some(2) && err.contains("interface=NAME"), "{err}");
    assert!(!folder.path().join("none.flex.h5").exists() && !folder.path().join("held.fem").exists());
}

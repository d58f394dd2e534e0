//! Errors of runs of another program: those that were put into a run are found, and wrong runs are refused.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::EulerParameters;
use flexbody_motion::scene::{Axes, Initial, MotionHistory, Scene, trace};
use flexbody_study::measured_run::{MeasuredRun, measured_run};
use flexbody_study::recipe::Recipe;
use flexbody_study::trade::{Source, TradeSettings, trade};
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::soft_block;
use oracle::mesh::Mesh;
use oracle::scenes::nothing_happens;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

fn tumble(body: &FlexBody) -> Scene {
    let spin = 0.1 * body.modes().eigenvalue[0].sqrt();
    let axis = Vector3::new(0.2, 1.0, 0.1).normalize();
    Scene {
        initial: Initial { angular_velocity: axis * spin, axes: Axes::Body, ..Initial::default() },
        ..nothing_happens("tumble", std::f64::consts::TAU / spin, 1e-10)
    }
}

/// Returns the motion of `body` in `scene` as another program would write it, at the instants of a trace.
fn history(body: &FlexBody, scene: &Scene) -> MotionHistory {
    let motion = trace(body, scene, &Context::QUIET).expect("a motion").0;
    // Breaks are sampled at both sides.
    let mut kept: Vec<usize> = (0..motion.time.len()).collect();
    kept.dedup_by_key(|i| motion.time[*i].to_bits());
    MotionHistory {
        path: PathBuf::from("run.csv"),
        time: kept.iter().map(|i| motion.time[*i]).collect(),
        attitude: Some(kept.iter().map(|i| motion.attitude[*i]).collect()),
        q: kept.iter().map(|i| motion.q[*i].clone()).collect(),
    }
}

fn measured(body: &FlexBody, scene: &Scene, history: MotionHistory) -> MeasuredRun {
    measured_run(body, history, scene, None, &Context::QUIET).expect("a run").0
}

#[test]
fn an_error_that_was_put_into_a_run_is_found() {
    let body = soft_block(5);
    let scene = tumble(&body);
    let exact = history(&body, &scene);
    let none = measured(&body, &scene, exact.clone());
    assert!(none.worst < 1e-9, "{none:?}");
    // Both runs lack the stress stiffness of the spin, so that the run is not one of the part.
    assert!(none.stress_error.is_some() && !none.holds(), "{none:?}");
    // All deformations 1 % too large.
    let mut larger = exact.clone();
    larger.q.iter_mut().flatten().for_each(|q| *q *= 1.01);
    let errors = measured(&body, &scene, larger).errors;
    let [deflection, stress] = [errors.deflection, errors.stress].map(|error| error.expect("a deformation"));
    assert!((deflection - 0.01).abs() < 1e-6 && (stress - 0.01).abs() < 1e-6, "{errors:?}");
    assert!(errors.attitude.expect("an attitude") < 1e-9);
    // An attitude turned by 2 mrad about an axis of the world.
    let mut turned = exact.clone();
    let by = EulerParameters([0.001f64.cos(), 0.0, 0.0, 0.001f64.sin()]);
    for own in turned.attitude.as_mut().expect("an attitude") {
        let ([a, x, y, z], [b, .., w]) = (own.0, by.0);
        *own = EulerParameters([b * a - w * z, b * x - w * y, b * y + w * x, b * z + w * a]);
    }
    let run = measured(&body, &scene, turned);
    assert!((run.errors.attitude.expect("an attitude") - 0.002).abs() < 1e-9, "{run:?}");
    assert!(!run.holds() && (run.worst - 2.0).abs() < 1e-6);
    // A run without attitudes has no error of the attitude.
    assert_eq!(measured(&body, &scene, MotionHistory { attitude: None, ..exact }).errors.attitude, None);
}

/// A run without any error, of which only three instants are written, says nothing about the motion between them.
#[test]
fn instants_too_far_apart_are_refused() {
    let body = soft_block(5);
    let scene = tumble(&body);
    let mut sparse = history(&body, &scene);
    let last = sparse.time.len() - 1;
    let few = [0, last / 2, last];
    sparse.time = few.map(|i| sparse.time[i]).to_vec();
    sparse.q = few.map(|i| sparse.q[i].clone()).to_vec();
    sparse.attitude = sparse.attitude.map(|all| few.map(|i| all[i]).to_vec());
    let refused = measured_run(&body, sparse, &scene, None, &Context::QUIET).expect_err("too few instants");
    assert!(refused.has(Code::SeriesRange), "{refused}");
    assert!(refused.to_string().contains("the 3 instants are too far apart"), "{refused}");
}

#[test]
fn the_error_of_a_reduced_body_is_that_of_a_trade_study() {
    let model = FeModel::from_raw(
        Mesh::block(ElementKind::Hex8, [4, 2, 2], [2.0, 1.0, 0.6])
            .assemble(&Material { youngs: 4.0, poisson: 0.3, density: 1.0 }, MassRule::Consistent)
            .raw_model(),
    )
    .expect("a model")
    .model;
    let made = |n_modes: usize| {
        let modes = ModeSettings { wanted: Wanted::Lowest(n_modes), ..ModeSettings::default() };
        let settings = ConvertSettings { modes, ..ConvertSettings::default() };
        convert(&model, &settings, &Context::QUIET).expect("a body").body
    };
    let (whole, small) = (made(10), made(4));
    let scene = tumble(&whole);
    let sources = [
        Source::new("whole", whole.clone(), Recipe::File, None).expect("a body"),
        Source::new("small", small.clone(), Recipe::File, None)
            .expect("a body")
            .beside(&whole, &model)
            .expect("modes"),
    ];
    let settings = TradeSettings { repeat: 1, reserved: &[], varied: None };
    let study = trade(&sources, &scene.clone().into(), None, &settings, &Context::QUIET).expect("a study");
    let is_small =
        |row: &&flexbody_study::trade::TradeRow| row.candidate.source == 1 && row.candidate.modes.len() == 4;
    let row = study.rows.iter().find(is_small).expect("the small body");
    let expected = row.outcome.as_ref().expect("a motion").decisive_case().errors;
    let own = history(&small, &scene);
    let run = measured_run(&small, own, &scene, Some((&whole, &model)), &Context::QUIET).expect("a run").0;
    for ((name, a), (_, b)) in run.errors.named().into_iter().zip(expected.named()) {
        let (Some(a), Some(b)) = (a, b) else { continue };
        assert!((a - b).abs() <= 1e-3 * b, "{name}: {a} {b}");
    }
}

#[test]
fn the_command_refuses_runs_that_do_not_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let body = soft_block(3);
    flexbody_file::write(&body, place.join("b.h5")).expect("a file");
    fs::write(place.join("s.toml"), "[run]\nduration = 1e-3\n[initial]\nangular_velocity = [0, 0, 10]\n")
        .expect("a scene");
    let run = |table: &str| {
        fs::write(place.join("run.csv"), table).expect("a table");
        let words = ["measure", "b.h5", "--scene", "s.toml", "--history", "run.csv", "--json"];
        let done = flexbody(place, &words);
        let told: Value = serde_json::from_slice(&done.stdout).expect("JSON");
        (done.status.code(), told["diagnostics"][0]["code"].as_str().map(str::to_owned))
    };
    let refused = |code: &str| (Some(2), Some(code.to_owned()));
    assert_eq!(run("time,q_1,q_2\n0,0,0\n1e-3,0,0\n"), refused("FB215"));
    assert_eq!(run("time,q_1,q_2,q_3\n0,0,0,0\n1e-3,0,nan,0\n"), refused("FB216"));
    assert_eq!(run("time,q_1,q_2,q_3\n0,0,0,0\n2e-3,0,0,0\n"), refused("FB217"));
    let head = "time,q_1,q_2,q_3,attitude_0,attitude_1,attitude_2,attitude_3\n";
    assert_eq!(run(&format!("{head}0,0,0,0,1,0,0,0\n1e-3,0,0,0,1,1,0,0\n")), refused("FB216"));
    // At rest instead of turning: the attitude is off by 0.01 rad.
    assert_eq!(run(&format!("{head}0,0,0,0,1,0,0,0\n1e-3,0,0,0,1,0,0,0\n")).0, Some(1));
}

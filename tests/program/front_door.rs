//! Public API of the library as a user program calls it: progress callbacks, interfaces, reports, motions,
//! trade studies, jobs.

use flexbody::{
    Basis, Code, ConvertOptions, Coupling, ExitCode, FlexBody, Model, Progress, ReferenceChoice,
    ReportFormat, Scene, SparseMatrix, TradeOptions,
};
use oracle::fixtures;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

fn bracket() -> Model {
    Model::read(fixtures().join("models/bracket_hex20/model.toml")).expect("a model of the fixtures")
}

fn body() -> FlexBody {
    bracket().convert(&ConvertOptions::default().modes(6)).expect("a body").body
}

/// Returns a short spin with tolerances, and its folder.
fn spin() -> (tempfile::TempDir, Scene) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("spin.toml");
    let text = "[run]\nduration = 0.004\noutputs = 20\n[initial]\nangular_velocity = [10, 200, 5]\n[[watch]]\ninterface = \"bolt_wall\"\n\
                [tolerance]\ndeflection = 0.05\nattitude = 0.01\n";
    std::fs::write(&path, text).expect("a file");
    let scene = Scene::read(&path).expect("a scene");
    (folder, scene)
}

#[test]
fn a_listener_hears_the_phases_and_stops_the_work_anywhere() {
    let (model, options) = (bracket(), ConvertOptions::default().modes(6));
    let phases = Mutex::new(Vec::new());
    let events = AtomicUsize::new(0);
    let listen = |progress: Progress<'_>| {
        events.fetch_add(1, Ordering::Relaxed);
        if let Progress::Phase(name) = progress {
            phases.lock().expect("no panic").push(name.to_owned());
        }
        ControlFlow::Continue(())
    };
    let whole = model.convert_with_progress(&options, &listen).expect("a body").body;
    let (phases, events) = (phases.into_inner().expect("no panic"), events.into_inner());
    for name in ["factorisation", "modes", "invariants"] {
        assert!(phases.iter().any(|phase| phase == name), "{name} in {phases:?}");
    }
    for last in [0, 1, events / 2, events - 1] {
        let heard = AtomicUsize::new(0);
        let stop = |_: Progress<'_>| match heard.fetch_add(1, Ordering::Relaxed) {
            before if before < last => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        };
        let error = model.convert_with_progress(&options, &stop).expect_err("stopped");
        assert!(error.has(Code::Stopped) && error.exit_code() == ExitCode::Interrupted, "{last}: {error}");
        assert_eq!(heard.into_inner(), last + 1, "nothing is heard after the end");
    }
    assert_eq!(model.convert(&options).expect("a body").body, whole);
}

#[test]
fn every_long_work_can_be_stopped() {
    let (body, (_folder, scene)) = (body(), spin());
    let stop = |_: Progress<'_>| ControlFlow::Break(());
    let options = ConvertOptions::default().modes(6);
    let outcomes = [
        body.simulate_with_progress(&scene, &stop).map(|_| ()),
        body.select_with_progress(&scene, &stop).map(|_| ()),
        body.trade(&scene, &TradeOptions::default(), &stop).map(|_| ()),
        bracket().convert_for_with_progress(&scene, &options, &stop).map(|_| ()),
    ];
    for (at, outcome) in outcomes.into_iter().enumerate() {
        assert!(outcome.is_err_and(|error| error.has(Code::Stopped)), "{at}");
    }
}

/// The library refuses what the command refuses: a body whose selection cannot be judged.
#[test]
fn a_body_that_cannot_be_judged_is_made_only_if_this_is_allowed() {
    let cube = Model::read(fixtures().join("models/cube_hex8/model.toml")).expect("a model");
    let shock = "[run]\nduration = 2e-4\noutputs = 20\n[[load]]\nnode = 1\nforce = [10, 20, 100]\n\
                 [tolerance]\ndeflection = 0.5\nstress = 0.5\n";
    let scene = Scene::parse(shock, "").expect("a scene");
    let options = ConvertOptions::default().modes(5);
    let error = cube.convert_for(&scene, &options).expect_err("refused");
    assert!(error.has(Code::SelectionUnjudged) && error.exit_code() == ExitCode::CheckFailed, "{error}");
    assert!(error.has(Code::ReferenceIncomplete), "the reason stands before the error: {error}");
    let (_, selection) = cube.convert_for(&scene, &options.allow_unjudged()).expect("a body");
    assert!(!selection.holds());
}

#[test]
fn interfaces_have_their_nodes_and_what_the_modes_do_there() {
    let body = bracket()
        .convert(&ConvertOptions::default().modes(4).basis(Basis::CraigBampton))
        .expect("a body")
        .body;
    let interfaces = body.interfaces();
    assert_eq!(interfaces.len(), 2);
    for interface in &interfaces {
        assert!(interface.node_ids.iter().all(|id| body.node_ids().contains(id)));
        let point = body.interface_point(&interface.name).expect("a reference point");
        let rows = interface.translation.as_ref().expect("a reference point");
        for j in 0..body.n_modes() {
            let mut q = vec![0.0; body.n_modes()];
            q[j] = 1.0;
            let moved = point.deflection(&q);
            assert!((0..3).all(|k| (moved[k] - rows[(k, j)]).abs() <= 1e-12 * rows[(k, j)].abs().max(1.0)));
        }
    }
    let own = body.interface_coordinates().expect("a Craig-Bampton body");
    assert_eq!((own.names.len(), own.of_modes.columns()), (own.stiffness.rows(), body.n_modes()));
    assert!(self::body().interface_coordinates().is_none());
}

#[test]
fn what_a_builder_states_is_checked_and_kept() {
    let name = |folder: &str| fixtures().join("models").join(folder).join("model.toml");
    // A plane model from matrices in memory.
    let square =
        |triplets: &[(usize, usize, f64)]| SparseMatrix::from_triplets(4, triplets).expect("a matrix");
    let stiffness = square(&[(0, 0, 1.0), (2, 2, 1.0), (0, 2, -1.0), (2, 0, -1.0)]);
    let mass = square(&[(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (3, 3, 1.0)]);
    let plane = Model::builder("bar", stiffness.clone(), mass.clone())
        .nodes(vec![1, 2], vec![[0.0; 3], [1.0, 0.0, 0.0]])
        .plane()
        .coupled_interface("end", vec![2], Coupling::Free, None)
        .rayleigh_damping(0.1, 0.0)
        .build()
        .expect("a bar in the plane");
    let body = plane.convert(&ConvertOptions::default().modes(1)).expect("a body").body;
    assert_eq!((body.dimension(), body.equations_of_motion().n_rigid(), body.n_dofs()), (2, 3, 4));
    // K = [1 -1; -1 1] and m = 1 give lambda = 2, and D = alpha M.
    assert!((body.eigenvalues()[0] - 2.0).abs() < 1e-12 && (body.damping()[(0, 0)] - 0.1).abs() < 1e-12);
    assert_eq!(body.interfaces()[0].coupling, Some(Coupling::Free));
    let refused = Model::builder("bar", stiffness, mass)
        .nodes(vec![1, 2], vec![[0.0; 3], [1.0, 0.0, 0.0]])
        .plane()
        .damping_matrix(SparseMatrix::from_triplets(2, &[(0, 0, 1.0), (1, 1, 1.0)]).expect("a matrix"))
        .build();
    assert!(refused.is_err(), "a damping matrix of another size");
    let read = Model::read(name("cube_hex8")).expect("a model");
    let cube = read.convert(&ConvertOptions::default().modes(6)).expect("a body").body;
    assert_eq!(cube.source_files()[0].role, "manifest");
    assert_eq!(cube.source_files()[0].sha256.len(), 64);
    assert!(cube.settings_json().contains("\"modes\":6"));
    assert_eq!(cube.units(), ["m", "kg", "s"]);
    assert_eq!(cube.mass_structure(), "rotation-invariant");
}

#[test]
fn jobs_of_fe_programs_are_read() {
    let deck = fixtures().join("small/calculix/job.inp");
    let model = Model::read_job(&deck, None, Some(["m", "kg", "s"]), &[], None).expect("a job");
    assert!(model.n_dofs() > 0);
    let wrong = Model::read_job(&deck, None, None, &[("end", "NO SUCH SET", Some(Coupling::Rigid))], None);
    assert!(wrong.expect_err("no set").has(Code::NodeSetUnknown));
}

#[test]
#[ignore = "slow"]
fn motions_selections_and_studies_tell_their_numbers() {
    let (body, (folder, scene)) = (body(), spin());
    let motion = body.simulate(&scene).expect("a motion");
    let last = motion.times().len() - 1;
    assert_eq!((last, motion.modal_velocities(last).len()), (20, 6));
    let length: f64 = motion.attitude(last).iter().map(|p| p * p).sum();
    assert!((length - 1.0).abs() < 1e-12 && motion.reaction(last).is_none());
    // No load acts on the body: the work is rounding of the energies that it is the difference of.
    let (drift, work) = (motion.drift(), motion.work(last) / motion.kinetic_energy(last));
    assert!(drift.iter().all(|drift| *drift < 1e-6) && work.abs() < 1e-12, "{drift:?}, work {work:e}");
    let path = &motion.paths()[0];
    assert_eq!((path.name.as_str(), path.place.len()), ("interface bolt_wall", 21));
    let deflected =
        path.deflection.iter().map(|d| d.iter().map(|v| v * v).sum::<f64>().sqrt()).fold(0.0, f64::max);
    assert!(deflected > 0.0 && deflected <= motion.largest_deflection() * 1.001, "a length, not a ratio");
    motion.write(folder.path().join("motion.h5")).expect("a file");
    assert!(motion.csv().lines().count() > 21);

    let selection = body.select(&scene).expect("a selection");
    let trade = body
        .trade(&scene, &TradeOptions::default().repeat(1), &|_| ControlFlow::Continue(()))
        .expect("a study");
    assert!(trade.holds() && trade.front().contains(&trade.recommended().expect("a candidate")));
    assert_eq!(trade.body(0).expect("the whole body").n_modes(), 6);
    assert!(trade.body(trade.candidates()).expect_err("no candidate").has(Code::Argument));
    let nodal = body.trade(&scene, &TradeOptions::default().reference(ReferenceChoice::Nodal), &|_| {
        ControlFlow::Continue(())
    });
    assert!(nodal.expect_err("no matrices").has(Code::Usage));
    for (json, scene) in [
        (selection.report(ReportFormat::Json), "spin"),
        (motion.report(ReportFormat::Json), "spin"),
        (trade.report(ReportFormat::Json), "spin"),
    ] {
        let report: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(report["scene"], scene);
    }
    assert!(body.report(ReportFormat::Html).contains("<html"));
}

#[test]
fn scenes_come_from_text_and_from_values() {
    let text =
        "name = \"spin\"\n[run]\nduration = 0.01\noutputs = 4\n[initial]\nangular_velocity = [10, 200, 5]\n";
    let values = serde_json::json!({
        "name": "spin",
        "run": { "duration": 0.01, "outputs": 4 },
        "initial": { "angular_velocity": [10, 200, 5] },
    });
    let body = body();
    let motion = |scene: &Scene| body.simulate(scene).expect("a motion").csv();
    let parsed = Scene::parse(text, "").expect("a scene");
    let made = Scene::from_values(&values, "").expect("a scene");
    assert_eq!((parsed.name(), made.name()), ("spin", "spin"));
    assert_eq!(motion(&parsed), motion(&made));
    // Load cases are chosen by name.
    let cases =
        serde_json::json!({ "run": { "duration": 0.01 }, "case": [{ "name": "a" }, { "name": "b" }] });
    let cases = Scene::from_values(&cases, "").expect("two cases");
    assert_eq!(cases.case(Some("b")).expect("a case").name(), "scene: b");
    for name in [None, Some("c")] {
        assert!(cases.case(name).expect_err("no such case").has(Code::SceneCase));
    }
    // Errors name the line of a text, and the value among values.
    let error = Scene::parse("[run]\nduration = true\n", "").expect_err("no number");
    assert_eq!(error.diagnostics()[0].line(), Some(2));
    let loads = serde_json::json!({ "load": [{ "node": 1, "force": [0, 0, 1] }, { "node": 2, "force": 1 }] });
    // The table is named once, whether the message names it or not.
    let unknown = serde_json::json!({ "run": { "duration": 1.0, "durations": 2.0 } });
    let told = Scene::from_values(&unknown, "").expect_err("an unknown key").to_string();
    assert_eq!(told.matches("in [run]").count(), 1, "{told}");
    let error = Scene::from_values(&loads, "").expect_err("no vector");
    let said = error.diagnostics()[0].message();
    assert!(said.ends_with(" in [[load]] 2: `force = 1`"), "{said}");
    assert_eq!((error.diagnostics()[0].file(), error.diagnostics()[0].line()), (None, None));
    for values in
        [serde_json::json!({ "run": null }), serde_json::json!(3), serde_json::json!({ "runs": {} })]
    {
        assert!(Scene::from_values(&values, "").expect_err("no scene").has(Code::SceneSyntax), "{values}");
    }
    // Files of histories lie in the stated folder.
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("force.csv"), "time,f\n0,1\n0.01,2\n").expect("written");
    let history = serde_json::json!({ "file": "force.csv", "time": "time", "value": "f" });
    let load = serde_json::json!([{ "node": 1, "force": [0, 0, 1], "history": history }]);
    let values = serde_json::json!({ "run": { "duration": 0.01 }, "load": load });
    assert!(Scene::from_values(&values, folder.path()).is_ok());
    assert!(Scene::from_values(&values, folder.path().join("none")).is_err());
}

#[test]
fn bodies_become_bytes_and_fragments_of_pages() {
    let (body, folder) = (body(), tempfile::tempdir().expect("a folder"));
    let bytes = body.to_bytes().expect("bytes");
    body.write(folder.path().join("body.flex.h5")).expect("written");
    assert!(bytes == std::fs::read(folder.path().join("body.flex.h5")).expect("a file"));
    assert_eq!(FlexBody::from_bytes(&bytes).expect("a body"), body);
    assert!(FlexBody::from_bytes(&bytes[..bytes.len() / 2]).is_err());
    let html = body.summary_html();
    assert!(html.contains("<dl") && html.contains("6 flexible") && !html.contains("<script"), "{html}");
}

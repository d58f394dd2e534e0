//! Errors, extremes and verdicts refer to the continuous motion: the output times of a scene do not affect
//! them.

use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::Terms;
use flexbody_motion::scene::{
    Axes, FramedScene, History, Initial, Load, PerQuantity, Point, Recording, Requirements, Run, Scene,
    Scheme, VectorHistory, simulate,
};
use flexbody_study::selection::select;
use nalgebra::Vector3;
use oracle::flexible::soft_block;
use oracle::scenes::{bodies, doing, seeded};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// Returns the block with bending loads at two of its nodes, over this number of periods of its first mode.
fn scene(body: &FlexBody, periods: f64, outputs: usize, history: &History) -> Scene {
    let rate = body.modes().eigenvalue[0].sqrt();
    let (mass, size) = (body.invariants().mass(), body.invariants().inertia().trace().sqrt());
    let force = 1e-4 * size * mass.sqrt() * rate * rate;
    let ids = &body.nodes().ids;
    let load = |id: i64| Load {
        at: Point::Node(id),
        force: VectorHistory::Along {
            direction: Vector3::new(0.3, 0.2, 1.0) * force,
            factor: history.clone(),
        },
        torque: VectorHistory::nothing(),
        axes: Axes::Body,
    };
    let ends = [ids[0], ids[ids.len() - 1]];
    Scene {
        name: "pulse".to_owned(),
        run: Run {
            duration: Some(periods * TAU / rate),
            outputs,
            most_steps: Run::MOST_STEPS,
            scheme: Scheme::Adaptive { tolerance: 1e-9 },
            terms: Terms::ALL,
        },
        initial: Initial::default(),
        gravity: None,
        loads: ends.map(load).to_vec(),
        spin: None,
        carried: None,
        watched: ends.map(Point::Node).to_vec(),
        requirements: Requirements { damping: Some(0.05.into()), ..Requirements::default() },
        source: None,
        series: Vec::new(),
        resolved: false,
        case: None,
    }
}

/// Returns a pulse shorter than the periods of most modes, between two of a hundred output times.
fn pulse(body: &FlexBody, periods: f64) -> History {
    let duration = periods * TAU / body.modes().eigenvalue[0].sqrt();
    let at = |part: f64| part * duration;
    History::Table { times: vec![at(0.503), at(0.504), at(0.505)], values: vec![0.0, 1.0, 0.0] }
}

fn motion(body: &FlexBody, scene: &Scene) -> Recording {
    simulate(body, scene, &Context::QUIET).expect("a motion").0
}

/// Returns the largest deflection of the watched points at the output times.
fn written(recording: &Recording) -> f64 {
    recording.paths.iter().flat_map(|path| &path.deflection).map(|d| d.norm()).fold(0.0, f64::max)
}

/// Returns the largest difference of the deflections of two motions at the same times, relative to the
/// largest deflection.
fn apart(reference: &Recording, other: &Recording) -> f64 {
    let pairs = reference.paths.iter().zip(&other.paths);
    let all = pairs.flat_map(|(a, b)| a.deflection.iter().zip(&b.deflection));
    all.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / written(reference)
}

#[test]
fn a_pulse_between_two_instants_is_seen() {
    let body = soft_block(38);
    let scene = |outputs| scene(&body, 40.0, outputs, &pulse(&body, 40.0));
    // 20,000 output times are the oracle; two output times miss the pulse.
    let fine = motion(&body, &scene(20_000));
    let coarse = motion(&body, &scene(2));
    let nodes = |q: &[f64]| {
        let shape = &body.modes().shape;
        let at = |row: usize| q.iter().enumerate().map(|(j, q)| shape[(row, j)] * q).sum::<f64>();
        (0..body.n_nodes()).map(|i| Vector3::from_fn(|k, _| at(3 * i + k)).norm()).fold(0.0, f64::max)
    };
    let largest = fine.states.iter().map(|state| nodes(&state.q)).fold(0.0, f64::max);
    // The extent of a body is measured along the axes of the model.
    let staged = FramedScene::new(&body, &scene(2)).expect("a stage").body.into_owned();
    let largest = largest / staged.extent();
    for recording in [&fine, &coarse] {
        let found = recording.extremes.deflection.value;
        assert!((found / largest - 1.0).abs() < 2e-3, "{found} {largest}");
        for (peak, path) in recording.extremes.watched.iter().zip(&fine.paths) {
            let longest = path.deflection.iter().map(|d| d.norm()).fold(0.0, f64::max);
            assert!((peak.value / longest - 1.0).abs() < 2e-3, "{peak:?} {longest}");
        }
    }
    assert!(written(&coarse) < 0.05 * written(&fine), "two instants show next to nothing of it");
}

#[test]
fn a_selection_for_a_pulse_holds_at_every_instant() {
    let body = soft_block(38);
    let mut scene = scene(&body, 40.0, 100, &pulse(&body, 40.0));
    scene.requirements.tolerance.errors.deflection = 0.02;
    scene.requirements.tolerance.errors.stress = 0.05;
    let selection = select(&body, &[], &scene.clone().into(), &Context::QUIET).expect("a selection");
    assert!(selection.holds() && selection.modes.len() > 1, "{:?}", selection.modes);
    let own = body.reduced(&selection.modes, selection.groups, selection.terms.clone()).expect("a body");
    scene.run.outputs = 20_000;
    let error = apart(&motion(&body, &scene), &motion(&own, &scene.of_modes(&selection.modes)));
    assert!(error <= 0.02, "looked at 20,000 times the error is {error}");
    let claimed = selection.chosen.and_then(|chosen| chosen.errors).and_then(|errors| errors.deflection);
    assert!((claimed.expect("a deflection") / error - 1.0).abs() < 0.02, "{claimed:?} {error}");
}

#[test]
fn a_load_that_is_sampled_once_in_its_period_is_seen() {
    let body = soft_block(12);
    let rate = body.modes().eigenvalue[0].sqrt();
    // The number of output times equals that of oscillations, so that all of them have the same phase.
    let history = History::Sine { amplitude: 1.0, frequency: 5.0 * rate / TAU, phase: 0.0 };
    let of = |outputs| {
        let scene = scene(&body, 20.0, outputs, &history);
        select(&body, &[], &scene.into(), &Context::QUIET).expect("a selection")
    };
    let (sparse, dense) = (of(100), of(20_000));
    assert_eq!(sparse, dense);
}

proptest! {
    #![proptest_config(seeded(12, 11))]

    /// Pulses, resonances and kinks with 2 to 20,000 output times.
    #[test]
    fn verdicts_do_not_depend_on_the_outputs(
        of in 0..4usize,
        mut doing in doing(6.0),
        free in any::<bool>(),
        outputs in (2f64.ln()..20_000f64.ln()).prop_map(|x| x.exp() as usize),
        tolerance in (-3.0..-1.0f64).prop_map(|x| 10f64.powf(x)),
    ) {
        let whole = &bodies()[of];
        doing.rate *= 0.1;
        let mut scene = doing.scene(whole, free);
        scene.requirements.tolerance.errors = PerQuantity::all(tolerance);
        prop_assume!(simulate(whole, &scene, &Context::QUIET).is_ok());
        let first = select(whole, &[], &scene.clone().into(), &Context::QUIET).expect("a selection");
        scene.run.outputs = outputs;
        let again = select(whole, &[], &scene.clone().into(), &Context::QUIET).expect("a selection");
        prop_assert_eq!(&first, &again);

        // Output values are within the extremes, and reach them if the output is dense.
        let sparse = motion(whole, &scene);
        scene.run.outputs = 20_000;
        let dense = motion(whole, &scene);
        for (a, b) in sparse.extremes.watched.iter().zip(&dense.extremes.watched) {
            prop_assert!((a.value - b.value).abs() <= 1e-6 * b.value, "{a:?} {b:?}");
        }
        for (peak, path) in dense.extremes.watched.iter().zip(&dense.paths) {
            let longest = path.deflection.iter().map(|d| d.norm()).fold(0.0, f64::max);
            prop_assert!((peak.value - longest).abs() <= 0.01 * longest, "{peak:?} {longest}");
        }
    }
}

#[test]
fn the_steps_of_both_methods_do_not_depend_on_the_outputs() {
    let body = soft_block(6);
    for scheme in [
        Scheme::Adaptive { tolerance: 1e-9 },
        Scheme::Conserving { order: 4, step: None },
        Scheme::Conserving { order: 6, step: None },
    ] {
        let of = |outputs: usize| {
            let mut scene = scene(&body, 5.0, outputs, &pulse(&body, 5.0));
            scene.run.scheme = scheme;
            motion(&body, &scene)
        };
        let (few, many) = (of(3), of(3000));
        assert_eq!(few.work.steps, many.work.steps);
        let (a, b) = (few.states.last().expect("an end"), many.states.last().expect("an end"));
        assert_eq!(a, b, "the same steps, the same bits");
        // The motion within a step is as accurate as the method.
        let exact = {
            let mut scene = scene(&body, 5.0, 3, &pulse(&body, 5.0));
            scene.run.scheme = Scheme::Adaptive { tolerance: 1e-12 };
            motion(&body, &scene)
        };
        let size = exact.states.iter().map(|state| state.q[0].abs()).fold(0.0, f64::max);
        for (a, b) in few.states.iter().zip(&exact.states) {
            assert!((a.q[0] - b.q[0]).abs() < 1e-3 * size, "{scheme:?}");
        }
    }
}

#[test]
fn a_body_at_rest_does_not_drift() {
    let body = soft_block(4);
    let mut at_rest = scene(&body, 3.0, 10, &History::Constant(0.0));
    at_rest.watched.clear();
    let drift = motion(&body, &at_rest).drift();
    assert!(drift.energy < 1e-6 && drift.linear < 1e-6 && drift.angular < 1e-6, "{drift:?}");
    // Rounding of a fast translation is no energy of the body either.
    at_rest.initial.velocity = Vector3::new(1e3, -2e3, 5e2);
    let drift = motion(&body, &at_rest).drift();
    assert!(drift.energy < 1e-6 && drift.linear < 1e-12, "{drift:?}");
}

#[test]
fn runs_of_more_steps_than_allowed_are_refused_before_they_begin() {
    let body = soft_block(4);
    let refused = |scene: &Scene| {
        simulate(&body, scene, &Context::QUIET).expect_err("too long").diagnostics()[0].code()
    };
    let fast = History::Sine { amplitude: 1.0, frequency: 1e12, phase: 0.0 };
    assert_eq!(refused(&scene(&body, 5.0, 10, &fast)), Code::RunTooLong);
    let mut conserving = scene(&body, 5.0, 10, &fast);
    conserving.run.scheme = Scheme::Conserving { order: 4, step: None };
    assert_eq!(refused(&conserving), Code::RunTooLong);
    conserving.run.scheme = Scheme::Conserving { order: 4, step: Some(0.01) };
    assert_eq!(refused(&conserving), Code::StepPassesOver);
    let mut short = scene(&body, 5.0, 10, &History::Constant(1.0));
    short.run.most_steps = 3;
    assert_eq!(refused(&short), Code::RunTooLong);
    // The limit counts steps of the method, whatever breakpoints the histories have.
    let pulse = History::Table { times: vec![0.0, 0.5, 0.6, 0.8], values: vec![0.0, 0.0, 1.0, 0.0] };
    let mut exact = scene(&body, 1.0, 10, &pulse);
    exact.run.scheme = Scheme::Conserving { order: 4, step: Some(0.01) };
    let taken = simulate(&body, &exact, &Context::QUIET).expect("a motion").0.work.steps;
    exact.run.most_steps = taken;
    simulate(&body, &exact, &Context::QUIET).expect("as many steps as are allowed");
    exact.run.most_steps = taken - 1;
    assert_eq!(refused(&exact), Code::RunTooLong);
}

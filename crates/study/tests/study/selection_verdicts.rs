//! Decisions of `select` hold when measured: the selected body compared with the whole body, in the scene and
//! at its limits.

use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{EquationsOfMotion, Terms};
use flexbody_motion::scene::{
    AttachmentKind, LoadCases, Measure, MotionRange, PerQuantity, Range, Requirements, Scene, simulate,
    trace, trace_at,
};
use flexbody_study::selection::{Selection, VariedSelection, select};
use nalgebra::Vector3;
use oracle::scenes::{bodies, doing, nothing_happens, seeded, some_modes};
use proptest::prelude::*;
use std::path::Path;

/// Contribution of the integration to the errors.
const INTEGRATION: f64 = 1e-5;

fn selected(body: &FlexBody, scene: &Scene) -> Selection {
    select(body, &[], &scene.clone().into(), &Context::QUIET).expect("a selection")
}

fn reduced(body: &FlexBody, selection: &Selection) -> FlexBody {
    body.reduced(&selection.modes, selection.groups, selection.terms.clone()).expect("a body")
}

/// Returns the scene with `factor` times the rate of rotation.
fn faster(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    scene.requirements.motion = MotionRange::default();
    scene.initial.angular_velocity *= factor;
    if let Some(spin) = &mut scene.spin {
        spin.velocity = spin.velocity.scaled(factor);
    }
    scene
}

/// Returns the largest error over its tolerance of a selected body in a scene; `None` if the whole body
/// cannot be integrated there.
fn measured(whole: &FlexBody, selection: &Selection, scene: &Scene) -> Option<f64> {
    let (reference, _) = trace(whole, scene, &Context::QUIET).ok()?;
    let own = reduced(whole, selection);
    let motion = trace_at(&own, &scene.of_modes(&selection.modes), &reference.time, &Context::QUIET)
        .expect("a motion");
    let errors = Measure::new(whole, scene, &reference).of_subset(&motion, &selection.modes).largest();
    Some(errors.worst(&scene.requirements.tolerance))
}

proptest! {
    #![proptest_config(seeded(30, 3))]

    #[test]
    fn no_selected_body_exceeds_the_tolerances(
        of in 0..4usize,
        bits in any::<u8>(),
        doing in doing(10.0),
        free in any::<bool>(),
        range in prop_oneof![Just(None), (1.1..1.6f64).prop_map(Some)],
        tolerance in (-3.0..-0.5f64).prop_map(|x| 10f64.powf(x)),
        mild in any::<bool>(),
    ) {
        let whole = some_modes(&bodies()[of], bits);
        let mut doing = doing;
        // The rate is low enough for dropping terms, and for a stable free body.
        doing.rate *= if mild { 1e-3 } else { 0.2 };
        let mut scene = doing.scene(&whole, free);
        scene.requirements.tolerance.errors = PerQuantity::all(tolerance);
        let own = match &scene.spin {
            Some(spin) => spin.velocity.largest_until(scene.run.duration.expect("given")).0,
            None => scene.initial.angular_velocity.norm(),
        };
        scene.requirements.motion.angular_velocity = range.map(|range| Range::Any(range * own));
        prop_assume!(simulate(&whole, &faster(&scene, range.unwrap_or(1.0)), &Context::QUIET).is_ok());
        let selection = selected(&whole, &scene);
        for factor in [Some(1.0), range].into_iter().flatten() {
            let Some(worst) = measured(&whole, &selection, &faster(&scene, factor)) else { continue };
            prop_assert!(worst <= 1.0 + INTEGRATION / tolerance, "{worst} at {factor}: {:#?}", selection.trials);
        }
    }
}

proptest! {
    #![proptest_config(seeded(4, 4))]

    #[test]
    fn costs_are_held_and_selections_repeat(
        of in 0..4usize,
        doing in doing(3.0),
        free in any::<bool>(),
        part in 0.0..1.0f64,
    ) {
        let whole = &bodies()[of];
        let mut doing = doing;
        doing.rate *= 0.1;
        let mut scene = doing.scene(whole, free);
        prop_assume!(simulate(whole, &scene, &Context::QUIET).is_ok());
        let cost = |body: &FlexBody| EquationsOfMotion::new(body, Terms::ALL).multiplications();
        let least = cost(&whole.reduced(&[0], TermGroups::NONE, selected(whole, &scene).terms.iter().map(|term| {
            let mut term = term.clone();
            term.kept = false;
            term
        }).collect()).expect("a body"));
        let most = least + (part * (cost(whole) - least) as f64) as usize;
        scene.requirements.multiplications = Some(most);
        let selection = selected(whole, &scene);
        prop_assert!(cost(&reduced(whole, &selection)) <= most);
        prop_assert_eq!(selection.chosen.as_ref().map(|trial| trial.multiplications <= most), Some(true));
        prop_assert_eq!(&selection, &selected(whole, &scene));
    }
}

/// Returns a scene without simulation.
fn idle(requirements: Requirements) -> Scene {
    let mut scene = Scene { requirements, ..nothing_happens("idle", 0.0, 1e-9) };
    (scene.run.duration, scene.run.outputs) = (None, 500);
    scene
}

#[test]
fn without_a_run_only_bounds_and_the_band_decide() {
    let body = &bodies()[0];
    let all: Vec<usize> = (0..body.n_modes()).collect();
    let selection = selected(body, &idle(Requirements::default()));
    assert_eq!((selection.groups, &selection.modes), (TermGroups::ALL, &all));
    assert!(
        selection.chosen.is_none() && selection.terms.iter().all(|term| term.kept && !term.reason.is_empty())
    );

    let frequencies = body.frequencies_hz();
    let band = 0.5 * frequencies[3] * (1.0 + 1e-9);
    let selection = selected(body, &idle(Requirements { band: Some(band), ..Requirements::default() }));
    assert_eq!((selection.groups, selection.modes), (TermGroups::ALL, vec![0, 1, 2, 3]));

    // Joints that rotate the body slowly, and no requirement on the deflection.
    let mut slow = Requirements::default();
    slow.attachment.kind = AttachmentKind::Stiff;
    slow.motion.angular_velocity = Some(Range::Any(1e-5 * body.modes().eigenvalue[0].sqrt()));
    slow.motion.angular_acceleration = Some(Range::Axes(Vector3::zeros()));
    let selection = selected(body, &idle(slow.clone()));
    assert_eq!((selection.groups, &selection.modes), (TermGroups::NONE, &all));
    assert!(selection.terms.iter().all(|term| !term.kept && term.tier == 0 && term.bound <= term.limit));

    slow.motion.angular_velocity = Some(Range::Any(0.5 * body.modes().eigenvalue[0].sqrt()));
    let selection = selected(body, &idle(slow));
    assert_eq!(selection.groups, TermGroups::ALL, "half the first frequency is not slow");
}

/// A variation that only excites other modes adds modes and no groups. The groups of the scene fail with all modes in a
/// variation that adds a group.
#[test]
fn variations_add_groups_only_where_modes_are_not_enough() {
    let mut of_modes = 0;
    for body in &bodies()[..3] {
        let period = std::f64::consts::TAU / body.modes().eigenvalue[0].sqrt();
        let size = 1e-6 * body.extent() * body.invariants().mass() * body.modes().eigenvalue[0];
        let node = body.nodes().ids[0];
        let (end, start) = (4.0 * period, 3.0 * period);
        let text = format!(
            "[run]\nduration = {end:e}\ntolerance = 1e-8\n[initial]\ndeformation = \"static\"\n[tolerance]\ndeflection = 0.02\nstress = 0.02\n\
             [[load]]\nnode = {node}\nforce = [{size:e}, 0, 0]\naxes = \"body\"\nhistory = {{ to = 1, duration = {start:e} }}\n\
             [[variation]]\nname = \"across\"\nturn = {{ axis = [0, 0, 1], degrees = 90 }}\n"
        );
        let cases = LoadCases::parse(&text, Path::new("pushed.toml")).expect("a scene");
        let selection = select(body, &[], &cases, &Context::QUIET).expect("a selection");
        assert!(!selection.varied.is_empty());
        let groups_fail =
            |variation: &VariedSelection| variation.with_all_modes.as_ref().is_some_and(|all| !all.passed());
        let added = selection.terms.iter().any(|term| term.kept && term.reason.starts_with("variation `"));
        assert!(!added || selection.varied.iter().any(groups_fail), "{:?}", selection.terms);
        let more_modes = selection.varied.iter().any(|one| one.of_scene.is_some());
        of_modes += usize::from(more_modes && !added);
    }
    assert!(of_modes > 0, "a scene whose variations need more modes alone");
}

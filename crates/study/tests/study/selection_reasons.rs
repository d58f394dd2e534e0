//! Reasons for the modes of a selection, beside motions whose excitations are known.

use flexbody_body::flex_body::{FlexBody, Subset};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{
    Axes, History, Load, LoadCases, Measure, OutputErrors, Point, Scene, VectorHistory, trace, trace_at,
};
use flexbody_study::selection::{ErrorSource, ModeWorth, Selection, select};
use nalgebra::Vector3;
use oracle::flexible::soft_block;
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;

/// A force near the frequency of a mode, at the node and along the axis where the mode moves most.
fn push(body: &FlexBody, mode: usize) -> Load {
    let shape = &body.modes().shape;
    let places = (0..body.n_nodes()).flat_map(|node| (0..3).map(move |axis| (node, axis)));
    let size = |&(node, axis): &(usize, usize)| shape[(3 * node + axis, mode)].abs();
    let (node, axis) = places.max_by(|a, b| size(a).total_cmp(&size(b))).expect("nodes");
    let frequency = 0.97 * body.modes().eigenvalue[mode].sqrt() / TAU;
    let factor = History::Sine { amplitude: 1e-5, frequency, phase: 0.0 };
    Load {
        at: Point::Node(body.nodes().ids[node]),
        force: VectorHistory::Along { direction: Vector3::ith(axis, 1.0), factor },
        torque: VectorHistory::nothing(),
        axes: Axes::Body,
    }
}

fn selected(body: &FlexBody, scene: &Scene) -> Selection {
    select(body, &[], &LoadCases::from(scene.clone()), &Context::QUIET).expect("a selection")
}

/// Measures a body of some modes beside the whole one.
fn measured(body: &FlexBody, scene: &Scene, selection: &Selection, modes: &[usize]) -> OutputErrors {
    let (whole, _) = trace(body, scene, &Context::QUIET).expect("a motion");
    let subset = Subset { modes: Some(modes.to_vec()), groups: body.groups(), ..Subset::default() };
    let mut reduced = scene.of_modes(modes);
    reduced.run.terms = reduced.run.terms.held(selection.groups);
    let few = body.clone().subset(&subset).expect("fewer modes");
    let own = trace_at(&few, &reduced, &whole.time, &Context::QUIET).expect("a motion");
    Measure::new(body, scene, &whole).of_subset(&own, modes).largest()
}

#[test]
fn modes_have_their_loads_and_the_worth_of_one_more_or_fewer() {
    let body = soft_block(8);
    let first = TAU / body.modes().eigenvalue[0].sqrt();
    let mut scene = nothing_happens("pushed", 20.0 * first, 1e-8);
    scene.resolved = true;
    scene.loads = vec![push(&body, 0), push(&body, 3)];
    scene.requirements.tolerance.errors.deflection = 0.05;
    scene.requirements.tolerance.errors.stress = 0.05;
    let selection = selected(&body, &scene);
    let count = selection.modes.len();
    assert!(selection.holds() && (2..body.n_modes()).contains(&count), "{:?}", selection.modes);
    let reasons = selection.mode_reasons.as_ref().expect("reasons");
    let by =
        |mode: usize| reasons.excited.iter().find(|own| own.modes.contains(&mode)).map(|own| own.by.as_str());
    assert_eq!(by(0), Some(format!("the force at {}", scene.loads[0].at).as_str()));
    assert_eq!(by(3), Some(format!("the force at {}", scene.loads[1].at).as_str()));
    // Errors with one mode fewer and one more are those of such bodies.
    let (last, next) = (reasons.without_last.expect("the last"), reasons.with_next.expect("the next"));
    assert!(selection.modes.contains(&last.mode) && !selection.modes.contains(&next.mode));
    let agrees = |worth: ModeWorth, modes: &[usize]| {
        let errors = measured(&body, &scene, &selection, modes);
        let named = errors.named().into_iter().find(|(name, _)| *name == worth.output).expect("named");
        let error = named.1.expect("an error");
        assert!((error / worth.error - 1.0).abs() < 1e-3, "{worth:?}: {error:e}");
    };
    let fewer: Vec<usize> = selection.modes.iter().copied().filter(|mode| *mode != last.mode).collect();
    let mut more = selection.modes.clone();
    more.push(next.mode);
    more.sort_unstable();
    agrees(last, &fewer);
    agrees(next, &more);
    assert!(last.error > 0.05 && next.error < 0.05);
    assert_eq!(reasons.rest, Some(ErrorSource::Modes));
}

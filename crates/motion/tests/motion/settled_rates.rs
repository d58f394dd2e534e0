//! Rates that do not converge: rotation about the axis of a slender body.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{LoadCases, Scene, simulate, unsettled_rate};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::body_of;
use oracle::mesh::Mesh;

/// Returns a brick whose length along x is `ratio` times its width, with four free modes.
fn slender(ratio: f64) -> FlexBody {
    let mesh = Mesh::block(ElementKind::Hex8, [4, 1, 1], [1.0, 1.0 / ratio, 1.3 / ratio]);
    body_of(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model(), 4, BodyFrame::Principal)
}

/// Returns the scene of a free rotation through about a radian.
fn turning(tolerance: f64, duration: f64, rates: [f64; 3]) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let text = format!(
        "[run]\nduration = {duration}\noutputs = 20\ntolerance = {tolerance:e}\n[initial]\nangular_velocity = {:?}\n",
        rates.map(|rate| rate / duration)
    );
    std::fs::write(&path, text).expect("written");
    LoadCases::read_single(&path, None).expect("a scene")
}

/// Returns the rates about the axis, and the diagnostic about them.
fn rates_of(body: &FlexBody, scene: &Scene) -> (Vec<f64>, Option<Diagnostic>) {
    let recording = simulate(body, scene, &Context::QUIET).expect("a motion").0;
    let told = unsettled_rate(body, scene, &recording, &Context::QUIET).expect("a body");
    (recording.states.iter().map(|state| state.omega.x).collect(), told)
}

const RATES: [f64; 3] = [0.001, 1.0, 0.5];

/// The momentum about the axis of a slender body is 1e-10 of the whole, so that the rate about it is
/// determined by the error of the whole.
#[test]
fn the_rate_of_a_needle_that_changes_with_the_step_is_told() {
    let needle = slender(1e5);
    let (coarse, told) = rates_of(&needle, &turning(1e-6, 1.0, RATES));
    let (fine, settled) = rates_of(&needle, &turning(1e-10, 1.0, RATES));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let largest = fine.iter().fold(0.0f64, |most, rate| most.max(rate.abs()));
    assert!(apart > 0.01 * largest, "{apart:e} {largest:e}");
    let told = told.expect("a warning");
    assert_eq!(told.code(), Code::RateUnsettled);
    assert!(told.message().contains("depends on the step: at time"), "{}", told.message());
    assert!(settled.is_none(), "{settled:?}");
}

/// Asserts that rotations by the same angle about the axis, across it, and about all axes give no diagnostic.
fn assert_nothing_told(ratio: f64, tolerance: f64) {
    let body = slender(ratio);
    for rates in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.7, 0.7], RATES] {
        let (_, told) = rates_of(&body, &turning(tolerance, (ratio / 1e3).max(0.01), rates));
        assert!(told.is_none(), "{ratio} {tolerance} {rates:?}: {told:?}");
    }
}

#[test]
fn nothing_is_told_of_an_ordinary_body() {
    assert_nothing_told(100.0, 1e-6);
}

#[test]
#[ignore = "slow"]
fn nothing_is_told_of_ordinary_bodies() {
    for ratio in [1.5, 10.0, 100.0, 1000.0] {
        [1e-6, 1e-9, 1e-12].into_iter().for_each(|tolerance| assert_nothing_told(ratio, tolerance));
    }
}

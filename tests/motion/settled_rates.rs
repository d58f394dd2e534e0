//! Rates that are not settled: the axis of a needle.

use crate::support::elements::{Kind, MassRule, Material};
use crate::support::flexible::body_of;
use crate::support::mesh::Mesh;
use flexbody::base::diagnostic::Code;
use flexbody::body::flex_body::FlexBody;
use flexbody::body::invariants::BodyFrame;
use flexbody::motion::scene::{Scene, read_scene, simulate, unsettled_rate};

/// A brick of so many widths along x, with four free modes.
fn slender(ratio: f64) -> FlexBody {
    let mesh = Mesh::block(Kind::Hex8, [4, 1, 1], [1.0, 1.0 / ratio, 1.3 / ratio]);
    body_of(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model(), 4, BodyFrame::Principal)
}

/// The momentum about the axis of a needle is a part of 1e-10 of the whole, and the rate about it is what the error of the
/// whole leaves: that is told, and the same scenes of ordinary bodies are not spoken of.
#[test]
fn rates_that_change_with_the_step_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    // All turn by the same angle, in as many periods of their vibration.
    let scene = |tolerance: f64, duration: f64, rates: [f64; 3]| {
        let path = folder.path().join("scene.toml");
        let text = format!(
            "[run]\nduration = {duration}\noutputs = 20\ntolerance = {tolerance:e}\n[initial]\nangular_velocity = {:?}\n",
            rates.map(|rate| rate / duration)
        );
        std::fs::write(&path, text).expect("written");
        read_scene(&path).expect("a scene")
    };
    let rate_of = |body: &FlexBody, scene: &Scene| {
        let recording = simulate(body, scene, None, |_| ()).expect("a motion").0;
        let told = unsettled_rate(body, scene, &recording, None).expect("a body");
        (recording.states.iter().map(|state| state.omega.x).collect::<Vec<_>>(), told)
    };
    let needle = slender(1e5);
    let rates = [0.001, 1.0, 0.5];
    let (coarse, told) = rate_of(&needle, &scene(1e-6, 1.0, rates));
    let (fine, settled) = rate_of(&needle, &scene(1e-11, 1.0, rates));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let largest = fine.iter().fold(0.0f64, |most, rate| most.max(rate.abs()));
    assert!(apart > 0.01 * largest, "{apart:e} {largest:e}");
    let told = told.expect("a warning");
    assert_eq!(told.code(), Code::RateUnsettled);
    assert!(told.message().contains("is not settled: at time"), "{}", told.message());
    assert!(settled.is_none(), "{settled:?}");
    for ratio in [1.5, 10.0, 100.0, 1000.0] {
        let body = slender(ratio);
        for tolerance in [1e-6, 1e-9, 1e-12] {
            // About the axis, across it alone, and about all axes.
            for rates in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.7, 0.7], rates] {
                let (_, told) = rate_of(&body, &scene(tolerance, (ratio / 1e3).max(0.01), rates));
                assert!(told.is_none(), "{ratio} {tolerance} {rates:?}: {told:?}");
            }
        }
    }
}

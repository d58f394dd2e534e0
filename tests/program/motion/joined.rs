//! Examples that join bodies with Lagrange multipliers give the documented results.

#[allow(dead_code, clippy::duplicate_mod)] // `main` of the example is unused; each example has modules of its own
#[path = "../../../examples/pendulum.rs"]
mod pendulum;
#[allow(dead_code, clippy::duplicate_mod)] // `main` of the example is unused; each example has modules of its own
#[path = "../../../examples/slider_crank.rs"]
mod slider_crank;

/// Four times the stiffness gives a quarter of the difference between the flexible pendulum and the closed
/// form of the rigid one.
#[test]
fn the_pendulum_has_the_period_of_the_rigid_body_in_the_limit() {
    let [soft, stiff] = [1.0, 4.0].map(|factor| pendulum::swing(factor).expect("a swing"));
    let difference = |swing: &pendulum::Swing| swing.period / swing.rigid_period - 1.0;
    for swing in [&soft, &stiff] {
        assert!(swing.energy < 1e-5, "energy {:e}", swing.energy);
        assert!(swing.impulse < 1e-10, "momentum {:e}", swing.impulse);
        assert!(swing.gap < 1e-9, "gap {:e}", swing.gap);
        assert!(swing.passage.iter().all(|part| (part - 1.0).abs() < 1e-4), "{:?}", swing.passage);
    }
    let ratio = difference(&soft) / difference(&stiff);
    assert!(difference(&soft).abs() < 1e-5, "{:e}", difference(&soft));
    assert!((3.5..4.5).contains(&ratio), "{:e} {:e}", difference(&soft), difference(&stiff));
}

/// The slider-crank converges in the same way; besides the weight, the constraint forces of hinge and guide
/// change the momentum.
#[test]
fn the_slider_crank_moves_as_the_rigid_mechanism_in_the_limit() {
    let [soft, stiff] = [1.0, 4.0].map(|factor| slider_crank::run(factor, 0.06).expect("a run"));
    for run in [&soft, &stiff] {
        assert!(run.energy < 1e-4, "energy {:e}", run.energy);
        assert!(run.impulse < 1e-8, "momentum {:e}", run.impulse);
        assert!(run.gap < 1e-9, "gap {:e}", run.gap);
    }
    let [slider, speed] = [soft.slider / stiff.slider, soft.speed / stiff.speed];
    assert!(soft.slider < 1e-3 && (3.0..5.0).contains(&slider), "{:e} {:e}", soft.slider, stiff.slider);
    assert!(soft.speed < 0.03 && (1.5..3.0).contains(&speed), "{:e} {:e}", soft.speed, stiff.speed);
}

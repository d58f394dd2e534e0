//! Facts of a Craig-Bampton body: proof of its fixed-interface modes, deviation of its frequencies from those
//! of the free body, and static condensation.

use super::*;
use oracle::craig_bampton::record;

/// Largest ratio of an eigenvalue to the first truncated one for which the estimate is accurate.
const FAR_BELOW: f64 = 0.25;

/// Asserts lower <= lambda <= estimate <= theta for every mode, and that the estimate finds nearly all of
/// theta - lambda far below the cut. Returns the smallest fraction found there, and the largest ratio of the
/// bound to the exact value.
fn check_against(exact: &[f64], basis: &ModalBasis, held: &[f64], what: &str) -> [f64; 2] {
    let theta = &basis.solution.eigenvalues;
    let fixed = basis.fixed_interface.as_ref().expect("recorded");
    let free = fixed.free.as_ref().expect("estimates");
    assert_eq!(fixed.counted.map(|counted| counted >= fixed.modes), Some(true), "{what}");
    let cut = held.get(fixed.modes).copied().unwrap_or(f64::INFINITY);
    let (mut least, mut most) = (1.0f64, 1.0f64);
    for (j, theta) in theta.iter().enumerate() {
        let (lambda, estimate, lower) = (exact[j], free.estimate[j], free.lower[j]);
        // Difference between eigenvalues of dense and sparse solutions.
        let rounding = 1e-9 * theta;
        let all = format!("{what}, mode {j}: {lower:e} <= {lambda:e} <= {estimate:e} <= {theta:e}");
        assert!(lower <= lambda + rounding && lambda <= estimate + rounding && estimate <= *theta, "{all}");
        assert!(lower > 0.0 || *theta > 0.5 * cut, "{all}: no bound below {cut:e}");
        let missing = theta - lambda;
        if *theta < FAR_BELOW * cut && missing > 1e3 * rounding {
            least = least.min((theta - estimate) / missing);
            most = most.max((theta - lower) / missing);
        }
    }
    [least, most]
}

#[test]
#[ignore = "slow"]
fn estimates_and_bounds_enclose_the_frequencies_of_the_free_body() {
    let (mut least, mut most) = (1.0f64, 1.0f64);
    for raw in models() {
        let (what, oracle) = (format!("{:?}", raw.data.interfaces), Dense::new(&raw));
        let zero = if raw.dimension == 2 { 3 } else { 6 };
        let exact = oracle.eigenvalues(oracle.allowed().as_ref(), zero);
        let held = oracle.eigenvalues(oracle.held.as_ref(), 0);
        let model = model(raw);
        for count in [0, 1, 4, 10, 25, usize::MAX] {
            let found = check_against(&exact, &craig_bampton(&model, count), &held, &what);
            // With a single fixed-interface mode the bound is wide.
            let allowed = if count < 4 { 1.7 } else { 1.25 };
            assert!(found[0] > 0.95 && found[1] < allowed, "effectivity with {count} modes: {found:?}");
            (least, most) = (least.min(found[0]), most.max(found[1]));
        }
    }
    assert!(least < 1.0 && most > 1.0, "some of them miss something: {least}, {most}");
}

#[test]
#[ignore = "slow"]
fn the_frequencies_of_fixtures_are_told_as_well_as_free_modes_know_them() {
    for name in ["bracket_hex20", "connecting_rod"] {
        let manifest = oracle::root().join(format!("fixtures/models/{name}/model.toml"));
        let model = model(read_model(&read_manifest(&manifest).expect("a manifest")).expect("a model"));
        let free = converted(&model, BasisChoice::default(), 30, BodyFrame::Principal).body;
        let exact = &free.modes().eigenvalue;
        let body = body(&model, 10);
        let fixed = record(&body);
        let free = fixed.free.as_ref().expect("estimates");
        assert_eq!((fixed.modes, fixed.counted, fixed.next), (10, Some(10), None));
        let mut high = 0;
        for (j, theta) in body.modes().eigenvalue.iter().enumerate().take(exact.len()) {
            let (lambda, estimate, lower) = (exact[j], free.estimate[j], free.lower[j]);
            assert!(lower <= lambda * (1.0 + 1e-9) && lambda <= estimate * (1.0 + 1e-9), "{name}, mode {j}");
            if *theta < FAR_BELOW * fixed.shift {
                assert!(theta - estimate > 0.95 * (theta - lambda) - 1e-9 * theta, "{name}, mode {j}");
                assert!(theta - lower < 1.5 * (theta - lambda) + 1e-9 * theta, "{name}, mode {j}");
            }
            high += usize::from(theta / lambda > 1.0201);
        }
        assert!(high > 0, "{name}: 10 modes leave some frequency high");
    }
}

/// K and M of static condensation equal those of the constraint modes by definition, and the inertia of the
/// rigid body is exact.
#[test]
fn without_fixed_interface_modes_the_body_is_statically_condensed() {
    for raw in models() {
        let (what, oracle) = (format!("{:?}", raw.data.interfaces), Dense::new(&raw));
        let (d, held) = (usize::from(raw.dimension), oracle.eigenvalues(oracle.held.as_ref(), 0));
        let stiffness = oracle.held.transpose() * &oracle.k * &oracle.held;
        let loads = oracle.held.transpose() * (&oracle.k * &oracle.motion);
        let constraint = &oracle.motion - &oracle.held * stiffness.partial_piv_lu().solve(loads);
        let model = model(raw);
        let basis = craig_bampton(&model, 0);
        let coordinates = &basis.coordinates.as_ref().expect("interface coordinates").coordinates;
        assert!(fixed(&basis).is_empty() && coordinates.names.len() == oracle.motion.ncols(), "{what}");
        for (found, of) in [(&coordinates.stiffness, &oracle.k), (&coordinates.mass, &oracle.m)] {
            let expected = constraint.transpose() * of * &constraint;
            for i in 0..expected.nrows() {
                for j in 0..expected.ncols() {
                    let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
                    assert!((found[(i, j)] - expected[(i, j)]).abs() < 1e-9 * size, "{what}, ({i}, {j})");
                }
            }
        }
        let body = body(&model, 0);
        assert_eq!(body.n_modes(), oracle.motion.ncols() - if d == 2 { 3 } else { 6 });
        assert!(
            broken(&body).is_empty()
                && body.identities(BodyFrame::Principal).iter().all(|check| check.passed)
        );
        let mass = oracle.rigid.transpose() * &oracle.m * &oracle.rigid;
        close(body.invariants().mass(), mass[(0, 0)], 1e-12, &what);
        let fixed = record(&body);
        assert_eq!((fixed.modes, fixed.counted.is_some_and(|counted| counted > 0)), (0, true));
        close(fixed.next.expect("the first mode that is left out"), held[0], 1e-9, &what);
    }
}

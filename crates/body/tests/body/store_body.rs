//! Invalid parts of a flexible body are refused with all violations at once.

use flexbody_base::diagnostic::Code;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{FlexBody, Parts};
use flexbody_model::Coupling;
use oracle::file_bodies::{Random, body, parts};

fn refused(change: impl FnOnce(&mut Parts)) -> Vec<String> {
    let mut parts = parts(Random::new(3), 4, 3, 2, 2);
    change(&mut parts);
    let error = FlexBody::new(parts).expect_err("broken parts");
    assert!(error.diagnostics().iter().all(|d| d.code() == Code::BodySchema));
    error.diagnostics().iter().map(|d| d.message().to_owned()).collect()
}

#[track_caller]
fn assert_refused(change: impl FnOnce(&mut Parts), expected: &[&str]) {
    let found = refused(change);
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.contains(expected), "{found}\nlacks {expected}");
    }
}

#[test]
fn sizes_must_agree() {
    assert_refused(
        |p| {
            p.modes.residual.pop();
            p.nodes.positions.push([0.0; 3]);
            p.invariants.primary_mut().ibar[1][2].push(0.0);
            p.invariants.primary_mut().s[2][0] = faer::Mat::zeros(3, 2);
            p.invariants.primary_mut().c1 = faer::Mat::zeros(2, 3);
            p.lumped[1].invariants.primary_mut().modal_stiffness = faer::Mat::zeros(2, 2);
        },
        &[
            "`nodes.positions` has 5 values, expected 4, one per node",
            "`modes.residual` has 2 values, expected 3, one per mode",
            "`invariants.c1` is 2 x 3, expected 3 x 3",
            "`invariants.ibar[1][2]` has 4 values, expected 3, one per mode",
            "`invariants.s[2][0]` is 3 x 2, expected 3 x 3",
            ".modal_stiffness` is 2 x 2, expected 3 x 3",
        ],
    );
    assert_refused(
        |p| p.modes.shape = faer::Mat::zeros(11, 3),
        &["`modes.shape` is 11 x 3, expected 12 x 3"],
    );
}

#[test]
fn a_body_has_nodes_and_modes_and_no_more_modes_than_freedoms() {
    let without = |n: usize, nf: usize| {
        let mut p = parts(Random::new(1), n.max(1), nf.max(1), 0, 0);
        (p.modes.rotation, p.modes.internal) = (None, None);
        if n == 0 {
            p.nodes = Default::default();
            p.modes.shape = faer::Mat::zeros(0, nf);
        }
        if nf == 0 {
            p.modes.eigenvalue.clear();
        }
        FlexBody::new(p).expect_err("empty").to_string()
    };
    assert!(without(0, 1).contains("`nodes` is empty"));
    assert!(without(2, 0).contains("`modes` is empty"));
    assert!(without(1, 4).contains("4 modes of 1 nodes, expected at most 3"));
}

#[test]
fn numbers_must_be_finite_and_meaningful() {
    assert_refused(|p| p.modes.shape[(7, 1)] = f64::NAN, &["`modes.shape` has the value NaN at index 19"]);
    assert_refused(
        |p| p.invariants.primary_mut().second_moment[(0, 1)] = f64::INFINITY,
        &["second_moment` has the value inf"],
    );
    assert_refused(
        |p| p.invariants.primary_mut().ibar[0][0][0] = 1e301,
        &["`invariants.ibar[0][0]` has the value 1e301"],
    );
    assert_refused(
        |p| p.invariants.primary_mut().mass = 0.0,
        &["`invariants.mass` is 0e0, expected a positive mass"],
    );
    assert_refused(|p| p.certificate.shift = f64::NAN, &["`certificate` has the value NaN at index 0"]);
    assert_refused(|p| p.modes.damping_ratio[2] = -0.1, &["`modes.damping_ratio` is -1e-1 at mode 2"]);
    assert_refused(|p| p.lumped[0].comparison.push(("x".into(), f64::NAN)), &[" x` has the value NaN"]);
    assert_refused(
        |p| p.description.units = UnitSystem::parse("m", "kg", "1e-200").unwrap(),
        &["`units.time` is 1e-200 s, too short"],
    );
}

#[test]
fn eigenvalues_are_positive_and_ascend() {
    assert_refused(
        |p| p.modes.eigenvalue = vec![2.0, 1.0, 3.0],
        &["`modes.eigenvalue` falls from 2e0 to 1e0 at mode 1"],
    );
    assert_refused(|p| p.modes.eigenvalue[0] = 0.0, &["`modes.eigenvalue` is 0e0 at mode 0"]);
    assert_refused(|p| p.modes.eigenvalue[0] = -1.0, &["`modes.eigenvalue` is -1e0 at mode 0"]);
    let mut equal = parts(Random::new(3), 4, 3, 0, 0);
    equal.modes.eigenvalue = vec![5.0; 3];
    assert!(FlexBody::new(equal).is_ok(), "repeated eigenvalues are fine");
}

#[test]
fn axes_are_orthonormal_and_right_handed() {
    assert_refused(|p| p.frame.axes *= 1.001, &["`frame.axes` are not orthonormal: max |A'A - I| = 2.0e-3"]);
    assert_refused(|p| p.frame.axes = -p.frame.axes, &["`frame.axes` are left-handed"]);
}

#[test]
fn names_are_unique_and_can_be_stored() {
    assert_refused(|p| p.nodes.ids[3] = p.nodes.ids[1], &["twice, expected unique node numbers"]);
    assert_refused(|p| p.interfaces[0].name.clear(), &["empty name of an interface"]);
    assert_refused(|p| p.interfaces[0].nodes.clear(), &["has no nodes"]);
    assert_refused(|p| p.interfaces[1].nodes.push(4), &["names node index 4, expected indices below 4"]);
    assert_refused(
        |p| {
            p.interfaces[0].coupling = Some(Coupling::Free);
            p.interfaces[0].reference = Some([0.0; 3]);
        },
        &["is free, but has a reference point"],
    );
    assert_refused(|p| p.lumped[1].scheme = p.lumped[0].scheme.clone(), &["is given twice"]);
    assert_refused(|p| p.lumped[1].scheme = "x".repeat(1001), &["has 1001 bytes"]);
    assert_refused(|p| p.description.name.push('\0'), &["`source.name` contains a NUL character"]);
    assert_refused(|p| p.certificate.remark.push('\0'), &["`certificate.remark` contains a NUL character"]);
}

#[test]
fn loads_of_geometric_stiffness_are_those_that_a_file_can_name() {
    use flexbody_body::flex_body::LoadKind::{Force, Named, Spin};
    // The parts have geometric stiffness for a force and a spin.
    let load = |p: &mut Parts, kind, component| {
        (p.geometric_stiffness[0].load.kind, p.geometric_stiffness[0].load.component) = (kind, component);
    };
    assert_refused(|p| load(p, Spin, 6), &["has no component, interface or name"]);
    assert_refused(|p| load(p, Force(String::new()), 0), &["has no component, interface or name"]);
    assert_refused(|p| load(p, Named(String::new()), 0), &["has no component, interface or name"]);
    assert_refused(|p| load(p, Named("a\0".to_owned()), 0), &["contains a NUL character"]);
    assert_refused(|p| p.geometric_stiffness[1] = p.geometric_stiffness[0].clone(), &["is given twice"]);
    assert_refused(|p| p.geometric_stiffness[1].matrix[(0, 0)] = f64::NAN, &["has the value NaN"]);
    assert_refused(|p| p.geometric_stiffness[1].matrix = faer::Mat::zeros(2, 3), &["is 2 x 3, expected"]);
}

#[test]
fn frequencies_are_in_hertz_in_any_unit_of_time() {
    let mut p = parts(Random::new(3), 4, 1, 0, 0);
    p.modes.eigenvalue = vec![4.0 * std::f64::consts::PI.powi(2)];
    for (time, expected) in [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("0.5", 2.0)] {
        p.description.units = UnitSystem::parse("mm", "t", time).unwrap();
        let found = FlexBody::new(p.clone()).unwrap().frequencies_hz();
        assert!((found[0] / expected - 1.0).abs() < 1e-15, "{time}: {found:?}");
    }
}

#[test]
fn parts_come_back_as_they_were_given() {
    let given = parts(Random::new(8), 5, 4, 1, 1);
    let made = FlexBody::new(given.clone()).unwrap();
    assert_eq!((made.n_nodes(), made.n_modes()), (5, 4));
    assert_eq!(made.into_parts(), given);
    assert_ne!(body(8, 5, 4, 1, 1), body(9, 5, 4, 1, 1));
}

//! Lumped comparators compared with reference numbers of other programs and with their definitions.

use super::bodies::{Body, assert_agree};
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::invariants::{
    BodyFrame, Invariants, LumpedMasses, LumpedScheme, choose_frame, condense, condense_lumped,
};
use nalgebra::{Matrix3, Vector3};
use oracle::models::{self, Model, symmetric};
use oracle::nodal::{brute_force, expand};
use serde_json::Value;

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|k, _| value[k].as_f64().expect("number"))
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|k, l| value[k][l].as_f64().expect("number"))
}

/// Asserts mass, centre of mass and inertia about it; lumped values are in the frame of the consistent mass.
fn assert_rigid(what: &str, model: &Model, masses: Option<&LumpedMasses>, expected: &Value) {
    let (frame, properties) =
        choose_frame(&model.scalar_mass, &model.positions, BodyFrame::Com).expect("a body");
    let positions = frame.to_body(&model.positions);
    let none = Mat::zeros(3 * positions.len(), 0);
    let body: Invariants = match masses {
        Some(masses) => condense_lumped(masses, &positions, none.as_ref(), Mat::zeros(0, 0)),
        None => condense(&model.scalar_mass, &positions, none.as_ref(), Mat::zeros(0, 0)),
    };
    let com = body.first_moment() / body.mass();
    let inertia = body.shifted(com).inertia();
    let size = (properties.inertia.trace() / properties.mass).sqrt();
    // The references are sums over all entries about the origin of the model, without compensation.
    assert!((body.mass() / expected["mass"].as_f64().expect("mass") - 1.0).abs() < 1e-13, "{what}: mass");
    assert!((frame.origin + com - vector(&expected["com"])).amax() < 1e-12 * size, "{what}: centre of mass");
    let difference = (inertia - matrix(&expected["inertia_com"])).amax();
    assert!(difference < 1e-11 * inertia.amax(), "{what}: inertia differs by {difference:e}");
}

#[test]
fn own_models_have_the_reference_masses_of_both_schemes() {
    for model in models::own() {
        let reference = model.reference.clone();
        assert_rigid(&model.name, &model, None, &reference["rigid_body"]);
        let diagonal = LumpedMasses::diagonal_scaling(&model.scalar_mass).expect("masses");
        for masses in [LumpedMasses::row_sum(&model.scalar_mass), diagonal] {
            let expected = &reference["lumped"][masses.scheme().name()];
            let what = format!("{} {}", model.name, masses.scheme().name());
            assert_rigid(&what, &model, Some(&masses), expected);
            assert_eq!(
                masses.negative() as u64,
                expected["negative_nodal_masses"].as_u64().expect("count"),
                "{what}"
            );
        }
    }
}

#[test]
fn shared_models_have_the_reference_row_sums() {
    for model in models::shared() {
        let masses = LumpedMasses::row_sum(&model.scalar_mass);
        let reference = model.reference.clone();
        assert_rigid(&model.name, &model, None, &reference["consistent"]);
        assert_rigid(&model.name, &model, Some(&masses), &reference["rowsum_lumped"]);
        let rows = reference["rowsum_negative_rows"].as_u64().expect("count");
        assert_eq!(3 * masses.negative() as u64, rows, "{}", model.name);
    }
}

#[test]
fn lumped_invariants_are_those_of_the_diagonal_matrix() {
    let body = Body::cuboid(21, 4);
    let n = body.positions.len();
    for masses in [
        LumpedMasses::row_sum(&body.scalar_mass),
        LumpedMasses::diagonal_scaling(&body.scalar_mass).expect("masses"),
        LumpedMasses::user((0..n).map(|i| i as f64 - 3.0).collect(), n).expect("masses"),
    ] {
        let triplets: Vec<_> =
            masses.masses().iter().enumerate().map(|(i, &m)| (i as u32, i as u32, m)).collect();
        let diagonal = symmetric(n, &triplets);
        let lumped = condense_lumped(&masses, &body.positions, body.shapes.as_ref(), Mat::zeros(4, 4));
        let direct = condense(&diagonal, &body.positions, body.shapes.as_ref(), Mat::zeros(4, 4));
        assert_eq!(lumped, direct, "{}", masses.scheme().name());
        assert_agree(
            "definition",
            &brute_force(&expand(&diagonal), &body.positions, &body.shapes),
            &lumped,
            1e-13,
        );
    }
}

#[test]
fn both_schemes_keep_the_mass_and_row_sums_the_centre_of_mass() {
    let body = Body::cuboid(22, 0);
    let exact = condense(&body.scalar_mass, &body.positions, body.shapes.as_ref(), Mat::zeros(0, 0));
    let lumped = |masses| condense_lumped(&masses, &body.positions, body.shapes.as_ref(), Mat::zeros(0, 0));
    let row_sum = lumped(LumpedMasses::row_sum(&body.scalar_mass));
    let scaled = lumped(LumpedMasses::diagonal_scaling(&body.scalar_mass).expect("masses"));
    for lumped in [&row_sum, &scaled] {
        assert!((lumped.mass() / exact.mass() - 1.0).abs() < 1e-14);
    }
    assert!((row_sum.first_moment() - exact.first_moment()).amax() < 1e-15 * exact.mass());
    // Row sums of a trilinear cuboid exceed the exact moment by h^2/6 per direction and element row.
    let excess =
        row_sum.second_moment()[(0, 0)] / exact.mass() - exact.second_moment()[(0, 0)] / exact.mass();
    assert!((excess - 0.25f64.powi(2) / 6.0).abs() < 1e-15);
}

#[test]
fn negative_and_zero_masses_are_counted_apart() {
    let masses = LumpedMasses::user(vec![1.0, -1e-3, 0.0, -1e-18, 1e-9, 1e-16], 6).expect("masses");
    assert_eq!((masses.negative(), masses.zero()), (1, 3));
    assert_eq!(masses.scheme(), LumpedScheme::User);
}

#[test]
fn masses_that_cannot_be_used_are_refused() {
    for (masses, n) in [
        (vec![1.0], 2),
        (vec![1.0, f64::NAN], 2),
        (vec![1.0, f64::INFINITY], 2),
        (vec![1.0, -1.0], 2),
        (vec![f64::MAX, f64::MAX], 2),
        (vec![], 0),
    ] {
        let error = LumpedMasses::user(masses.clone(), n).expect_err("refused");
        assert!(error.has(Code::LumpedMassTable), "{masses:?}");
    }
    let no_diagonal = symmetric(2, &[(0, 1, 1.0), (1, 0, 1.0)]);
    assert!(LumpedMasses::diagonal_scaling(&no_diagonal).expect_err("refused").has(Code::MassNotPositive));
}

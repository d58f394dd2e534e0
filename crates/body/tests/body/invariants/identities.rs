//! The identities hold for exact bodies, and each of them fails for a body that violates it.

use super::bodies::{Body, orthonormalised, random_matrix};
use faer::Mat;
use flexbody_body::invariants::{
    BodyFrame, Derived, Expected, IdentityCheck, Invariants, LumpedMasses, Turning, choose_frame, condense,
    condense_lumped, derived_identities, identities,
};
use nalgebra::Vector3;
use oracle::models;
use oracle::random::Random;

const EIGENVALUES: [f64; 5] = [1.0, 2.0, 30.0, 400.0, 5e6];

fn expected() -> Expected<'static> {
    Expected {
        mass_normalised: true,
        free_surface: true,
        frame: BodyFrame::Principal,
        origin: Vector3::zeros(),
        eigenvalues: Some(&EIGENVALUES),
        eigenvalue_noise: 0.0,
        eigenvalue_rounding: 0.0,
        turning: Turning::None,
    }
}

fn diagonal() -> Mat<f64> {
    Mat::from_fn(5, 5, |p, q| if p == q { EIGENVALUES[p] } else { 0.0 })
}

/// Returns an exact body: free, mass-normalised shapes in the principal frame.
fn exact() -> Invariants {
    let body = Body::cuboid(51, 5);
    let frame = choose_frame(&body.scalar_mass, &body.positions, BodyFrame::Principal).expect("a body").0;
    let positions = frame.to_body(&body.positions);
    let shapes = orthonormalised(&body.scalar_mass, &positions, &body.shapes, true);
    condense(&body.scalar_mass, &positions, shapes.as_ref(), diagonal())
}

fn failed(checks: &[IdentityCheck]) -> Vec<&'static str> {
    checks.iter().filter(|check| !check.passed).map(|check| check.name).collect()
}

#[test]
fn exact_bodies_fulfil_every_identity() {
    let checks = identities(&exact(), &expected());
    assert_eq!(failed(&checks), [""; 0]);
    assert_eq!(checks.len(), 21);
    // Values are far below the limits: rounding only.
    assert!(checks.iter().all(|check| check.value < 1e-13), "{checks:?}");
    for (i, check) in checks.iter().enumerate() {
        assert!(checks[..i].iter().all(|other| other.name != check.name), "{} twice", check.name);
    }
    assert_eq!(failed(&derived_identities(&exact(), &exact().derived())), [""; 0]);
}

#[test]
fn real_bodies_fulfil_every_identity_in_every_frame_and_basis() {
    for model in models::own() {
        for &choice in BodyFrame::ALL {
            let frame = choose_frame(&model.scalar_mass, &model.positions, choice).expect("a body").0;
            let positions = frame.to_body(&model.positions);
            let raw = random_matrix(&mut Random(9), 3 * positions.len(), 5);
            let free = orthonormalised(&model.scalar_mass, &positions, &raw, true);
            for (free_surface, shapes) in [(true, free), (false, raw)] {
                let body = condense(&model.scalar_mass, &positions, shapes.as_ref(), diagonal());
                let expected = Expected {
                    mass_normalised: free_surface,
                    free_surface,
                    frame: choice,
                    origin: frame.origin,
                    ..expected()
                };
                assert_eq!(
                    failed(&identities(&body, &expected)),
                    [""; 0],
                    "{} {}",
                    model.name,
                    choice.name()
                );
            }
        }
    }
}

#[test]
fn identities_without_claims_hold_after_any_change_of_frame_and_basis() {
    let mut random = Random(52);
    let none = Expected {
        mass_normalised: false,
        free_surface: false,
        frame: BodyFrame::Model,
        eigenvalues: None,
        ..expected()
    };
    for _ in 0..10 {
        let moved = exact().shifted(Vector3::from(random.vector::<3>()) * 3.0).rotated(&random.rotation());
        let changed = moved.with_basis(random_matrix(&mut random, 5, 4).as_ref());
        assert_eq!(failed(&identities(&changed, &none)), [""; 0]);
    }
    let rigid = exact().with_basis(Mat::zeros(5, 0).as_ref());
    assert_eq!(failed(&identities(&rigid, &none)), [""; 0]);
}

#[test]
fn each_identity_fails_for_a_body_that_breaks_it() {
    type Damage = (&'static str, fn(&mut Invariants));
    let damages: &[Damage] = &[
        ("finite", |b| b.primary_mut().modal_stiffness[(0, 1)] = f64::NAN),
        ("mass_positive", |b| b.primary_mut().mass = -b.mass()),
        ("mass_positive", |b| b.primary_mut().mass = f64::NAN),
        ("second_moment_symmetric", |b| {
            b.primary_mut().second_moment[(0, 1)] += 1e-9 * b.second_moment().trace()
        }),
        ("second_moment_psd", |b| b.primary_mut().second_moment[(1, 1)] = -1e-6 * b.second_moment().trace()),
        ("second_moment_psd", |b| {
            b.primary_mut().first_moment.x = 2.0 * (b.mass() * b.second_moment().trace()).sqrt()
        }),
        ("inertia_triangle", |b| b.primary_mut().second_moment[(1, 1)] = -1e-6 * b.second_moment().trace()),
        ("s_transposed", |b| b.primary_mut().s[0][1][(2, 3)] += 1e-9),
        ("s_psd", |b| {
            let s = &mut b.primary_mut().s;
            (s[2][2][(1, 1)], s[0][0][(1, 1)]) = (-1e-3, s[0][0][(1, 1)] + s[2][2][(1, 1)] + 1e-3)
        }),
        ("s_bounded", |b| b.primary_mut().s[0][1][(0, 0)] = 1.1),
        ("ibar_bounded", |b| b.primary_mut().ibar[2][2][3] = 1.1 * b.second_moment()[(2, 2)].sqrt()),
        ("c1_bounded", |b| b.primary_mut().c1[(1, 2)] = -1.1 * b.mass().sqrt()),
        ("w3_skew", |b| b.primary_mut().s[1][2][(2, 2)] += 1e-9),
        ("w3_bounded", |b| b.primary_mut().s[1][2][(0, 1)] += 1.5),
        ("scalar_gram_psd", |b| {
            // Each bound holds, but not all together: x and psi_1 are parallel, 1 and psi_1 are not
            // orthogonal.
            b.primary_mut().ibar[0][0][0] = 0.9 * b.second_moment()[(0, 0)].sqrt();
            b.primary_mut().c1[(0, 0)] = 0.9 * b.mass().sqrt();
        }),
        ("motion_gram_psd", |b| b.primary_mut().ibar[1][2][0] += 1.5 * b.inertia()[(0, 0)].sqrt()),
        ("modal_mass_identity", |b| b.primary_mut().s[1][1][(2, 2)] += 1e-8),
        ("c1_zero", |b| b.primary_mut().c1[(2, 4)] = 1e-8 * b.mass().sqrt()),
        ("c2_zero", |b| b.primary_mut().ibar[0][1][4] += 1e-8 * b.second_moment().trace().sqrt()),
        ("ibar_symmetric", |b| b.primary_mut().ibar[0][1][4] += 1e-8 * b.second_moment().trace().sqrt()),
        ("modal_stiffness_diagonal", |b| b.primary_mut().modal_stiffness[(1, 1)] *= 1.0 + 1e-8),
        ("modal_stiffness_diagonal", |b| b.primary_mut().modal_stiffness[(0, 4)] = 1.0),
        ("first_moment_zero", |b| {
            b.primary_mut().first_moment.z = 1e-10 * (b.mass() * b.second_moment().trace()).sqrt()
        }),
        ("inertia_diagonal", |b| {
            b.primary_mut().second_moment[(0, 1)] += 1e-8 * b.second_moment().trace();
            b.primary_mut().second_moment[(1, 0)] += 1e-8 * b.second_moment().trace();
        }),
    ];
    for (name, damage) in damages {
        let mut body = exact();
        damage(&mut body);
        let checks = identities(&body, &expected());
        assert!(failed(&checks).contains(name), "{name} passes: {checks:?}");
    }
    for check in identities(&exact(), &expected()) {
        assert!(damages.iter().any(|(name, _)| *name == check.name), "{} is not tested", check.name);
    }
}

#[test]
fn each_stored_invariant_is_checked_against_its_source() {
    type Damage = (&'static str, fn(&mut Derived));
    let damages: &[Damage] = &[
        ("i0_of_j", |d| d.inertia[(0, 0)] *= 1.0 + 1e-9),
        ("c2_of_ibar", |d| d.c2[(2, 1)] += 1e-9),
        ("w1_of_ibar", |d| d.w1.as_mut().expect("held")[(1, 7)] += 1e-9),
        ("w2_of_s", |d| d.w2.as_mut().expect("held")[(14, 3)] -= 1e-9),
        ("w2_of_s", |d| d.w2 = Some(Mat::zeros(3, 3))),
        ("w3_of_s", |d| d.w3.as_mut().expect("held")[(14, 3)] -= 1e-9),
        ("w3_of_w2", |d| d.w2.as_mut().expect("held")[(5, 10)] += 1e-9),
        ("w3_of_w2", |d| d.w2 = Some(Mat::new())),
        ("w3_of_w2", |d| d.w3 = d.w3.as_ref().map(|w3| w3.transpose().to_owned())),
        ("modal_mass_of_s", |d| d.modal_mass[(0, 0)] = f64::NAN),
    ];
    for (name, damage) in damages {
        let mut derived = exact().derived();
        damage(&mut derived);
        assert!(failed(&derived_identities(&exact(), &derived)).contains(name), "{name} passes");
    }
    // Mode-blocked instead of component-blocked: a common mistake.
    let mut derived = exact().derived();
    let w1 = exact().w1().expect("held");
    derived.w1 = Some(Mat::from_fn(3, 15, |k, column| w1[(k, (column % 3) * 5 + column / 3)]));
    assert_eq!(failed(&derived_identities(&exact(), &derived)), ["w1_of_ibar"]);
}

#[test]
fn lumped_masses_break_the_identities_that_exactness_means() {
    let body = Body::cuboid(51, 5);
    let frame = choose_frame(&body.scalar_mass, &body.positions, BodyFrame::Principal).expect("a body").0;
    let positions = frame.to_body(&body.positions);
    let shapes = orthonormalised(&body.scalar_mass, &positions, &body.shapes, true);
    let masses = LumpedMasses::row_sum(&body.scalar_mass);
    let lumped = condense_lumped(&masses, &positions, shapes.as_ref(), diagonal());
    let failed = failed(&identities(&lumped, &expected()));
    for name in ["modal_mass_identity", "c2_zero", "ibar_symmetric"] {
        assert!(failed.contains(&name), "{name}");
    }
    assert!(!failed.contains(&"scalar_gram_psd") && !failed.contains(&"first_moment_zero"));
}

#[test]
fn a_distant_frame_may_miss_the_centre_of_mass_by_its_rounding_only() {
    let mut body = exact();
    body.primary_mut().first_moment.x = 1e-10 * (body.mass() * body.second_moment().trace()).sqrt();
    let far = Expected { origin: Vector3::new(1e6, 0.0, 0.0), ..expected() };
    assert_eq!(failed(&identities(&body, &far)), [""; 0]);
    assert_eq!(failed(&identities(&body, &expected())), ["first_moment_zero"]);
}

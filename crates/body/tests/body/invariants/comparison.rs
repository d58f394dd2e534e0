//! Error norms of lumped invariants: correct scale and order, and no hidden errors.

use super::bodies::{Body, orthonormalised, stiffness};
use faer::Mat;
use flexbody_body::invariants::{
    CauchySchwarz, ERROR_NORMS, Invariants, LumpedMasses, condense, condense_lumped, error_norms,
};
use nalgebra::Matrix3;
use oracle::cuboid::Cuboid;

fn norm(table: &[(String, f64)], name: &str) -> f64 {
    table.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}")).1
}

/// Returns a cuboid about its centre with free, mass-normalised shapes.
fn free_body(cells: [usize; 3], modes: usize) -> (Body, Invariants) {
    let size = [1.0, 0.4, 0.2];
    let cuboid = Cuboid { cells, low: size.map(|s| -0.5 * s), size, density: 2.0 };
    let (scalar_mass, positions) = (cuboid.scalar_mass(), cuboid.positions());
    let shapes = Mat::from_fn(3 * positions.len(), modes, |row, p| {
        let x = positions[row / 3];
        (1.0 + p as f64 + 2.0 * x[row % 3]).powi(2) * x[p % 3] + (3.0 * x[(row + 1) % 3] + p as f64).cos()
    });
    let shapes = orthonormalised(&scalar_mass, &positions, &shapes, true);
    let exact = condense(&scalar_mass, &positions, shapes.as_ref(), stiffness(modes));
    (Body::new(scalar_mass, positions, shapes), exact)
}

#[test]
fn nothing_differs_from_itself() {
    for modes in [0, 1, 4] {
        let body = Body::cuboid(41, modes);
        let exact = condense(&body.scalar_mass, &body.positions, body.shapes.as_ref(), stiffness(modes));
        let table = error_norms(&exact, &exact);
        assert!(table.iter().map(|(name, _)| name.as_str()).eq(ERROR_NORMS.iter().map(|(name, _)| *name)));
        assert!(table.iter().all(|(_, value)| *value == 0.0), "{table:?}");
    }
}

#[test]
fn norms_are_those_of_a_known_error() {
    let (_, exact) = free_body([4, 3, 3], 3);
    let mut other = exact.clone();
    // J grows by a factor: I0 grows by that factor, and nothing else changes.
    other.primary_mut().second_moment *= 1.25;
    let table = error_norms(&exact, &other);
    for name in ["I0_frobenius", "I0_spectral", "I0_max"] {
        assert!((norm(&table, name) - 0.25).abs() < 1e-14, "{name}");
    }
    assert!(table.iter().filter(|(name, _)| !name.starts_with("I0")).all(|(_, value)| *value == 0.0));

    // All modal products grow by 21 %.
    let other = exact.with_basis((Mat::<f64>::identity(3, 3) * faer::Scale(1.1)).as_ref());
    let table = error_norms(&exact, &other);
    for name in
        ["modal_mass_frobenius", "modal_mass_spectral", "modal_mass_max", "W2_frobenius", "W2_spectral"]
    {
        assert!((norm(&table, name) - 0.21).abs() < 1e-13, "{name}");
    }
    // W3 is relative to its bound 1 if it is smaller.
    let size = exact.w3().expect("held").norm_l2();
    assert!(size > 0.1 && size < 1.0, "{size}");
    assert!((norm(&table, "W3_frobenius") - 0.21 * size).abs() < 1e-13);
    let (_, exact) = free_body([4, 3, 3], 8);
    assert!(exact.w3().expect("held").norm_l2() > 1.0);
    let other = exact.with_basis((Mat::<f64>::identity(8, 8) * faer::Scale(1.1)).as_ref());
    assert!((norm(&error_norms(&exact, &other), "W3_frobenius") - 0.21).abs() < 1e-13);

    // The centre of mass moves by 1 % of the radius of gyration.
    let radius = (exact.second_moment().trace() / exact.mass()).sqrt();
    let mut other = exact.clone();
    other.primary_mut().first_moment.y += 0.01 * radius * exact.mass();
    assert!((norm(&error_norms(&exact, &other), "com_shift") - 0.01).abs() < 1e-10);
    let mut other = exact.clone();
    other.primary_mut().mass *= 0.9;
    assert!((norm(&error_norms(&exact, &other), "mass") - 0.1).abs() < 1e-14);
}

#[test]
fn lost_free_surface_conditions_are_relative_to_their_bounds() {
    let (_, exact) = free_body([4, 3, 3], 2);
    assert!(exact.c1().norm_l2() < 1e-14);
    let mut other = exact.clone();
    other.primary_mut().c1[(1, 0)] += 1e-3 * exact.mass().sqrt();
    let table = error_norms(&exact, &other);
    for name in ["C1_frobenius", "C1_spectral", "C1_max"] {
        assert!((norm(&table, name) - 1e-3).abs() < 1e-12, "{name}");
    }
    let mut other = exact.clone();
    // C2_z = Ibar_xy - Ibar_yx; z has the largest moment of this body.
    other.primary_mut().ibar[0][1][1] += 1e-3 * exact.inertia()[(2, 2)].sqrt();
    let table = error_norms(&exact, &other);
    for name in ["C2_frobenius", "C2_spectral", "C2_max"] {
        assert!((norm(&table, name) - 1e-3).abs() < 1e-12, "{name}");
    }
}

#[test]
fn an_error_about_a_slender_axis_shows_entry_by_entry() {
    let (_, mut exact) = free_body([4, 3, 3], 0);
    exact.primary_mut().second_moment = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1e-4, 1e-4));
    let mut other = exact.clone();
    other.primary_mut().second_moment[(1, 1)] = 2e-4;
    let table = error_norms(&exact, &other);
    assert!(norm(&table, "I0_frobenius") < 1e-3);
    assert!((norm(&table, "I0_max") - 0.5).abs() < 1e-12, "I0_xx grows from 2e-4 to 3e-4");
}

#[test]
fn norms_do_not_depend_on_units_or_axes() {
    let (body, exact) = free_body([3, 2, 2], 4);
    let lumped = LumpedMasses::diagonal_scaling(&body.scalar_mass).expect("masses");
    let other = condense_lumped(&lumped, &body.positions, body.shapes.as_ref(), stiffness(4));
    let axes = oracle::random::Random(4).rotation();
    let table = error_norms(&exact, &other);
    for (name, value) in error_norms(&exact.rotated(&axes), &other.rotated(&axes)) {
        // Entry norms depend on the axes; the W matrices change by an orthogonal factor only.
        if !name.ends_with("max") {
            assert!((value - norm(&table, &name)).abs() < 1e-12 * (1.0 + value), "{name}");
        }
    }
    assert!(
        norm(&table, "W1_frobenius") > 1e-3 && norm(&table, "W2_spectral") > 1e-2,
        "coarse meshes show errors"
    );
}

#[test]
fn row_sum_errors_of_linear_elements_fall_with_the_square_of_the_mesh_width() {
    let error = |cells: [usize; 3], name: &str| {
        let (body, exact) = free_body(cells, 4);
        let masses = LumpedMasses::row_sum(&body.scalar_mass);
        let lumped = condense_lumped(&masses, &body.positions, body.shapes.as_ref(), stiffness(4));
        norm(&error_norms(&exact, &lumped), name)
    };
    for name in ["I0_frobenius", "W1_frobenius", "W2_frobenius", "W3_frobenius", "modal_mass_spectral"] {
        let (coarse, fine) = (error([8, 6, 4], name), error([16, 12, 8], name));
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() < 0.15, "{name}: order {order}, {coarse:e} {fine:e}");
    }
}

#[test]
fn bounds_hold_and_are_reached() {
    let body = Body::cuboid(44, 5);
    // One mode is a stretch along x: Ibar_xx = sqrt(J_xx) |psi| exactly.
    let mut shapes = body.shapes.clone();
    for (i, x) in body.positions.iter().enumerate() {
        for k in 0..3 {
            shapes[(3 * i + k, 2)] = if k == 0 { x[0] } else { 0.0 };
        }
    }
    let invariants = condense(&body.scalar_mass, &body.positions, shapes.as_ref(), stiffness(5));
    let bound = CauchySchwarz::of(&invariants);
    let (w1, w2, w3, c2, inertia) = (
        invariants.w1().expect("held"),
        invariants.w2().expect("held"),
        invariants.w3().expect("held"),
        invariants.c2(),
        invariants.inertia(),
    );
    let within = |value: f64, bound: f64| assert!(value.abs() <= bound * (1.0 + 1e-14), "{value} > {bound}");
    for k in 0..3 {
        within(invariants.first_moment()[k], bound.first_moment(k));
        for l in 0..3 {
            within(invariants.second_moment()[(k, l)], bound.second_moment(k, l));
            within(inertia[(k, l)], bound.inertia(k, l));
            for p in 0..5 {
                within(invariants.ibar().unwrap()[k][l][p], bound.ibar(k, p));
                within(w1[(k, 5 * l + p)], bound.w1(k, l, p));
                within(invariants.c1()[(k, p)], bound.c1(p));
                within(c2[(k, p)], bound.c2(k, p));
                for q in 0..5 {
                    within(invariants.s().unwrap()[k][l][(p, q)], bound.s(p, q));
                    within(w2[(5 * k + p, 5 * l + q)], bound.s(p, q));
                    within(w3[(5 * k + p, q)], bound.s(p, q));
                }
            }
        }
    }
    assert!((invariants.ibar().unwrap()[0][0][2] / bound.ibar(0, 2) - 1.0).abs() < 1e-14);
}

#[test]
fn a_number_that_is_not_finite_is_not_hidden() {
    let (_, exact) = free_body([2, 2, 2], 2);
    let mut other = exact.clone();
    other.primary_mut().ibar[1][1][0] = f64::NAN;
    let table = error_norms(&exact, &other);
    for name in ["W1_frobenius", "W1_spectral", "W1_max"] {
        assert!(norm(&table, name).is_nan(), "{name}");
    }
    assert_eq!(norm(&table, "W2_max"), 0.0);
}

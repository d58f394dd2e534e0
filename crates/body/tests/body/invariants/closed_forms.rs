//! Bodies with known closed forms of the inertia data.

use super::bodies::stiffness;
use faer::Mat;
use flexbody_body::invariants::{BodyFrame, choose_frame, condense};
use nalgebra::{Matrix3, Vector3};
use oracle::cuboid::Cuboid;

#[test]
fn inertia_of_a_cuboid_is_exact_for_any_mesh() {
    for cells in [[1, 1, 1], [5, 3, 2], [12, 10, 9]] {
        let body = Cuboid { cells, low: [2.0, -1.0, 0.25], size: [0.4, 1.0, 0.2], density: 7850.0 };
        let (mass, positions) = (body.scalar_mass(), body.positions());
        let (frame, properties) = choose_frame(&mass, &positions, BodyFrame::Principal).expect("a body");
        let m = body.mass();
        let [a, b, c] = body.size;
        // Ascending: about y, about x, about z.
        let moments = [a * a + c * c, b * b + c * c, a * a + b * b].map(|sum| m * sum / 12.0);
        assert!((properties.mass / m - 1.0).abs() < 1e-14);
        assert!((properties.centre_of_mass - Vector3::new(2.2, -0.5, 0.35)).amax() < 1e-15);
        for (found, exact) in properties.principal_moments.iter().zip(moments) {
            assert!((found / exact - 1.0).abs() < 1e-14, "{found} instead of {exact} for {cells:?}");
        }
        let body_axes = Matrix3::new(0., 1., 0., 1., 0., 0., 0., 0., -1.);
        assert_eq!(frame.axes, body_axes, "model axes, sorted by moment, right-handed");

        let none = Mat::<f64>::zeros(3 * positions.len(), 0);
        let invariants = condense(&mass, &frame.to_body(&positions), none.as_ref(), Mat::zeros(0, 0));
        let inertia = invariants.inertia();
        assert!((inertia - Matrix3::from_diagonal(&Vector3::from(moments))).amax() < 1e-14 * moments[2]);
        assert!(invariants.first_moment().amax() < 1e-15 * m);
        assert_eq!(
            (invariants.n_modes(), invariants.w2().expect("held").nrows(), invariants.c2().ncols()),
            (0, 0, 0)
        );
    }
}

#[test]
fn homogeneous_strains_of_a_cuboid_follow_from_its_second_moments() {
    // Mode (a, b): u = e_a x_b, exact in trilinear elements. Ibar_kl = d_la J_kb, S_kl = d_ka d_lc J_bd.
    let size = [0.9, 0.5, 0.3];
    let body = Cuboid { cells: [4, 5, 3], low: size.map(|s| -0.5 * s), size, density: 3.0 };
    let positions = body.positions();
    let shapes =
        Mat::from_fn(
            3 * positions.len(),
            9,
            |row, p| {
                if row % 3 == p / 3 { positions[row / 3][p % 3] } else { 0.0 }
            },
        );
    let invariants = condense(&body.scalar_mass(), &positions, shapes.as_ref(), stiffness(9));
    let j = size.map(|s| body.mass() * s * s / 12.0);
    let kronecker = |a: usize, b: usize| if a == b { 1.0 } else { 0.0 };
    let near = |value: f64, exact: f64| (value - exact).abs() < 1e-15;
    for p in 0..9 {
        let (a, b) = (p / 3, p % 3);
        for k in 0..3 {
            assert!(near(invariants.c1()[(k, p)], 0.0));
            for l in 0..3 {
                assert!(
                    near(invariants.ibar().unwrap()[k][l][p], kronecker(l, a) * kronecker(k, b) * j[b]),
                    "Ibar {k}{l},{p}"
                );
                for q in 0..9 {
                    let (c, d) = (q / 3, q % 3);
                    let exact = kronecker(k, a) * kronecker(l, c) * kronecker(b, d) * j[b];
                    assert!(near(invariants.s().unwrap()[k][l][(p, q)], exact), "S {k}{l},{p}{q}");
                }
            }
        }
    }
    // The rotation e_z x r is the difference of the modes (y, x) and (x, y): its C2 is a column of I0.
    let c2 = invariants.c2();
    assert!(near(c2[(2, 3)] - c2[(2, 1)], invariants.inertia()[(2, 2)]));
    // A stretch by q along x changes I(q) to the inertia of the stretched cuboid: (1 + q)^2 J_xx.
    let (w1, w2, q) = (invariants.w1().expect("held"), invariants.w2().expect("held"), 0.3);
    let moment = invariants.inertia()[(1, 1)] + w1[(1, 9)] * q + w2[(9, 9)] * q * q;
    assert!(near(moment, (1.0 + q) * (1.0 + q) * j[0] + j[2]));
    assert_eq!(invariants.modal_stiffness(), &stiffness(9));
}

#[test]
fn layout_is_component_blocked() {
    // Point masses in a frame of their own: all invariants can be written down.
    let mass = oracle::models::symmetric(2, &[(0, 0, 2.0), (1, 1, 3.0)]);
    let positions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut shapes = Mat::zeros(6, 2);
    (shapes[(0, 0)], shapes[(1, 0)], shapes[(5, 1)], shapes[(1, 1)]) = (1.0, 2.0, 5.0, 7.0);
    let body = condense(&mass, &positions, shapes.as_ref(), stiffness(2));
    let matrix = |rows: &[&[f64]]| Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]);
    assert_eq!(body.c1(), &matrix(&[&[2.0, 0.0], &[4.0, 14.0], &[0.0, 15.0]]));
    assert_eq!(body.ibar().unwrap()[0][0], [2.0, 0.0]);
    assert_eq!(body.ibar().unwrap()[0][1], [4.0, 14.0]);
    assert_eq!(body.ibar().unwrap()[1][2], [0.0, 15.0]);
    assert_eq!(body.s().unwrap()[0][1], matrix(&[&[4.0, 14.0], &[0.0, 0.0]]));
    assert_eq!(body.inertia(), Matrix3::from_diagonal(&Vector3::new(3.0, 2.0, 5.0)));
    assert_eq!(body.c2(), matrix(&[&[0.0, 15.0], &[0.0, 0.0], &[4.0, 14.0]]));
    assert_eq!(
        body.w1().expect("held"),
        matrix(&[
            &[0.0, 0.0, -4.0, -14.0, 0.0, 0.0],
            &[-4.0, -14.0, 4.0, 0.0, 0.0, -15.0],
            &[0.0, 0.0, 0.0, -15.0, 4.0, 0.0],
        ])
    );
    let (w2, w3) = (body.w2().expect("held"), body.w3().expect("held"));
    // Block (1, 1) = S22 + S33, block (1, 2) = -S21, W3 block 3 = S12 - S21.
    assert_eq!((w2[(0, 0)], w2[(0, 1)], w2[(1, 1)]), (8.0, 28.0, 98.0 + 75.0));
    assert_eq!((w2[(0, 2)], w2[(0, 3)], w2[(1, 2)], w2[(1, 3)]), (-4.0, 0.0, -14.0, 0.0));
    assert_eq!((w3[(4, 0)], w3[(4, 1)], w3[(5, 0)], w3[(5, 1)]), (0.0, 14.0, -14.0, 0.0));
    assert_eq!(body.modal_mass(), matrix(&[&[10.0, 28.0], &[28.0, 98.0 + 75.0]]));
    assert_eq!(body.derived().w2, Some(w2));
}

//! Condensation compared with the definitions, evaluated with twice the digits on the 3n x 3n mass matrix.

use super::bodies::{Body, assert_agree, orthonormalised, random_matrix, smooth_shapes};
use faer::Mat;
use flexbody_body::invariants::{BodyFrame, LumpedMasses, choose_frame, condense, condense_lumped};
use oracle::models;
use oracle::nodal::brute_force;
use oracle::random::Random;

/// Largest difference of independent evaluations, relative to the Cauchy-Schwarz bound of each entry.
const LIMIT: f64 = 1e-13;

#[test]
fn synthetic_bodies_agree_with_the_definitions() {
    for (what, body) in [
        ("cuboid", Body::cuboid(1, 5)),
        ("no structure", Body::random(2, 40, 13)),
        ("one node", Body::random(3, 1, 2)),
        ("no mode", Body::random(4, 25, 0)),
        ("one mode", Body::random(5, 25, 1)),
    ] {
        let nf = body.shapes.ncols();
        let exact = brute_force(&body.mass, &body.positions, &body.shapes);
        let condensed =
            condense(&body.scalar_mass, &body.positions, body.shapes.as_ref(), Mat::zeros(nf, nf));
        assert_agree(what, &exact, &condensed, LIMIT);
    }
}

#[test]
fn real_bodies_agree_with_the_definitions() {
    for model in models::own() {
        let (frame, _) =
            choose_frame(&model.scalar_mass, &model.positions, BodyFrame::Principal).expect("a body");
        let positions = frame.to_body(&model.positions);
        let mut random = Random(11);
        let smooth = smooth_shapes(&mut random, &positions, 3);
        let free = orthonormalised(&model.scalar_mass, &positions, &smooth, true);
        for (kind, shapes) in [("free", free), ("random", random_matrix(&mut random, 3 * positions.len(), 2))]
        {
            let nf = shapes.ncols();
            let exact = brute_force(&model.mass, &positions, &shapes);
            let condensed = condense(&model.scalar_mass, &positions, shapes.as_ref(), Mat::zeros(nf, nf));
            assert_agree(&format!("{} {kind}", model.name), &exact, &condensed, LIMIT);
        }
    }
}

#[test]
fn sums_do_not_lose_digits_with_the_number_of_nodes() {
    // Half a million nodes of mass 0.1: naive summation would have an error of 1e-11.
    let n = 500_000;
    let masses = LumpedMasses::user(vec![0.1; n], n).expect("masses");
    let shapes = Mat::from_fn(3 * n, 1, |_, _| 0.1);
    let body = condense_lumped(&masses, &vec![[0.1; 3]; n], shapes.as_ref(), Mat::zeros(1, 1));
    for (value, exact) in [
        (body.mass(), 5e4),
        (body.first_moment().y, 5e3),
        (body.second_moment()[(0, 2)], 5e2),
        (body.c1()[(1, 0)], 5e3),
        (body.ibar().unwrap()[2][0][0], 5e2),
        (body.s().unwrap()[1][1][(0, 0)], 5e2),
    ] {
        assert!((value / exact - 1.0).abs() < 1e-14, "{value} instead of {exact}");
    }
}

#[test]
fn symmetries_are_exact_and_results_independent_of_the_number_of_threads() {
    let body =
        oracle::cuboid::Cuboid { cells: [13, 12, 11], low: [0.0; 3], size: [1.3, 1.2, 1.1], density: 1.0 };
    let (mass, positions) = (body.scalar_mass(), body.positions());
    let shapes = random_matrix(&mut Random(7), 3 * positions.len(), 23);
    let condensed = || condense(&mass, &positions, shapes.as_ref(), Mat::zeros(23, 23));
    let with_threads = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(condensed)
    };
    let one = with_threads(1);
    for threads in [2, 3, 5] {
        assert_eq!(one, with_threads(threads), "{threads} threads");
    }
    for k in 0..3 {
        for l in 0..3 {
            assert_eq!(one.second_moment()[(k, l)], one.second_moment()[(l, k)]);
            assert_eq!(one.s().unwrap()[k][l].transpose().to_owned(), one.s().unwrap()[l][k]);
        }
    }
}

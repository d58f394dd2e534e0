//! Acceptance test: generalised inertia forces from the invariants equal the sums of M times the nodal
//! accelerations, for random motions of bodies with random and smooth shapes, in any basis and any frame.

use super::bodies::{Body, orthonormalised, random_matrix, smooth_shapes};
use faer::Mat;
use flexbody_body::invariants::{BodyFrame, choose_frame, condense};
use oracle::equations::Coriolis;
use oracle::models::{self, Model};
use oracle::nodal::{deviation, inertia_forces, random_state, reduced};
use oracle::random::Random;

/// Returns the deviation of the reduced forces and, for comparison, of the forces with the misprinted
/// Coriolis terms.
fn deviations(body: &Body, random: &mut Random, displacement: f64) -> (f64, f64) {
    let nf = body.shapes.ncols();
    let invariants = condense(&body.scalar_mass, &body.positions, body.shapes.as_ref(), Mat::zeros(nf, nf));
    let reduced = reduced(&invariants);
    let (state, accelerations) = random_state(random, nf, displacement);
    let nodal = inertia_forces(&body.mass, &body.positions, &body.shapes, &state, &accelerations);
    let printed =
        reduced.mass_matrix(&state) * &accelerations + reduced.velocity_terms(&state, Coriolis::Printed);
    (deviation(&nodal, &reduced.inertia_forces(&state, &accelerations)), deviation(&nodal, &printed))
}

#[test]
fn reduced_forces_are_the_nodal_forces_of_synthetic_bodies() {
    for seed in 0..20 {
        let mut random = Random(100 + seed);
        for body in [Body::cuboid(seed, 6), Body::random(seed, 30, 8), Body::random(seed, 12, 0)] {
            let (exact, _) = deviations(&body, &mut random, 0.5);
            assert!(exact < 1e-13, "seed {seed}: {exact:e}");
        }
    }
}

#[test]
fn misprinted_coriolis_terms_are_seen() {
    let (exact, printed) = deviations(&Body::cuboid(3, 6), &mut Random(5), 0.5);
    assert!(exact < 1e-13 && printed > 1e-3, "{exact:e} {printed:e}");
}

fn check_model(model: Model) {
    let mut random = Random(42);
    for &choice in BodyFrame::ALL {
        let (frame, properties) = choose_frame(&model.scalar_mass, &model.positions, choice).expect("a body");
        let positions = frame.to_body(&model.positions);
        let smooth = smooth_shapes(&mut random, &positions, 6);
        let size = (properties.inertia.trace() / properties.mass).sqrt();
        let orthonormal = orthonormalised(&model.scalar_mass, &positions, &smooth, false);
        let noise = random_matrix(&mut random, 3 * positions.len(), 4);
        // Displacements of a third of the size of the body, without linearisation.
        for (kind, shapes, displacement) in [
            ("smooth", smooth, 0.3 * size),
            ("orthonormal", orthonormal, 0.3 * size * properties.mass.sqrt()),
            ("random", noise, 0.3 * size),
        ] {
            let body = Body {
                scalar_mass: model.scalar_mass.clone(),
                mass: model.mass.clone(),
                positions: positions.clone(),
                shapes,
            };
            let (exact, printed) = deviations(&body, &mut random, displacement);
            let what = format!("{} {} {kind}", model.name, choice.name());
            assert!(exact < 1e-12, "{what}: {exact:e}");
            assert!(printed > 1e-4, "{what}: the misprinted terms should differ, {printed:e}");
        }
    }
}

#[test]
fn reduced_forces_are_the_nodal_forces_of_real_bodies() {
    models::own().into_iter().for_each(check_model);
}

#[test]
fn reduced_forces_are_the_nodal_forces_of_shared_real_bodies() {
    models::shared().into_iter().for_each(check_model);
}

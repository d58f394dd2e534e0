//! Real bodies with their own modes: norms of the invariants computed independently by another program.

use super::bodies::orthonormalised;
use faer::Mat;
use flexbody_body::invariants::{
    BodyFrame, Expected, Invariants, LumpedMasses, Turning, choose_frame, condense, condense_lumped,
    identities,
};
use flexbody_eigen::{EigenProblem, EigenSettings, Wanted, solve};
use flexbody_linalg::Pencil;
use flexbody_linalg::context::Context;
use flexbody_model::rigid_fields;
use oracle::models::{self, Model};

/// Shapes, modal stiffness and eigenvalues in the frame of the positions.
struct Modes {
    shapes: Mat<f64>,
    stiffness: Mat<f64>,
    eigenvalues: Vec<f64>,
}

fn modes(model: &Model, positions: &[[f64; 3]], count: usize) -> Modes {
    let stiffness = model.stiffness();
    let pencil = Pencil::new(&stiffness, &model.scalar_mass, 3);
    let rigid = rigid_fields(positions, 3, [0.0; 3], 1.0);
    let rigid = orthonormalised(&model.scalar_mass, positions, &rigid, false);
    // CalculiX writes 14 digits.
    let first_estimate = 2.0 * model.reference["flexible_eigenvalues"][0].as_f64().expect("number");
    let problem =
        EigenProblem { pencil, rigid: rigid.as_ref(), first_estimate, input_error: 0.5e-13, order: None };
    let settings = EigenSettings { wanted: Wanted::Lowest(count), ..EigenSettings::default() };
    let solution = solve(&problem, &settings, &Context::QUIET).expect("modes");
    let product = pencil.apply_stiffness(solution.vectors.as_ref());
    Modes {
        stiffness: solution.vectors.transpose() * product,
        shapes: solution.vectors,
        eigenvalues: solution.eigenvalues,
    }
}

/// Asserts the Frobenius norms of the reference; C1 and C2 relative to their Cauchy-Schwarz bounds.
fn assert_norms(what: &str, body: &Invariants, reference: &serde_json::Value) {
    let derived = body.derived();
    let [w1, w2, w3] = [&derived.w1, &derived.w2, &derived.w3].map(|group| group.as_ref().expect("held"));
    let inertia = Mat::from_fn(3, 3, |k, l| derived.inertia[(k, l)]);
    let rotation = body.second_moment().trace().sqrt();
    // Modes have a residual of 1e-9 and relative gaps of at least 3 %: mode errors of 3e-8. Nonzero norms
    // change by their square and by the rounding of the reference; norms that vanish by symmetry change by
    // the errors themselves.
    for (name, norm, scale, limit) in [
        ("I0", inertia.norm_l2(), inertia.norm_l2(), 1e-11),
        ("W1", w1.norm_l2(), w1.norm_l2(), 1e-9),
        ("W2", w2.norm_l2(), w2.norm_l2(), 1e-9),
        ("W3", w3.norm_l2(), w3.norm_l2(), 1e-9),
        ("C1", body.c1().norm_l2(), body.mass().sqrt(), 3e-8),
        ("C2", derived.c2.norm_l2(), rotation, 3e-8),
    ] {
        let difference = (norm - reference[name].as_f64().expect("number")).abs() / scale;
        assert!(difference < limit, "{what}: {name} differs by {difference:e}");
    }
}

#[test]
fn norms_are_those_of_the_reference_program() {
    for model in models::own() {
        let count = model.reference["invariant_norms"]["modes"].as_u64().expect("count") as usize;
        // In model axes the modes need no rotation.
        let frame = choose_frame(&model.scalar_mass, &model.positions, BodyFrame::Com).expect("a body").0;
        let positions = frame.to_body(&model.positions);
        let modes = modes(&model, &positions, count);
        let exact = condense(&model.scalar_mass, &positions, modes.shapes.as_ref(), modes.stiffness.clone());
        let norms = model.reference["invariant_norms"].clone();
        assert_norms(&model.name, &exact, &norms["consistent"]);
        let diagonal = LumpedMasses::diagonal_scaling(&model.scalar_mass).expect("masses");
        for masses in [LumpedMasses::row_sum(&model.scalar_mass), diagonal] {
            let lumped = condense_lumped(&masses, &positions, modes.shapes.as_ref(), modes.stiffness.clone());
            let scheme = masses.scheme().name();
            assert_norms(&format!("{} {scheme}", model.name), &lumped, &norms[scheme]);
        }
        let expected = Expected {
            mass_normalised: true,
            free_surface: true,
            frame: BodyFrame::Com,
            origin: frame.origin,
            eigenvalues: Some(&modes.eigenvalues),
            eigenvalue_noise: 0.0,
            eigenvalue_rounding: 0.0,
            turning: Turning::None,
        };
        for check in identities(&exact, &expected) {
            assert!(check.passed, "{}: {} is {:e}", model.name, check.name, check.value);
        }
    }
}

//! Reduced equations of motion of the library compared with equations written out term by term, with nodes,
//! and with conservation laws.

use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::LoadKind;
use flexbody_motion::dynamics::{AngularVelocity, BodyPoint, EquationsOfMotion, Evaluation, Terms};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::equations::{Coriolis, State};
use oracle::flexible::{
    accelerations, fixture, invariants_of, made_of, moving_state, oracle, set, stressed, to_first_order,
};
use oracle::general::{
    GeneralBody, NodalBody, Row, RowKind, quasi_velocities, random_body, random_matrix, to_faer,
};
use oracle::nodal::{deviation, random_state};
use oracle::random::Random;

/// Returns a solid without symmetry: eight rows of M = Ms kron I, two of them internal, and five shapes.
fn random_solid(seed: u64) -> (NodalBody, FlexBody) {
    let mut random = Random(seed);
    let positions: Vec<[f64; 3]> = (0..6).map(|_| random.vector::<3>()).collect();
    let kind = |node| if node < 6 { RowKind::Displacement } else { RowKind::Internal };
    let rows: Vec<Row> =
        (0..8).flat_map(|node| [0, 1, 2].map(|axis| Row { kind: kind(node), node, axis })).collect();
    let a = random_matrix(&mut random, 8, 8);
    let mass = to_faer(&(&a * a.transpose()).kronecker(&DMatrix::<f64>::identity(3, 3)));
    let a = random_matrix(&mut random, 24, 24);
    let (stiffness, shapes) = (to_faer(&(&a * a.transpose())), to_faer(&random_matrix(&mut random, 24, 5)));
    let nodal = NodalBody::new(&stiffness, &mass, &rows, &positions, &shapes);
    let shape = shapes.subrows(0, 18).to_owned();
    let body = made_of(invariants_of(&nodal.invariants(), true), positions, shape, Mat::zeros(5, 5));
    (nodal, body)
}

/// Returns a body with an arbitrary symmetric mass matrix and four shapes.
fn random_general(seed: u64) -> (NodalBody, FlexBody) {
    let nodal = random_body(seed);
    let body = made_of(
        invariants_of(&nodal.invariants(), false),
        vec![[0.0; 3]; 2],
        Mat::zeros(6, 4),
        Mat::zeros(4, 4),
    );
    (nodal, body)
}

fn mass_matrix(evaluation: &Evaluation<'_>) -> DMatrix<f64> {
    let n = evaluation.equations().n_velocities();
    let mut matrix = vec![0.0; n * n];
    evaluation.mass_matrix(&mut matrix);
    DMatrix::from_row_slice(n, n, &matrix)
}

/// Asserts that momenta, energies and mass matrix agree with the oracle.
fn assert_quantities(
    what: &str,
    evaluation: &Evaluation<'_>,
    oracle: &GeneralBody,
    state: &State,
    limit: f64,
) {
    let expected = oracle.mass_matrix(&state.q);
    let found = mass_matrix(evaluation);
    assert!((&found - &expected).norm() < limit * expected.norm(), "{what}: mass matrix");
    assert_eq!(found, found.transpose(), "{what}: mass matrix");
    let momenta = &expected * quasi_velocities(state);
    let mut pi = vec![0.0; state.q.len()];
    evaluation.modal_momentum(&mut pi);
    let (p, h) = (evaluation.linear_momentum(), evaluation.angular_momentum());
    let own = DVector::from_iterator(momenta.len(), p.iter().chain(&h).chain(&pi).copied());
    assert!(deviation(&momenta, &own) < limit, "{what}: momenta");
    let energy = evaluation.kinetic_energy() + evaluation.elastic_energy();
    assert!((energy / oracle.energy(state) - 1.0).abs() < limit, "{what}: energy");
}

#[test]
fn random_bodies_move_like_their_nodes() {
    for seed in 0..20 {
        for (what, (nodal, body)) in [("solid", random_solid(seed)), ("general", random_general(seed))] {
            let what = format!("{what} {seed}");
            let equations = EquationsOfMotion::new(&body, Terms::ALL);
            let (state, _) = random_state(&mut Random(900 + seed), body.n_modes(), 0.7);
            let mut evaluation = Evaluation::new(&equations);
            set(&mut evaluation, &state);
            assert_quantities(&what, &evaluation, &nodal.invariants(), &state, 1e-12);
            let found = accelerations(&equations, &state, |_, _| {});
            let error = deviation(&nodal.accelerations(&state), &found);
            assert!(error < 1e-12, "{what}: {error:e}");
        }
    }
}

/// Section 3 in its printed form, with the velocities (R' world, omega, qd).
#[test]
fn solids_have_the_terms_of_section_three() {
    let converted = ["cube_hex8", "bracket_hex20"].map(|name| fixture(name, 12, BodyFrame::Model));
    let random = (0..10).map(|seed| random_solid(seed).1);
    for (at, body) in converted.into_iter().chain(random).enumerate() {
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let reduced = oracle(&body).reduced;
        let state = moving_state(&mut Random(40 + at as u64), &body);
        let mut evaluation = Evaluation::new(&equations);
        set(&mut evaluation, &state);
        let orientation = AngularVelocity { axes: state.axes };
        let n = equations.n_velocities();
        let (mut matrix, mut h) = (vec![0.0; n * n], vec![0.0; n]);
        evaluation.mass_matrix_of(&orientation, &mut matrix);
        evaluation.velocity_forces_of(&orientation, &state.omega, &mut h);
        let expected = reduced.mass_matrix(&state);
        let matrix = DMatrix::from_row_slice(n, n, &matrix);
        assert!((matrix - &expected).norm() < 1e-13 * expected.norm(), "body {at}: mass matrix");
        let error = deviation(&reduced.velocity_terms(&state, Coriolis::Correct), &DVector::from_vec(h));
        assert!(error < 1e-12, "body {at}: velocity forces {error:e}");
        let found = accelerations(&equations, &state, |_, _| {});
        let error = deviation(&reduced.free_accelerations(&state, Coriolis::Correct), &found);
        assert!(error < 1e-12, "body {at}: accelerations {error:e}");
    }
}

#[test]
fn converted_bodies_have_the_terms_of_section_six() {
    for name in ["cube_hex8", "bracket_hex20", "frame_beams", "shell_folded", "mpc_block", "hex8_bubbles"] {
        // The origin of a free body at its centre of mass has an acceleration of rounding only.
        let body = to_first_order(fixture(name, 10, BodyFrame::Model));
        let (equations, oracle) = (EquationsOfMotion::new(&body, Terms::ALL), oracle(&body));
        let state = moving_state(&mut Random(7), &body);
        let mut evaluation = Evaluation::new(&equations);
        set(&mut evaluation, &state);
        assert_quantities(name, &evaluation, &oracle, &state, 1e-12);
        let found = accelerations(&equations, &state, |_, _| {});
        let error = deviation(&oracle.accelerations(&state), &found);
        assert!(error < 1e-12, "{name}: accelerations {error:e}");
    }
}

/// Dropped terms agree with an oracle whose arrays are zero.
#[test]
fn dropped_terms_are_zero_arrays() {
    for seed in 0..8u64 {
        let terms = Terms { w1: seed & 1 == 0, w2: seed & 2 == 0, w3: seed & 4 == 0, ..Terms::ALL };
        for (nodal, body) in [random_solid(seed), random_general(seed)] {
            let mut truncated = nodal.invariants();
            for (kept, array) in [
                (terms.w1, &mut truncated.reduced.w1),
                (terms.w2, &mut truncated.reduced.w2),
                (terms.w3, &mut truncated.reduced.w3),
            ] {
                if !kept {
                    array.fill(0.0);
                }
            }
            // The amplitude keeps the inertia positive without W2.
            let (state, _) = random_state(&mut Random(60 + seed), body.n_modes(), 0.01);
            let equations = EquationsOfMotion::new(&body, terms);
            assert_eq!(equations.terms(), terms);
            let mut evaluation = Evaluation::new(&equations);
            set(&mut evaluation, &state);
            assert_quantities(&format!("{terms:?}"), &evaluation, &truncated, &state, 1e-12);
            let found = accelerations(&equations, &state, |_, _| {});
            let error = deviation(&truncated.accelerations(&state), &found);
            assert!(error < 1e-12, "{terms:?}: {error:e}");
        }
    }
}

/// The forces are polynomials of second degree in each coordinate and velocity, so that central differences
/// of any step are exact.
#[test]
fn jacobians_are_the_differences_of_the_forces() {
    let bodies = (0..6).flat_map(|seed| [random_solid(seed).1, random_general(seed).1]);
    let plane = ["plane_frame"].map(|name| fixture(name, 6, BodyFrame::Model));
    let motion = [LoadKind::Spin, LoadKind::Acceleration, LoadKind::AngularAcceleration];
    for (at, body) in bodies.chain(plane).enumerate() {
        let nf = body.n_modes();
        let mut random = Random(at as u64);
        let body = stressed(body, &motion[..at % 4], 1.0, &mut random);
        let mut parts = body.into_parts();
        parts.modes.modal_damping = Some(Mat::from_fn(nf, nf, |i, j| 0.1 * (1 + i.min(j)) as f64));
        // The stiffness is scaled to the other forces.
        parts.invariants.primary_mut().modal_stiffness =
            Mat::from_fn(nf, nf, |i, j| 0.3 * (1 + i.min(j)) as f64);
        let body = FlexBody::new(parts).expect("valid parts");
        for terms in [Terms::ALL, Terms::NONE, Terms { w3: false, ..Terms::ALL }] {
            let equations = EquationsOfMotion::new(&body, terms);
            let n = equations.n_velocities();
            let mut numbers = |n: usize| -> Vec<f64> { (0..n).map(|_| random.signed()).collect() };
            let (q, nu, acceleration) = (numbers(nf), numbers(n), numbers(n));
            let mut evaluation = Evaluation::new(&equations);
            evaluation.set(&q, &nu);
            let (mut by_q, mut by_nu) = (vec![0.0; n * nf], vec![0.0; n * n]);
            evaluation.jacobian(&acceleration, &mut by_q, &mut by_nu);

            let mut balance = |q: &[f64], nu: &[f64]| {
                let mut forces = DVector::zeros(n);
                evaluation.set(q, nu);
                evaluation.balance(&acceleration, forces.as_mut_slice());
                forces
            };
            let moved = |x: &[f64], j: usize, step: f64| -> Vec<f64> {
                x.iter().enumerate().map(|(i, x)| if i == j { x + step } else { *x }).collect()
            };
            let scale = DVector::from_vec(by_nu.clone()).amax() + DVector::from_vec(by_q.clone()).amax();
            for j in 0..nf {
                let [ahead, behind] = [0.5, -0.5].map(|step| balance(&moved(&q, j, step), &nu));
                // The difference has the rounding of both terms.
                let scale = scale + ahead.amax() + behind.amax();
                let difference = ahead - behind;
                for i in 0..n {
                    let error = (difference[i] - by_q[i * nf + j]).abs() / scale;
                    assert!(error < 1e-13, "body {at} {terms:?}: df_{i}/dq_{j} {error:e}");
                }
            }
            for j in 0..n {
                let difference = balance(&q, &moved(&nu, j, 0.5)) - balance(&q, &moved(&nu, j, -0.5));
                for i in 0..n {
                    let error = (difference[i] - by_nu[i * n + j]).abs() / scale;
                    assert!(error < 1e-13, "body {at} {terms:?}: df_{i}/dnu_{j} {error:e}");
                }
            }
        }
    }
}

/// Accelerations and the forces that cause them are inverse to each other, including damping.
#[test]
fn balance_returns_the_applied_forces() {
    for seed in 0..10 {
        for (_, body) in [random_solid(seed), random_general(seed)] {
            let nf = body.n_modes();
            let mut parts = body.into_parts();
            parts.modes.modal_damping =
                (seed % 2 == 0).then(|| Mat::from_fn(nf, nf, |i, j| 1.0 / (1 + i + j) as f64));
            parts.modes.damping_ratio.fill(0.3);
            let body = FlexBody::new(parts).expect("valid parts");
            let equations = EquationsOfMotion::new(&body, Terms::ALL);
            let mut random = Random(seed);
            let (state, applied) = random_state(&mut random, nf, 0.7);
            let mut evaluation = Evaluation::new(&equations);
            set(&mut evaluation, &state);
            let (mut rates, mut back) = (DVector::zeros(applied.len()), DVector::zeros(applied.len()));
            evaluation.accelerations(applied.as_slice(), rates.as_mut_slice()).expect("a body");
            evaluation.balance(rates.as_slice(), back.as_mut_slice());
            let scale = applied.norm() + DVector::from_column_slice(evaluation.velocity_forces()).norm();
            assert!((&back - &applied).norm() < 1e-11 * scale, "seed {seed}: {:e}", (back - applied).norm());
            // Force and power of damping.
            let at_rest = State { qd: DVector::zeros(nf), omega: Vector3::zeros(), ..state.clone() };
            let moving = State { qd: DVector::from_element(nf, 1e-3), ..at_rest.clone() };
            let modal = |evaluation: &mut Evaluation<'_>, state: &State| {
                let mut forces = DVector::zeros(6 + nf);
                set(evaluation, state);
                evaluation.balance(&vec![0.0; 6 + nf], forces.as_mut_slice());
                forces.rows(6, nf).into_owned()
            };
            let taken = modal(&mut evaluation, &moving) - modal(&mut evaluation, &at_rest);
            for (j, taken) in taken.iter().enumerate() {
                let expected = match &body.modes().modal_damping {
                    Some(matrix) => 1e-3 * (0..nf).map(|k| matrix[(j, k)]).sum::<f64>(),
                    None => 1e-3 * 2.0 * 0.3 * body.modes().eigenvalue[j].sqrt(),
                };
                assert!((taken - expected).abs() < 1e-12 * (1.0 + scale), "damping of mode {j}");
            }
        }
    }
}

/// Forces at nodes have the power of the nodal motion; gravity has that of the mass.
#[test]
fn loads_do_the_power_of_the_nodes() {
    for seed in 0..10 {
        let (_, body) = random_solid(seed);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let (state, _) = random_state(&mut Random(seed), 5, 0.7);
        let nu = quasi_velocities(&state);
        let mut evaluation = Evaluation::new(&equations);
        set(&mut evaluation, &state);
        let (mut forces, mut power) = (DVector::zeros(11), 0.0);
        for (i, node) in [4, 0, 2].into_iter().enumerate() {
            let force = Vector3::new(0.3, -1.0, 0.2 + i as f64);
            let point = BodyPoint::node(&body, node);
            assert!(!point.turns());
            point.add_force(&evaluation, &force, forces.as_mut_slice());
            // Computed by hand: x + u and its velocity.
            let shape = |q: &DVector<f64>| {
                Vector3::from_fn(|k, _| (0..5).map(|j| body.modes().shape[(3 * node + k, j)] * q[j]).sum())
            };
            let place = Vector3::from(body.nodes().positions[node]) + shape(&state.q);
            let velocity =
                state.axes.transpose() * state.velocity + state.omega.cross(&place) + shape(&state.qd);
            assert!((point.place(&evaluation) - place).norm() < 1e-14);
            assert!((point.velocity(&evaluation) - velocity).norm() < 1e-13);
            power += force.dot(&velocity);
        }
        assert!((forces.dot(&nu) - power).abs() < 1e-12 * power.abs().max(1.0), "seed {seed}");

        // In free fall gravity accelerates only the origin of a solid.
        let gravity = Vector3::new(0.5, -9.0, 3.0);
        let free = accelerations(&equations, &state, |_, _| {});
        let fall = accelerations(&equations, &state, |at, forces| {
            at.add_gravity(&(state.axes.transpose() * gravity), forces);
        });
        let mut expected = free.clone();
        let mut origin = expected.fixed_rows_mut::<3>(0);
        origin += gravity;
        assert!((fall - &expected).norm() < 1e-11 * expected.norm(), "seed {seed}: free fall");
    }
}

#[test]
fn too_much_deformation_for_a_truncated_inertia_is_said() {
    let (_, body) = random_solid(3);
    let equations = EquationsOfMotion::new(&body, Terms { w2: false, ..Terms::ALL });
    let mut evaluation = Evaluation::new(&equations);
    let mut rates = vec![0.0; 11];
    let refused = [1e3, -1e3].into_iter().filter(|&size| {
        evaluation.set(&[size; 5], &[0.0; 11]);
        evaluation.accelerations(&[0.0; 11], &mut rates).is_err()
    });
    assert!(refused.count() > 0, "an inertia linear in q is negative somewhere");
}

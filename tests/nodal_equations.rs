//! The nodal equations of the library against the dense oracles, the reduced equations and what must hold of them.

mod support;

use faer::Mat;
use flexbody::dynamics::{NodalEquations, NodalEvaluation, ReferenceConditions};
use flexbody::model::DofLabel;
use nalgebra::{DVector, Matrix3, Vector3};
use support::elements::Kind;
use support::equations::State;
use support::general::{FIXTURES, dense};
use support::unreduced::{Unreduced, configuration, soft_block, soft_plate, times};

/// What rounding may do: the oracle has products with K of all modes, and the cancellation in them.
const LIMIT: f64 = 1e-11;

/// Solids, plane bodies, general masses, and masses without an inverse.
fn bodies() -> Vec<(String, Unreduced)> {
    let made = [
        ("hex8", soft_block(Kind::Hex8, [3, 2, 1])),
        ("tet10", soft_block(Kind::Tet10, [1, 1, 1])),
        ("plate", soft_plate()),
    ];
    let made = made.into_iter().map(|(name, raw)| (name.to_owned(), Unreduced::new(raw)));
    made.chain(FIXTURES.map(|name| (name.to_owned(), Unreduced::fixture(name)))).collect()
}

/// Degrees of freedom that hold a body: three of one node, two of another and one of a third, all far apart.
fn holding(body: &Unreduced) -> Vec<DofLabel> {
    let x: Vec<Vector3<f64>> = body.positions.iter().map(|x| Vector3::from(*x)).collect();
    let farthest =
        |f: &dyn Fn(usize) -> f64| (0..x.len()).max_by(|&i, &j| f(i).total_cmp(&f(j))).expect("nodes");
    let first = farthest(&|i| x[i].norm());
    let second = farthest(&|i| (x[i] - x[first]).norm());
    let along = x[second] - x[first];
    let third = farthest(&|i| along.cross(&(x[i] - x[first])).norm());
    let directions = |v: Vector3<f64>| {
        let mut order = [0u8, 1, 2];
        order.sort_by(|&i, &j| v[i as usize].abs().total_cmp(&v[j as usize].abs()));
        order
    };
    let label = |i: usize, k: u8| DofLabel { node: body.model.nodes().ids[i], direction: k + 1 };
    if body.model.dimension() == 2 {
        let across = u8::from(along.x.abs() > along.y.abs());
        return vec![label(first, 0), label(first, 1), label(second, across)];
    }
    let [across, also, _] = directions(along);
    let [.., normal] = directions(along.cross(&(x[third] - x[first])));
    vec![
        label(first, 0),
        label(first, 1),
        label(first, 2),
        label(second, across),
        label(second, also),
        label(third, normal),
    ]
}

/// Shapes without what the conditions forbid: Psi - R (C R)^-1 C Psi.
fn held_shapes(body: &Unreduced, held: &[DofLabel]) -> Mat<f64> {
    let rigid = dense(&body.model.rigid_fields(body.frame.origin.into(), 1.0));
    let shapes = dense(&body.shapes);
    let rows: Vec<usize> = held
        .iter()
        .map(|dof| (0..body.rows.len()).find(|&i| body.model.label(i) == *dof).expect("a row"))
        .collect();
    let part = rigid.select_rows(&rows).try_inverse().expect("independent") * shapes.select_rows(&rows);
    let left = shapes - rigid * part;
    Mat::from_fn(left.nrows(), left.ncols(), |i, j| left[(i, j)])
}

/// Accelerations, momenta and energies against the oracle, whose modes are a basis of all displacements that the conditions allow.
fn assert_oracle(what: &str, body: &Unreduced, conditions: &ReferenceConditions, shapes: &Mat<f64>) {
    let equations = NodalEquations::new(&body.model, &body.frame, conditions).expect("equations");
    let oracle = body.oracle(shapes);
    for seed in 0..3 {
        let state = body.lively_state(seed, 0.1);
        let mut evaluation = NodalEvaluation::new(&equations);
        evaluation.set(&equations.state(&configuration(shapes, &state)).expect("a state")).expect("a state");
        let mut errors = Vec::new();
        let mut compare = |name, found: &[f64], expected: &[f64], scale: f64| {
            let difference: f64 = found.iter().zip(expected).map(|(a, b)| (a - b).powi(2)).sum();
            errors.push((name, difference.sqrt() / scale));
        };

        let found = evaluation.configuration();
        let (rate, length) = (body.eigenvalues[0].sqrt(), body.size / body.total_mass.sqrt());
        compare("R'", found.velocity.as_slice(), state.velocity.as_slice(), rate * length);
        compare("omega", found.omega.as_slice(), state.omega.as_slice(), rate);
        let weighted = |x: &DVector<f64>| x.dot(&times(&body.mass, x)).abs().sqrt();
        let rates = times(shapes, &state.qd);
        let error = weighted(&(DVector::from_column_slice(evaluation.displacement_rates()) - &rates));
        compare("u'", &[error], &[0.0], weighted(&rates));

        let (p, l) = evaluation.momenta();
        let linear = oracle.linear_momentum(&state);
        compare("P", p.as_slice(), linear.as_slice(), linear.norm());
        let angular = oracle.angular_momentum(&state) - state.origin.cross(&linear);
        compare("L", l.as_slice(), angular.as_slice(), angular.norm() + length * linear.norm());
        let energy = evaluation.kinetic_energy() + evaluation.elastic_energy();
        compare("energy", &[energy], &[oracle.energy(&state)], energy);

        let expected = oracle.accelerations(&state);
        let mut udd = vec![0.0; equations.n_rows()];
        let (linear, angular) = evaluation.accelerations(&mut udd).expect("accelerations");
        let velocity = state.axes.transpose() * state.velocity;
        let origin = state.axes * (linear + state.omega.cross(&velocity));
        let spin = state.omega.norm_squared();
        // A frame that is fixed to nodes follows the fastest modes.
        let size = |from: usize| expected.rows(from, 3).norm();
        compare("R''", origin.as_slice(), &expected.as_slice()[..3], spin * length + size(0));
        compare("omega'", angular.as_slice(), &expected.as_slice()[3..6], spin + size(3));
        let expected = times(shapes, &expected.rows(6, shapes.ncols()).into_owned());
        let error = weighted(&(DVector::from_vec(udd) - &expected));
        compare("u''", &[error], &[0.0], weighted(&expected));
        for (quantity, error) in errors {
            assert!(error < limit, "{what}, seed {seed}: {quantity} {error:e}");
        }
    }
}

#[test]
fn accelerations_are_those_of_the_dense_oracle() {
    for (name, body) in bodies() {
        assert_oracle(&name, &body, &ReferenceConditions::MeanAxes, &body.shapes);
        let held = holding(&body);
        let shapes = held_shapes(&body, &held);
        let conditions = ReferenceConditions::Held(held);
        if name == "shell_folded" {
            let error = NodalEquations::new(&body.model, &body.frame, &conditions).expect_err("null vectors");
            assert!(error.to_string().contains("8 null vectors"), "{error}");
            continue;
        }
        assert_oracle(&format!("{name}, held"), &body, &conditions, &shapes);
    }
}

/// Two thirds of the rank of M are missing: reduced integration.
#[test]
fn masses_of_low_rank_are_condensed() {
    let body = Unreduced::fixture("bar_c3d8r");
    assert_eq!(body.shapes.ncols(), 396 - 216 - 6);
    assert_oracle("bar_c3d8r", &body, &ReferenceConditions::MeanAxes, &body.shapes);
}

/// The axes of the frame name components, nothing else.
#[test]
fn the_axes_of_the_frame_do_not_matter() {
    for name in ["mpc_block", "plane_frame"] {
        let body = Unreduced::fixture(name);
        let state = body.lively_state(5, 0.1);
        let turn = if body.model.dimension() == 2 {
            nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.8).into_inner()
        } else {
            support::random::Random(4).rotation()
        };
        let run = |axes: Matrix3<f64>| {
            let frame = flexbody::flex_body::Frame { axes, ..body.frame };
            let equations =
                NodalEquations::new(&body.model, &frame, &ReferenceConditions::MeanAxes).expect("equations");
            let turned =
                State { axes: state.axes * axes, omega: axes.transpose() * state.omega, ..state.clone() };
            let y = equations.state(&configuration(&body.shapes, &turned)).expect("a state");
            let mut evaluation = NodalEvaluation::new(&equations);
            evaluation.set(&y).expect("a state");
            let gravity = Vector3::new(0.3, -1.0, 0.0) * body.eigenvalues[0] * body.size;
            evaluation.add_gravity(&gravity);
            evaluation.add_force(2, &(gravity * body.total_mass));
            let mut rates = vec![0.0; y.len()];
            evaluation.rates(&mut rates).expect("rates");
            (y, rates, evaluation.place(3), evaluation.node_velocity(3))
        };
        let ((y, rates, place, velocity), (other, turned, moved, speed)) =
            (run(Matrix3::identity()), run(turn));
        assert!((place - moved).norm() < 1e-13 && (velocity - speed).norm() < 1e-12 * velocity.norm());
        for (a, b) in [(&y, &other), (&rates, &turned)] {
            for part in [0..3, 7..10, 10..13, 13..a.len()] {
                let of = |y: &[f64]| DVector::from_column_slice(&y[part.clone()]);
                assert!((of(a) - of(b)).norm() < 1e-11 * of(a).norm(), "{name}: {part:?}");
            }
        }
    }
}

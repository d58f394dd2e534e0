//! Forces and torques at nodes and interfaces: their power, the motion that they act on, and their
//! derivatives.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::{Coupling, InterfaceMotion, LoadKind, NodeSet, Reference};
use flexbody_motion::dynamics::{
    BodyPoint, EquationsOfMotion, Evaluation, LoadAxes, LoadJacobian, Orientation, RotationVector, Terms,
};
use nalgebra::{DVector, Matrix3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::{body_of, fixture, stressed};
use oracle::mesh::Mesh;
use oracle::plane::rectangle;
use oracle::random::Random;

const CELL: f64 = 0.05;

/// Returns a bracket with interfaces at its ends, the second about a point far from its nodes.
fn bracket() -> FlexBody {
    let mesh = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL);
    let set = |name: &str, axis: usize, reference: Reference| {
        let kept = mesh.nodes.iter().enumerate().filter(|(_, x)| (x[axis] - 4.0 * CELL).abs() < 1e-9);
        let nodes = kept.map(|(i, _)| i as i64 + 1).collect();
        NodeSet { coupling: Some(Coupling::Averaging), reference, ..NodeSet::new(name, nodes) }
    };
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.interfaces =
        vec![set("first", 0, Reference::Centre), set("second", 2, Reference::Point([0.1, 0.05, 0.3]))];
    body_of(raw, 8, BodyFrame::Principal)
}

/// Returns a plane strip with an interface at one end.
fn strip() -> FlexBody {
    let mut raw = rectangle(8, 3, 0.4, [0.3, -0.1]);
    let nodes = (1..=raw.nodes.len() as i64).step_by(9).collect();
    raw.data.interfaces =
        vec![NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new("first", nodes) }];
    body_of(raw, 6, BodyFrame::Principal)
}

fn interface(body: &FlexBody, at: usize) -> BodyPoint {
    BodyPoint::interface(body, &body.interfaces()[at], Terms::ALL).expect("a reference point")
}

/// Returns points of all kinds with their bodies.
fn points() -> Vec<(&'static str, FlexBody, BodyPoint)> {
    let random = &mut Random(1);
    let at = |name: &str| [LoadKind::Force(name.to_owned()), LoadKind::Moment(name.to_owned())];
    let accelerated = [LoadKind::Acceleration];
    let stiffened = stressed(stressed(bracket(), &at("second"), 0.1, random), &accelerated, 1.0, random);
    let plane = stressed(stressed(strip(), &at("first"), 0.1, random), &accelerated, 1.0, random);
    let (beams, frame) =
        (fixture("frame_beams", 6, BodyFrame::Model), fixture("plane_frame", 6, BodyFrame::Model));
    vec![
        ("interface", bracket(), interface(&bracket(), 0)),
        ("far interface with geometric stiffness", stiffened.clone(), interface(&stiffened, 1)),
        ("plane interface", plane.clone(), interface(&plane, 0)),
        ("node", stiffened.clone(), BodyPoint::node(&stiffened, 5)),
        ("node of beams", beams.clone(), BodyPoint::node(&beams, 3)),
        ("node of plane beams", frame.clone(), BodyPoint::node(&frame, 2)),
    ]
}

/// Returns amplitudes of unit size for which the point rotates, or moves if it has no orientation.
fn state(random: &mut Random, body: &FlexBody, point: &BodyPoint) -> (Vec<f64>, Vec<f64>) {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let mut evaluation = Evaluation::new(&equations);
    let nf = body.n_modes();
    let mut size: f64 = 0.0;
    for j in 0..nf {
        let mut nu = vec![0.0; equations.n_velocities()];
        nu[equations.n_rigid() + j] = 1.0;
        evaluation.set(&vec![0.0; nf], &nu);
        let speed = point.angular_velocity(&evaluation).unwrap_or_else(|| point.velocity(&evaluation)).norm();
        size = size.max(speed);
    }
    let mut numbers = |n: usize, size: f64| -> Vec<f64> { (0..n).map(|_| size * random.signed()).collect() };
    let rigid = numbers(equations.n_rigid(), 1.0);
    (numbers(nf, 0.7 / size), [rigid, numbers(nf, 0.7 / size)].concat())
}

/// Returns loads along directions in which the body can move.
fn loads(random: &mut Random, body: &FlexBody) -> (Vector3<f64>, Vector3<f64>) {
    let (mut force, mut torque) = (Vector3::from(random.vector::<3>()), Vector3::from(random.vector::<3>()));
    if body.dimension() == 2 {
        force.z = 0.0;
        (torque.x, torque.y) = (0.0, 0.0);
    }
    (force, torque)
}

/// Returns f'(0) from four values; exact to the fourth power of the step.
fn derivative(step: f64, mut f: impl FnMut(f64) -> DVector<f64>) -> DVector<f64> {
    let near = f(step) - f(-step);
    (near * 8.0 - (f(2.0 * step) - f(-2.0 * step))) / (12.0 * step)
}

/// Returns f at time 0 and its rate for velocities nu constant in body axes; the evaluation is left at time
/// 0.
fn along(
    evaluation: &mut Evaluation<'_>,
    (q, nu): (&[f64], &[f64]),
    f: impl Fn(&Evaluation<'_>, f64) -> DVector<f64>,
) -> (DVector<f64>, DVector<f64>) {
    let r = evaluation.equations().n_rigid();
    let mut at = |time: f64| {
        let moved: Vec<f64> = q.iter().zip(&nu[r..]).map(|(q, qd)| q + time * qd).collect();
        evaluation.set(&moved, nu);
        f(evaluation, time)
    };
    let rate = derivative(3e-4, &mut at);
    (at(0.0), rate)
}

#[test]
fn forces_and_torques_do_their_power() {
    for (what, body, point) in points() {
        let mut random = Random(8);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let mut evaluation = Evaluation::new(&equations);
        for _ in 0..5 {
            let ((q, nu), (force, torque)) = (state(&mut random, &body, &point), loads(&mut random, &body));
            evaluation.set(&q, &nu);
            let mut forces = DVector::zeros(nu.len());
            point.add_force(&evaluation, &force, forces.as_mut_slice());
            let mut power = force.dot(&point.velocity(&evaluation));
            if point.turns() {
                point.add_torque(&evaluation, &torque, forces.as_mut_slice());
                power += torque.dot(&point.angular_velocity(&evaluation).expect("it turns"));
            }
            let found = forces.dot(&DVector::from_vec(nu));
            assert!((found - power).abs() < 1e-13 * forces.norm(), "{what}: {found} {power}");
        }
    }
}

/// Velocity and angular velocity are the rates of position and axes.
#[test]
fn points_move_as_their_velocities_say() {
    for (what, body, point) in points() {
        let mut random = Random(9);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let (q, nu) = state(&mut random, &body, &point);
        let mut evaluation = Evaluation::new(&equations);
        let (now, rates) = along(&mut evaluation, (&q, &nu), |evaluation, _| {
            let axes = point.axes(evaluation).unwrap_or_else(Matrix3::identity);
            let place = point.place(evaluation);
            DVector::from_iterator(12, place.iter().chain(axes.iter()).copied())
        });
        let (v, w) = evaluation.rigid_velocity();
        let place = Vector3::from_column_slice(&now.as_slice()[..3]);
        let velocity = v + w.cross(&place) + rates.fixed_rows::<3>(0);
        let error = (velocity - point.velocity(&evaluation)).norm() / (1.0 + place.norm());
        assert!(error < 1e-11, "{what}: velocity {error:e}");
        let Some(angular) = point.angular_velocity(&evaluation) else {
            assert!(!point.turns() && point.axes(&evaluation).is_none());
            continue;
        };
        let axes = Matrix3::from_column_slice(&now.as_slice()[3..]);
        assert!((axes.transpose() * axes - Matrix3::identity()).norm() < 1e-14, "{what}");
        assert!((axes - Matrix3::identity()).norm() > 0.05, "{what}: turned little");
        let rate = Matrix3::from_column_slice(&rates.as_slice()[3..]) * axes.transpose();
        let error = (rate - (angular - w).cross_matrix()).norm();
        assert!(error < 1e-11, "{what}: angular velocity {error:e}");
    }
}

/// Rates of the velocities in the world for nu constant in body axes.
#[test]
fn velocities_drift_as_they_say() {
    for (what, body, point) in points() {
        let mut random = Random(11);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let (q, nu) = state(&mut random, &body, &point);
        let mut evaluation = Evaluation::new(&equations);
        let (now, rates) = along(&mut evaluation, (&q, &nu), |evaluation, time| {
            // Axes of the body relative to those at time 0.
            let turn = RotationVector(evaluation.rigid_velocity().1 * time).axes();
            let angular = point.angular_velocity(evaluation).unwrap_or_else(Vector3::zeros);
            let (linear, angular) = (turn * point.velocity(evaluation), turn * angular);
            DVector::from_iterator(6, linear.iter().chain(angular.iter()).copied())
        });
        let size = 1.0 + now.norm();
        let drift = point.velocity_drift(&evaluation);
        let error = (rates.fixed_rows::<3>(0) - drift).norm() / size;
        assert!(error < 1e-10 && drift.norm() > 0.1, "{what}: velocity {error:e}");
        let Some(angular) = point.angular_drift(&evaluation) else { continue };
        let error = (rates.fixed_rows::<3>(3) - angular).norm() / size;
        assert!(error < 1e-10, "{what}: angular velocity {error:e}");
    }
}

/// A load at an averaging interface is distributed to forces at the nodes (theory 5.3).
#[test]
fn loads_at_an_interface_are_forces_at_its_nodes() {
    let body = bracket();
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let evaluation = Evaluation::new(&equations);
    for (at, interface) in body.interfaces().iter().enumerate() {
        let positions: Vec<[f64; 3]> = interface.nodes.iter().map(|&i| body.nodes().positions[i]).collect();
        let motion = InterfaceMotion::new(&positions, false, 3, interface.reference);
        let (force, torque) = loads(&mut Random(2), &body);
        let mut expected = DVector::zeros(14);
        for (i, &node) in interface.nodes.iter().enumerate() {
            let share = |k: usize| -> f64 {
                let row = motion.average().row(3 * i + k);
                (0..3).map(|a| row[a] * force[a] + row[3 + a] * torque[a]).sum()
            };
            let share = Vector3::from_fn(|k, _| share(k));
            BodyPoint::node(&body, node).add_force(&evaluation, &share, expected.as_mut_slice());
        }
        let mut found = DVector::zeros(14);
        let point = self::interface(&body, at);
        point.add_force(&evaluation, &force, found.as_mut_slice());
        point.add_torque(&evaluation, &torque, found.as_mut_slice());
        let error = (&found - &expected).norm() / expected.norm();
        assert!(error < 1e-12, "interface {at}: {error:e}");
    }
}

/// Applies every load of a body at one state; the axes of the body are rotated by a small angle from those in
/// which the loads are resolved.
fn apply(
    evaluation: &Evaluation<'_>,
    point: &BodyPoint,
    (force, torque, gravity): (&Vector3<f64>, &Vector3<f64>, &Vector3<f64>),
    (axes, turn): (LoadAxes, Vector3<f64>),
    forces: &mut [f64],
) {
    let turned = RotationVector(turn).axes();
    let own = |load: &Vector3<f64>| if axes == LoadAxes::World { turned.tr_mul(load) } else { *load };
    evaluation.add_gravity(&turned.tr_mul(gravity), forces);
    point.add_force(evaluation, &own(force), forces);
    if point.turns() {
        point.add_torque(evaluation, &own(torque), forces);
    }
}

#[test]
fn derivatives_of_loads_are_their_differences() {
    for (what, body, point) in points() {
        for axes in [LoadAxes::World, LoadAxes::Body] {
            let mut random = Random(10);
            let equations = EquationsOfMotion::new(&body, Terms::ALL);
            let (q, nu) = state(&mut random, &body, &point);
            let ((force, torque), (gravity, _)) = (loads(&mut random, &body), loads(&mut random, &body));
            let (n, nf) = (nu.len(), q.len());
            let about: &[usize] = if body.dimension() == 2 { &[2] } else { &[0, 1, 2] };
            let mut evaluation = Evaluation::new(&equations);
            evaluation.set(&q, &nu);
            let (mut by_q, mut by_turn) = (vec![0.0; n * nf], vec![0.0; n * about.len()]);
            let mut jacobian = LoadJacobian { by_q: &mut by_q, by_turn: &mut by_turn };
            evaluation.add_gravity_jacobian(&gravity, &mut jacobian);
            point.add_force_jacobian(&evaluation, &force, axes, &mut jacobian);
            if point.turns() {
                point.add_torque_jacobian(&evaluation, &torque, axes, &mut jacobian);
            }
            let mut at = |q: &[f64], turn: Vector3<f64>| {
                let mut forces = DVector::zeros(n);
                evaluation.set(q, &nu);
                apply(&evaluation, &point, (&force, &torque, &gravity), (axes, turn), forces.as_mut_slice());
                forces
            };
            let size = at(&q, Vector3::zeros()).norm();
            for j in 0..nf {
                let step = 1e-3 * q.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let difference = derivative(step, |h| {
                    let mut moved = q.clone();
                    moved[j] += h;
                    at(&moved, Vector3::zeros())
                });
                let own = DVector::from_fn(n, |i, _| by_q[i * nf + j]);
                let error = (&difference - &own).norm() * step * 1e3 / size;
                assert!(error < 1e-10, "{what}, {axes:?}: by q_{j} {error:e}");
            }
            for (column, &axis) in about.iter().enumerate() {
                let difference = derivative(1e-3, |h| at(&q, Vector3::ith(axis, h)));
                let own = DVector::from_fn(n, |i, _| by_turn[i * about.len() + column]);
                let error = (&difference - &own).norm() / size;
                assert!(error < 1e-10 && own.norm() > 1e-3, "{what}, {axes:?}: by turn {axis} {error:e}");
            }
        }
    }
}

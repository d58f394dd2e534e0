//! Motion of one body by the integrators: compared with another integrator in other variables, conserved
//! quantities, loads and prescribed motion.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_motion::dynamics::{
    AlongFrame, Balance, Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Evaluation,
    Orientation, Place, Prescribed, Surroundings, Terms,
};
use flexbody_motion::integration::Method;
use nalgebra::{DVector, Matrix3, Vector3};
use oracle::flexible::{fixture, soft_block};
use oracle::integrate as reference;
use oracle::motion::{adaptive, conserving, orientation, run, velocity_rates};

/// Returns a spin about an axis near the middle one with `spin` times the first circular frequency, with
/// deformation and translation.
fn tumbling(body: &FlexBody, spin: f64) -> Configuration {
    let rate = body.modes().eigenvalue[0].sqrt();
    let radius = body.invariants().inertia()[(2, 2)].sqrt();
    let plane = body.dimension() == 2;
    let flat = |v: Vector3<f64>| if plane { Vector3::new(v.x, v.y, 0.0) } else { v };
    let axis = if plane { Vector3::z() } else { Vector3::new(0.1, 1.0, 0.05) };
    Configuration {
        origin: flat(Vector3::new(0.3, -0.2, 0.5)),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: flat(Vector3::new(0.2, 0.5, -0.4))
            * (spin * rate * radius / body.invariants().mass().sqrt()),
        omega: axis * (spin * rate),
        q: body.modes().eigenvalue.iter().map(|l| 0.05 * radius * rate / l.sqrt()).collect(),
        qd: vec![0.0; body.n_modes()],
    }
}

/// Returns the time of one turn.
fn turn(start: &Configuration) -> f64 {
    std::f64::consts::TAU / start.omega.norm()
}

/// Returns the largest difference of two configurations: attitude, and modes and rates relative to `scale`.
fn difference(a: &Configuration, b: &Configuration, scale: &Configuration) -> f64 {
    let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let apart = |x: &[f64], y: &[f64]| size(&x.iter().zip(y).map(|(x, y)| x - y).collect::<Vec<_>>());
    let turn = (a.attitude.axes() - b.attitude.axes()).norm();
    turn.max(apart(&a.q, &b.q) / size(&scale.q)).max((a.omega - b.omega).norm() / scale.omega.norm())
}

/// Computes the motion in velocities and by extrapolation; only the accelerations are shared with the
/// library.
fn by_velocities(
    equations: &EquationsOfMotion,
    start: &Configuration,
    duration: f64,
    steps: usize,
) -> Configuration {
    let nf = equations.n_modes();
    let mut y = DVector::zeros(13 + 2 * nf);
    y.rows_mut(0, 3).copy_from(&start.origin);
    y.rows_mut(3, 4).copy_from_slice(&start.attitude.0);
    y.rows_mut(7, nf).copy_from_slice(&start.q);
    y.rows_mut(7 + nf, 3).copy_from(&start.attitude.axes().tr_mul(&start.velocity));
    y.rows_mut(10 + nf, 3).copy_from(&start.omega);
    y.rows_mut(13 + nf, nf).copy_from_slice(&start.qd);
    for _ in 0..steps {
        y = reference::step(&y, duration / steps as f64, &|y| velocity_rates(equations, y, &|_, _, _, _| {}));
    }
    let e = orientation(&y);
    Configuration {
        origin: y.fixed_rows::<3>(0).into_owned(),
        attitude: e,
        velocity: e.axes() * y.fixed_rows::<3>(7 + nf),
        omega: y.fixed_rows::<3>(10 + nf).into_owned(),
        q: y.rows(7, nf).as_slice().to_vec(),
        qd: y.rows(13 + nf, nf).as_slice().to_vec(),
    }
}

#[test]
fn momentum_form_moves_like_velocity_form() {
    for body in [soft_block(10), fixture("shell_folded", 8, BodyFrame::Model)] {
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let start = tumbling(&body, 0.2);
        let duration = 2.0 * turn(&start);
        let expected = by_velocities(&equations, &start, duration, 900);
        let step = duration / 4000.0;
        for method in [&adaptive(1e-12) as &dyn Fn(usize) -> Method, &conserving(6, step)] {
            let (places, _) = run(&equations, &EmptySpace, &start, method, &[0.0, duration], &[]);
            let apart = difference(&places[1], &expected, &start);
            assert!(apart < 1e-9, "{}: {apart:e}", body.description().name);
            assert!(
                (places[1].origin - expected.origin).norm() < 1e-9 * (expected.origin - start.origin).norm()
            );
        }
    }
}

#[test]
fn methods_converge_with_their_order_on_a_tumbling_body() {
    let body = soft_block(4);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let start = tumbling(&body, 0.2);
    let duration = 0.5 * turn(&start);
    let exact = by_velocities(&equations, &start, duration, 400);
    let fastest = body.modes().eigenvalue[3].sqrt();
    for order in [2, 4, 6] {
        let error = |steps: f64| {
            let method = conserving(order, duration / steps);
            let (places, balances) = run(&equations, &EmptySpace, &start, method, &[0.0, duration], &[]);
            let energy = |b: &Balance| b.kinetic + b.elastic;
            (
                difference(&places[1], &exact, &start),
                (energy(&balances[1]) / energy(&balances[0]) - 1.0).abs(),
            )
        };
        let steps = (duration * fastest * if order == 2 { 12.0 } else { 3.0 }).ceil();
        let (coarse, fine) = (error(steps), error(2.0 * steps));
        for (what, found) in [("state", coarse.0 / fine.0), ("energy", coarse.1 / fine.1)] {
            assert!((found.log2() - order as f64).abs() < 0.35, "{what}, order {order}: {}", found.log2());
        }
    }
}

#[test]
#[ignore = "slow"]
fn a_free_body_keeps_momenta_to_rounding_and_its_energy_for_a_hundred_thousand_steps() {
    // A spatial body, a plane body, and a general mass whose frame is away from the centre of mass, for which
    // the method is not symplectic.
    for (body, order, limit) in [
        (soft_block(6), 4, 1e-6),
        (fixture("plane_frame", 6, BodyFrame::Principal), 4, 1e-7),
        (fixture("shell_folded", 6, BodyFrame::Model), 6, 1e-9),
    ] {
        let name = &body.description().name;
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let start = tumbling(&body, 0.1);
        let step = 0.3 / body.modes().eigenvalue[5].sqrt();
        let instants: Vec<f64> = (0..=20).map(|i| f64::from(i) * 5000.0 * step).collect();
        let method = conserving(order, step);
        let (_, balances) = run(&equations, &EmptySpace, &start, method, &instants, &[]);
        let first = balances[0];
        let total = |b: &Balance| b.kinetic + b.elastic;
        let mut worst = [0.0_f64; 2];
        for (i, balance) in balances.iter().enumerate() {
            let linear = (balance.linear - first.linear).norm() / first.linear.norm();
            let angular = (balance.angular - first.angular).norm() / first.angular.norm();
            assert!(linear < 1e-13 && angular < 1e-12, "{name}: {linear:e}, {angular:e}");
            let energy = (total(balance) / total(&first) - 1.0).abs();
            worst[i / 11] = worst[i / 11].max(energy);
        }
        let [early, late] = worst;
        assert!(late < limit && late < 3.0 * early, "{name}: {early:e}, then {late:e}");
    }
}

/// Gravity, and a force and a torque that rotate with the body.
struct Loads {
    gravity: Vector3<f64>,
    force: Vector3<f64>,
    torque: Vector3<f64>,
}

impl Surroundings for Loads {
    fn add_forces(&self, _: f64, place: &Place, evaluation: &Evaluation<'_>, forces: &mut [f64]) {
        evaluation.add_gravity(&place.axes.tr_mul(&self.gravity), forces);
        for k in 0..3 {
            forces[k] += self.force[k];
            forces[3 + k] += self.torque[k];
        }
    }
}

#[test]
fn work_and_impulses_balance_energy_and_momenta() {
    let body = soft_block(6);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let start = tumbling(&body, 0.1);
    let weight = body.invariants().mass() * start.velocity.norm() / turn(&start);
    let loads = Loads {
        gravity: Vector3::new(0.0, 0.3, -1.0) * (weight / body.invariants().mass()),
        force: Vector3::new(1.0, 0.5, 0.2) * weight,
        torque: Vector3::new(0.1, -0.2, 0.3) * weight,
    };
    let end = 2.0 * turn(&start);
    let (_, balances) = run(&equations, &loads, &start, adaptive(1e-11), &[0.0, 0.6 * end, end], &[]);
    let first = balances[0];
    for balance in &balances[1..] {
        let energy = balance.kinetic + balance.elastic - first.kinetic - first.elastic;
        assert!(balance.work.abs() > 0.1 * first.kinetic, "the loads work");
        assert!((energy - balance.work).abs() < 1e-9 * balance.work.abs(), "{energy:e}, {:e}", balance.work);
        let linear = balance.linear - first.linear - balance.impulse;
        let angular = balance.angular - first.angular - balance.angular_impulse;
        assert!(linear.norm() < 1e-10 * balance.impulse.norm(), "{linear}");
        assert!(angular.norm() < 1e-9 * balance.angular_impulse.norm(), "{angular}");
    }
}

#[test]
fn a_body_falls_as_a_point_and_turns_as_if_it_did_not() {
    let body = soft_block(6);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let start = tumbling(&body, 0.1);
    let end = 2.0 * turn(&start);
    let gravity = Vector3::new(1.0, -2.0, 3.0) * (start.velocity.norm() / end);
    let falling = Loads { gravity, force: Vector3::zeros(), torque: Vector3::zeros() };
    for method in [&adaptive(1e-12) as &dyn Fn(usize) -> Method, &conserving(4, end / 3000.0)] {
        let [fallen, free] = [&falling as &dyn Surroundings, &EmptySpace]
            .map(|around| run(&equations, around, &start, method, &[0.0, end], &[]).0[1].clone());
        // The frame is at the centre of mass, which the modes do not move.
        let exact = start.origin + start.velocity * end + gravity * (0.5 * end * end);
        assert!((fallen.origin - exact).norm() < 1e-11 * exact.norm());
        let apart = difference(&fallen, &free, &start);
        assert!(apart < 1e-8, "{apart:e}");
    }
}

/// Spin about the third axis that rises smoothly; the origin is held if `held` is true.
struct SpinUp {
    rate: f64,
    duration: f64,
    held: bool,
}

impl Surroundings for SpinUp {
    fn add_forces(&self, _: f64, _: &Place, _: &Evaluation<'_>, _: &mut [f64]) {}

    fn prescribed(&self, time: f64, _: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        let phase = std::f64::consts::TAU * (time / self.duration).min(1.0);
        let rate = self.rate * (phase - phase.sin()) / std::f64::consts::TAU;
        let slope = self.rate / self.duration * (1.0 - phase.cos());
        let held = self.held.then(AlongFrame::default);
        let about = |value: f64| Prescribed { linear: held, angular: Some(AlongFrame(Vector3::z() * value)) };
        (about(rate), about(slope))
    }
}

#[test]
fn prescribed_spin_takes_the_torque_that_the_momentum_needs() {
    let body = soft_block(6);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let first = body.modes().eigenvalue[0].sqrt();
    let duration = 8.0 / first;
    let mut start = tumbling(&body, 0.0);
    start.q.fill(0.0);
    for held in [false, true] {
        let spin = SpinUp { rate: 0.3 * first, duration, held };
        let (places, balances) =
            run(&equations, &spin, &start, adaptive(1e-12), &[0.0, duration, 1.5 * duration], &[duration]);
        let (begun, ended) = (balances[0], balances[2]);
        // Half a turn at the mean rate of the profile, then half a turn at the full rate.
        let angle: f64 = spin.rate * duration;
        let exact = angle.cos();
        assert!((places[2].attitude.axes()[(0, 0)] - exact).abs() < 1e-9, "{exact}");
        assert!((places[2].omega - Vector3::z() * spin.rate).norm() < 1e-13 * spin.rate);
        // Momenta are computed from the velocities, impulses from the torque.
        let angular = ended.angular - begun.angular - ended.angular_impulse;
        assert!(angular.norm() < 1e-9 * ended.angular.norm(), "{angular}");
        let energy = ended.kinetic + ended.elastic - begun.kinetic - begun.elastic;
        assert!((energy - ended.work).abs() < 1e-9 * ended.work, "{energy:e}, {:e}", ended.work);
        let strayed = (places[2].origin - start.origin).norm();
        assert!(!held || strayed < 1e-14, "{strayed:e}");
        let deformation = places[2].q.iter().map(|q| q * q).sum::<f64>().sqrt();
        assert!(deformation > 1e-3 * body.invariants().inertia()[(2, 2)].sqrt(), "{deformation:e}");
    }
}

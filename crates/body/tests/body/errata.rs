//! Misprints of the literature (theory section 11) on a tumbling body: the correct equations conserve energy
//! and momentum, the printed ones do not.

use flexbody_body::invariants::BodyFrame;
use nalgebra::{DVector, Matrix3, Quaternion, UnitQuaternion, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::equations::{Coriolis, ReducedBody, State};
use oracle::integrate;
use oracle::mesh::Mesh;
use oracle::nodal::reduced;
use oracle::pipeline::modes;

/// Returns a rubber-like block without symmetry with 10 modes about its principal axes, for which W1, W2 and
/// W3 matter.
fn soft_body() -> ReducedBody {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &oracle::mesh::grid([6, 4, 2]), |[x, y, z]| {
        [0.2 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.2 * z * (1.0 + 0.1 * y)]
    });
    let body = modes(&mesh.assemble(&rubber, MassRule::Consistent), 10);
    reduced(&body.condensed(BodyFrame::Principal).invariants)
}

/// Returns the state of y = (Euler parameters, omega, q, qd); at the centre of mass the translation is
/// uncoupled.
fn unpack(y: &DVector<f64>) -> State {
    let nf = (y.len() - 7) / 2;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(y[0], y[1], y[2], y[3]));
    State {
        origin: Vector3::zeros(),
        axes: turn.to_rotation_matrix().into_inner(),
        velocity: Vector3::zeros(),
        omega: Vector3::new(y[4], y[5], y[6]),
        q: y.rows(7, nf).into_owned(),
        qd: y.rows(7 + nf, nf).into_owned(),
    }
}

fn rate(body: &ReducedBody, y: &DVector<f64>, coriolis: Coriolis) -> DVector<f64> {
    let state = unpack(y);
    let nf = state.q.len();
    let acceleration = body.free_accelerations(&state, coriolis);
    let turn = Quaternion::new(y[0], y[1], y[2], y[3]) * Quaternion::from_imag(state.omega) * 0.5;
    let mut rate = DVector::zeros(y.len());
    rate.rows_mut(0, 4).copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
    rate.rows_mut(4, 3).copy_from(&acceleration.rows(3, 3));
    rate.rows_mut(7, nf).copy_from(&state.qd);
    rate.rows_mut(7 + nf, nf).copy_from(&acceleration.rows(6, nf));
    rate
}

/// Largest relative drifts of angular momentum and energy while the body tumbles, and range of omega_y.
struct Tumble {
    momentum: f64,
    energy: f64,
    swing: (f64, f64),
    deformation: f64,
}

fn tumble(body: &ReducedBody, coriolis: Coriolis) -> Tumble {
    let nf = body.n_modes();
    let mut y = DVector::zeros(7 + 2 * nf);
    y[0] = 1.0;
    // Principal moments ascend: y is the middle axis, about which spin is unstable.
    (y[4], y[5], y[6]) = (0.05, 1.0, 0.03);
    let start = unpack(&y);
    let (momentum, energy) = (body.angular_momentum(&start), body.energy(&start));
    let mut found = Tumble { momentum: 0.0, energy: 0.0, swing: (1.0, 1.0), deformation: 0.0 };
    for _ in 0..800 {
        y = integrate::step(&y, 0.05, &|y| rate(body, y, coriolis));
        let state = unpack(&y);
        found.momentum =
            found.momentum.max((body.angular_momentum(&state) - momentum).norm() / momentum.norm());
        found.energy = found.energy.max((body.energy(&state) / energy - 1.0).abs());
        found.swing = (found.swing.0.min(state.omega.y), found.swing.1.max(state.omega.y));
        found.deformation = found.deformation.max(state.q.norm());
    }
    found
}

#[test]
fn misprinted_coriolis_terms_lose_angular_momentum_and_hide_from_the_energy() {
    let body = soft_body();
    let correct = tumble(&body, Coriolis::Correct);
    // The body flips (Dzhanibekov effect) and deforms by some per cent of its size, so that the terms matter.
    assert!(correct.swing.0 < -0.99 && correct.swing.1 > 0.99, "{:?}", correct.swing);
    let radius = (0.5 * body.inertia.trace() / body.mass).sqrt();
    assert!(correct.deformation > 0.02 * radius * body.mass.sqrt(), "{}", correct.deformation);
    assert!(correct.momentum < 1e-12, "momentum drifts by {:e}", correct.momentum);
    assert!(correct.energy < 1e-12, "energy drifts by {:e}", correct.energy);

    // [WP19] (16), (33), (44): W1 Qd + 2 Q'W2 Qd in addition to the W3 term. Measured drift: 1.7e-3.
    let printed = tumble(&body, Coriolis::Printed);
    assert!(printed.momentum > 1e-3, "momentum drifts by {:e} only", printed.momentum);
    assert!(printed.energy < 1e-12, "energy drifts by {:e}", printed.energy);
}

#[test]
fn euler_parameters_carry_a_factor_of_four() {
    // [WP19] (29) to (33) and (41) to (45) lose a factor on one side: with w = G pd and |p| = 1, G G' is four
    // times the identity, so that the equations of omega follow from those of p as G (...) / 4.
    let p = [0.5, -0.1, 0.7, 0.5];
    let [e0, e1, e2, e3] = p.map(|v| 2.0 * v);
    let g = nalgebra::Matrix3x4::new(-e1, e0, e3, -e2, -e2, -e3, e0, e1, -e3, e2, -e1, e0);
    assert!((g * g.transpose() - Matrix3::identity() * 4.0).norm() < 1e-14);
    // G is that of w = G pd in body axes: the rate of p used by the integration gives omega.
    let omega = Vector3::new(0.3, -0.8, 1.1);
    let rate = Quaternion::new(p[0], p[1], p[2], p[3]) * Quaternion::from_imag(omega) * 0.5;
    let back = g * nalgebra::Vector4::new(rate.w, rate.i, rate.j, rate.k);
    assert!((back - omega).norm() < 1e-14, "{back}");
}

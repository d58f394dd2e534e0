//! Conservation of energy and momenta: with all terms, for every truncation and for general masses; and
//! violations by misprints.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::LoadKind;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Orientation, Terms};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use oracle::elements::ElementKind;
use oracle::flexible::{body_of, fixture, oracle, soft_block, stressed};
use oracle::general::dense;
use oracle::integrate;
use oracle::motion::{Drift, Kept, orientation, velocity_rates};
use oracle::random::Random;
use oracle::turning::{block, disc_on_shaft};

/// Returns energy and world momenta (about the world origin), including the `potential` energy.
fn kept(equations: &EquationsOfMotion, y: &DVector<f64>, potential: f64) -> Kept {
    let nf = equations.n_modes();
    let mut evaluation = Evaluation::new(equations);
    evaluation.set(y.rows(7, nf).as_slice(), y.rows(7 + nf, 6 + nf).as_slice());
    let (axes, origin) = (orientation(y).axes(), y.fixed_rows::<3>(0).into_owned());
    let linear = axes * evaluation.linear_momentum();
    let angular = axes * evaluation.angular_momentum() + origin.cross(&linear);
    Kept { energy: evaluation.kinetic_energy() + evaluation.elastic_energy() + potential, linear, angular }
}

/// Returns a spin about the middle axis with a fifth of the first circular frequency, with deformation and
/// translation at the start.
fn start(body: &FlexBody) -> DVector<f64> {
    let nf = body.n_modes();
    let omega: Vec<f64> = body.modes().eigenvalue.iter().map(|l| l.sqrt()).collect();
    let radius = body.invariants().inertia()[(1, 1)].sqrt();
    let spin = 0.2 * omega[0];
    let mut y = DVector::zeros(13 + 2 * nf);
    y.rows_mut(0, 7).copy_from_slice(&[0.3, -0.2, 0.5, 1.0, 0.0, 0.0, 0.0]);
    let velocity = Vector3::new(0.2, 0.5, -0.4) * spin * radius / body.invariants().mass().sqrt();
    y.rows_mut(7 + nf, 3).copy_from(&velocity);
    y.rows_mut(10 + nf, 3).copy_from(&(Vector3::new(0.1, 1.0, 0.05) * spin));
    (0..nf).for_each(|j| y[7 + j] = 0.05 * radius * omega[0] / omega[j]);
    y
}

fn tumble(
    body: &FlexBody,
    terms: Terms,
    load: impl Fn(&Evaluation<'_>, &Matrix3<f64>, &DVector<f64>, &mut [f64]),
    potential: impl Fn(&DVector<f64>) -> f64,
) -> Drift {
    let equations = EquationsOfMotion::new(body, terms);
    let nf = equations.n_modes();
    let mut y = start(body);
    let omega: Vec<f64> = body.modes().eigenvalue.iter().map(|l| l.sqrt()).collect();
    let step = 0.6 / omega[nf - 1];
    let steps = (15.0 * std::f64::consts::TAU / omega[0] / step).ceil() as usize;
    let height = potential(&y);
    let kept = |y: &DVector<f64>| kept(&equations, y, potential(y) - height);
    let (first, mut found) = (kept(&y), Drift::default());
    let radius = body.invariants().inertia()[(1, 1)].sqrt();
    for _ in 0..steps {
        y = integrate::step(&y, step, &|y| velocity_rates(&equations, y, &load));
        found.add(&first, &kept(&y), y.rows(7, nf).norm() / radius, y.rows(10 + nf, 3).norm() * step);
    }
    found
}

fn nothing(_: &Evaluation<'_>, _: &Matrix3<f64>, _: &DVector<f64>, _: &mut [f64]) {}

#[test]
fn energy_and_momenta_are_kept_by_every_truncation() {
    let turning =
        [block(ElementKind::Hex8).raw, disc_on_shaft(2.0)].map(|raw| body_of(raw, 6, BodyFrame::Principal));
    let bodies = [soft_block(10), fixture("frame_beams", 6, BodyFrame::Principal)];
    for body in bodies.into_iter().chain(turning) {
        for bits in 0..8 {
            let terms = Terms { w1: bits & 1 == 0, w2: bits & 2 == 0, w3: bits & 4 == 0, ..Terms::ALL };
            let drift = tumble(&body, terms, nothing, |_| 0.0);
            assert!(drift.deformation > 0.05 && drift.turns > 2.0, "{terms:?}: {drift:?}");
            assert!(drift.worst() < 1e-10, "{terms:?}: {drift:?}");
        }
    }
}

/// Each kind of load by itself and all together, for a solid and for a general mass, under gravity.
#[test]
#[ignore = "slow"]
fn energy_is_kept_with_geometric_stiffness() {
    let motion = [LoadKind::Spin, LoadKind::Acceleration, LoadKind::AngularAcceleration];
    for body in [soft_block(10), fixture("frame_beams", 6, BodyFrame::Model)] {
        let lambda = body.modes().eigenvalue[0];
        let radius = (body.invariants().inertia()[(1, 1)] / body.invariants().mass()).sqrt();
        // Second-order motion of nodes whose modes rotate with the body: some hundredths of the first
        // stiffness.
        let sizes = [0.5, 0.5 / radius, 0.5];
        let single = (0..3).map(|at| at..at + 1);
        for kinds in single.chain(std::iter::once(0..3)) {
            let mut random = Random(5);
            let stiff = kinds
                .clone()
                .fold(body.clone(), |body, at| stressed(body, &motion[at..=at], sizes[at], &mut random));
            let gravity = Vector3::new(0.2, -0.5, 1.0) * (0.02 * lambda * radius);
            let equations = EquationsOfMotion::new(&stiff, Terms::ALL);
            let potential = |y: &DVector<f64>| {
                let mut at = Evaluation::new(&equations);
                at.set(y.rows(7, equations.n_modes()).as_slice(), &vec![0.0; equations.n_velocities()]);
                let s = orientation(y).axes() * at.first_moment();
                -gravity.dot(&(body.invariants().mass() * y.fixed_rows::<3>(0) + s))
            };
            let load = |at: &Evaluation<'_>, axes: &Matrix3<f64>, _: &DVector<f64>, forces: &mut [f64]| {
                at.add_gravity(&(axes.transpose() * gravity), forces);
            };
            let drift = tumble(&stiff, Terms::ALL, load, potential);
            assert!(drift.energy < 1e-10 && drift.deformation > 0.05, "{kinds:?}: {drift:?}");
            let free = tumble(&stiff, Terms::ALL, nothing, |_| 0.0);
            assert!(free.worst() < 1e-10 && free.turns > 2.0, "{kinds:?}: {free:?}");
            // The geometric stiffness has an effect.
            let without = Terms { geometric_stiffness: false, ..Terms::ALL };
            let soft = tumble(&stiff, without, nothing, |_| 0.0);
            assert!((soft.deformation / free.deformation - 1.0).abs() > 1e-6, "{kinds:?}");
        }
    }
}

/// Misprint [WP19] (16) and guideline IV: 2 Q'W2 Qd in place of Q'W2 Qd + Qd'W2 Q, and the W3 term.
#[test]
fn misprinted_coriolis_terms_lose_angular_momentum_and_hide_from_the_energy() {
    let body = soft_block(10);
    let (own, nf) = (oracle(&body).reduced, body.n_modes());
    let misprint = |_: &Evaluation<'_>, _: &Matrix3<f64>, y: &DVector<f64>, forces: &mut [f64]| {
        let kron = |at: usize| DMatrix::<f64>::identity(3, 3).kronecker(&y.rows(at, nf).into_owned());
        let mixed = kron(7).transpose() * &own.w2 * kron(13 + nf);
        let torque = (mixed.transpose() - mixed) * y.rows(10 + nf, 3);
        (0..3).for_each(|k| forces[3 + k] += torque[k]);
    };
    let drift = tumble(&body, Terms::ALL, misprint, |_| 0.0);
    assert!(drift.angular > 1e-4, "{drift:?}");
    assert!(drift.energy < 1e-10 && drift.linear < 1e-10, "{drift:?}");
}

/// Gravity is the gradient of -g'(m R + A (c + C1 q)), for general masses too.
#[test]
fn gravity_keeps_the_energy() {
    for name in ["frame_beams", "mpc_block"] {
        let body = fixture(name, 6, BodyFrame::Model);
        let (own, nf) = (oracle(&body).reduced, 6);
        let omega = body.modes().eigenvalue[0].sqrt();
        let size = body.invariants().inertia()[(1, 1)].sqrt() / own.mass.sqrt();
        let gravity = Vector3::new(0.2, -0.5, 1.0) * (0.01 * omega * omega * size);
        let load = |at: &Evaluation<'_>, axes: &Matrix3<f64>, _: &DVector<f64>, forces: &mut [f64]| {
            at.add_gravity(&(axes.transpose() * gravity), forces);
        };
        // s(q) = c + C1 q + q'K^a q / 2, with the stiffness of inertia of rotating nodes.
        let potential = |y: &DVector<f64>| {
            let q = y.rows(7, nf);
            let of_inertia = body.inertia_stiffness().into_iter().flat_map(|own| &own.stiffness);
            let mut s = own.first_moment + Vector3::from_column_slice((&own.c1 * q).as_slice());
            for stiffness in of_inertia.filter(|stiffness| stiffness.load.kind == LoadKind::Acceleration) {
                s[stiffness.load.component] += 0.5 * q.dot(&(dense(&stiffness.matrix) * q));
            }
            -gravity.dot(&(own.mass * y.fixed_rows::<3>(0) + orientation(y).axes() * s))
        };
        let drift = tumble(&body, Terms::ALL, load, potential);
        assert!(drift.energy < 1e-10 && drift.linear > 0.1, "{name}: {drift:?}");
    }
}

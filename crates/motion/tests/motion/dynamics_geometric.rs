//! Geometric stiffness in the equations of motion: it equals theory (7.3), and the second-order motion of the
//! nodes.

use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::flexible::{fixture, invariants_of, made_of, stressed};
use oracle::general::{NodalBody, Row, RowKind, random_matrix, to_faer};
use oracle::random::Random;

const MOTION: [LoadKind; 3] = [LoadKind::Spin, LoadKind::Acceleration, LoadKind::AngularAcceleration];

/// Returns the sum of the matrices of a kind times `amounts`, in the order of its components, times q.
fn product(body: &FlexBody, kind: &LoadKind, amounts: &[f64], q: &[f64]) -> DVector<f64> {
    let mut sum = DVector::zeros(q.len());
    for stiffness in body.geometric_stiffness().iter().filter(|stiffness| stiffness.load.kind == *kind) {
        for i in 0..q.len() {
            let row: f64 = (0..q.len()).map(|j| stiffness.matrix[(i, j)] * q[j]).sum();
            sum[i] += amounts[stiffness.load.component] * row;
        }
    }
    sum
}

/// (7.3): the modal forces with geometric stiffness exceed those without by K_geo q.
#[test]
fn the_modes_are_stiffened_by_the_motion_of_the_frame() {
    for (at, name) in ["bracket_hex20", "frame_beams", "plane_frame"].into_iter().enumerate() {
        let mut parts = fixture(name, 6, BodyFrame::Model).into_parts();
        // The elastic stiffness would dominate the difference.
        parts.invariants.primary_mut().modal_stiffness = Mat::zeros(6, 6);
        let plain = FlexBody::new(parts).expect("valid parts");
        for kinds in [&MOTION[..1], &MOTION[1..2], &MOTION[2..], &MOTION] {
            let mut random = Random(at as u64);
            let body = stressed(plain.clone(), kinds, 1.0, &mut random);
            let equations = EquationsOfMotion::new(&body, Terms::ALL);
            let (n, nf, r) = (equations.n_velocities(), equations.n_modes(), equations.n_rigid());
            let mut numbers = |n: usize| -> Vec<f64> { (0..n).map(|_| random.signed()).collect() };
            let (q, nu, acceleration) = (numbers(nf), numbers(n), numbers(n));
            let modal = |terms: Terms| {
                let equations = EquationsOfMotion::new(&body, terms);
                let mut evaluation = Evaluation::new(&equations);
                evaluation.set(&q, &nu);
                let mut forces = vec![0.0; n];
                evaluation.balance(&acceleration, &mut forces);
                DVector::from_column_slice(&forces[r..])
            };
            let without = modal(Terms { geometric_stiffness: false, ..Terms::ALL });
            let found = modal(Terms::ALL) - &without;
            let split = |x: &[f64]| match r {
                3 => (Vector3::new(x[0], x[1], 0.0), Vector3::new(0.0, 0.0, x[2])),
                _ => (Vector3::from_column_slice(&x[..3]), Vector3::from_column_slice(&x[3..6])),
            };
            let ((v, w), (rate, alpha)) = (split(&nu), split(&acceleration));
            let products: Vec<f64> = LoadKind::SPIN.iter().map(|&(k, l)| w[k] * w[l]).collect();
            let expected = product(&body, &LoadKind::Spin, &products, &q)
                + product(&body, &LoadKind::Acceleration, (rate + w.cross(&v)).as_slice(), &q)
                + product(&body, &LoadKind::AngularAcceleration, alpha.as_slice(), &q);
            let error = (&found - &expected).norm();
            assert!(error < 1e-13 * (without.norm() + expected.norm()), "{name} {kinds:?}: {error:e}");
            assert!(expected.norm() > 1e-3 * without.norm(), "{name} {kinds:?}");
        }
    }
}

/// Masses at points that move by x + Psi q plus the second-order motion q'H q / 2.
struct Points {
    mass: Vec<f64>,
    positions: Vec<Vector3<f64>>,
    /// Shape of point i along k in row 3 i + k.
    shapes: DMatrix<f64>,
    /// H of point i along k at index 3 i + k.
    second: Vec<DMatrix<f64>>,
}

impl Points {
    fn random(random: &mut Random, nf: usize) -> Self {
        let n = 4;
        let symmetric = |random: &mut Random| {
            let a = random_matrix(random, nf, nf);
            &a + a.transpose()
        };
        Self {
            mass: (0..n).map(|_| 1.5 + random.signed()).collect(),
            positions: (0..n).map(|_| Vector3::from(random.vector::<3>())).collect(),
            shapes: random_matrix(random, 3 * n, nf),
            second: (0..3 * n).map(|_| symmetric(random)).collect(),
        }
    }

    /// Returns sum_i m_i H_ik f_ik for a field f.
    fn weighted(&self, field: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Mat<f64> {
        let nf = self.shapes.ncols();
        let mut sum = DMatrix::zeros(nf, nf);
        for (i, (mass, x)) in self.mass.iter().zip(&self.positions).enumerate() {
            let f = field(x) * *mass;
            (0..3).for_each(|k| sum += &self.second[3 * i + k] * f[k]);
        }
        to_faer(&sum)
    }

    /// Returns the body with geometric stiffness by its definition: the inertia forces -M a of a unit load do
    /// the work -q'K q / 2 on the second-order motion.
    fn body(&self) -> FlexBody {
        let (n, nf) = (self.mass.len(), self.shapes.ncols());
        let mass = DMatrix::from_fn(3 * n, 3 * n, |i, j| if i == j { self.mass[i / 3] } else { 0.0 });
        let stiffness = DMatrix::from_fn(3 * n, 3 * n, |i, j| f64::from(i == j));
        let rows: Vec<Row> =
            (0..3 * n).map(|row| Row { kind: RowKind::Displacement, node: row / 3, axis: row % 3 }).collect();
        let positions: Vec<[f64; 3]> = self.positions.iter().map(|x| (*x).into()).collect();
        let shapes = to_faer(&self.shapes);
        let nodal = NodalBody::new(&to_faer(&stiffness), &to_faer(&mass), &rows, &positions, &shapes);
        let plain = made_of(invariants_of(&nodal.invariants(), true), positions, shapes, Mat::zeros(nf, nf));
        let mut parts = plain.into_parts();
        let mut give = |kind: LoadKind, component: usize, matrix: Mat<f64>| {
            let load = UnitLoad { kind, component };
            parts.geometric_stiffness.push(GeometricStiffness { load, matrix });
        };
        for k in 0..3 {
            let e = Vector3::ith(k, 1.0);
            give(LoadKind::Acceleration, k, self.weighted(|_| e));
            give(LoadKind::AngularAcceleration, k, self.weighted(|x| e.cross(x)));
        }
        for (component, &(k, l)) in LoadKind::SPIN.iter().enumerate() {
            let (e, f) = (Vector3::ith(k, 1.0), Vector3::ith(l, 1.0));
            give(
                LoadKind::Spin,
                component,
                self.weighted(|x| {
                    if k == l { e.cross(&e.cross(x)) } else { e.cross(&f.cross(x)) + f.cross(&e.cross(x)) }
                }),
            );
        }
        FlexBody::new(parts).expect("valid parts")
    }

    /// Returns kinetic energy, momentum and angular momentum about the origin with all powers of q.
    fn motion(
        &self,
        q: &DVector<f64>,
        qd: &DVector<f64>,
        v: &Vector3<f64>,
        w: &Vector3<f64>,
    ) -> (f64, Vector3<f64>, Vector3<f64>) {
        let (mut energy, mut linear, mut angular) = (0.0, Vector3::zeros(), Vector3::zeros());
        for (i, (mass, x)) in self.mass.iter().zip(&self.positions).enumerate() {
            let at = |f: &dyn Fn(usize) -> f64| Vector3::from_fn(|k, _| f(3 * i + k));
            let place = x + at(&|row| {
                (self.shapes.row(row) * q)[0] + 0.5 * (q.transpose() * &self.second[row] * q)[0]
            });
            let rate =
                at(&|row| (self.shapes.row(row) * qd)[0] + (q.transpose() * &self.second[row] * qd)[0]);
            let velocity = v + w.cross(&place) + rate;
            energy += 0.5 * mass * velocity.norm_squared();
            linear += velocity * *mass;
            angular += place.cross(&velocity) * *mass;
        }
        (energy, linear, angular)
    }
}

/// Kinetic energy, momentum and first moment agree with masses whose motion is known to second order; the
/// difference is of third order.
#[test]
fn geometric_stiffness_is_the_inertia_of_motion_of_second_order() {
    let mut random = Random(17);
    let points = Points::random(&mut random, 3);
    let body = points.body();
    let (v, w) = (Vector3::from(random.vector::<3>()), Vector3::from(random.vector::<3>()));
    let (q, qd) =
        (DVector::from(random.vector::<3>().to_vec()), DVector::from(random.vector::<3>().to_vec()));
    let errors = |size: f64, terms: Terms| {
        let equations = EquationsOfMotion::new(&body, terms);
        let mut evaluation = Evaluation::new(&equations);
        let (q, qd) = (&q * size, &qd * size);
        let nu: Vec<f64> = v.iter().chain(&w).chain(&qd).copied().collect();
        evaluation.set(q.as_slice(), &nu);
        let (energy, linear, angular) = points.motion(&q, &qd, &v, &w);
        [
            (evaluation.kinetic_energy() - energy).abs(),
            (evaluation.linear_momentum() - linear).norm(),
            (evaluation.angular_momentum() - angular).norm(),
        ]
    };
    let (coarse, fine) = (errors(1e-2, Terms::ALL), errors(5e-3, Terms::ALL));
    // The momentum is complete.
    assert!(fine[1] < 1e-14, "{fine:?}");
    for at in [0, 2] {
        let order = (coarse[at] / fine[at]).log2();
        assert!((order - 3.0).abs() < 0.1, "order {order}, {at}");
    }
    // Without geometric stiffness the error is of second order.
    let without = Terms { geometric_stiffness: false, ..Terms::ALL };
    let (coarse, fine) = (errors(1e-2, without), errors(5e-3, without));
    for at in 0..3 {
        let order = (coarse[at] / fine[at]).log2();
        assert!((order - 2.0).abs() < 0.1, "order {order} without, {at}");
    }
}

/// Momenta change by p' = F - omega x p, h' = tau - omega x h - V x p and `modal_momentum_rate`: they are
/// cubic in time along straight lines, for which five points are exact.
#[test]
fn momenta_change_as_their_rates_say() {
    for (at, name) in ["bracket_hex20", "frame_beams"].into_iter().enumerate() {
        let mut random = Random(30 + at as u64);
        let mut parts = fixture(name, 5, BodyFrame::Model).into_parts();
        parts.invariants.primary_mut().modal_stiffness = Mat::zeros(5, 5);
        let body = stressed(FlexBody::new(parts).expect("valid parts"), &MOTION, 0.3, &mut random);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let mut evaluation = Evaluation::new(&equations);
        let mut numbers = |n: usize| DVector::from_fn(n, |_, _| 0.3 * random.signed());
        let (q, nu, applied) = (numbers(5) * 0.03, numbers(11), numbers(11));
        evaluation.set(q.as_slice(), nu.as_slice());
        let (mut rates, mut acceleration) = (applied.clone(), DVector::zeros(11));
        evaluation.modal_momentum_rate(&applied.as_slice()[6..], &mut rates.as_mut_slice()[6..]);
        evaluation.accelerations(applied.as_slice(), acceleration.as_mut_slice()).expect("a body");
        let (w, p, h) =
            (nu.fixed_rows::<3>(3).into_owned(), evaluation.linear_momentum(), evaluation.angular_momentum());
        let turned = nu.fixed_rows::<3>(0).cross(&p);
        let mut torque = rates.fixed_rows_mut::<3>(3);
        torque -= turned;
        let mut momenta = |time: f64| {
            evaluation.set((&q + nu.rows(6, 5) * time).as_slice(), (&nu + &acceleration * time).as_slice());
            let mut pi = vec![0.0; 5];
            evaluation.modal_momentum(&mut pi);
            let (p, h) = (evaluation.linear_momentum(), evaluation.angular_momentum());
            DVector::from_iterator(11, p.iter().chain(&h).chain(&pi).copied())
        };
        let step = 0.1 / acceleration.norm().max(1.0);
        let near = (momenta(step) - momenta(-step)) * (8.0 / 12.0 / step);
        let mut found = near - (momenta(2.0 * step) - momenta(-2.0 * step)) / (12.0 * step);
        for (first, carried) in [(0, w.cross(&p)), (3, w.cross(&h))] {
            let mut part = found.fixed_rows_mut::<3>(first);
            part += carried;
        }
        let error = (&found - &rates).norm() / (rates.norm() + momenta(0.0).norm() / step);
        assert!(error < 1e-13, "{name}: {error:e}");
    }
}

/// Terms are switched independently.
#[test]
fn geometric_stiffness_stays_without_the_inertia_that_it_corrects() {
    let body = stressed(fixture("bracket_hex20", 4, BodyFrame::Principal), &MOTION, 1.0, &mut Random(3));
    let (q, nu): (Vec<f64>, Vec<f64>) = ((0..4).map(|j| 0.1 * j as f64).collect(), vec![0.3; 10]);
    let forces = |terms: Terms| {
        let equations = EquationsOfMotion::new(&body, terms);
        let mut evaluation = Evaluation::new(&equations);
        evaluation.set(&q, &nu);
        let mut forces = DVector::zeros(10);
        evaluation.balance(&[0.7; 10], forces.as_mut_slice());
        forces
    };
    let only = Terms { geometric_stiffness: true, stress_without_w2: true, ..Terms::NONE };
    let all_but = Terms { geometric_stiffness: false, ..Terms::ALL };
    let (alone, beside) = (forces(only) - forces(Terms::NONE), forces(Terms::ALL) - forces(all_but));
    assert!(alone.norm() > 0.0 && (&alone - &beside).norm() < 1e-13 * forces(Terms::ALL).norm());
    // That of the spin is left out with W2, which it corrects; that of other loads stays.
    let without = forces(Terms { stress_without_w2: false, ..only }) - forces(Terms::NONE);
    assert!(without.norm() > 0.0 && (&without - &alone).norm() > 1e-3 * alone.norm());
}

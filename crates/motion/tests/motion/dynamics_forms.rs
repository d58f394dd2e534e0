//! Equations of motion in other coordinates of the rotation, and in the plane.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_motion::dynamics::{
    AngularVelocity, EquationsOfMotion, EulerParameters, Evaluation, Orientation, PlaneAngle, RotationVector,
    Terms,
};
use nalgebra::{DMatrix, DVector, Matrix2, SMatrix, SVector, Vector2, Vector3};
use oracle::flexible::{body_of, fixture, oracle, to_first_order};
use oracle::plane::rectangle;
use oracle::random::Random;

/// Returns the derivative at 0 to the sixth order in the step; its rounding is that of f divided by the step.
fn slope<const R: usize, const C: usize>(f: impl Fn(f64) -> SMatrix<f64, R, C>) -> SMatrix<f64, R, C> {
    let h = 0.003;
    let difference = |k: f64| f(k * h) - f(-k * h);
    (difference(1.0) * 45.0 - difference(2.0) * 9.0 + difference(3.0)) / (60.0 * h)
}

/// Asserts that A' dA/dt is the skew matrix of omega = G theta', and dG/dt theta' the drift.
fn assert_kinematics<const R: usize, O: Orientation<R>>(
    make: impl Fn(&SVector<f64, R>) -> O,
    theta: &SVector<f64, R>,
    rate: &SVector<f64, R>,
) {
    let at = make(theta);
    let axes = at.axes();
    assert!((axes.transpose() * axes - SMatrix::<f64, 3, 3>::identity()).norm() < 1e-14);
    let turning = axes.transpose() * slope(|t| make(&(theta + rate * t)).axes());
    let omega = at.map() * rate;
    assert!((turning - omega.cross_matrix()).norm() < 1e-11, "{theta}: omega");
    let drift = slope(|t| make(&(theta + rate * t)).map()) * rate;
    assert!((drift - at.drift(rate)).norm() < 1e-11, "{theta}: drift");
}

#[test]
fn maps_of_the_rotation_are_its_derivatives() {
    let mut random = Random(1);
    for angle in [0.0, 1e-9, 1e-4, 0.3, 0.999, 1.001, 2.0, 3.1, 5.0] {
        let axis = Vector3::from(random.vector::<3>()).normalize();
        let rate = Vector3::from(random.vector::<3>());
        assert_kinematics(|v| RotationVector(*v), &(axis * angle), &rate);
        let half: f64 = 0.5 * angle;
        let e = axis * half.sin();
        let p = SVector::<f64, 4>::new(half.cos(), e.x, e.y, e.z);
        // Rates of unit Euler parameters are orthogonal to them.
        let any = SVector::<f64, 4>::from(random.vector::<4>());
        let rate: SVector<f64, 4> = any - p * p.dot(&any);
        let at = EulerParameters(p.into());
        let difference = at.axes() - RotationVector(axis * angle).axes();
        assert!(difference.norm() < 1e-14, "the same rotation");
        let omega = at.map() * rate;
        assert!((SVector::<f64, 4>::from(at.rate(&omega)) - rate).norm() < 1e-15);
        // On the unit sphere, along a great circle.
        let circle = |t: f64| {
            let angle = rate.norm() * t;
            EulerParameters((p * angle.cos() + rate.normalize() * angle.sin()).into())
        };
        let turning = at.axes().transpose() * slope(|t| circle(t).axes());
        assert!((turning - omega.cross_matrix()).norm() < 1e-11, "{angle}: omega");
        // Identity G(p') p' = 0.
        assert!((EulerParameters(rate.into()).map() * rate).norm() < 1e-15);
    }
    assert_kinematics(|a| PlaneAngle(a[0]), &SVector::<f64, 1>::new(0.7), &SVector::<f64, 1>::new(1.3));
}

/// Series and closed form of the rotation vector agree.
#[test]
fn small_and_large_rotation_vectors_meet() {
    let axis = Vector3::new(0.6, -0.48, 0.64);
    let rate = Vector3::new(0.3, 1.0, -0.2);
    let (below, above) = (RotationVector(axis * (1.0 - 1e-12)), RotationVector(axis * (1.0 + 1e-12)));
    assert!((below.axes() - above.axes()).norm() < 1e-11);
    assert!((below.map() - above.map()).norm() < 1e-11);
    assert!((below.drift(&rate) - above.drift(&rate)).norm() < 1e-11);
}

/// Asserts nu = H x' and, for any x'': H'(Mc nu' + h) = H'Mc H x'' + H'(Mc dH/dt x' + h).
fn assert_form<const R: usize>(body: &FlexBody, orientation: &impl Orientation<R>, random: &mut Random) {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let (nf, n) = (equations.n_modes(), equations.n_velocities());
    let d = if body.dimension() == 2 { 2 } else { 3 };
    let size = d + R + nf;
    let mut numbers = |n: usize| DVector::from_fn(n, |_, _| random.signed());
    let (q, rates, accelerations) = (numbers(nf), numbers(size), numbers(size));
    let mut nu = DVector::zeros(n);
    equations.velocities(orientation, rates.as_slice(), nu.as_mut_slice());
    let mut evaluation = Evaluation::new(&equations);
    evaluation.set(q.as_slice(), nu.as_slice());

    // H, row by row from its definition.
    let mut h = DMatrix::zeros(n, size);
    for (row, axis) in (if d == 2 { vec![0, 1, 5] } else { vec![0, 1, 2, 3, 4, 5] }).into_iter().enumerate() {
        for k in 0..d {
            h[(row, k)] = if axis < 3 { orientation.axes()[(k, axis)] } else { 0.0 };
        }
        for k in 0..R {
            h[(row, d + k)] = if axis < 3 { 0.0 } else { orientation.map()[(axis - 3, k)] };
        }
    }
    (0..nf).for_each(|j| h[(n - nf + j, d + R + j)] = 1.0);
    assert!((&h * &rates - &nu).norm() < 1e-14 * nu.norm());
    let theta = SVector::<f64, R>::from_column_slice(&rates.as_slice()[d..d + R]);
    let omega = orientation.map() * theta;
    let velocity = Vector3::new(nu[0], nu[1], if d == 3 { nu[2] } else { 0.0 });
    let (apparent, drift) = (-omega.cross(&velocity), orientation.drift(&theta));
    let mut nu_rate = &h * &accelerations;
    for k in 0..d {
        nu_rate[k] += apparent[k];
    }
    (if d == 2 { 2..3 } else { 0..3 }).enumerate().for_each(|(i, k)| nu_rate[d + i] += drift[k]);

    let mut matrix = vec![0.0; n * n];
    evaluation.mass_matrix(&mut matrix);
    let of_nu = DMatrix::from_row_slice(n, n, &matrix) * &nu_rate
        + DVector::from_column_slice(evaluation.velocity_forces());
    let mut carried = DVector::zeros(size);
    equations.forces(orientation, of_nu.as_slice(), carried.as_mut_slice());
    assert!((h.transpose() * &of_nu - &carried).norm() < 1e-13 * carried.norm());

    let (mut matrix, mut forces) = (vec![0.0; size * size], DVector::zeros(size));
    evaluation.mass_matrix_of(orientation, &mut matrix);
    evaluation.velocity_forces_of(orientation, &theta, forces.as_mut_slice());
    let matrix = DMatrix::from_row_slice(size, size, &matrix);
    assert_eq!(matrix, matrix.transpose());
    let found = matrix * &accelerations + forces;
    assert!((found - &carried).norm() < 1e-13 * carried.norm());
}

#[test]
fn other_coordinates_have_the_same_equations() {
    let mut random = Random(5);
    for name in ["cube_hex8", "frame_beams"] {
        let body = fixture(name, 8, BodyFrame::Model);
        assert_form(&body, &AngularVelocity { axes: random.rotation() }, &mut random);
        let p = SVector::<f64, 4>::from(random.vector::<4>()).normalize();
        assert_form(&body, &EulerParameters(p.into()), &mut random);
        for size in [0.1, 2.0] {
            assert_form(&body, &RotationVector(Vector3::from(random.vector::<3>()) * size), &mut random);
        }
    }
    for body in [
        fixture("plane_frame", 6, BodyFrame::Model),
        body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 8, BodyFrame::Model),
    ] {
        assert_form(&body, &PlaneAngle(0.8), &mut random);
    }
}

/// Equations (4.1) and (4.2) in their printed form.
#[test]
fn plane_bodies_have_the_terms_of_section_four() {
    let body = body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 8, BodyFrame::Model);
    let (nf, own) = (8, oracle(&body).reduced);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    assert_eq!((equations.n_rigid(), equations.n_velocities()), (3, 3 + nf));
    let mut random = Random(3);
    let mut numbers = |n: usize| DVector::from_fn(n, |_, _| random.signed());
    let (q, qd, rates, angle) = (numbers(nf), numbers(nf), numbers(3), PlaneAngle(0.4));
    let spin = rates[2];
    let all = DVector::from_iterator(3 + nf, rates.iter().chain(qd.iter()).copied());
    let mut nu = vec![0.0; 3 + nf];
    equations.velocities(&angle, all.as_slice(), &mut nu);
    let mut evaluation = Evaluation::new(&equations);
    evaluation.set(q.as_slice(), &nu);

    let a = Matrix2::new(0.4f64.cos(), -0.4f64.sin(), 0.4f64.sin(), 0.4f64.cos());
    let a_theta = -a * Matrix2::new(0.0, 1.0, -1.0, 0.0);
    let c1 = own.c1.rows(0, 2).into_owned();
    let plane = |v: DVector<f64>| Vector2::new(v[0], v[1]);
    let s = own.first_moment.xy() + plane(&c1 * &q);
    let b = (own.w1.view((2, 2 * nf), (1, nf)) * 0.5).transpose();
    let w3 = own.w3.rows(2 * nf, nf).into_owned();
    let (c2, m_ff) = (own.c2.row(2).transpose(), &own.modal_mass);
    let mut matrix = DMatrix::zeros(3 + nf, 3 + nf);
    let turned = a_theta * s;
    for k in 0..2 {
        matrix[(k, k)] = own.mass;
        matrix[(k, 2)] = turned[k];
        let row = a.row(k) * &c1;
        (0..nf).for_each(|j| matrix[(k, 3 + j)] = row[j]);
    }
    matrix[(2, 2)] = own.inertia[(2, 2)] + 2.0 * b.dot(&q) + q.dot(&(m_ff * &q));
    let coupling = c2 + w3.transpose() * &q;
    (0..nf).for_each(|j| matrix[(2, 3 + j)] = coupling[j]);
    matrix.view_mut((3, 3), (nf, nf)).copy_from(m_ff);
    matrix.fill_lower_triangle_with_upper_triangle();
    let of_origin = -a * s * (spin * spin) + a_theta * plane(&c1 * &qd) * (2.0 * spin);
    let of_angle = 2.0 * spin * (b.dot(&qd) + q.dot(&(m_ff * &qd)));
    let of_modes = -(&b + m_ff * &q) * (spin * spin) - &w3 * &qd * (2.0 * spin);
    let expected = of_origin.iter().copied().chain([of_angle]).chain(of_modes.iter().copied());
    let expected = DVector::from_iterator(3 + nf, expected);

    let (mut found, mut forces) = (vec![0.0; (3 + nf) * (3 + nf)], DVector::zeros(3 + nf));
    evaluation.mass_matrix_of(&angle, &mut found);
    evaluation.velocity_forces_of(&angle, &SVector::<f64, 1>::new(spin), forces.as_mut_slice());
    let found = DMatrix::from_row_slice(3 + nf, 3 + nf, &found);
    assert!((found - &matrix).norm() < 1e-13 * matrix.norm(), "mass matrix");
    assert!((&forces - &expected).norm() < 1e-13 * expected.norm(), "{forces} {expected}");
}

/// Section 6 in the plane by differences of the kinetic energy, which is quadratic in q: h = dMc/dt nu +
/// (omega x p, V x p, -dT/dq).
#[test]
fn plane_bodies_with_any_mass_follow_from_their_kinetic_energy() {
    let body = to_first_order(fixture("plane_frame", 8, BodyFrame::Model));
    let (nf, own) = (8, oracle(&body));
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let mut random = Random(9);
    let mut numbers = |n: usize| DVector::from_fn(n, |_, _| random.signed());
    let (q, nu) = (numbers(nf), numbers(3 + nf));
    let mut evaluation = Evaluation::new(&equations);
    evaluation.set(q.as_slice(), nu.as_slice());
    let keep: Vec<usize> = [0, 1, 5].into_iter().chain(6..6 + nf).collect();
    let matrix = |q: &DVector<f64>| own.mass_matrix(q).select_rows(&keep).select_columns(&keep);
    let mut found = vec![0.0; (3 + nf) * (3 + nf)];
    evaluation.mass_matrix(&mut found);
    let found = DMatrix::from_row_slice(3 + nf, 3 + nf, &found);
    assert!((found - matrix(&q)).norm() < 1e-13 * matrix(&q).norm());

    let qd = nu.rows(3, nf).into_owned();
    let momenta = matrix(&q) * &nu;
    let mut expected = (matrix(&(&q + &qd * 0.5)) - matrix(&(&q - &qd * 0.5))) * &nu;
    expected[0] -= nu[2] * momenta[1];
    expected[1] += nu[2] * momenta[0];
    expected[2] += nu[0] * momenta[1] - nu[1] * momenta[0];
    for j in 0..nf {
        let step = DVector::from_fn(nf, |i, _| if i == j { 0.5 } else { 0.0 });
        let energy = |q: DVector<f64>| 0.5 * nu.dot(&(matrix(&q) * &nu));
        expected[3 + j] -= energy(&q + &step) - energy(&q - &step);
    }
    let forces = DVector::from_column_slice(evaluation.velocity_forces());
    assert!((&forces - &expected).norm() < 1e-12 * expected.norm(), "{forces} {expected}");
}

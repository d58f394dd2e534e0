//! Canonical principal axes of inertia: independent of numbering, thread count and initial orientation of a
//! symmetric body.

use nalgebra::{Matrix3, Vector3};

/// Relative difference below which moments count as equal. Rounding of the moments is about 1e-15, so that
/// axes of moments this close are known to six digits; axes of closer moments would turn noise into a
/// rotation.
const EQUAL_MOMENTS: f64 = 1e-9;
/// Relative difference below which components count as equal in the search for the largest one, so that
/// rounding does not decide.
const EQUAL_COMPONENTS: f64 = 1e-6;

/// Returns the principal axes (columns, right-handed, moments ascending) of an inertia in model axes.
///
/// An axis of a distinct moment is positive along its largest component (the first such). Within a plane of
/// equal moments the first axis is the projection of the model axis closest to the plane (the first such);
/// three equal moments give the model axes themselves. The last axis closes the right-handed frame.
pub fn principal_axes(inertia: &Matrix3<f64>) -> Matrix3<f64> {
    let (moments, vectors) = jacobi(inertia);
    let equal = |a: usize, b: usize| moments[b] - moments[a] <= EQUAL_MOMENTS * moments[2].abs();
    match (equal(0, 1), equal(1, 2)) {
        (true, true) => Matrix3::identity(),
        (true, false) => {
            let normal = positive(&vectors[2]);
            let first = in_plane(&normal);
            Matrix3::from_columns(&[first, normal.cross(&first), normal])
        }
        (false, true) => {
            let normal = positive(&vectors[0]);
            let first = in_plane(&normal);
            Matrix3::from_columns(&[normal, first, normal.cross(&first)])
        }
        (false, false) => {
            let (first, second) = (positive(&vectors[0]), positive(&vectors[1]));
            Matrix3::from_columns(&[first, second, first.cross(&second)])
        }
    }
}

/// Returns the first index whose value is the largest up to rounding.
fn first_largest(values: [f64; 3]) -> usize {
    let largest = values.iter().copied().fold(0.0, f64::max);
    values.iter().position(|&v| v >= largest * (1.0 - EQUAL_COMPONENTS)).unwrap_or(0)
}

fn positive(v: &Vector3<f64>) -> Vector3<f64> {
    let largest = first_largest([v.x.abs(), v.y.abs(), v.z.abs()]);
    if v[largest] < 0.0 { -v } else { *v }
}

/// Returns the direction in the plane normal to `normal` that is closest to a model axis.
fn in_plane(normal: &Vector3<f64>) -> Vector3<f64> {
    let length = |k: usize| (1.0 - normal[k] * normal[k]).max(0.0);
    let k = first_largest([length(0), length(1), length(2)]);
    let mut direction = -normal * normal[k];
    direction[k] += 1.0;
    direction.normalize()
}

/// Returns the eigenvalues, ascending, and the eigenvectors of a symmetric 3x3 matrix by cyclic Jacobi
/// rotations.
///
/// Jacobi and not QR: off-diagonal entries at rounding level are not touched, so that a body whose
/// principal axes are the model axes keeps its coordinates exactly, and small moments of needles keep their
/// digits.
fn jacobi(matrix: &Matrix3<f64>) -> ([f64; 3], [Vector3<f64>; 3]) {
    let mut a = *matrix;
    let mut v = Matrix3::<f64>::identity();
    // Convergence is quadratic: five sweeps suffice. The limit only ends a loop over NaN.
    for _sweep in 0..32 {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let negligible = 4.0 * f64::EPSILON * (a[(p, p)].abs() * a[(q, q)].abs()).sqrt();
            if a[(p, q)].abs() <= negligible {
                continue;
            }
            rotated = true;
            let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            let mut rotation = Matrix3::identity();
            (rotation[(p, p)], rotation[(p, q)]) = (c, s);
            (rotation[(q, p)], rotation[(q, q)]) = (-s, c);
            a = rotation.transpose() * a * rotation;
            (a[(p, q)], a[(q, p)]) = (0.0, 0.0);
            v *= rotation;
        }
        if !rotated {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[(i, i)].total_cmp(&a[(j, j)]));
    (order.map(|i| a[(i, i)]), order.map(|i| v.column(i).normalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn diagonal(a: f64, b: f64, c: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(a, b, c))
    }

    fn is_right_handed(axes: &Matrix3<f64>) -> bool {
        (axes.transpose() * axes - Matrix3::identity()).amax() < 1e-15 && axes.determinant() > 0.0
    }

    #[test]
    fn distinct_moments_come_ascending_and_diagonal() {
        let turn = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let inertia = turn.matrix() * diagonal(5.0, 1.0, 3.0) * turn.matrix().transpose();
        let axes = principal_axes(&inertia);
        assert!(is_right_handed(&axes));
        assert!((axes.transpose() * inertia * axes - diagonal(1.0, 3.0, 5.0)).amax() < 4e-15);
        for k in 0..2 {
            assert!(
                axes.column(k)[axes.column(k).iamax()] > 0.0,
                "axis {k} is positive along its largest component"
            );
        }
    }

    #[test]
    fn three_equal_moments_give_the_model_axes() {
        let mut inertia = diagonal(4.5, 4.5 * (1.0 + 1e-13), 4.5);
        inertia[(0, 1)] = 1e-14;
        inertia[(1, 0)] = 1e-14;
        assert_eq!(principal_axes(&inertia), Matrix3::identity());
    }

    #[test]
    fn noise_in_a_plane_of_equal_moments_does_not_turn_the_axes() {
        // A disc about z and a bar along z.
        for (moments, expected) in [
            (diagonal(1.0, 1.0, 2.0), Matrix3::identity()),
            (diagonal(2.0, 2.0, 1.0), Matrix3::new(0., 1., 0., 0., 0., 1., 1., 0., 0.)),
        ] {
            for (i, sign) in [(0, 1.0), (1, -1.0)] {
                let mut inertia = moments;
                inertia[(i, i)] *= 1.0 + sign * 3e-12;
                inertia[(0, 1)] = sign * 7e-12;
                inertia[(1, 0)] = sign * 7e-12;
                assert_eq!(principal_axes(&inertia), expected);
            }
        }
    }

    #[test]
    fn tilted_disc_has_the_projected_model_axis_whatever_the_noise() {
        let normal = Vector3::new(1.0, 2.0, 2.0) / 3.0;
        let exact = Matrix3::identity() + normal * normal.transpose();
        for noise in [0.0, 1e-12, -1e-12] {
            let mut inertia = exact;
            inertia[(0, 2)] += noise;
            inertia[(2, 0)] += noise;
            let axes = principal_axes(&inertia);
            assert!(is_right_handed(&axes));
            // x is closest to the plane: its projection is x - n (n.x).
            let first = (Vector3::x() - normal * normal.x).normalize();
            assert!((axes.column(0) - first).amax() < 1e-11 && (axes.column(2) - normal).amax() < 1e-11);
        }
    }

    #[test]
    fn equal_components_take_the_sign_of_the_first() {
        let n = Vector3::new(-1.0, 1.0 + 1e-9, 0.0).normalize();
        let axes = principal_axes(&(Matrix3::identity() * 2.0 - n * n.transpose()));
        assert!(axes[(0, 0)] > 0.0 && axes[(1, 0)] < 0.0);
    }

    #[test]
    fn needle_keeps_the_digits_of_its_small_moment() {
        let turn = Rotation3::from_euler_angles(0.0, 0.0, 1e-4);
        let inertia = turn.matrix() * diagonal(1e-10, 1.0, 1.0) * turn.matrix().transpose();
        let axes = principal_axes(&inertia);
        assert!((axes.transpose() * inertia * axes)[(0, 0)] > 0.0);
        assert!((axes.column(0) - turn.matrix().column(0)).amax() < 1e-15);
    }

    #[test]
    fn numbers_that_are_not_finite_end_the_iteration() {
        principal_axes(&diagonal(f64::NAN, 1.0, 2.0));
        principal_axes(&Matrix3::from_element(f64::INFINITY));
        assert_eq!(principal_axes(&Matrix3::zeros()), Matrix3::identity());
    }
}

//! Rotations whose last bits are the same whatever the C library.

use libm::sin;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// Returns the rotation by `angle` (radians) about `axis` n,
///
/// ```text
/// R = 1 + sin(angle) [n x] + (1 - cos(angle)) [n x]^2
/// ```
///
/// (Rodrigues), as [`Rotation3::from_axis_angle`] does with the functions of the C library.
pub fn rotation(axis: &Unit<Vector3<f64>>, angle: f64) -> Rotation3<f64> {
    // 1 - cos without cancellation.
    let versine = 2.0 * sin(0.5 * angle).powi(2);
    let cross = axis.cross_matrix();
    Rotation3::from_matrix_unchecked(Matrix3::identity() + cross * sin(angle) + cross * cross * versine)
}

/// Returns the rotation about the direction of `vector` by its length, in radians.
pub fn rotation_by(vector: &Vector3<f64>) -> Rotation3<f64> {
    match Unit::try_new_and_get(*vector, 0.0) {
        Some((axis, angle)) => rotation(&axis, angle),
        None => Rotation3::identity(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_those_of_quaternions() {
        for angle in [0.0, 1e-9, 0.3, 1.0, std::f64::consts::FRAC_PI_2, 3.0, -7.0] {
            let axis = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.9));
            let expected = nalgebra::UnitQuaternion::from_axis_angle(&axis, angle).to_rotation_matrix();
            assert!((rotation(&axis, angle).matrix() - expected.matrix()).amax() < 4e-16, "{angle}");
            assert!((rotation_by(&(axis.into_inner() * angle)).matrix() - expected.matrix()).amax() < 2e-15);
        }
        assert_eq!(rotation_by(&Vector3::zeros()), Rotation3::identity());
    }

    #[test]
    fn quarter_turns_exchange_axes() {
        let quarter = rotation(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        assert!((quarter * Vector3::x() - Vector3::y()).amax() < 3e-16);
    }
}

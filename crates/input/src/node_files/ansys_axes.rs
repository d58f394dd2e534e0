//! Axes of rotated nodes of Ansys: three angles in degrees, THXY about z, THYZ about the rotated x, THZX about the
//! rotated y.

use flexbody_model::NodeAxes;
use nalgebra::{Rotation3, Vector3};

/// Returns the unit vectors along the rows of a node; `None` if all angles are zero.
pub(super) fn axes([xy, yz, zx]: [f64; 3]) -> Option<NodeAxes> {
    if [xy, yz, zx] == [0.0; 3] {
        return None;
    }
    let about = |axis, degrees: f64| Rotation3::from_axis_angle(&axis, degrees.to_radians());
    let turn = about(Vector3::z_axis(), xy) * about(Vector3::x_axis(), yz) * about(Vector3::y_axis(), zx);
    Some([Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (turn * axis).into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about z, then one about the rotated x, which points along y: z then points along x.
    #[test]
    fn angles_turn_about_axes_that_are_turned() {
        let turned = axes([90.0, 90.0, 0.0]).expect("turned");
        let expected = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        for (turned, expected) in turned.iter().flatten().zip(expected.iter().flatten()) {
            assert!((turned - expected).abs() < 1e-15, "{turned} {expected}");
        }
        assert_eq!(axes([0.0; 3]), None);
    }
}

//! Feature edges that show the form of a surface.

use libm::cos;
use nalgebra::Vector3;

/// Angle between two surfaces, in degrees, above which there is an edge between them.
const FEATURE_ANGLE_DEGREES: f64 = 30.0;

/// Side of a triangle that is an edge of its element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Side {
    /// Nodes of the side, in the direction of the triangle.
    pub step: [u32; 2],
    pub triangle: u32,
}

impl Side {
    fn key(&self) -> [u32; 2] {
        let [a, b] = self.step;
        [a.min(b), a.max(b)]
    }
}

/// Returns the sides where triangles meet at an angle, where more than two of them meet, and where the
/// surface ends; ascending.
pub(crate) fn feature_edges(
    triangles: &[[u32; 3]],
    mut sides: Vec<Side>,
    positions: &[[f64; 3]],
) -> Vec<[u32; 2]> {
    let normal = |side: &Side| normal(triangles[side.triangle as usize], positions);
    sides.sort_by_key(|side| (side.key(), side.triangle));
    let is_feature = |sharing: &&[Side]| match sharing {
        [one, other] => {
            // If both run along the edge in one direction, one of the shells is turned over.
            let turned = if one.step == other.step { -1.0 } else { 1.0 };
            let cosine = turned * normal(one).dot(&normal(other));
            // Triangles without area have no normal, and no feature edge.
            cosine < cos(FEATURE_ANGLE_DEGREES.to_radians())
                && normal(one) != Vector3::zeros()
                && normal(other) != Vector3::zeros()
        }
        _ => true,
    };
    let groups = sides.chunk_by(|a, b| a.key() == b.key());
    groups.filter(is_feature).map(|sharing| sharing[0].key()).collect()
}

/// Returns the unit normal of a triangle; zero if it has no area.
pub(crate) fn normal([a, b, c]: [u32; 3], positions: &[[f64; 3]]) -> Vector3<f64> {
    let x = |i: u32| Vector3::from(positions[i as usize]);
    let cross = (x(b) - x(a)).cross(&(x(c) - x(a)));
    cross.try_normalize(0.0).unwrap_or_default()
}

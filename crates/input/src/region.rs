//! Node sets by geometry: the nodes in a box, about an axis, in a plane, or nearest to a point.

use flexbody_model::Reference;
use nalgebra::Vector3;

/// Region that contains the nodes of a set, in model axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// Box between two corners, including its faces.
    Box {
        /// Smallest coordinates.
        min: [f64; 3],
        /// Largest coordinates.
        max: [f64; 3],
    },
    /// Hollow cylinder: distances from an axis, between its ends.
    Cylinder {
        /// One end of the axis.
        from: [f64; 3],
        /// Other end of the axis.
        to: [f64; 3],
        /// Smallest and largest distance from the axis.
        radius: [f64; 2],
    },
    /// Layer on both sides of a plane.
    Plane {
        /// A point of the plane.
        point: [f64; 3],
        /// Normal of the plane, of any length.
        normal: [f64; 3],
        /// Largest distance from the plane.
        within: f64,
    },
    /// Nodes nearest to a point.
    Nearest {
        /// Point from which distances are measured.
        point: [f64; 3],
        /// Number of nodes.
        count: usize,
    },
}

impl Region {
    /// Returns the nodes among `nodes` (number and position) in the region, in their order. Among equally near nodes
    /// the first ones are chosen.
    pub fn nodes(&self, nodes: impl Iterator<Item = (i64, [f64; 3])>) -> Vec<i64> {
        if let Self::Nearest { point, count } = *self {
            let away = |x: [f64; 3]| (Vector3::from(x) - Vector3::from(point)).norm();
            let mut all: Vec<(f64, usize, i64)> =
                nodes.enumerate().map(|(at, (id, x))| (away(x), at, id)).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            all.truncate(count);
            all.sort_by_key(|(_, at, _)| *at);
            return all.into_iter().map(|(_, _, id)| id).collect();
        }
        nodes.filter(|(_, x)| self.holds(*x)).map(|(id, _)| id).collect()
    }

    /// Returns the default reference point of an interface in the region: on the axis for a cylinder, at the centre for
    /// others.
    pub fn reference(&self) -> Reference {
        match *self {
            Self::Cylinder { from, to, .. } => {
                Reference::Axis { point: from, direction: [0, 1, 2].map(|k| to[k] - from[k]) }
            }
            Self::Box { .. } | Self::Plane { .. } | Self::Nearest { .. } => Reference::Centre,
        }
    }

    fn holds(&self, x: [f64; 3]) -> bool {
        match *self {
            Self::Box { min, max } => (0..3).all(|k| (min[k]..=max[k]).contains(&x[k])),
            Self::Cylinder { from, to, radius } => {
                let (from, to, x) = (Vector3::from(from), Vector3::from(to), Vector3::from(x));
                let length = (to - from).norm();
                let axis = (to - from) / length;
                let along = (x - from).dot(&axis);
                let away = (x - from - along * axis).norm();
                // Ends and surfaces belong to the region, whatever the rounding of the coordinates.
                let slack = 1e-9 * (length + radius[1]);
                (-slack..=length + slack).contains(&along)
                    && (radius[0] - slack..=radius[1] + slack).contains(&away)
            }
            Self::Plane { point, normal, within } => {
                let (point, normal) = (Vector3::from(point), Vector3::from(normal));
                (Vector3::from(x) - point).dot(&normal.normalize()).abs() <= within
            }
            Self::Nearest { .. } => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a block of 5 x 3 x 3 nodes, numbered from 10.
    fn block() -> impl Iterator<Item = (i64, [f64; 3])> {
        (0..45).map(|k| (10 + k, [(k % 5) as f64, (k / 5 % 3) as f64, (k / 15) as f64]))
    }

    #[test]
    fn regions_hold_what_lies_in_them() {
        let ends = Region::Box { min: [4.0, 0.0, 0.0], max: [9.0, 9.0, 9.0] };
        assert_eq!(ends.nodes(block()).len(), 9);
        let ring = Region::Cylinder { from: [0.0, 1.0, 1.0], to: [2.0, 1.0, 1.0], radius: [0.9, 1.1] };
        assert_eq!(ring.nodes(block()).len(), 3 * 4, "the four nearest of three layers");
        let turned = Region::Plane { point: [0.0; 3], normal: [2.0, -2.0, 0.0], within: 1e-6 };
        assert!(turned.nodes(block()).iter().all(|id| (id - 10) % 5 == (id - 10) / 5 % 3));
        let near = Region::Nearest { point: [0.1, 0.0, 0.0], count: 2 };
        assert_eq!(near.nodes(block()), [10, 11]);
    }
}

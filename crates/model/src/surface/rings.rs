//! Ring of the nodes of a face, and its triangulation.

use crate::elements::ElementShape;

/// Nodes around a face by their indices: corners, with mid-edge nodes between them, if any.
#[derive(Debug, Clone, Default)]
pub(super) struct Ring {
    /// Index of the node, and true for a corner.
    nodes: Vec<(u32, bool)>,
}

impl Ring {
    /// Returns the ring of a face of an element. Elements with fewer corners written as larger ones have
    /// repeated nodes, which count once; `None` if fewer than three corners are left.
    pub(super) fn of(shape: ElementShape, face: &[usize], nodes: &[u32]) -> Option<Self> {
        let mut ring: Vec<(u32, bool)> = Vec::with_capacity(2 * face.len());
        for (k, &corner) in face.iter().enumerate() {
            let next = face[(k + 1) % face.len()];
            ring.push((nodes[corner], true));
            let middle = shape.middle(corner, next).and_then(|at| nodes.get(at));
            ring.extend(middle.map(|&node| (node, false)));
        }
        // Of a repeated node the corner is kept.
        ring.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            kept.1 |= same && next.1;
            same
        });
        while ring.len() > 1 && ring[0].0 == ring[ring.len() - 1].0 {
            let last = ring.pop().is_some_and(|(_, corner)| corner);
            ring[0].1 |= last;
        }
        let ring = Self { nodes: ring };
        let corners = ring.key();
        (corners[2] != u32::MAX).then_some(ring)
    }

    /// Returns the corners, ascending, at most four; `u32::MAX` fills missing ones. Faces of two elements
    /// that touch have equal keys, with or without mid-edge nodes.
    pub(super) fn key(&self) -> [u32; 4] {
        let mut corners: Vec<u32> =
            self.nodes.iter().filter(|(_, corner)| *corner).map(|member| member.0).collect();
        corners.sort_unstable();
        corners.dedup();
        let mut key = [u32::MAX; 4];
        key.iter_mut().zip(corners).for_each(|(slot, corner)| *slot = corner);
        key
    }

    /// Returns triangles with the orientation of the ring, and for each of their sides (from each corner to
    /// the next) true if it lies on the ring.
    ///
    /// A corner between two mid-edge nodes is cut off; the remainder is a fan about a mid-edge node, or
    /// about the first corner.
    pub(super) fn triangles(&self) -> Vec<([u32; 3], [bool; 3])> {
        let n = self.nodes.len();
        let mut found = Vec::new();
        let mut left = Vec::new();
        for k in 0..n {
            let (before, after) = ((k + n - 1) % n, (k + 1) % n);
            let cut = self.nodes[k].1 && !self.nodes[before].1 && !self.nodes[after].1;
            if cut {
                found.push([before, k, after]);
            } else {
                left.push(k);
            }
        }
        let first = left.iter().position(|&k| !self.nodes[k].1).unwrap_or(0);
        left.rotate_left(first);
        if let Some((&centre, others)) = left.split_first() {
            found.extend(others.windows(2).map(|pair| [centre, pair[0], pair[1]]));
        }
        let side = |a: usize, b: usize| (a + 1) % n == b;
        let triangle = |[a, b, c]: [usize; 3]| {
            let nodes = [a, b, c].map(|k| self.nodes[k].0);
            (nodes, [side(a, b), side(b, c), side(c, a)])
        };
        let distinct = |([a, b, c], _): &([u32; 3], [bool; 3])| a != b && b != c && c != a;
        found.into_iter().map(triangle).filter(distinct).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(shape: ElementShape, nodes: &[u32]) -> Option<Vec<[u32; 3]>> {
        let ring = Ring::of(shape, shape.faces()[0], nodes)?;
        Some(ring.triangles().into_iter().map(|(nodes, _)| nodes).collect())
    }

    #[test]
    fn faces_with_middles_are_cut_at_them() {
        let quadratic = triangles(ElementShape::Triangle, &[0, 1, 2, 10, 11, 12]);
        assert_eq!(quadratic, Some(vec![[12, 0, 10], [10, 1, 11], [11, 2, 12], [10, 11, 12]]));
        let quadratic = triangles(ElementShape::Quadrilateral, &[0, 1, 2, 3, 10, 11, 12, 13]);
        assert_eq!(quadratic.map(|ring| ring.len()), Some(6));
        assert_eq!(triangles(ElementShape::Quadrilateral, &[0, 1, 2, 3]), Some(vec![[0, 1, 2], [0, 2, 3]]));
    }

    /// A triangle written as a quadrilateral is a triangle, with and without mid-edge nodes; a face with
    /// two corners is dropped.
    #[test]
    fn collapsed_faces_have_fewer_corners() {
        assert_eq!(triangles(ElementShape::Quadrilateral, &[0, 1, 2, 2]), Some(vec![[0, 1, 2]]));
        assert_eq!(triangles(ElementShape::Quadrilateral, &[0, 1, 2, 0]), Some(vec![[0, 1, 2]]));
        let with_middles = triangles(ElementShape::Quadrilateral, &[0, 1, 2, 2, 10, 11, 2, 13]);
        assert_eq!(with_middles.map(|ring| ring.len()), Some(4));
        assert_eq!(triangles(ElementShape::Quadrilateral, &[0, 1, 1, 0]), None);
        assert_eq!(triangles(ElementShape::Quadrilateral, &[0, 0, 0, 0]), None);
    }

    /// Every side of the ring is a side of one triangle, and no other side is.
    #[test]
    fn sides_on_the_ring_are_known() {
        let shape = ElementShape::Quadrilateral;
        let ring = Ring::of(shape, shape.faces()[0], &[0, 1, 2, 3, 10, 11, 12, 13]).expect("a face");
        let sides: usize = ring.triangles().iter().map(|(_, on)| on.iter().filter(|on| **on).count()).sum();
        assert_eq!(sides, 8);
    }
}

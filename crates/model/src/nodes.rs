//! Nodes and labels of degrees of freedom.

use std::collections::BTreeMap;

/// Node numbers and undeformed positions, in the order of the node table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Nodes {
    /// Node numbers of the FE program; gaps and any order are allowed, duplicates are not.
    pub ids: Vec<i64>,
    /// Positions in model axes, model length units (2D tables: z = 0).
    pub positions: Vec<[f64; 3]>,
}

impl Nodes {
    /// Returns the number of nodes.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Returns true if there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }
}

/// Label of a matrix row: a direction of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DofLabel {
    /// Node number.
    pub node: i64,
    /// 1, 2, 3: displacement along x, y, z; 4, 5, 6: rotation about x, y, z.
    pub direction: u8,
}

impl std::fmt::Display for DofLabel {
    /// Formats the label as `node 17 uy` or `node 17 rz`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = match self.direction {
            1 => "ux",
            2 => "uy",
            3 => "uz",
            4 => "rx",
            5 => "ry",
            6 => "rz",
            _ => "?",
        };
        write!(f, "node {} {name}", self.node)
    }
}

// Elements by their nodes, for drawing only. The mechanics are in the matrices.

/// Geometry of an element, independent of its formulation. Corner nodes come first, then one node for each
/// edge of the shape in the order of its edges, or none of these.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ElementShape {
    /// Two ends.
    Line,
    /// Three corners.
    Triangle,
    /// Four corners.
    Quadrilateral,
    /// Four corners.
    Tetrahedron,
    /// Base of four corners, and the apex.
    Pyramid,
    /// Triangle and the triangle above it.
    Wedge,
    /// Quadrilateral and the quadrilateral above it.
    Hexahedron,
}

impl ElementShape {
    /// Returns the number of corners.
    pub fn corners(self) -> usize {
        match self {
            Self::Line => 2,
            Self::Triangle => 3,
            Self::Quadrilateral | Self::Tetrahedron => 4,
            Self::Pyramid => 5,
            Self::Wedge => 6,
            Self::Hexahedron => 8,
        }
    }

    /// Returns the corners joined by each edge.
    pub fn edges(self) -> &'static [[usize; 2]] {
        match self {
            Self::Line => &[[0, 1]],
            Self::Triangle => &[[0, 1], [1, 2], [2, 0]],
            Self::Quadrilateral => &[[0, 1], [1, 2], [2, 3], [3, 0]],
            Self::Tetrahedron => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
            Self::Pyramid => &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
            Self::Wedge => &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
            Self::Hexahedron => &[
                [0, 1],
                [1, 2],
                [2, 3],
                [3, 0],
                [4, 5],
                [5, 6],
                [6, 7],
                [7, 4],
                [0, 4],
                [1, 5],
                [2, 6],
                [3, 7],
            ],
        }
    }

    /// Returns the corners of each face, counterclockwise seen from outside; a shell is a face by itself, a
    /// line has none.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Line => &[],
            Self::Triangle => &[&[0, 1, 2]],
            Self::Quadrilateral => &[&[0, 1, 2, 3]],
            Self::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]],
            Self::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
            Self::Wedge => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
            Self::Hexahedron => {
                &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]
            }
        }
    }

    /// Returns true if the shape fills a volume.
    pub fn is_solid(self) -> bool {
        matches!(self, Self::Tetrahedron | Self::Pyramid | Self::Wedge | Self::Hexahedron)
    }

    /// Returns the index of the mid-edge node between two corners; mid-edge nodes follow the corners.
    pub(crate) fn middle(self, a: usize, b: usize) -> Option<usize> {
        let at = self.edges().iter().position(|&[c, d]| [c, d] == [a, b] || [d, c] == [a, b])?;
        Some(self.corners() + at)
    }
}

/// Elements of a model in the order of their file, by node numbers, and the numbers of elements that were
/// left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Elements {
    /// Shape, and the end of its nodes in `nodes`.
    ends: Vec<(ElementShape, usize)>,
    nodes: Vec<i64>,
    left_out: BTreeMap<String, usize>,
}

impl Elements {
    /// Adds an element. Nodes beyond corners and mid-edge nodes (such as those of faces) are ignored, and
    /// mid-edge nodes are used only if all are present. An element with fewer nodes than corners is counted
    /// as left out under its `kind`.
    pub fn add(&mut self, kind: &str, shape: ElementShape, nodes: &[i64]) {
        let (corners, all) = (shape.corners(), shape.corners() + shape.edges().len());
        let taken = if nodes.len() >= all { all } else { corners };
        match nodes.get(..taken) {
            Some(nodes) => {
                self.nodes.extend_from_slice(nodes);
                self.ends.push((shape, self.nodes.len()));
            }
            None => self.leave_out(kind, 1),
        }
    }

    /// Counts `count` elements of a kind that cannot be drawn.
    pub fn leave_out(&mut self, kind: &str, count: usize) {
        *self.left_out.entry(kind.to_owned()).or_default() += count;
    }

    /// Returns the number of elements that can be drawn.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns true if no element can be drawn.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Returns shape and node numbers of each element.
    pub fn iter(&self) -> impl Iterator<Item = (ElementShape, &[i64])> {
        let starts = std::iter::once(0).chain(self.ends.iter().map(|(_, end)| *end));
        starts.zip(&self.ends).map(|(start, &(shape, end))| (shape, &self.nodes[start..end]))
    }

    /// Returns the kinds that cannot be drawn, by name, and the number of elements of each.
    pub fn left_out(&self) -> impl Iterator<Item = (&str, usize)> {
        self.left_out.iter().map(|(kind, count)| (kind.as_str(), *count))
    }
}

#[cfg(test)]
mod tests {
    use super::ElementShape::{Hexahedron, Pyramid, Tetrahedron, Wedge};
    use super::*;

    /// Every edge of a solid belongs to two faces, once in each direction: the faces close the solid with
    /// consistent orientation.
    #[test]
    fn faces_close_every_solid() {
        for shape in [Tetrahedron, Pyramid, Wedge, Hexahedron] {
            let steps = |face: &&'static [usize]| {
                (0..face.len()).map(|k| [face[k], face[(k + 1) % face.len()]]).collect::<Vec<_>>()
            };
            let passed: Vec<[usize; 2]> = shape.faces().iter().flat_map(steps).collect();
            assert_eq!(passed.len(), 2 * shape.edges().len(), "{shape:?}");
            for &[a, b] in shape.edges() {
                assert!(passed.contains(&[a, b]) && passed.contains(&[b, a]), "{shape:?} {a} {b}");
            }
        }
    }

    #[test]
    fn short_elements_are_left_out_and_middles_come_all_or_none() {
        let mut elements = Elements::default();
        elements.add("C3D4", Tetrahedron, &[1, 2, 3]);
        elements.add("C3D10", Tetrahedron, &[1, 2, 3, 4, 5, 6]);
        elements.add("C3D10", Tetrahedron, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
        let read: Vec<usize> = elements.iter().map(|(_, nodes)| nodes.len()).collect();
        assert_eq!(read, [4, 10]);
        assert_eq!(elements.left_out().collect::<Vec<_>>(), [("C3D4", 1)]);
    }
}

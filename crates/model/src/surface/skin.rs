//! Surface of elements: faces of solids that belong to one element only, shells as they are, beams as
//! lines.

use super::SurfaceMesh;
use super::features::{Side, feature_edges};
use super::rings::Ring;
use crate::Nodes;
use crate::elements::{ElementShape, Elements};
use std::collections::{HashMap, HashSet};

/// Surface of elements, and the number of elements left out because the model lacks some of their nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skin {
    /// Surface; `None` if no element can be drawn.
    pub mesh: Option<SurfaceMesh>,
    /// Number of elements with nodes that are not in the table.
    pub without_nodes: usize,
}

/// Returns the surface of `elements` on the nodes of a table, by their indices there. Shells and lines on
/// the surface of a solid, which meshers write for surfaces and curves of a volume, are not drawn twice.
pub fn skin(elements: &Elements, nodes: &Nodes) -> Skin {
    let index: HashMap<i64, u32> = nodes.ids.iter().zip(0..).map(|(&id, i)| (id, i)).collect();
    let (mut placed, mut without_nodes) = (Placed::default(), 0);
    for (shape, ids) in elements.iter() {
        let start = placed.nodes.len();
        placed.nodes.extend(ids.iter().map_while(|id| index.get(id).copied()));
        if placed.nodes.len() == start + ids.len() {
            placed.ends.push((shape, placed.nodes.len()));
        } else {
            placed.nodes.truncate(start);
            without_nodes += 1;
        }
    }
    let (mut triangles, mut sides) = (Vec::new(), Vec::new());
    for ring in placed.outer_faces() {
        for (corners, on_ring) in ring.triangles() {
            let steps = [[corners[0], corners[1]], [corners[1], corners[2]], [corners[2], corners[0]]];
            let steps_on_ring = steps.into_iter().zip(on_ring).filter(|(_, on)| *on);
            sides.extend(steps_on_ring.map(|(step, _)| Side { step, triangle: triangles.len() as u32 }));
            triangles.push(corners);
        }
    }
    let mut edges = feature_edges(&triangles, sides, &nodes.positions);
    edges.extend(placed.free_lines());
    Skin { mesh: SurfaceMesh::of_parts(triangles, edges), without_nodes }
}

/// Elements by the indices of their nodes.
#[derive(Default)]
struct Placed {
    ends: Vec<(ElementShape, usize)>,
    nodes: Vec<u32>,
}

/// Face of an element, by its corners.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Face {
    key: [u32; 4],
    /// Start of the nodes of its element.
    start: usize,
    shape: ElementShape,
    face: u8,
}

impl Placed {
    fn iter(&self) -> impl Iterator<Item = (ElementShape, usize, &[u32])> {
        let starts = std::iter::once(0).chain(self.ends.iter().map(|(_, end)| *end));
        starts.zip(&self.ends).map(|(start, &(shape, end))| (shape, start, &self.nodes[start..end]))
    }

    /// Returns the faces of solid elements, or of all others, sorted by their corners.
    fn faces(&self, solid: bool) -> Vec<Face> {
        let mut faces = Vec::new();
        for (shape, start, nodes) in self.iter().filter(|(shape, ..)| shape.is_solid() == solid) {
            for (face, corners) in (0..).zip(shape.faces()) {
                let ring = Ring::of(shape, corners, nodes);
                faces.extend(ring.map(|ring| Face { key: ring.key(), start, shape, face }));
            }
        }
        faces.sort_unstable();
        faces
    }

    /// Returns the faces of solids that occur once, and shells that are no face of a solid, in the order of
    /// the elements.
    fn outer_faces(&self) -> Vec<Ring> {
        let solids = self.faces(true);
        let mut outer: Vec<Face> = solids
            .chunk_by(|a, b| a.key == b.key)
            .filter(|faces| faces.len() == 1)
            .map(|faces| faces[0])
            .collect();
        let mut shells = self.faces(false);
        shells.dedup_by_key(|face| face.key);
        let on_solid = |shell: &Face| solids.binary_search_by_key(&shell.key, |face| face.key).is_ok();
        outer.extend(shells.into_iter().filter(|shell| !on_solid(shell)));
        outer.sort_unstable_by_key(|face| (face.start, face.face));
        let ends: HashMap<usize, usize> = self.iter().map(|(_, start, nodes)| (start, nodes.len())).collect();
        let ring = |face: Face| {
            let nodes = &self.nodes[face.start..face.start + ends[&face.start]];
            Ring::of(face.shape, face.shape.faces()[usize::from(face.face)], nodes)
        };
        outer.into_iter().filter_map(ring).collect()
    }

    /// Returns the lines between nodes that are no edge of another element, each once.
    fn free_lines(&self) -> Vec<[u32; 2]> {
        let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
        let is_line = |shape: &ElementShape| *shape == ElementShape::Line;
        let ends = |shape: ElementShape, nodes: &[u32]| -> Vec<[u32; 2]> {
            shape.edges().iter().map(|&[a, b]| ordered(nodes[a], nodes[b])).collect()
        };
        let lines: Vec<(&[u32], [u32; 2])> = self
            .iter()
            .filter(|(shape, ..)| is_line(shape))
            .map(|(_, _, nodes)| (nodes, ordered(nodes[0], nodes[1])))
            .collect();
        let mut wanted: HashSet<[u32; 2]> = lines.iter().map(|(_, ends)| *ends).collect();
        if !wanted.is_empty() {
            for (shape, _, nodes) in self.iter().filter(|(shape, ..)| !is_line(shape)) {
                ends(shape, nodes).iter().for_each(|edge| {
                    wanted.remove(edge);
                });
            }
        }
        let mut found = Vec::new();
        for (nodes, ends) in lines {
            // The second of two lines between the same nodes is skipped here.
            if !wanted.remove(&ends) {
                continue;
            }
            match *nodes {
                [a, b, middle] => found.extend([[a, middle], [middle, b]]),
                _ => found.push(ends),
            }
        }
        found.retain(|[a, b]| a != b);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a bar of n bricks along x, with the quadrilaterals and lines that a mesher writes for its
    /// end at x = 0.
    fn bar(n: usize) -> (Elements, Nodes) {
        let mut elements = Elements::default();
        let node = |i: usize, k: usize| (1 + 4 * i + k) as i64;
        for i in 0..n {
            let ring = |i: usize| (0..4).map(move |k| node(i, k));
            let nodes: Vec<i64> = ring(i).chain(ring(i + 1)).collect();
            elements.add("C3D8", ElementShape::Hexahedron, &nodes);
        }
        elements.add("quad", ElementShape::Quadrilateral, &[3, 4, 1, 2]);
        elements.add("line", ElementShape::Line, &[1, 2]);
        let place = |i: usize, k: usize| [i as f64, [0.0, 1.0, 1.0, 0.0][k], [0.0, 0.0, 1.0, 1.0][k]];
        let each = (0..=n).flat_map(|i| (0..4).map(move |k| (i, k)));
        let (ids, positions) = each.map(|(i, k)| (node(i, k), place(i, k))).unzip();
        (elements, Nodes { ids, positions })
    }

    #[test]
    fn the_surface_of_a_bar_is_closed_and_encloses_its_volume() {
        let (elements, nodes) = bar(3);
        let Skin { mesh, without_nodes } = skin(&elements, &nodes);
        let mesh = mesh.expect("a surface");
        assert_eq!((mesh.triangles().len(), without_nodes), (2 * (2 + 4 * 3), 0));
        // The twelve edges of the box, four of which are three elements long.
        assert_eq!(mesh.edges().len(), 4 + 4 + 4 * 3);
        let x = |i: u32| nalgebra::Vector3::from(nodes.positions[i as usize]);
        let volume: f64 = mesh.triangles().iter().map(|&[a, b, c]| x(a).dot(&x(b).cross(&x(c))) / 6.0).sum();
        assert!((volume - 3.0).abs() < 1e-12, "{volume}");
    }

    /// Without the node of one corner the last brick is not drawn, and the bar ends before it.
    #[test]
    fn elements_without_their_nodes_are_counted() {
        let (elements, mut nodes) = bar(3);
        nodes.ids.pop();
        nodes.positions.pop();
        let found = skin(&elements, &nodes);
        assert_eq!(found.without_nodes, 1);
        assert_eq!(found.mesh, skin(&bar(2).0, &nodes).mesh);
    }

    #[test]
    fn lines_are_drawn_where_nothing_else_is() {
        let mut elements = Elements::default();
        elements.add("B31", ElementShape::Line, &[1, 2]);
        elements.add("B31", ElementShape::Line, &[2, 1]);
        elements.add("B32", ElementShape::Line, &[2, 4, 3]);
        let positions = (0..4).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let mesh = skin(&elements, &Nodes { ids: vec![1, 2, 3, 4], positions }).mesh.expect("lines");
        assert_eq!((mesh.triangles(), mesh.edges()), (&[][..], &[[0, 1], [1, 2], [2, 3]][..]));
    }
}

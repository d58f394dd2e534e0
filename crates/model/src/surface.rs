//! Surface of a part, for drawing.

pub(crate) mod decimate;
pub(crate) mod feature_edges;

use crate::Nodes;
use crate::nodes::{ElementShape, Elements};
use crate::surface::feature_edges::{Side, feature_edges};
use std::collections::{HashMap, HashSet};

/// Triangles of the surface of a part, and lines: its feature edges, the rims of shells, and beams, all by
/// indices of nodes. The mesh is used for drawing only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SurfaceMesh {
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) edges: Vec<[u32; 2]>,
}

impl SurfaceMesh {
    /// Creates a mesh on `nodes` nodes. The corners of a triangle run counterclockwise seen from outside,
    /// if there is an outside.
    ///
    /// # Errors
    /// A text with the reason: an index beyond the nodes, a triangle or an edge with a node twice, or
    /// neither triangles nor edges.
    pub fn new(triangles: Vec<[u32; 3]>, edges: Vec<[u32; 2]>, nodes: usize) -> Result<Self, String> {
        let mesh = Self { triangles, edges };
        if mesh.triangles.is_empty() && mesh.edges.is_empty() {
            return Err("a mesh without triangles and edges".to_owned());
        }
        if let Some(index) = mesh.indices().find(|index| *index as usize >= nodes) {
            return Err(format!("a mesh with node index {index}, expected indices below {nodes}"));
        }
        if let Some(t) = mesh.triangles.iter().position(|&[a, b, c]| a == b || b == c || c == a) {
            return Err(format!("a mesh whose triangle {t} has a node twice"));
        }
        if let Some(e) = mesh.edges.iter().position(|[a, b]| a == b) {
            return Err(format!("a mesh whose edge {e} has a node twice"));
        }
        Ok(mesh)
    }

    /// Creates a mesh from valid parts; `None` if there is nothing to draw.
    pub(crate) fn of_parts(triangles: Vec<[u32; 3]>, edges: Vec<[u32; 2]>) -> Option<Self> {
        (!triangles.is_empty() || !edges.is_empty()).then_some(Self { triangles, edges })
    }

    /// Returns the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the edges.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    fn indices(&self) -> impl Iterator<Item = u32> {
        self.triangles.as_flattened().iter().chain(self.edges.as_flattened()).copied()
    }

    /// Returns one more than the highest index.
    pub fn least_nodes(&self) -> usize {
        self.indices().max().map_or(0, |highest| highest as usize + 1)
    }

    /// Returns the indices of the drawn nodes, ascending.
    pub fn drawn_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.indices().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Returns the part of the mesh whose nodes are among the nodes `to`, with the indices of that list;
    /// `from` holds the numbers of the present nodes. Returns `None` if no part is left.
    pub fn among(&self, from: &[i64], to: &[i64]) -> Option<Self> {
        if from == to {
            return Some(self.clone());
        }
        let index: HashMap<i64, u32> = to.iter().zip(0..).map(|(&id, i)| (id, i)).collect();
        let moved: Vec<Option<u32>> = from.iter().map(|id| index.get(id).copied()).collect();
        let at = |i: u32| moved.get(i as usize).copied().flatten();
        Self::of_parts(
            self.triangles.iter().filter_map(|&[a, b, c]| Some([at(a)?, at(b)?, at(c)?])).collect(),
            self.edges.iter().filter_map(|&[a, b]| Some([at(a)?, at(b)?])).collect(),
        )
    }
}

// Surface of elements: faces of solids that belong to one element only, shells as they are, beams as
// lines.

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

// Ring of the nodes of a face, and its triangulation.

/// Nodes around a face by their indices: corners, with mid-edge nodes between them, if any.
#[derive(Debug, Clone, Default)]
struct Ring {
    /// Index of the node, and true for a corner.
    nodes: Vec<(u32, bool)>,
}

impl Ring {
    /// Returns the ring of a face of an element. Elements with fewer corners written as larger ones have
    /// repeated nodes, which count once; `None` if fewer than three corners are left.
    fn of(shape: ElementShape, face: &[usize], nodes: &[u32]) -> Option<Self> {
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
    fn key(&self) -> [u32; 4] {
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
    fn triangles(&self) -> Vec<([u32; 3], [bool; 3])> {
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

    #[test]
    fn a_mesh_names_nodes_that_there_are_and_none_twice() {
        let mesh = |triangles: &[[u32; 3]], edges: &[[u32; 2]]| {
            SurfaceMesh::new(triangles.to_vec(), edges.to_vec(), 4).map(|mesh| mesh.least_nodes())
        };
        assert_eq!(mesh(&[[0, 1, 3]], &[]), Ok(4));
        assert_eq!(mesh(&[], &[[0, 1]]), Ok(2));
        assert!(mesh(&[], &[]).is_err());
        assert!(mesh(&[[0, 1, 4]], &[]).unwrap_err().contains("index 4"));
        assert!(mesh(&[[0, 1, 1]], &[]).unwrap_err().contains("triangle 0"));
        assert!(mesh(&[], &[[0, 1], [2, 2]]).unwrap_err().contains("edge 1"));
    }

    #[test]
    fn a_part_of_the_nodes_keeps_what_lies_among_them() {
        let mesh = SurfaceMesh::new(vec![[0, 1, 2], [1, 2, 3]], vec![[0, 3]], 4).expect("a mesh");
        let part = mesh.among(&[10, 20, 30, 40], &[40, 30, 20]).expect("a part");
        assert_eq!((part.triangles(), part.edges()), (&[[2, 1, 0]][..], &[][..]));
        assert_eq!(mesh.among(&[10, 20, 30, 40], &[10, 20]), None);
    }

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

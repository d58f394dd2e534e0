//! Decimation: fewer triangles for a given surface.
//!
//! One node after the other moves onto a neighbour, first the node whose move changes the surface least,
//! after Garland and Heckbert, "Surface simplification using quadric error metrics" (1997), with one
//! addition: the error also counts the distance that a node moves. On a flat plate the planes alone would
//! leave two triangles, which cannot show its bending; with the distance, triangles keep about equal sizes.

use crate::surface::SurfaceMesh;
use crate::surface::feature_edges::normal;
use nalgebra::{Matrix3, Vector3};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Weight of the squared distance that a node moves, relative to its squared distance from the planes of
/// its triangles. Up to triangles of eight tenths of the radius of curvature the moved distance dominates.
const MOVED_DISTANCE_WEIGHT: f64 = 0.01;

/// Weight of the planes that hold feature edges in place.
const FEATURE_PLANE_WEIGHT: f64 = 10.0;

/// Cosine of the largest rotation of a triangle in one move.
const MAX_ROTATION_COSINE: f64 = 0.2;

impl SurfaceMesh {
    /// Returns the mesh with at most `most` triangles, on some of its nodes, whose positions are
    /// `positions`. Edges follow the nodes at their ends. Equal input gives equal meshes.
    ///
    /// # Panics
    /// When there are fewer positions than [`least_nodes`](Self::least_nodes).
    pub fn decimated(&self, positions: &[[f64; 3]], most: usize) -> Option<Self> {
        if self.triangles.len() <= most {
            return Some(self.clone());
        }
        let mut decimation = Decimation::new(self, positions);
        decimation.run(most, true);
        // Small parts and rims may block the last moves: then allow moves that change the form.
        decimation.run(most, false);
        decimation.mesh(self)
    }
}

/// Mesh under decimation, with its own numbering of nodes.
struct Decimation {
    /// Index of each node in the body.
    nodes: Vec<u32>,
    index: HashMap<u32, u32>,
    positions: Vec<[f64; 3]>,
    /// Corners of each triangle; two equal corners mark a removed one.
    triangles: Vec<[u32; 3]>,
    alive: usize,
    /// Triangles at each node, including removed ones.
    at_node: Vec<Vec<u32>>,
    /// Neighbours of each node along feature edges.
    features: Vec<Vec<u32>>,
    error: Vec<Quadric>,
    /// Number of changes of the error of each node.
    changes: Vec<u32>,
    /// Node that each node moved onto; itself if it did not move.
    merged_into: Vec<u32>,
}

/// Move of the first node onto the second, ordered by its error (the bits of a non-negative number sort
/// like the number), with the numbers of changes that the error includes.
type Move = Reverse<(u64, [u32; 2], [u32; 2])>;

impl Decimation {
    fn new(mesh: &SurfaceMesh, positions: &[[f64; 3]]) -> Self {
        let mut nodes: Vec<u32> = mesh.triangles.as_flattened().to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let index: HashMap<u32, u32> = nodes.iter().zip(0..).map(|(&node, i)| (node, i)).collect();
        let n = nodes.len();
        let mut decimation = Self {
            positions: nodes.iter().map(|&node| positions[node as usize]).collect(),
            triangles: mesh.triangles.iter().map(|corners| corners.map(|node| index[&node])).collect(),
            alive: mesh.triangles.len(),
            at_node: vec![Vec::new(); n],
            features: vec![Vec::new(); n],
            error: vec![Quadric::default(); n],
            changes: vec![0; n],
            merged_into: (0..n as u32).collect(),
            nodes,
            index,
        };
        for (t, corners) in (0..).zip(&decimation.triangles) {
            corners.iter().for_each(|&node| decimation.at_node[node as usize].push(t));
        }
        for [a, b] in &mesh.edges {
            if let (Some(&a), Some(&b)) = (decimation.index.get(a), decimation.index.get(b)) {
                decimation.features[a as usize].push(b);
                decimation.features[b as usize].push(a);
            }
        }
        decimation.measure();
        decimation
    }

    fn x(&self, node: u32) -> Vector3<f64> {
        self.positions[node as usize].into()
    }

    /// Measures the errors of all nodes: distances from the planes of their triangles, from planes across
    /// these at feature edges, and from their positions, weighted by the areas around them.
    fn measure(&mut self) {
        for t in 0..self.triangles.len() {
            let corners = self.triangles[t];
            let [a, b, c] = corners.map(|node| self.x(node));
            let area = (b - a).cross(&(c - a)).norm() / 6.0;
            let normal = normal(corners, &self.positions);
            for (k, &node) in corners.iter().enumerate() {
                let x = self.x(node);
                self.error[node as usize] += Quadric::plane(normal, x, area);
                self.error[node as usize] += Quadric::point(x, MOVED_DISTANCE_WEIGHT * area);
                let next = corners[(k + 1) % 3];
                if !self.features[node as usize].contains(&next) {
                    continue;
                }
                let along = self.x(next) - x;
                let across = along.cross(&normal).try_normalize(0.0).unwrap_or_default();
                let holding = Quadric::plane(across, x, FEATURE_PLANE_WEIGHT * along.norm_squared());
                self.error[node as usize] += holding;
                self.error[next as usize] += holding;
            }
        }
    }

    /// Moves nodes until `most` triangles are left, or no move is possible; with `form` only moves that
    /// preserve the form.
    fn run(&mut self, most: usize, form: bool) {
        let mut moves = BinaryHeap::new();
        if self.alive > most {
            for node in 0..self.nodes.len() as u32 {
                self.offer(node, &mut moves);
            }
        }
        while self.alive > most {
            let Some(Reverse((_, [from, to], changes))) = moves.pop() else { return };
            let current = [from, to].map(|node| self.changes[node as usize]);
            let are_present = [from, to].iter().all(|&node| self.merged_into[node as usize] == node);
            if are_present && current == changes && (!form || self.keeps_form(from, to)) {
                self.collapse(from, to);
                self.offer(to, &mut moves);
            }
        }
    }

    /// Adds the moves between a node and its neighbours.
    fn offer(&self, node: u32, moves: &mut BinaryHeap<Move>) {
        for other in self.neighbours(node) {
            for [from, to] in [[node, other], [other, node]] {
                let mut error = self.error[from as usize];
                error += self.error[to as usize];
                let changes = [from, to].map(|node| self.changes[node as usize]);
                moves.push(Reverse((error.at(self.x(to)).to_bits(), [from, to], changes)));
            }
        }
    }

    /// Returns the triangles at a node.
    fn around(&self, node: u32) -> impl Iterator<Item = [u32; 3]> {
        let all = self.at_node[node as usize].iter().map(|&t| self.triangles[t as usize]);
        all.filter(move |corners| corners.contains(&node) && corners[0] != corners[1])
    }

    /// Returns the nodes that share a triangle with a node, ascending.
    fn neighbours(&self, node: u32) -> Vec<u32> {
        let mut found: Vec<u32> = self.around(node).flatten().filter(|&other| other != node).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Returns true if a move preserves feature edges, folds nothing and joins nothing that was separate.
    fn keeps_form(&self, from: u32, to: u32) -> bool {
        let features = &self.features[from as usize];
        let along_feature = features.len() == 2 && features.contains(&to);
        if !features.is_empty() && !along_feature {
            return false;
        }
        let others = self.neighbours(to);
        let common = self.neighbours(from).iter().filter(|node| others.binary_search(node).is_ok()).count();
        let shared = self.around(from).filter(|corners| corners.contains(&to)).count();
        let folds = |corners: [u32; 3]| {
            let moved = corners.map(|node| if node == from { to } else { node });
            normal(corners, &self.positions).dot(&normal(moved, &self.positions)) < MAX_ROTATION_COSINE
        };
        common == shared && !self.around(from).filter(|corners| !corners.contains(&to)).any(folds)
    }

    fn collapse(&mut self, from: u32, to: u32) {
        let moved = std::mem::take(&mut self.at_node[from as usize]);
        // Remove the triangles that contain both nodes; the others move to `to`.
        for t in moved {
            let corners = &mut self.triangles[t as usize];
            if !corners.contains(&from) {
                continue;
            }
            if corners.contains(&to) {
                *corners = [to; 3];
                self.alive -= 1;
            } else {
                corners.iter_mut().filter(|node| **node == from).for_each(|node| *node = to);
                self.at_node[to as usize].push(t);
            }
        }
        // Feature edges follow the node.
        for other in std::mem::take(&mut self.features[from as usize]) {
            let of_other = &mut self.features[other as usize];
            of_other.retain(|node| *node != from && *node != to);
            if other != to {
                of_other.push(to);
                self.features[to as usize].retain(|node| *node != other);
                self.features[to as usize].push(other);
            }
        }
        // The error accumulates; moves that were rated before are outdated.
        let error = self.error[from as usize];
        self.error[to as usize] += error;
        self.changes[to as usize] += 1;
        self.merged_into[from as usize] = to;
    }

    /// Returns the remaining mesh, by the nodes of the body.
    fn mesh(&self, before: &SurfaceMesh) -> Option<SurfaceMesh> {
        let are_present = |node: u32| {
            let Some(&start) = self.index.get(&node) else { return node };
            let mut at = start;
            while self.merged_into[at as usize] != at {
                at = self.merged_into[at as usize];
            }
            self.nodes[at as usize]
        };
        let left = self.triangles.iter().filter(|[a, b, c]| a != b && b != c && c != a);
        let triangles = left.map(|corners| corners.map(|node| self.nodes[node as usize])).collect();
        let ordered = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let mut edges: Vec<[u32; 2]> =
            before.edges.iter().map(|ends| ordered(ends.map(are_present))).collect();
        edges.retain(|[a, b]| a != b);
        edges.sort_unstable();
        edges.dedup();
        SurfaceMesh::of_parts(triangles, edges)
    }
}

// Sums of squared distances from planes and points, as functions of the position.

/// Quadratic function x'Ax - 2 b'x + c.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Quadric {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: f64,
}

impl Quadric {
    /// Returns `weight` times the squared distance from the plane through `point` with the unit normal
    /// `normal`.
    pub(crate) fn plane(normal: Vector3<f64>, point: Vector3<f64>, weight: f64) -> Self {
        let distance = normal.dot(&point);
        Self {
            a: weight * normal * normal.transpose(),
            b: weight * distance * normal,
            c: weight * distance * distance,
        }
    }

    /// Returns `weight` times the squared distance from `point`.
    pub(crate) fn point(point: Vector3<f64>, weight: f64) -> Self {
        Self { a: Matrix3::identity() * weight, b: weight * point, c: weight * point.norm_squared() }
    }

    /// Returns the value at `x`; negative rounding becomes zero.
    pub(crate) fn at(&self, x: Vector3<f64>) -> f64 {
        (x.dot(&(self.a * x)) - 2.0 * self.b.dot(&x) + self.c).max(0.0)
    }
}

impl std::ops::AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nodes::{ElementShape, Elements};
    use crate::{Nodes, skin};

    /// Returns a box of n x n x n bricks with sides of length 1.
    fn cube(n: usize) -> (SurfaceMesh, Nodes) {
        let node = |i: usize, j: usize, k: usize| ((i * (n + 1) + j) * (n + 1) + k) as i64;
        let mut elements = Elements::default();
        let cells = |end: usize| (0..end.pow(3)).map(move |m| (m / end / end, m / end % end, m % end));
        for (i, j, k) in cells(n) {
            let ring =
                |k: usize| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
            elements.add("", ElementShape::Hexahedron, &[ring(k), ring(k + 1)].concat());
        }
        let place = |(i, j, k): (usize, usize, usize)| [i, j, k].map(|m| m as f64 / n as f64);
        let nodes = Nodes {
            ids: cells(n + 1).map(|(i, j, k)| node(i, j, k)).collect(),
            positions: cells(n + 1).map(place).collect(),
        };
        (skin(&elements, &nodes).mesh.expect("a surface"), nodes)
    }

    fn volume(mesh: &SurfaceMesh, nodes: &Nodes) -> f64 {
        let x = |i: u32| Vector3::from(nodes.positions[i as usize]);
        mesh.triangles().iter().map(|&[a, b, c]| x(a).dot(&x(b).cross(&x(c))) / 6.0).sum()
    }

    /// A cube stays a cube of equal volume, with triangles of about equal size.
    #[test]
    fn a_cube_keeps_its_form() {
        let (mesh, nodes) = cube(10);
        assert_eq!(mesh.triangles().len(), 1200);
        let fewer = mesh.decimated(&nodes.positions, 300).expect("a mesh");
        assert!((280..=300).contains(&fewer.triangles().len()), "{}", fewer.triangles().len());
        assert!((volume(&fewer, &nodes) - 1.0).abs() < 1e-9, "{}", volume(&fewer, &nodes));
        let area = |&[a, b, c]: &[u32; 3]| {
            let x = |i: u32| Vector3::from(nodes.positions[i as usize]);
            (x(b) - x(a)).cross(&(x(c) - x(a))).norm() / 2.0
        };
        let largest = fewer.triangles().iter().map(area).fold(0.0, f64::max);
        assert!(largest < 8.0 * 6.0 / 300.0, "{largest}");
        assert!(fewer.edges().len() < mesh.edges().len());
        assert_eq!(Some(fewer), mesh.decimated(&nodes.positions, 300));
    }

    /// The number of triangles never exceeds the limit.
    #[test]
    fn the_number_is_kept_to() {
        let (mesh, nodes) = cube(3);
        for most in [100, 50, 12, 7, 1] {
            let fewer = mesh.decimated(&nodes.positions, most).expect("a mesh");
            assert!(fewer.triangles().len() <= most, "{most}: {}", fewer.triangles().len());
        }
    }

    #[test]
    fn distances_from_planes_and_points_add_up() {
        let mut sum = Quadric::plane(Vector3::z(), Vector3::new(5.0, 6.0, 1.0), 2.0);
        sum += Quadric::point(Vector3::x(), 3.0);
        let value = sum.at(Vector3::new(1.0, 2.0, 4.0));
        assert!((value - (2.0 * 9.0 + 3.0 * (4.0 + 16.0))).abs() < 1e-12, "{value}");
    }
}

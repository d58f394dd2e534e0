//! Default reference point of an interface: on its axis, or the centre of the faces or edges between its
//! nodes.

use super::{Reference, SurfaceMesh};
use nalgebra::Vector3;

/// Part of the nodes of an interface above which its faces (or edges) must reach for their centre to be
/// used.
const MIN_COVERED_NODES: f64 = 0.5;

/// Nodes of an interface, by indices of `positions`, at least one.
pub(super) struct InterfaceNodes<'n> {
    /// Nodes with rows.
    pub nodes: &'n [u32],
    /// Nodes that define its faces and edges.
    pub outline: &'n [u32],
    /// Positions of all nodes of the model.
    pub positions: &'n [[f64; 3]],
}

/// Point that follows from the nodes of an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InterfaceCentre {
    /// Point in model axes.
    pub point: [f64; 3],
    /// Mean of the nodes, model axes.
    pub mean: [f64; 3],
    /// Description of the point for messages.
    pub origin: &'static str,
}

impl InterfaceCentre {
    /// Returns the point of an interface without a stated point. On an axis it is the middle of the extent
    /// of the nodes along it. Otherwise it is the centre of the triangles of the surface `mesh` whose nodes
    /// all belong to the outline of the interface, weighted by area, or that of the edges, weighted by
    /// length; either must reach more than half of the outline. Otherwise it is the mean of the nodes.
    pub(crate) fn new(
        interface: &InterfaceNodes<'_>,
        mesh: Option<&SurfaceMesh>,
        reference: &Reference,
    ) -> Self {
        let members = Members::new(interface.nodes, interface.positions);
        let outline = Members::new(interface.outline, interface.positions);
        let by_mesh = || {
            let mesh = mesh?;
            let faces = outline.centre(mesh.triangles().iter().copied());
            if let Some(point) = faces {
                return Some((point, "the centre of its faces, weighted by area"));
            }
            let sides = mesh.triangles().iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
            let mut edges: Vec<[u32; 2]> = sides
                .chain(mesh.edges().iter().copied())
                .map(|[a, b]| [a.min(b), a.max(b)])
                .filter(|edge| edge.iter().all(|node| outline.holds(*node)))
                .collect();
            edges.sort_unstable();
            edges.dedup();
            Some((outline.centre(edges.into_iter())?, "the centre of its edges, weighted by length"))
        };
        let (point, origin) = match *reference {
            Reference::Axis { point, direction } => (
                members.on_axis(&point.into(), &direction.into()),
                "the point of its axis in the middle of its nodes",
            ),
            _ => by_mesh().unwrap_or((members.mean(), "the mean of its nodes")),
        };
        Self { point: point.into(), mean: members.mean().into(), origin }
    }
}

/// Nodes of an interface, measured from the first of them, so that sums keep their digits far from the
/// origin.
struct Members<'m> {
    nodes: &'m [u32],
    positions: &'m [[f64; 3]],
    is_member: Vec<bool>,
    first: Vector3<f64>,
}

impl<'m> Members<'m> {
    fn new(nodes: &'m [u32], positions: &'m [[f64; 3]]) -> Self {
        let mut is_member = vec![false; positions.len()];
        nodes.iter().for_each(|&node| is_member[node as usize] = true);
        let first = nodes.first().map_or([0.0; 3], |&node| positions[node as usize]);
        Self { nodes, positions, is_member, first: first.into() }
    }

    fn holds(&self, node: u32) -> bool {
        self.is_member.get(node as usize).copied().unwrap_or(false)
    }

    fn offset(&self, node: u32) -> Vector3<f64> {
        Vector3::from(self.positions[node as usize]) - self.first
    }

    fn mean(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self.nodes.iter().map(|&node| self.offset(node)).sum();
        self.first + sum / self.nodes.len().max(1) as f64
    }

    fn on_axis(&self, point: &Vector3<f64>, direction: &Vector3<f64>) -> Vector3<f64> {
        let axis = direction.normalize();
        let along = self.nodes.iter().map(|&node| self.offset(node).dot(&axis));
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| (low.min(s), high.max(s)));
        let start = (self.first - point).dot(&axis);
        point + axis * (start + (low + high) / 2.0)
    }

    /// Returns the centre of the `parts` (edges or triangles) whose nodes all are members, weighted by
    /// length or area. Returns `None` if the parts reach at most half of the members, or have no length or
    /// area.
    fn centre<const N: usize>(&self, parts: impl Iterator<Item = [u32; N]>) -> Option<Vector3<f64>> {
        let mut is_reached = vec![false; self.positions.len()];
        let (mut moment, mut total) = (Vector3::zeros(), 0.0);
        for part in parts.filter(|part| part.iter().all(|node| self.holds(*node))) {
            part.iter().for_each(|node| is_reached[*node as usize] = true);
            let corners = part.map(|node| self.offset(node));
            let size = match corners[1..] {
                [b] => (b - corners[0]).norm(),
                [b, c] => (b - corners[0]).cross(&(c - corners[0])).norm() / 2.0,
                _ => 0.0,
            };
            moment += corners.iter().sum::<Vector3<f64>>() * (size / N as f64);
            total += size;
        }
        let reached = is_reached.iter().filter(|reached| **reached).count();
        let is_enough = reached as f64 > MIN_COVERED_NODES * self.nodes.len() as f64;
        (is_enough && total > 0.0).then(|| self.first + moment / total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 3]; 6] = [
        [0.0, 0.0, 5.0],
        [2.0, 0.0, 5.0],
        [2.0, 2.0, 5.0],
        [0.0, 2.0, 5.0],
        [0.1, 0.0, 5.0],
        [1.0, 1.0, 9.0],
    ];

    fn of(nodes: &[u32], mesh: Option<&SurfaceMesh>) -> [f64; 3] {
        let interface = InterfaceNodes { nodes, outline: nodes, positions: &SQUARE };
        InterfaceCentre::new(&interface, mesh, &Reference::Centre).point
    }

    #[test]
    fn faces_count_by_area_edges_by_length_and_nodes_alike() {
        let mesh = |triangles: &[[u32; 3]], edges: &[[u32; 2]]| {
            SurfaceMesh::new(triangles.to_vec(), edges.to_vec(), 6).expect("a mesh")
        };
        let faces = mesh(&[[0, 4, 3], [4, 1, 2], [4, 2, 3], [0, 1, 5]], &[]);
        let square = [0, 1, 2, 3, 4];
        let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-14);
        assert!(near(of(&square, Some(&faces)), [1.0, 1.0, 5.0]));
        // Rim of the square; one edge has a node within.
        let rim = mesh(&[], &[[0, 4], [4, 1], [1, 2], [2, 3], [3, 0]]);
        assert!(near(of(&square, Some(&rim)), [1.0, 1.0, 5.0]));
        // Edges of triangles are edges as well.
        assert!(near(of(&[4, 0], Some(&faces)), [0.05, 0.0, 5.0]));
        assert!(near(of(&square, None), [0.82, 0.8, 5.0]));
        // A triangle that reaches too few of the nodes is not used.
        let small = mesh(&[[0, 4, 3]], &[]);
        assert_eq!(of(&[0, 1, 2, 3, 4, 5], Some(&small)), of(&[0, 1, 2, 3, 4, 5], None));
    }

    #[test]
    fn an_axis_has_its_point_in_the_middle_of_the_nodes() {
        let axis = Reference::Axis { point: [1.0, 7.0, 1.0], direction: [0.0, 0.0, -3.0] };
        let nodes = [0, 1, 5, 2];
        let interface = InterfaceNodes { nodes: &nodes, outline: &nodes, positions: &SQUARE };
        let found = InterfaceCentre::new(&interface, None, &axis);
        assert_eq!(found.point, [1.0, 7.0, 7.0]);
        assert_eq!(found.mean, [1.25, 0.75, 6.0]);
    }
}

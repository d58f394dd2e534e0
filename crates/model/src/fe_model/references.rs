//! Reference points of interfaces: their positions, and checks of these.

use crate::{Coupling, Nodes, RawModel, Reference, SurfaceMesh, centre_and_length, span};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Distance of a reference point from the middle of the nodes, relative to the largest distance of a node,
/// above which it is an error, usually of units. Rotations about a point this far away lose four digits.
const MAX_RELATIVE_DISTANCE: f64 = 100.0;

/// Distance of a reference point from the middle of its nodes, relative to the extent of the nodes, above
/// which a warning is given.
const WARNING_DISTANCE: f64 = 3.0;
/// Smallest extent of the nodes of an interface, relative to the body, that [`WARNING_DISTANCE`] is applied to.
const MIN_RELATIVE_EXTENT: f64 = 0.05;

/// Distance of the default point of an interface from the mean of its nodes, relative to the largest
/// distance between two of them, above which a warning is given. A smaller value warns of bores whose mesh is merely
/// irregular: 1.4 % at the big end of the connecting rod of the fixtures, 2 % at bolt holes, with the centre of the faces on
/// the axis.
const MEAN_POINT_DISTANCE: f64 = 0.05;
/// Length, relative to the body, below which a distance or a coordinate counts as rounding.
const ROUNDING_LENGTH: f64 = 1e-9;

/// Replaces the definitions of reference points by positions, and adds errors for invalid ones.
pub(crate) fn resolve_references(raw: &mut RawModel, used: &Nodes, diagnostics: &mut Vec<Diagnostic>) {
    let (centre, size) = centre_and_length(&used.positions);
    let body = Extent { centre, size };
    let index: HashMap<i64, u32> = raw.nodes.ids.iter().copied().zip(0..).collect();
    let positions = &raw.nodes.positions;
    for set in &mut raw.data.interfaces {
        let is_free = set.coupling == Some(Coupling::Free);
        if is_free && set.reference.is_stated() {
            let message = format!("interface `{}` is free, but has a reference point", set.name);
            diagnostics.push(Diagnostic::new(Code::ManifestSyntax, message));
        }
        let places = |ids: &[i64]| ids.iter().filter_map(|id| index.get(id)).copied().collect::<Vec<u32>>();
        let nodes = places(&set.nodes);
        let member_positions: Vec<[f64; 3]> = nodes.iter().map(|&node| positions[node as usize]).collect();
        match set.reference {
            Reference::Node(id) => match index.get(&id) {
                Some(&node) => set.reference = Reference::Point(positions[node as usize]),
                None => {
                    let message = format!("reference node {id} of interface `{}` is unknown", set.name);
                    diagnostics.push(Diagnostic::new(Code::InterfaceNode, message));
                }
            },
            Reference::Centre | Reference::Axis { .. } if !is_free => {
                let mut outline = places(if set.outline.is_empty() { &set.nodes } else { &set.outline });
                outline.sort_unstable();
                outline.dedup();
                let members = InterfaceNodes { nodes: &nodes, outline: &outline, positions };
                let centre = InterfaceCentre::new(&members, raw.data.mesh.as_ref(), &set.reference);
                diagnostics.extend(beside_the_mean(&set.name, &centre, &member_positions, body.size));
                set.reference = Reference::Default(centre.point);
            }
            _ => {}
        }
        if let Some(x) = set.reference.point() {
            let problem = impossible(&set.name, x, raw.dimension, &body);
            diagnostics.extend(problem.or_else(|| far_reference(&set.name, x, &member_positions, body.size)));
        }
    }
}

/// Extent of the nodes of a body: their mean, and the largest distance from it.
struct Extent {
    centre: [f64; 3],
    size: f64,
}

/// Returns an error for a reference point that is invalid.
fn impossible(name: &str, reference: [f64; 3], dimension: u8, body: &Extent) -> Option<Diagnostic> {
    if reference.iter().any(|x| !x.is_finite()) {
        let message = format!("reference point of interface `{name}` is not finite");
        return Some(Diagnostic::new(Code::CoordinateNotFinite, message));
    }
    if dimension == 2 && reference[2] != 0.0 {
        let message =
            format!("reference point of interface `{name}` in a plane model has z = {}", reference[2]);
        return Some(Diagnostic::new(Code::DirectionOutOfPlane, message));
    }
    let away = (Vector3::from(reference) - Vector3::from(body.centre)).norm() / body.size;
    (away.is_nan() || away > MAX_RELATIVE_DISTANCE).then(|| {
        let message = format!(
            "reference point of interface `{name}` is {away:.1e} times the size of the body away from its middle"
        );
        let help = "give the reference point in model axes and in the unit of length of the nodes";
        Diagnostic::new(Code::InterfaceCoupling, message).with_help(help)
    })
}

/// Returns a warning for a default reference point that differs from the mean of the nodes, the default of
/// earlier versions.
fn beside_the_mean(
    name: &str,
    centre: &InterfaceCentre,
    nodes: &[[f64; 3]],
    size: f64,
) -> Option<Diagnostic> {
    let away = (Vector3::from(centre.point) - Vector3::from(centre.mean)).norm();
    let extent = span(nodes);
    (away > MEAN_POINT_DISTANCE * extent && away > ROUNDING_LENGTH * size).then(|| {
        let [point, mean] = [centre.point, centre.mean].map(|x| in_words(x, size));
        let (percent, away) = (significant(100.0 * away / extent, 2), significant(away, 4));
        let message = format!(
            "interface `{name}`: the reference point is {}, at ({point}); the mean of its nodes, ({mean}), is {away} away from it, {percent} % of the extent of the nodes ({})",
            centre.origin,
            significant(extent, 4)
        );
        Diagnostic::new(Code::InterfaceCentre, message)
    })
}

/// Formats a point as `120, 0, -3.25`, with six digits; rounding relative to `size` becomes zero.
fn in_words(point: [f64; 3], size: f64) -> String {
    point.map(|x| significant(if x.abs() <= ROUNDING_LENGTH * size { 0.0 } else { x }, 6)).join(", ")
}

/// Returns a warning for a reference point that is far from its nodes compared with their extent, in a body
/// of the given size.
fn far_reference(name: &str, reference: [f64; 3], nodes: &[[f64; 3]], size: f64) -> Option<Diagnostic> {
    let (centre, radius) = match nodes {
        [] => return None,
        [only] => (*only, 0.0),
        _ => centre_and_length(nodes),
    };
    let away = (Vector3::from(reference) - Vector3::from(centre)).norm();
    let reach = radius.max(MIN_RELATIVE_EXTENT * size);
    (away > WARNING_DISTANCE * reach).then(|| {
        let message = format!(
            "reference point of interface `{name}` is {} away from the middle of its nodes, which reach {} from there, in a body whose nodes reach {} from its middle",
            significant(away, 4),
            significant(radius, 4),
            significant(size, 4)
        );
        Diagnostic::new(Code::InterfaceFar, message)
    })
}

// Default reference point of an interface: on its axis, or the centre of the faces or edges between its
// nodes.

/// Part of the nodes of an interface above which its faces (or edges) must reach for their centre to be
/// used.
const MIN_COVERED_NODES: f64 = 0.5;

/// Nodes of an interface, by indices of `positions`, at least one.
pub(crate) struct InterfaceNodes<'n> {
    /// Nodes with rows.
    pub nodes: &'n [u32],
    /// Nodes that define its faces and edges.
    pub outline: &'n [u32],
    /// Positions of all nodes of the model.
    pub positions: &'n [[f64; 3]],
}

/// Point that follows from the nodes of an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
struct InterfaceCentre {
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

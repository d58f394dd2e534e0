//! Drawn parts of a body: its surface, with fewer triangles if it is large, or its nodes as points.

use super::packed::Packed;
use crate::notation::numbers::counted;
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use nalgebra::Vector3;

/// Half a step of a 16-bit number, relative to the largest.
#[cfg(feature = "hdf5")]
pub(crate) const HALF_STEP: f64 = 0.5 / STEPS;
/// Number of steps of a 16-bit number from zero to the largest.
const STEPS: f64 = 32767.0;

/// Smallest number of drawn nodes. Fewer nodes show no recognisable shape, however many modes share the page.
const MIN_NODES: usize = 300;

/// Nodes and triangles that a page draws.
pub(crate) struct Drawing<'b> {
    body: &'b FlexBody,
    mesh: Option<SurfaceMesh>,
    /// Drawn nodes, ascending.
    nodes: Vec<u32>,
    /// Positions of the drawn nodes in model coordinates. Unit: length.
    places: Vec<[f64; 3]>,
    /// Centre of the box around the drawn nodes. Unit: length.
    centre: Vector3<f64>,
    /// Half the largest extent of the box. Unit: length.
    half: f64,
    /// Largest component and largest displacement of each mode at the drawn nodes.
    sizes: Vec<[f64; 2]>,
}

impl<'b> Drawing<'b> {
    /// Builds the drawing of a body with at most `triangles` triangles or, without a number, as many as
    /// `max_bytes` bytes of text hold together with at most the first `modes` modes and `sets` sets of values.
    pub(crate) fn new(
        body: &'b FlexBody,
        triangles: Option<usize>,
        max_bytes: usize,
        modes: usize,
        sets: usize,
    ) -> Self {
        let modes = modes.min(body.n_modes());
        // A node needs six bytes for its position and six for each shape, two for each value, plus two
        // triangles; base64 writes three bytes as four letters.
        let most = (max_bytes / (8 + 8 * modes + 3 * sets + 32)).max(MIN_NODES);
        let positions = &body.nodes().positions;
        let mesh = body.mesh().and_then(|mesh| mesh.decimated(positions, triangles.unwrap_or(2 * most)));
        let nodes = match &mesh {
            Some(mesh) => mesh.drawn_nodes(),
            None => evenly(body.n_nodes(), most),
        };
        let frame = body.frame();
        let places: Vec<[f64; 3]> =
            nodes.iter().map(|&node| frame.to_model(positions[node as usize])).collect();
        let bound = |pick: fn(f64, f64) -> f64| {
            let first = places.first().copied().unwrap_or_default();
            Vector3::from(places.iter().fold(first, |own, x| [0, 1, 2].map(|k| pick(own[k], x[k]))))
        };
        let (low, high) = (bound(f64::min), bound(f64::max));
        let mut own = Self {
            body,
            mesh,
            nodes,
            places,
            centre: 0.5 * (low + high),
            half: (0.5 * (high - low)).amax(),
            sizes: Vec::new(),
        };
        own.sizes = (0..modes).map(|j| own.size(j)).collect();
        own
    }

    /// Returns the displacement of a drawn node in a mode, in body axes.
    fn displacement(&self, node: u32, j: usize) -> Vector3<f64> {
        let shape = &self.body.modes().shape;
        Vector3::from_fn(|k, _| shape[(3 * node as usize + k, j)])
    }

    fn size(&self, j: usize) -> [f64; 2] {
        let axes = &self.body.frame().axes;
        let larger = |own: [f64; 2], &node: &u32| {
            let u = axes * self.displacement(node, j);
            [own[0].max(u.amax()), own[1].max(u.norm())]
        };
        self.nodes.iter().fold([0.0; 2], larger)
    }

    /// Returns positions, shapes, `values` at the vertices, triangles and edges in the form that the page reads.
    pub(crate) fn arrays(&self, values: Option<Packed>) -> Vec<Packed> {
        let axes = self.body.frame().axes;
        let half = if self.half > 0.0 { self.half } else { 1.0 };
        let places = self.places.iter().map(|x| (Vector3::from(*x) - self.centre) / half);
        let shapes = (0..self.sizes.len()).flat_map(|j| {
            let scale = if self.sizes[j][0] > 0.0 { self.sizes[j][0] } else { 1.0 };
            self.nodes.iter().map(move |&node| axes * self.displacement(node, j) / scale)
        });
        let mut arrays = vec![
            Packed::i16("positions", places.flat_map(in_steps)),
            Packed::i16("shapes", shapes.flat_map(in_steps)),
        ];
        arrays.extend(values);
        if let Some(mesh) = &self.mesh {
            let own =
                |nodes: &[u32]| nodes.iter().filter_map(|&i| self.vertex(i as usize)).collect::<Vec<_>>();
            let parts =
                [("triangles", mesh.triangles().as_flattened()), ("edges", mesh.edges().as_flattened())];
            arrays.extend(parts.map(|(name, nodes)| Packed::indices(name, self.nodes.len(), &own(nodes))));
        }
        arrays
    }

    /// Returns the drawn nodes, ascending.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Returns the number of modes in the drawing.
    pub(crate) fn modes(&self) -> usize {
        self.sizes.len()
    }

    /// Returns the positions of the vertices in model coordinates.
    pub(crate) fn places(&self) -> &[[f64; 3]] {
        &self.places
    }

    /// Returns the vertices of every triangle.
    pub(super) fn triangle_corners(&self) -> Vec<[u32; 3]> {
        let triangles = self.mesh.iter().flat_map(SurfaceMesh::triangles);
        triangles.filter_map(|nodes| self.vertices_of(nodes)).collect()
    }

    /// Returns the vertices of every edge.
    pub(super) fn edge_ends(&self) -> Vec<[u32; 2]> {
        let edges = self.mesh.iter().flat_map(SurfaceMesh::edges);
        edges.filter_map(|nodes| self.vertices_of(nodes)).collect()
    }

    fn vertices_of<const N: usize>(&self, nodes: &[u32; N]) -> Option<[u32; N]> {
        let mut own = [0; N];
        for (vertex, &node) in own.iter_mut().zip(nodes) {
            *vertex = self.vertex(node as usize)?;
        }
        Some(own)
    }

    /// Returns the vertex of the page that draws a node of the body; `None` if the node is not drawn.
    pub(crate) fn vertex(&self, node: usize) -> Option<u32> {
        let node = u32::try_from(node).ok()?;
        self.nodes.binary_search(&node).ok().and_then(|at| u32::try_from(at).ok())
    }

    pub(crate) fn vertices(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn triangles(&self) -> usize {
        self.mesh.as_ref().map_or(0, |mesh| mesh.triangles().len())
    }

    pub(crate) fn edges(&self) -> usize {
        self.mesh.as_ref().map_or(0, |mesh| mesh.edges().len())
    }

    /// Returns the kind of drawing: `surface`, `lines` or `points`.
    pub(crate) fn kind(&self) -> &'static str {
        match (self.triangles(), self.edges()) {
            (0, 0) => "points",
            (0, _) => "lines",
            _ => "surface",
        }
    }

    /// Returns the size of the drawing: `1200 triangles, thinned from 4000`.
    pub(crate) fn in_words(&self) -> String {
        let all = self.body.mesh().map_or(0, |mesh| mesh.triangles().len());
        match self.kind() {
            "points" => "not in the file: nodes are drawn as points".to_owned(),
            "lines" => counted(self.edges(), "line"),
            _ if self.triangles() < all => {
                format!("{}, thinned from {all}", counted(self.triangles(), "triangle"))
            }
            _ => counted(all, "triangle"),
        }
    }

    pub(crate) fn centre(&self) -> [f64; 3] {
        self.centre.into()
    }

    /// Returns the length that the integer 32767 stands for in the positions. Unit: length.
    pub(crate) fn half(&self) -> f64 {
        self.half
    }

    /// Returns the largest distance of a drawn node from the centre; 1 for a single node.
    pub(crate) fn radius(&self) -> f64 {
        let distance = |x: &[f64; 3]| (Vector3::from(*x) - self.centre).norm();
        let radius = self.places.iter().map(distance).fold(0.0, f64::max);
        if radius > 0.0 { radius } else { 1.0 }
    }

    /// Returns the component of the shape of mode `j` that the integer 32767 stands for.
    pub(crate) fn scale(&self, j: usize) -> f64 {
        self.sizes[j][0]
    }

    /// Returns the largest displacement of a drawn node in mode `j`.
    pub(crate) fn largest(&self, j: usize) -> f64 {
        self.sizes[j][1]
    }

    /// Returns the largest rounding error of the drawn position of a node along an axis.
    #[cfg(feature = "hdf5")]
    pub(crate) fn position_error(&self) -> f64 {
        self.half * HALF_STEP
    }
}

/// Rounds numbers from -1 to 1 to 16-bit integers.
#[allow(clippy::cast_possible_truncation)] // values are clamped to the range
fn in_steps(x: Vector3<f64>) -> [i16; 3] {
    [x.x, x.y, x.z].map(|x| (x * STEPS).round().clamp(-STEPS, STEPS) as i16)
}

/// Returns at most `most` equally spaced indices below `n`.
fn evenly(n: usize, most: usize) -> Vec<u32> {
    let count = n.min(most);
    (0..count).filter_map(|i| u32::try_from(i as u128 * n as u128 / count as u128).ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_of_many_nodes_are_spread_over_all() {
        assert_eq!(evenly(10, 4), [0, 2, 5, 7]);
        assert_eq!(evenly(3, 300), [0, 1, 2]);
        assert_eq!(evenly(0, 300), [] as [u32; 0]);
    }

    #[test]
    fn steps_round_to_the_nearest() {
        let x = Vector3::new(1.0, -1.0, 0.4 / STEPS);
        assert_eq!(in_steps(x), [32767, -32767, 0]);
    }
}

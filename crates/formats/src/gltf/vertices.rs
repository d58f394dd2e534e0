//! Vertices of a surface. A point has one vertex for each smooth part of the surface around it, so that
//! feature edges remain sharp.

use crate::picture::Drawn;
use nalgebra::Vector3;
use std::collections::HashSet;

/// Normal of a vertex without triangles.
const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// Vertices, and the triangles and lines between them.
pub(super) struct Vertices {
    /// Point of each vertex.
    pub points: Vec<u32>,
    /// Triangles as vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Lines as vertex indices.
    pub edges: Vec<[u32; 2]>,
    /// Normals of length one; those of vertices without triangles have no meaning.
    pub normals: Vec<[f32; 3]>,
}

impl Vertices {
    /// Builds the vertices of the drawn parts, whose points lie at `positions`.
    pub(super) fn new(drawn: &Drawn<'_>, positions: &[[f64; 3]]) -> Self {
        let (triangles, edges) = (drawn.triangles(), drawn.edges());
        let mut groups = CornerGroups::new(3 * triangles.len());
        join_smooth(triangles, edges, &mut groups);
        let mut own =
            Self { points: Vec::new(), triangles: Vec::new(), edges: Vec::new(), normals: Vec::new() };
        // First vertex of each point.
        let mut first = vec![None; drawn.len()];
        let mut of_group = vec![None; 3 * triangles.len()];
        // One vertex for each smooth group of corners at a point.
        for (t, triangle) in triangles.iter().enumerate() {
            let corner = |k: usize| {
                let group = groups.root(3 * t + k);
                let vertex = *of_group[group].get_or_insert_with(|| own.add(triangle[k]));
                first[triangle[k] as usize].get_or_insert(vertex);
                vertex
            };
            let corners = [0, 1, 2].map(corner);
            own.triangles.push(corners);
        }
        // Lines use the first vertex of a point.
        for edge in edges {
            let ends = edge.map(|point| *first[point as usize].get_or_insert_with(|| own.add(point)));
            own.edges.push(ends);
        }
        for point in drawn.loose() {
            own.add(point);
        }
        own.normals = own.normals(positions);
        own
    }

    fn add(&mut self, point: u32) -> u32 {
        self.points.push(point);
        self.points.len() as u32 - 1
    }

    /// Returns the mean normals of the triangles around each vertex, weighted by area.
    fn normals(&self, positions: &[[f64; 3]]) -> Vec<[f32; 3]> {
        // Positions are scaled so that products neither overflow nor underflow.
        let size = positions.as_flattened().iter().fold(0.0f64, |own, x| own.max(x.abs()));
        let size = if size > 0.0 { size } else { 1.0 };
        let place = |vertex: u32| Vector3::from(positions[self.points[vertex as usize] as usize]) / size;
        let mut sums = vec![Vector3::zeros(); self.points.len()];
        // The cross product of two sides is the normal times twice the area.
        for &[a, b, c] in &self.triangles {
            let area = (place(b) - place(a)).cross(&(place(c) - place(a)));
            for vertex in [a, b, c] {
                sums[vertex as usize] += area;
            }
        }
        let normal = |sum: &Vector3<f64>| {
            let length = sum.norm();
            if length > 0.0 { <[f64; 3]>::from(sum / length).map(|x| x as f32) } else { UP }
        };
        sums.iter().map(normal).collect()
    }
}

/// Joins the corners of triangles that share an edge which is no feature edge, if the triangles have the same
/// orientation.
fn join_smooth(triangles: &[[u32; 3]], edges: &[[u32; 2]], groups: &mut CornerGroups) {
    let sorted = |[a, b]: [u32; 2]| if a < b { [a, b] } else { [b, a] };
    let features: HashSet<[u32; 2]> = edges.iter().map(|edge| sorted(*edge)).collect();
    // Sides: edge, its direction, and the corners at its ends, the corner with the lower point first.
    let mut sides: Vec<([u32; 2], bool, [usize; 2])> = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (own, next) = (3 * t + k, 3 * t + (k + 1) % 3);
            let edge = [triangle[k], triangle[(k + 1) % 3]];
            let forward = edge[0] < edge[1];
            sides.push((sorted(edge), forward, if forward { [own, next] } else { [next, own] }));
        }
    }
    sides.sort_unstable();
    // Two sides in opposite directions belong to triangles of the same orientation.
    for shared in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(edge, false, one), (_, true, other)] = shared
            && !features.contains(edge)
        {
            groups.join(one[0], other[0]);
            groups.join(one[1], other[1]);
        }
    }
}

/// Groups of corners (union-find): each corner points to another of its group, the first to itself.
struct CornerGroups(Vec<usize>);

impl CornerGroups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn root(&mut self, mut at: usize) -> usize {
        while self.0[at] != at {
            self.0[at] = self.0[self.0[at]];
            at = self.0[at];
        }
        at
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

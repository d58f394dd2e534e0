//! The two parts of a file: a description in JSON, and the binary numbers that it refers to.

use crate::picture::Drawn;
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::collections::HashSet;

/// Component types and targets of buffer views in the numbering of glTF.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Numbers with their description.
#[derive(Default)]
pub(super) struct Binary {
    data: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// Adds vectors at vertices with their bounds, and returns the number of the accessor.
    pub(super) fn vertices(&mut self, vectors: &[[f32; 3]]) -> usize {
        let accessor = self.floats("VEC3", vectors, Some(VERTICES));
        self.bound(accessor, vectors);
        accessor
    }

    /// Adds vectors at vertices without bounds, and returns the number of the accessor.
    pub(super) fn directions(&mut self, vectors: &[[f32; 3]]) -> usize {
        self.floats("VEC3", vectors, Some(VERTICES))
    }

    /// Adds vertex indices, and returns the number of the accessor.
    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes = indices.iter().flat_map(|index| index.to_le_bytes());
        let view = self.view(bytes, Some(INDICES));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR"
        }))
    }

    /// Adds times of key frames, ascending, and returns the number of the accessor.
    pub(super) fn times(&mut self, times: &[f32]) -> usize {
        let times: Vec<[f32; 1]> = times.iter().map(|time| [*time]).collect();
        let accessor = self.floats("SCALAR", &times, None);
        self.bound(accessor, &times);
        accessor
    }

    /// Adds values at key frames, and returns the number of the accessor.
    pub(super) fn keys<const N: usize>(&mut self, kind: &str, keys: &[[f32; N]]) -> usize {
        self.floats(kind, keys, None)
    }

    fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]], target: Option<u32>) -> usize {
        let view = self.view(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()), target);
        self.accessor(
            json!({ "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind }),
        )
    }

    fn bound<const N: usize>(&mut self, accessor: usize, values: &[[f32; N]]) {
        let each = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let first = values.first().copied().unwrap_or([0.0; N]);
            let fold = |own: [f32; N], x: &[f32; N]| std::array::from_fn(|k| pick(own[k], x[k]));
            values.iter().fold(first, fold).to_vec()
        };
        self.accessors[accessor]["min"] = json!(each(f32::min));
        self.accessors[accessor]["max"] = json!(each(f32::max));
    }

    /// Adds a buffer view. All numbers have four bytes, so that every view is aligned.
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> usize {
        let offset = self.data.len();
        self.data.extend(bytes);
        let length = self.data.len() - offset;
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Returns the bytes of the file; `None` if the file is longer than its length fields can state.
    pub(super) fn file(self, mut document: Value) -> Option<Vec<u8>> {
        document["buffers"] = json!([{ "byteLength": self.data.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = u32::try_from(12 + 8 + text.len() + 8 + self.data.len()).ok()?;
        let part = |kind: &[u8; 4], bytes: &[u8]| -> Option<Vec<u8>> {
            let length = u32::try_from(bytes.len()).ok()?;
            Some([&length.to_le_bytes()[..], kind, bytes].concat())
        };
        let mut file = [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes()].concat();
        file.extend(part(b"JSON", &text)?);
        file.extend(part(b"BIN\0", &self.data)?);
        Some(file)
    }
}

// Vertices of a surface. A point has one vertex for each smooth part of the surface around it, so that
// feature edges remain sharp.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_parts_in_order_and_at_multiples_of_four() {
        let mut binary = Binary::default();
        let vectors = [[1.0, -2.0, 3.0], [0.5, 4.0, -1.0]];
        assert_eq!((binary.vertices(&vectors), binary.indices(&[1, 0])), (0, 1));
        assert_eq!(binary.accessors[0]["min"], json!([0.5, -2.0, -1.0]));
        assert_eq!(binary.accessors[0]["max"], json!([1.0, 4.0, 3.0]));
        let file = binary.file(json!({ "asset": { "version": "2.0" } })).expect("a short file");
        assert_eq!(&file[..4], b"glTF");
        let number =
            |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((number(4), number(8), &file[16..20]), (2, file.len(), &b"JSON"[..]));
        let second = 20 + number(12);
        assert_eq!((second % 4, number(second), &file[second + 4..second + 8]), (0, 32, &b"BIN\0"[..]));
        let text: Value = serde_json::from_slice(&file[20..second]).expect("JSON");
        assert_eq!(text["buffers"][0]["byteLength"], json!(32));
    }
}

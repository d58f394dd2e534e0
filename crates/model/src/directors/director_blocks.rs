//! Mass matrix of a model by node blocks, converted to a mass of points and directors.

use crate::directors::mass_structure::Columns;
use crate::rows::Rows;
use flexbody_linalg::{SymmetricMatrix, parallel};
use std::ops::Range;

/// Part of sqrt(M_ii M_jj) below which an entry of the rest is the rounding of the values that it is a
/// difference of.
pub(crate) const ROUNDING_ENTRY: f64 = 1e-14;

/// Number of vertices per parallel task.
const VERTICES_PER_TASK: usize = 1024;

/// Marks a vertex without directors.
const NO_DIRECTORS: u32 = u32::MAX;

/// M by blocks of vertices.
pub(crate) struct Blocks<'a> {
    m: &'a SymmetricMatrix,
    rows: &'a Rows,
    /// Nodes whose rotations carry mass, ascending.
    nodes: Vec<u32>,
    /// Index in `nodes` of every vertex, or [`NO_DIRECTORS`].
    place_of: Vec<u32>,
    points: usize,
}

/// Local rows of a vertex: displacements 0, 1, 2, rotations 3, 4, 5.
type Block = [[f64; 6]; 6];

/// Returns the symmetric matrix (n x n) with these columns.
fn symmetric(n: usize, parts: Vec<Columns>) -> SymmetricMatrix {
    SymmetricMatrix::new(Columns::joined(n, parts))
        .expect("entries are computed alike on both sides of the diagonal")
}

/// Columns of a range of vertices.
#[derive(Default)]
struct Partial {
    points: Columns,
    directors: Columns,
    rest_of_points: Columns,
    rest_of_rotations: Columns,
    share: f64,
}

impl<'a> Blocks<'a> {
    /// Creates the blocks of the mass `m` of these rows.
    pub(crate) fn new(m: &'a SymmetricMatrix, rows: &'a Rows) -> Self {
        let first = rows.displacements();
        let mut nodes: Vec<u32> = Vec::new();
        for (at, &(node, _)) in rows.rotations().iter().enumerate() {
            if !m.row(first + at).0.is_empty() && nodes.last() != Some(&node) {
                nodes.push(node);
            }
        }
        let points = first / rows.dimension;
        let mut place_of = vec![NO_DIRECTORS; points];
        nodes.iter().zip(0..).for_each(|(&node, place)| place_of[node as usize] = place);
        Self { m, rows, nodes, place_of, points }
    }

    /// Returns true if a rotation carries mass.
    pub(crate) fn turn(&self) -> bool {
        !self.nodes.is_empty()
    }

    /// Returns the number of vertices.
    pub(crate) fn points(&self) -> usize {
        self.points
    }

    /// Returns the index of a vertex among the nodes whose rotations carry mass.
    pub(crate) fn place(&self, q: usize) -> Option<u32> {
        Some(self.place_of[q]).filter(|place| *place != NO_DIRECTORS)
    }

    /// Returns the nodes whose rotations carry mass, ascending.
    pub(crate) fn into_nodes(self) -> Vec<u32> {
        self.nodes
    }

    /// Returns E_s, and the rest on extended rows if it is more than rounding.
    pub(crate) fn split(&self) -> (SymmetricMatrix, Option<SymmetricMatrix>) {
        let d = self.rows.dimension;
        let sizes = self.sizes();
        let parts = parallel::map(self.chunks(), |vertices| self.part(vertices, &sizes));
        let (mut points, mut directors, mut share) = (Vec::new(), Vec::new(), 0.0f64);
        let (mut rest_of_points, mut rest_of_rotations) = (Vec::new(), Vec::new());
        for part in parts {
            points.push(part.points);
            directors.push(part.directors);
            rest_of_points.push(part.rest_of_points);
            rest_of_rotations.push(part.rest_of_rotations);
            share = share.max(part.share);
        }
        // Columns in the order of the extended rows: points, then directors, then rotations.
        points.append(&mut directors);
        let scalar = symmetric(self.points + d * self.nodes.len(), points);
        if share <= ROUNDING_ENTRY {
            return (scalar, None);
        }
        let empty = d * d * self.nodes.len();
        rest_of_points.push(Columns::empty(empty));
        rest_of_points.append(&mut rest_of_rotations);
        let turns = if d == 2 { 1 } else { 3 };
        let n = d * self.points + empty + turns * self.nodes.len();
        (scalar, Some(symmetric(n, rest_of_points)))
    }

    /// Returns the vertices of every parallel task.
    fn chunks(&self) -> Vec<Range<usize>> {
        (0..self.points)
            .step_by(VERTICES_PER_TASK)
            .map(|i| i..(i + VERTICES_PER_TASK).min(self.points))
            .collect()
    }

    /// Returns the largest entry of the rest relative to sqrt(M_ii M_jj).
    pub(crate) fn share(&self) -> f64 {
        let sizes = self.sizes();
        let of_vertex = |p: usize| {
            let blocks = self.neighbours(p);
            blocks.iter().map(|(q, block)| self.rest_of(p, *q, block, &sizes).1).fold(0.0, f64::max)
        };
        let of_chunk = |vertices: Range<usize>| vertices.map(of_vertex).fold(0.0, f64::max);
        parallel::map(self.chunks(), of_chunk).into_iter().fold(0.0, f64::max)
    }

    /// Returns the columns of these vertices.
    fn part(&self, vertices: Range<usize>, sizes: &[[f64; 2]]) -> Partial {
        let mut part = Partial::default();
        for p in vertices {
            let blocks = self.neighbours(p);
            self.point_column(&blocks, &mut part.points);
            part.share = part.share.max(self.rest_of_point(p, &blocks, sizes, &mut part.rest_of_points));
            if self.place(p).is_some() {
                self.director_columns(&blocks, &mut part.directors);
                self.rest_of_rotations(p, &blocks, sizes, &mut part.rest_of_rotations);
            }
        }
        part
    }

    /// Returns the blocks M_pq of the vertex p with every vertex q that shares mass with it, ascending.
    fn neighbours(&self, p: usize) -> Vec<(usize, Block)> {
        let (first, d) = (self.rows.displacements(), self.rows.dimension);
        let local = |row: usize| match row.checked_sub(first) {
            None => row % d,
            Some(at) => 3 + usize::from(self.rows.rotations()[at].1),
        };
        let mut blocks: Vec<(usize, Block)> = Vec::new();
        for row in self.rows.of_vertex(p) {
            let local_row = local(row);
            let (columns, values) = self.m.row(row);
            let mut at = 0;
            for (&column, &value) in columns.iter().zip(values) {
                let q = self.rows.vertex(column as usize);
                // Columns ascend within displacements and within rotations.
                at = match blocks.get(at) {
                    Some((known, _)) if *known == q => at,
                    _ => match blocks.binary_search_by_key(&q, |(known, _)| *known) {
                        Ok(at) => at,
                        Err(at) => {
                            blocks.insert(at, (q, [[0.0; 6]; 6]));
                            at
                        }
                    },
                };
                blocks[at].1[local_row][local(column as usize)] = value;
            }
        }
        blocks
    }

    /// Returns mu of a block.
    fn mean(&self, block: &Block) -> f64 {
        let d = self.rows.dimension;
        (0..d).map(|k| block[k][k]).sum::<f64>() / d as f64
    }

    /// Returns h_a of the displacements of p and the rotations of q, M_tr = -h~ + N; `entry` takes
    /// (displacement, rotation).
    fn first_moment(&self, entry: impl Fn(usize, usize) -> f64, a: usize) -> f64 {
        if self.rows.dimension == 2 {
            return if a == 0 { entry(1, 5) } else { -entry(0, 5) };
        }
        let (k, l) = ((a + 1) % 3, (a + 2) % 3);
        0.5 * (entry(k, 3 + l) - entry(l, 3 + k))
    }

    /// Returns P_ab of the rotations of p and q.
    fn second_moment(&self, block: &Block, a: usize, b: usize) -> f64 {
        if self.rows.dimension == 2 {
            return if a == b { 0.5 * block[5][5] } else { 0.0 };
        }
        if a != b {
            return -block[3 + b][3 + a];
        }
        let (k, l) = ((a + 1) % 3, (a + 2) % 3);
        // tr/2 - M_aa, in an order that rounds equally on both sides of the diagonal.
        0.5 * ((block[3 + k][3 + k] + block[3 + l][3 + l]) - block[3 + a][3 + a])
    }

    fn director(&self, place: u32, a: usize) -> usize {
        self.points + self.rows.dimension * place as usize + a
    }

    fn point_column(&self, blocks: &[(usize, Block)], columns: &mut Columns) {
        for (q, block) in blocks {
            columns.push(*q, self.mean(block));
        }
        for (q, block) in blocks {
            let Some(place) = self.place(*q) else { continue };
            for a in 0..self.rows.dimension {
                columns.push(self.director(place, a), self.first_moment(|k, b| block[k][b], a));
            }
        }
        columns.end();
    }

    fn director_columns(&self, blocks: &[(usize, Block)], columns: &mut Columns) {
        for b in 0..self.rows.dimension {
            for (q, block) in blocks {
                columns.push(*q, self.first_moment(|k, c| block[c][k], b));
            }
            for (q, block) in blocks {
                let Some(place) = self.place(*q) else { continue };
                for a in 0..self.rows.dimension {
                    // Director a of q, director b of p: P_qp[a, b] = P_pq[b, a].
                    columns.push(self.director(place, a), self.second_moment(block, b, a));
                }
            }
            columns.end();
        }
    }

    /// Returns the square root of the largest diagonal entry of the displacements and of the rotations of
    /// every vertex.
    fn sizes(&self) -> Vec<[f64; 2]> {
        let diagonal = self.m.diagonal();
        let (first, mut sizes) = (self.rows.displacements(), vec![[0.0f64; 2]; self.points]);
        for (row, value) in diagonal.iter().enumerate() {
            let vertex = self.rows.vertex(row);
            if let Some(size) = sizes.get_mut(vertex) {
                let kind = usize::from(row >= first);
                size[kind] = size[kind].max(value.abs().sqrt());
            }
        }
        sizes
    }

    /// Returns the rest in the rows of displacements of p and all rows of q, with rounding removed, and its
    /// largest entry relative to sqrt(M_ii M_jj).
    fn rest_of(&self, p: usize, q: usize, block: &Block, sizes: &[[f64; 2]]) -> (Block, f64) {
        let d = self.rows.dimension;
        let mean = self.mean(block);
        let mut rest = [[0.0; 6]; 6];
        for k in 0..d {
            for l in 0..d {
                rest[k][l] = block[k][l] - if k == l { mean } else { 0.0 };
                if d == 3 {
                    rest[k][3 + l] = 0.5 * (block[k][3 + l] + block[l][3 + k]);
                }
            }
        }
        let mut largest = 0.0f64;
        for row in rest.iter_mut().take(d) {
            for (l, value) in row.iter_mut().enumerate() {
                let size = sizes[p][0] * sizes[q][usize::from(l >= 3)];
                let share = value.abs() / size;
                if share > ROUNDING_ENTRY { largest = largest.max(share) } else { *value = 0.0 }
            }
        }
        (rest, largest)
    }

    /// Returns the first extended row of the rotations of the node at a place.
    fn rotation(&self, place: u32) -> usize {
        let d = self.rows.dimension;
        d * self.points + d * d * self.nodes.len() + 3 * place as usize
    }

    /// Adds the columns of the displacements of p. Returns their largest entry relative to sqrt(M_ii M_jj).
    fn rest_of_point(
        &self,
        p: usize,
        blocks: &[(usize, Block)],
        sizes: &[[f64; 2]],
        columns: &mut Columns,
    ) -> f64 {
        let d = self.rows.dimension;
        let mut largest = 0.0f64;
        let rest_of = |(q, block): &(usize, Block)| {
            let (rest, share) = self.rest_of(p, *q, block, sizes);
            largest = largest.max(share);
            (*q, rest)
        };
        let rests: Vec<(usize, Block)> = blocks.iter().map(rest_of).collect();
        for k in 0..d {
            for (q, rest) in &rests {
                (0..d).for_each(|l| columns.push(d * q + l, rest[k][l]));
            }
            for (q, rest) in rests.iter().filter(|_| d == 3) {
                let Some(place) = self.place(*q) else { continue };
                (0..3).for_each(|b| columns.push(self.rotation(place) + b, rest[k][3 + b]));
            }
            columns.end();
        }
        largest
    }

    /// Adds the columns of the rotations of the node p, which contain N only.
    fn rest_of_rotations(
        &self,
        p: usize,
        blocks: &[(usize, Block)],
        sizes: &[[f64; 2]],
        columns: &mut Columns,
    ) {
        if self.rows.dimension == 2 {
            return columns.end();
        }
        let transposed = |block: &Block| {
            let mut turned = [[0.0; 6]; 6];
            (0..6).for_each(|k| (0..6).for_each(|l| turned[l][k] = block[k][l]));
            turned
        };
        let rest_of = |(q, block): &(usize, Block)| (*q, self.rest_of(*q, p, &transposed(block), sizes).0);
        let rests: Vec<(usize, Block)> = blocks.iter().map(rest_of).collect();
        for b in 0..3 {
            for (q, rest) in &rests {
                (0..3).for_each(|k| columns.push(3 * q + k, rest[k][3 + b]));
            }
            columns.end();
        }
    }
}

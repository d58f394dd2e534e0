//! The mass matrix of a model with nodal rotations as a mass of points and directors (theory section 6).
//!
//! A node with rotations is a point x and directors d_a = R e_a, a = 1..d, which turn with it. With the blocks
//! of M between node i and node j,
//!
//! ```text
//! M_tr,ij = -h_ij~ + N_ij            h_ij: first moment, N_ij: symmetric
//! M_rr,ij = tr(P_ij) I - P_ij'       P_ij' = tr(M_rr,ij)/2 I - M_rr,ij: second moment
//! M_tt,ij = mu_ij I + D_ij           mu_ij = tr(M_tt,ij)/d
//! ```
//!
//! the kinetic energy of points and directors is that of a solid: their mass E_s = [mu, h; h', P], a number for
//! every pair of points and directors, is the same along every axis and does not change with the rotations.
//! The rest N and D, which it leaves of M, is multiplied by the velocities of the rows along the axes of the body: the
//! rest. Of a plane body, with the directors e_x, e_y, h = (M_y, -M_x) of the column M_tr, P = M_rr/2 I and
//! N = 0.

use super::columns::Columns;
use super::node_moments::NodeMoments;
use super::rows::Rows;
use crate::numerics::linalg::{
    SymmetricMatrix, contiguous, contiguous_mut, multiply, multiply_vector, zeros,
};
use faer::{Mat, MatMut, MatRef};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// Part of sqrt(M_ii M_jj) below which an entry of the rest is rounding of the values it is the difference of.
const ROUNDING: f64 = 1e-14;

/// Vertices per parallel task.
const CHUNK: usize = 1024;

/// No director.
const NONE: u32 = u32::MAX;

/// M as a mass of points and directors, and what this leaves of it.
///
/// Columns of *extended rows* are what it multiplies: displacements of the points (d for each), then of the
/// directors (d for each of the d directors of a node with rotational mass), then, where there is a rest, the
/// rotations of these nodes (three for each, in the plane one). [`DirectorMass::extend`] takes the columns of a
/// model there, [`DirectorMass::restrict`] forces back.
#[derive(Debug, Clone)]
pub struct DirectorMass {
    dimension: usize,
    model_rows: usize,
    points: usize,
    /// Nodes with directors, ascending.
    nodes: Vec<u32>,
    /// Place of its node in `nodes`, axis and row of the model of every rotation of these nodes.
    rotations: Vec<Rotation>,
    /// E_s: points, then d directors of each of the nodes.
    scalar: SymmetricMatrix,
    /// N and D, on extended rows.
    rest: Option<SymmetricMatrix>,
}

#[derive(Debug, Clone, Copy)]
struct Rotation {
    place: usize,
    axis: usize,
    row: usize,
}

impl DirectorMass {
    /// The mass `m` (rows of the model, symmetric) on points and directors; `None` when no rotation carries
    /// mass.
    pub(super) fn new(m: &SymmetricMatrix, rows: &Rows) -> Option<Self> {
        let (nodes, place_of) = carriers(m, rows)?;
        let (d, first) = (rows.dimension, rows.displacements());
        let points = first / d;
        let rotations = rows.rotations().iter().zip(first..).filter_map(|(&(node, axis), row)| {
            let place = place_of[node as usize];
            (place != NONE).then_some(Rotation { place: place as usize, axis: axis.into(), row })
        });
        let rotations = rotations.collect();
        let blocks = Blocks { m, rows, nodes: &nodes, place_of: &place_of, points };
        let (scalar, rest) = blocks.split();
        Some(Self { dimension: d, model_rows: rows.len(), points, rotations, nodes, scalar, rest })
    }

    /// Largest entry of the rest of the mass `m`, as [`DirectorMass::new`] finds it, relative to sqrt(M_ii M_jj): how much
    /// of M does not turn with the nodes. Zero for lumped masses and rigid regions of solids; of consistent beams and
    /// shells it stays, and its effect falls with the square of the element size to that of the rotary inertia of their
    /// sections. `None` when no rotation carries mass.
    pub(super) fn rest_share(m: &SymmetricMatrix, rows: &Rows) -> Option<f64> {
        let (nodes, place_of) = carriers(m, rows)?;
        let points = rows.displacements() / rows.dimension;
        let share = Blocks { m, rows, nodes: &nodes, place_of: &place_of, points }.share();
        Some(if share > ROUNDING { share } else { 0.0 })
    }

    /// Nodes with directors, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// E_s: a number for every pair of points and directors, points first, then the directors of each of the nodes.
    pub(crate) fn scalar(&self) -> &SymmetricMatrix {
        &self.scalar
    }

    /// N and D on extended rows; `None` where E_s is all of M.
    pub(crate) fn rest(&self) -> Option<&SymmetricMatrix> {
        self.rest.as_ref()
    }

    /// Number of extended rows.
    pub fn rows(&self) -> usize {
        self.turning_rows() + if self.rest.is_some() { self.turns() * self.nodes.len() } else { 0 }
    }

    /// Extended rows that turn with the body, which come first: vectors of points and directors.
    pub fn turning_rows(&self) -> usize {
        self.dimension * self.scalar.n()
    }

    /// Rotations of a node that there can be.
    fn turns(&self) -> usize {
        if self.dimension == 2 { 1 } else { 3 }
    }

    /// First extended row of director `a` of the node at `place`.
    fn director(&self, place: usize, a: usize) -> usize {
        let d = self.dimension;
        d * (self.points + d * place + a)
    }

    /// First extended row of the rotations of the node at `place`, where there is a rest.
    fn rotation(&self, place: usize) -> usize {
        self.turning_rows() + self.turns() * place
    }

    /// Velocities of the extended rows for those of the rows of the model, both to first order and along the
    /// axes of the model: theta x e_a of a director.
    ///
    /// # Panics
    /// When there is not one row for each of the model.
    pub fn extend(&self, shapes: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(shapes.nrows(), self.model_rows, "one row per row of the model");
        let mut extended = zeros(self.rows(), shapes.ncols());
        each_column(shapes, &mut extended, |from, to| self.extend_vector(from, to));
        extended
    }

    /// [`DirectorMass::extend`] of one column, into another.
    pub fn extend_vector(&self, shape: &[f64], extended: &mut [f64]) {
        let points = self.dimension * self.points;
        extended[..points].copy_from_slice(&shape[..points]);
        extended[points..].fill(0.0);
        for &Rotation { place, axis, row } in &self.rotations {
            self.turn(place, axis, shape[row], extended);
        }
    }

    /// Adds the rotation of a node about an axis of the model to its directors.
    fn turn(&self, place: usize, axis: usize, angle: f64, extended: &mut [f64]) {
        // e_axis x e_a = e_b and e_axis x e_b = -e_a for the cyclic order (axis, a, b).
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        extended[self.director(place, a) + b] += angle;
        extended[self.director(place, b) + a] -= angle;
        if self.rest.is_some() {
            extended[self.rotation(place) + if self.dimension == 2 { 0 } else { axis }] += angle;
        }
    }

    /// Unit translations and unit rotations of the extended rows, given those of the model (N x 6, in the plane
    /// N x 3, along its axes, rotations not divided by a length): directors and rotations of nodes turn whatever
    /// rows of rotations their nodes have.
    ///
    /// # Panics
    /// When there is not one row for each of the model.
    pub fn extend_rigid(&self, fields: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(fields.nrows(), self.model_rows, "one row per row of the model");
        let (d, points) = (self.dimension, self.dimension * self.points);
        let mut extended = zeros(self.rows(), fields.ncols());
        extended.as_mut().subrows_mut(0, points).copy_from(fields.subrows(0, points));
        for column in d..fields.ncols() {
            let axis = if d == 2 { 2 } else { column - 3 };
            let extended = extended.col_as_slice_mut(column);
            (0..self.nodes.len()).for_each(|place| self.turn(place, axis, 1.0, extended));
        }
        extended
    }

    /// Forces on the rows of the model that do the power of forces on the extended rows: moments
    /// sum_a e_a x f_a of those of the directors on the rotations of their node.
    ///
    /// # Panics
    /// When there is not one row for each extended one.
    pub fn restrict(&self, forces: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(forces.nrows(), self.rows(), "one row per extended row");
        let mut restricted = zeros(self.model_rows, forces.ncols());
        each_column(forces, &mut restricted, |from, to| self.restrict_vector(from, to));
        restricted
    }

    /// [`DirectorMass::restrict`] of one column, into another.
    pub fn restrict_vector(&self, forces: &[f64], restricted: &mut [f64]) {
        let points = self.dimension * self.points;
        restricted[..points].copy_from_slice(&forces[..points]);
        restricted[points..].fill(0.0);
        for &Rotation { place, axis, row } in &self.rotations {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            restricted[row] = forces[self.director(place, a) + b] - forces[self.director(place, b) + a];
            if self.rest.is_some() {
                restricted[row] += forces[self.rotation(place) + if self.dimension == 2 { 0 } else { axis }];
            }
        }
    }

    /// y = E x of extended rows.
    ///
    /// # Panics
    /// When the sizes disagree.
    pub fn multiply(&self, x: MatRef<'_, f64>, mut y: MatMut<'_, f64>) {
        let turning = self.turning_rows();
        if let Some(rest) = &self.rest {
            multiply(rest, 1, x, y.as_mut());
            let mut product = zeros(turning, x.ncols());
            multiply(&self.scalar, self.dimension, x.subrows(0, turning), product.as_mut());
            let mut head = y.subrows_mut(0, turning);
            head += product;
        } else {
            multiply(&self.scalar, self.dimension, x, y);
        }
    }

    /// [`DirectorMass::multiply`] of one column; `scratch` has as many entries.
    pub fn multiply_vector(&self, x: &[f64], y: &mut [f64], scratch: &mut [f64]) {
        let turning = self.turning_rows();
        multiply_vector(&self.scalar, self.dimension, &x[..turning], &mut y[..turning]);
        if let Some(rest) = &self.rest {
            multiply_vector(rest, 1, x, scratch);
            y[turning..].fill(0.0);
            y.iter_mut().zip(scratch).for_each(|(y, rest)| *y += *rest);
        }
    }

    /// Adds H theta to the moments on the rotations of every node, in the rows of the model: theta of `u`, H of the
    /// node at a place among [`DirectorMass::nodes`].
    ///
    /// # Panics
    /// When there is not one row for each of the model.
    pub fn add_second_order(&self, h: impl Fn(usize) -> Matrix3<f64>, u: &[f64], forces: &mut [f64]) {
        assert!(u.len() == self.model_rows && forces.len() == u.len(), "one row per row of the model");
        for of_node in self.rotations.chunk_by(|a, b| a.place == b.place) {
            let mut theta = Vector3::zeros();
            of_node.iter().for_each(|rotation| theta[rotation.axis] = u[rotation.row]);
            let moment = h(of_node[0].place) * theta;
            of_node.iter().for_each(|rotation| forces[rotation.row] += moment[rotation.axis]);
        }
    }

    /// The moments of the mass that turns with every node, about the point and along the axes that the rigid
    /// motions `fields` of the extended rows have, columns of `axes` in the axes of the model.
    ///
    /// * `fields`: [`DirectorMass::extend_rigid`], turned to these axes.
    pub fn moments(&self, fields: MatRef<'_, f64>, axes: &Matrix3<f64>) -> Vec<NodeMoments> {
        let mut product = zeros(self.rows(), fields.ncols());
        self.multiply(fields, product.as_mut());
        let d = self.dimension;
        let vector = |row: usize, column: usize| {
            Vector3::from_fn(|k, _| if k < d { product[(row + k, column)] } else { 0.0 })
        };
        let axis = |k: usize| axes.column(k).into_owned();
        let of_node = |place: usize| {
            let (mut first, mut second) = (Vector3::zeros(), Matrix3::zeros());
            for a in 0..d {
                let row = self.director(place, a);
                first[a] = (0..d).map(|k| vector(row, k).dot(&axis(k))).sum::<f64>() / d as f64;
                // The sum over the axes k of e_k x (e_k x z) is -2 z, in the plane -z.
                let turned = |k: usize, column: usize| axis(k).cross(&vector(row, column));
                let z = match d {
                    2 => -turned(2, 2),
                    _ => (0..3).map(|k| turned(k, 3 + k)).sum::<Vector3<f64>>() * -0.5,
                };
                second.set_row(a, &z.transpose());
            }
            NodeMoments { first: axes.transpose() * first, second: axes.transpose() * second * axes }
        };
        (0..self.nodes.len()).map(of_node).collect()
    }
}

/// Makes every column of `to` of that of `from`, by all threads.
fn each_column(from: MatRef<'_, f64>, to: &mut Mat<f64>, make: impl Fn(&[f64], &mut [f64]) + Sync) {
    let columns: Vec<_> = from.col_iter().zip(to.col_iter_mut()).collect();
    columns.into_par_iter().for_each(|(from, to)| make(contiguous(from), contiguous_mut(to)));
}

/// Nodes whose rotations carry mass, ascending, and the place of every vertex among them; `None` when there are none.
fn carriers(m: &SymmetricMatrix, rows: &Rows) -> Option<(Vec<u32>, Vec<u32>)> {
    let first = rows.displacements();
    let mut nodes: Vec<u32> = Vec::new();
    for (at, &(node, _)) in rows.rotations().iter().enumerate() {
        if !m.row(first + at).0.is_empty() && nodes.last() != Some(&node) {
            nodes.push(node);
        }
    }
    let mut place_of = vec![NONE; first / rows.dimension];
    nodes.iter().zip(0..).for_each(|(&node, place)| place_of[node as usize] = place);
    (!nodes.is_empty()).then_some((nodes, place_of))
}

/// M by blocks of vertices.
struct Blocks<'a> {
    m: &'a SymmetricMatrix,
    rows: &'a Rows,
    nodes: &'a [u32],
    place_of: &'a [u32],
    points: usize,
}

/// Local rows of a vertex: displacements 0, 1, 2, rotations 3, 4, 5.
type Block = [[f64; 6]; 6];

/// The symmetric matrix (n x n) of these columns.
fn symmetric(n: usize, parts: Vec<Columns>) -> SymmetricMatrix {
    SymmetricMatrix::new(Columns::joined(n, parts))
        .expect("entries are computed alike on both sides of the diagonal")
}

/// Columns of a range of vertices.
#[derive(Default)]
struct Part {
    points: Columns,
    directors: Columns,
    rest_of_points: Columns,
    rest_of_rotations: Columns,
    share: f64,
}

impl Blocks<'_> {
    /// E_s, and the rest on extended rows where it is more than rounding.
    fn split(&self) -> (SymmetricMatrix, Option<SymmetricMatrix>) {
        let d = self.rows.dimension;
        let sizes = self.sizes();
        let parts: Vec<Part> =
            self.chunks().into_par_iter().map(|vertices| self.part(vertices, &sizes)).collect();
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
        if share <= ROUNDING {
            return (scalar, None);
        }
        let empty = d * d * self.nodes.len();
        rest_of_points.push(Columns::empty(empty));
        rest_of_points.append(&mut rest_of_rotations);
        let turns = if d == 2 { 1 } else { 3 };
        let n = d * self.points + empty + turns * self.nodes.len();
        (scalar, Some(symmetric(n, rest_of_points)))
    }

    /// Vertices of every parallel task.
    fn chunks(&self) -> Vec<Range<usize>> {
        (0..self.points).step_by(CHUNK).map(|i| i..(i + CHUNK).min(self.points)).collect()
    }

    /// Largest entry of the rest relative to sqrt(M_ii M_jj); 0 where it is rounding.
    fn share(&self) -> f64 {
        let sizes = self.sizes();
        let of_vertex = |p: usize| {
            let blocks = self.neighbours(p);
            blocks.iter().map(|(q, block)| self.rest_of(p, *q, block, &sizes).1).fold(0.0, f64::max)
        };
        let of_chunk = |vertices: Range<usize>| vertices.map(of_vertex).fold(0.0, f64::max);
        let shares: Vec<f64> = self.chunks().into_par_iter().map(of_chunk).collect();
        shares.into_iter().fold(0.0, f64::max)
    }

    /// The columns of these vertices.
    fn part(&self, vertices: Range<usize>, sizes: &[[f64; 2]]) -> Part {
        let mut part = Part::default();
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

    /// Blocks M_pq of the vertex p with every vertex q that shares mass with it, ascending.
    fn neighbours(&self, p: usize) -> Vec<(usize, Block)> {
        let (first, d) = (self.rows.displacements(), self.rows.dimension);
        let local = |row: usize| match row.checked_sub(first) {
            None => row % d,
            Some(at) => 3 + usize::from(self.rows.rotations()[at].1),
        };
        let mut blocks: Vec<(usize, Block)> = Vec::new();
        for row in self.rows.of_vertex(p) {
            let own = local(row);
            let (columns, values) = self.m.row(row);
            let mut at = 0;
            for (&column, &value) in columns.iter().zip(values) {
                let q = self.rows.vertex(column as usize);
                // Columns of displacements ascend, and those of rotations.
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
                blocks[at].1[own][local(column as usize)] = value;
            }
        }
        blocks
    }

    /// mu of a block.
    fn mean(&self, block: &Block) -> f64 {
        let d = self.rows.dimension;
        (0..d).map(|k| block[k][k]).sum::<f64>() / d as f64
    }

    /// h_a of the displacements of p and the rotations of q, M_tr = -h~ + N; `entry` has (displacement,
    /// rotation).
    fn first_moment(&self, entry: impl Fn(usize, usize) -> f64, a: usize) -> f64 {
        if self.rows.dimension == 2 {
            return if a == 0 { entry(1, 5) } else { -entry(0, 5) };
        }
        let (k, l) = ((a + 1) % 3, (a + 2) % 3);
        0.5 * (entry(k, 3 + l) - entry(l, 3 + k))
    }

    /// P_ab of the rotations of p and q.
    fn second_moment(&self, block: &Block, a: usize, b: usize) -> f64 {
        if self.rows.dimension == 2 {
            return if a == b { 0.5 * block[5][5] } else { 0.0 };
        }
        if a != b {
            return -block[3 + b][3 + a];
        }
        let (k, l) = ((a + 1) % 3, (a + 2) % 3);
        // tr/2 - M_aa, so that both sides of the diagonal round alike.
        0.5 * ((block[3 + k][3 + k] + block[3 + l][3 + l]) - block[3 + a][3 + a])
    }

    fn director(&self, place: u32, a: usize) -> usize {
        self.points + self.rows.dimension * place as usize + a
    }

    fn place(&self, q: usize) -> Option<u32> {
        Some(self.place_of[q]).filter(|place| *place != NONE)
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

    /// Square root of the largest diagonal entry of the displacements and of the rotations of every vertex.
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

    /// What E_s leaves of the rows of displacements of p and all rows of q, and the largest of it relative to
    /// sqrt(M_ii M_jj); rounding is taken out.
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
                match share > ROUNDING {
                    true => largest = largest.max(share),
                    false => *value = 0.0,
                }
            }
        }
        (rest, largest)
    }

    /// First extended row of the rotations of the node at a place.
    fn rotation(&self, place: u32) -> usize {
        let d = self.rows.dimension;
        d * self.points + d * d * self.nodes.len() + 3 * place as usize
    }

    /// The columns of the displacements of p. Returns their largest entry relative to sqrt(M_ii M_jj).
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

    /// The columns of the rotations of the node p: N alone.
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

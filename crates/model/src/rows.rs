//! Meaning of the rows of a model in the internal order, and their rigid motion.
//!
//! First the displacements of the nodes, node-major; then those of vectors without a position, whose rigid
//! motion only K determines (bubbles, hierarchical shape functions); then nodal rotations; last massless
//! rows without a position.

pub(crate) mod given_rows;
pub(crate) mod internal_rows;
pub(crate) mod neighbours;

use crate::{DofLabel, Nodes};
use faer::Mat;
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{SymmetricMatrix, connected_components, largest, parallel};
use std::ops::Range;

/// Largest rigid motion of a row at rest, relative to a unit translation: rounding of the stiffness.
const MAX_MOTION_AT_REST: f64 = 1e-9;

/// Rows of a model beyond its plain displacements, and the order of all rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    pub(crate) dimension: usize,
    pub(crate) nodes: usize,
    /// Numbers in the labels of vectors without a position.
    pub(crate) vectors: Vec<i64>,
    /// Index of the node and axis (0, 1, 2) of every rotation, ascending.
    pub(crate) rotations: Vec<(u32, u8)>,
    /// Labels of the massless rows without a position.
    pub(crate) others: Vec<DofLabel>,
    pub(crate) recovered: Recovered,
}

/// Rigid motion of the rows without a position, determined by K: vectors first, then the massless rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Recovered {
    /// One column per rigid motion; rotations about `centre`, divided by `length`.
    pub fields: Mat<f64>,
    pub centre: [f64; 3],
    pub length: f64,
}

impl Recovered {
    /// Returns the recovered motion of no rows.
    pub(crate) fn none() -> Self {
        Self { fields: Mat::new(), centre: [0.0; 3], length: 1.0 }
    }
}

impl Rows {
    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.displacements() + self.rotations.len() + self.others.len()
    }

    /// Returns true if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns true if every row is the displacement of a node.
    pub fn are_plain(&self) -> bool {
        self.len() == self.dimension * self.nodes
    }

    /// Returns the number of rows of displacements: d per node, then d per vector without a position.
    pub fn displacements(&self) -> usize {
        self.dimension * (self.nodes + self.vectors.len())
    }

    /// Returns the number of vectors without a position.
    pub fn vectors(&self) -> usize {
        self.vectors.len()
    }

    /// Returns node index and axis (0, 1, 2) of every rotation; the first has the row
    /// [`displacements`](Self::displacements).
    pub fn rotations(&self) -> &[(u32, u8)] {
        &self.rotations
    }

    /// Returns the rows of the vectors without a position, and of the massless rows without a position.
    pub fn without_place(&self) -> [Range<usize>; 2] {
        let last = self.displacements() + self.rotations.len();
        [self.dimension * self.nodes..self.displacements(), last..self.len()]
    }

    /// Returns true if a vertex ([`Rows::vertex`]) is a node.
    pub(crate) fn is_node(&self, vertex: usize) -> bool {
        vertex < self.nodes
    }

    /// Returns the vertex of a row: nodes first, then vectors, then each of the other rows by itself.
    pub(crate) fn vertex(&self, row: usize) -> usize {
        let after = self.displacements();
        match row {
            _ if row < after => row / self.dimension,
            _ if row < after + self.rotations.len() => self.rotations[row - after].0 as usize,
            _ => self.nodes + self.vectors.len() + row - after - self.rotations.len(),
        }
    }

    /// Returns the rows of a [`vertex`](Self::vertex), ascending.
    pub(crate) fn of_vertex(&self, vertex: usize) -> impl Iterator<Item = usize> {
        let (after, d) = (self.displacements(), self.dimension);
        let up_to = |node: usize| after + self.rotations.partition_point(|&(row, _)| (row as usize) < node);
        let (first, second) = match vertex.checked_sub(self.nodes + self.vectors.len()) {
            Some(other) => {
                (after + self.rotations.len() + other..after + self.rotations.len() + other + 1, 0..0)
            }
            None if self.rotations.is_empty() || vertex >= self.nodes => (d * vertex..d * vertex + d, 0..0),
            None => (d * vertex..d * vertex + d, up_to(vertex)..up_to(vertex + 1)),
        };
        first.chain(second)
    }

    /// Returns the label of a row.
    pub(crate) fn label(&self, nodes: &Nodes, row: usize) -> DofLabel {
        let (after, d) = (self.displacements(), self.dimension);
        if row < after {
            return DofLabel { node: self.number(nodes, row / d), direction: (row % d) as u8 + 1 };
        }
        match self.rotations.get(row - after) {
            Some(&(node, axis)) => DofLabel { node: nodes.ids[node as usize], direction: axis + 4 },
            None => self.others[row - after - self.rotations.len()],
        }
    }

    /// Returns the size of a rigid field with the given `length` at each row: one for a displacement.
    pub(crate) fn field_sizes(&self, length: f64) -> Vec<f64> {
        let mut sizes = vec![1.0; self.displacements()];
        sizes.resize(sizes.len() + self.rotations.len(), 1.0 / length);
        let first = self.dimension * self.vectors.len();
        for from in first..first + self.others.len() {
            let known = &self.recovered.fields;
            let largest = (0..known.ncols()).fold(0.0f64, |m, c| m.max(known[(from, c)].abs()));
            sizes.push(if largest > 0.0 { largest } else { 1.0 });
        }
        sizes
    }

    /// Returns true if rigid motion does not move the vectors without a position (bubbles).
    pub(crate) fn are_still(&self) -> bool {
        let known = &self.recovered.fields;
        let rows = self.dimension * self.vectors.len();
        (0..known.ncols()).all(|c| (0..rows).all(|row| known[(row, c)].abs() < MAX_MOTION_AT_REST))
    }

    /// Returns the connected component of every vertex, numbered from 0 in the order of their first
    /// vertices. Any entry of any of the matrices connects, and the rows of a node are connected.
    pub(crate) fn components(&self, matrices: &[&SymmetricMatrix]) -> Vec<usize> {
        if self.rotations.is_empty() && self.others.is_empty() {
            return connected_components(matrices, self.dimension);
        }
        // Components of single rows first, then union of those that share a vertex.
        let by_row = connected_components(matrices, 1);
        let mut root: Vec<usize> = (0..by_row.iter().max().map_or(0, |last| last + 1)).collect();
        let find = |root: &[usize], mut c: usize| {
            while root[c] != c {
                c = root[c];
            }
            c
        };
        let mut first = vec![usize::MAX; self.vertices()];
        for (row, &c) in by_row.iter().enumerate() {
            let vertex = self.vertex(row);
            match first[vertex] {
                usize::MAX => first[vertex] = c,
                other => {
                    let (a, b) = (find(&root, c), find(&root, other));
                    root[a.max(b)] = a.min(b);
                }
            }
        }
        // Number the components in the order of their first vertices.
        let mut number = vec![usize::MAX; root.len()];
        let mut count = 0;
        let numbered = |&c: &usize| {
            let component = &mut number[find(&root, c)];
            if *component == usize::MAX {
                *component = count;
                count += 1;
            }
            *component
        };
        first.iter().map(numbered).collect()
    }

    /// Splits the rows by the component of their vertices; returns the rows of each component, ascending,
    /// and their meaning.
    pub(crate) fn separated(&self, component: &[usize]) -> Vec<(Vec<usize>, Self)> {
        let empty = Self {
            dimension: self.dimension,
            nodes: 0,
            vectors: Vec::new(),
            rotations: Vec::new(),
            others: Vec::new(),
            recovered: Recovered::none(),
        };
        let count = component.iter().max().map_or(0, |last| last + 1);
        let mut parts = vec![(Vec::new(), empty); count];
        (0..self.len()).for_each(|row| parts[component[self.vertex(row)]].0.push(row));
        let (nodes, after) = component.split_at(self.nodes);
        let (vectors, others) = after.split_at(self.vectors.len());
        let mut local = Vec::with_capacity(self.nodes);
        for &c in nodes {
            local.push(parts[c].1.nodes as u32);
            parts[c].1.nodes += 1;
        }
        vectors.iter().zip(&self.vectors).for_each(|(&c, &number)| parts[c].1.vectors.push(number));
        for &(node, axis) in &self.rotations {
            parts[nodes[node as usize]].1.rotations.push((local[node as usize], axis));
        }
        others.iter().zip(&self.others).for_each(|(&c, &label)| parts[c].1.others.push(label));
        parts
    }

    /// Returns the number of nodes, vectors without a position, and other rows.
    pub(crate) fn vertices(&self) -> usize {
        self.nodes + self.vectors.len() + self.others.len()
    }

    /// Returns the number in the label of a vertex.
    pub(crate) fn number(&self, nodes: &Nodes, vertex: usize) -> i64 {
        let after = vertex.saturating_sub(self.nodes);
        match nodes.ids.get(vertex).or_else(|| self.vectors.get(after)) {
            Some(&number) => number,
            None => self.others[after - self.vectors.len()].node,
        }
    }

    /// Returns the rigid fields (one row per row of the model): unit translations, then rotations
    /// e_k x (x - `centre`) / `length` with e_k / `length` at the rotations; in the plane those that stay in it.
    pub fn rigid_fields(&self, positions: &[[f64; 3]], centre: [f64; 3], length: f64) -> Mat<f64> {
        let (d, count) = (self.dimension, rigid_count(self.dimension));
        let mut fields = rigid_fields(positions, d, centre, length);
        if self.are_plain() {
            return fields;
        }
        fields.resize_with(self.len(), count, |_, _| 0.0);
        for (row, &(_, axis)) in (self.displacements()..).zip(&self.rotations) {
            // In the plane the only rotation is about z.
            fields[(row, if d == 2 { 2 } else { 3 + usize::from(axis) })] = 1.0 / length;
        }
        let known = &self.recovered;
        let offset = [0, 1, 2].map(|k| known.centre[k] - centre[k]);
        for (row, from) in self.without_place().into_iter().flatten().zip(0..known.fields.nrows()) {
            let old = |column: usize| known.fields[(from, column)];
            for k in 0..d {
                fields[(row, k)] = old(k);
            }
            for turn in d..count {
                // e_k x (x - c) = e_k x (x - c0) + e_k x (c0 - c); the second term is a translation.
                let axis = if d == 2 { 2 } else { turn - 3 };
                let (l, m) = ((axis + 1) % 3, (axis + 2) % 3);
                let along = |k: usize| if k < d { old(k) } else { 0.0 };
                let shift = offset[l] * along(m) - offset[m] * along(l);
                fields[(row, turn)] = (old(turn) * known.length + shift) / length;
            }
        }
        fields
    }
}

// Rigid displacement fields of the nodes, and the residual of K for them.

/// Returns the number of rigid motions of a body of the given dimension: six in space, three in the plane.
pub fn rigid_count(dimension: usize) -> usize {
    rigid_axes(dimension).len()
}

/// Returns the indices of the rigid motions of a body of the given dimension, among three translations and three
/// rotations; those of forces and torques are the same.
pub fn rigid_axes(dimension: usize) -> &'static [usize] {
    if dimension == 2 { &[0, 1, 5] } else { &[0, 1, 2, 3, 4, 5] }
}

/// Returns the rigid fields (3n x 6) about `centre`: three unit translations, three rotations e_k x (x -
/// centre) / `length`; in the plane (`dimension` 2) those that stay in it (2n x 3): two translations, and
/// the rotation about z.
pub fn rigid_fields(positions: &[[f64; 3]], dimension: usize, centre: [f64; 3], length: f64) -> Mat<f64> {
    if dimension == 2 {
        let mut fields = Mat::zeros(2 * positions.len(), 3);
        for (i, x) in positions.iter().enumerate() {
            (fields[(2 * i, 0)], fields[(2 * i + 1, 1)]) = (1.0, 1.0);
            fields[(2 * i, 2)] = -(x[1] - centre[1]) / length;
            fields[(2 * i + 1, 2)] = (x[0] - centre[0]) / length;
        }
        return fields;
    }
    let mut fields = Mat::zeros(3 * positions.len(), 6);
    for (i, x) in positions.iter().enumerate() {
        let r = [0, 1, 2].map(|k| (x[k] - centre[k]) / length);
        for k in 0..3 {
            fields[(3 * i + k, k)] = 1.0;
            // e_k x r has the components -r_m at l and r_l at m, for (k, l, m) cyclic.
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            fields[(3 * i + l, 3 + k)] = -r[m];
            fields[(3 * i + m, 3 + k)] = r[l];
        }
    }
    fields
}

/// Returns the mean of the positions and the largest distance from it (1 if all coincide).
pub fn centre_and_length(positions: &[[f64; 3]]) -> ([f64; 3], f64) {
    let n = positions.len().max(1) as f64;
    // Sum differences to the first node, so that sums keep their digits far from the origin.
    let first = positions.first().copied().unwrap_or_default();
    let mut centre = [0.0; 3];
    for x in positions {
        for k in 0..3 {
            centre[k] += (x[k] - first[k]) / n;
        }
    }
    for k in 0..3 {
        centre[k] += first[k];
    }
    let length = positions
        .iter()
        .map(|x| (0..3).map(|k| (x[k] - centre[k]).powi(2)).sum::<f64>().sqrt())
        .fold(0.0, f64::max);
    (centre, if length > 0.0 { length } else { 1.0 })
}

/// Returns the size of the bounding box of the positions along each axis; zero without positions.
pub fn extents(positions: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let (low, high) = positions
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x[k].min(low), x[k].max(high)));
        (high - low).max(0.0)
    })
}

/// Returns the distance of two positions that are far from each other: the search goes from the middle to
/// the farthest position, and on to the one farthest from that, until the distance does not grow. The
/// result is equal in all axes, and for most bodies it is the largest distance; zero without positions.
pub fn span(positions: &[[f64; 3]]) -> f64 {
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let farthest = |from: &[f64; 3]| {
        first_largest(positions.iter().map(|x| (distance(x, from), x)), |(distance, _)| *distance)
    };
    let mut mean = [0.0; 3];
    for x in positions {
        (0..3).for_each(|k| mean[k] += x[k] / positions.len() as f64);
    }
    let mut span = 0.0;
    let mut next = farthest(&mean).and_then(|(_, end)| farthest(end));
    while let Some((distance, end)) = next.filter(|(distance, _)| *distance > span) {
        span = distance;
        next = farthest(end);
    }
    span
}

/// Returns for each row i the maximum over the fields of |(K R)_i| / sum_j |K_ij| r_j, zero for empty rows,
/// with r_j the typical size of a field at row j. Values near one mean a support, values near roundoff a
/// free body.
pub(crate) fn rigid_residuals(k: &SymmetricMatrix, fields: &Mat<f64>, sizes: &[f64]) -> Vec<f64> {
    // Store the fields row by row, so that the data for a matrix entry lie in one or two cache lines.
    let rows: Vec<[f64; 7]> = parallel::values(k.n(), 1024, |i| {
        std::array::from_fn(|c| match c {
            6 => sizes[i],
            _ if c < fields.ncols() => fields[(i, c)],
            _ => 0.0,
        })
    });
    parallel::values(k.n(), 1024, |i| {
        let (columns, values) = k.row(i);
        let mut sums = [0.0; 6];
        let mut scale = 0.0;
        for (&j, &v) in columns.iter().zip(values) {
            let row = &rows[j as usize];
            scale += v.abs() * row[6];
            for (sum, field) in sums.iter_mut().zip(row) {
                *sum += v * field;
            }
        }
        let worst = largest(sums.map(f64::abs));
        if scale > 0.0 { worst / scale } else { 0.0 }
    })
}

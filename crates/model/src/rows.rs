//! Meaning of the rows of a model in the internal order, and their rigid motion.
//!
//! First the displacements of the nodes, node-major; then those of vectors without a position, whose rigid
//! motion only K determines (bubbles, hierarchical shape functions); then nodal rotations; last massless
//! rows without a position.

use super::rigid::{rigid_count, rigid_fields};
use super::{DofLabel, Nodes};
use faer::Mat;
use flexbody_linalg::{SymmetricMatrix, connected_components};
use std::ops::Range;

/// Largest rigid motion of a row at rest, relative to a unit translation: rounding of the stiffness.
const MAX_MOTION_AT_REST: f64 = 1e-9;

/// Rows of a model beyond its plain displacements, and the order of all rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    pub(super) dimension: usize,
    pub(super) nodes: usize,
    /// Numbers in the labels of vectors without a position.
    pub(super) vectors: Vec<i64>,
    /// Index of the node and axis (0, 1, 2) of every rotation, ascending.
    pub(super) rotations: Vec<(u32, u8)>,
    /// Labels of the massless rows without a position.
    pub(super) others: Vec<DofLabel>,
    pub(super) recovered: Recovered,
}

/// Rigid motion of the rows without a position, determined by K: vectors first, then the massless rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Recovered {
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
    pub(super) fn is_node(&self, vertex: usize) -> bool {
        vertex < self.nodes
    }

    /// Returns the vertex of a row: nodes first, then vectors, then each of the other rows by itself.
    pub(super) fn vertex(&self, row: usize) -> usize {
        let after = self.displacements();
        match row {
            _ if row < after => row / self.dimension,
            _ if row < after + self.rotations.len() => self.rotations[row - after].0 as usize,
            _ => self.nodes + self.vectors.len() + row - after - self.rotations.len(),
        }
    }

    /// Returns the rows of a [`vertex`](Self::vertex), ascending.
    pub(super) fn of_vertex(&self, vertex: usize) -> impl Iterator<Item = usize> {
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
    pub(super) fn label(&self, nodes: &Nodes, row: usize) -> DofLabel {
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
    pub(super) fn field_sizes(&self, length: f64) -> Vec<f64> {
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
    pub(super) fn are_still(&self) -> bool {
        let known = &self.recovered.fields;
        let rows = self.dimension * self.vectors.len();
        (0..known.ncols()).all(|c| (0..rows).all(|row| known[(row, c)].abs() < MAX_MOTION_AT_REST))
    }

    /// Returns the connected component of every vertex, numbered from 0 in the order of their first
    /// vertices. Any entry of any of the matrices connects, and the rows of a node are connected.
    pub(super) fn components(&self, matrices: &[&SymmetricMatrix]) -> Vec<usize> {
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
    pub(super) fn separated(&self, component: &[usize]) -> Vec<(Vec<usize>, Self)> {
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
    pub(super) fn vertices(&self) -> usize {
        self.nodes + self.vectors.len() + self.others.len()
    }

    /// Returns the number in the label of a vertex.
    pub(super) fn number(&self, nodes: &Nodes, vertex: usize) -> i64 {
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

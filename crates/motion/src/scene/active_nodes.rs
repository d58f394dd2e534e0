//! Nodes with the largest displacements, which suffice to find the deflection of a body.

use faer::MatRef;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};

/// Nodes of a body, and their rows of the modes: three per node, each with nf entries.
#[derive(Debug, Clone)]
pub(super) struct ActiveNodes {
    rows: Vec<f64>,
    nf: usize,
}

impl ActiveNodes {
    /// Takes the given nodes (from 0).
    pub(super) fn new(body: &FlexBody, nodes: &[usize]) -> Self {
        let nf = body.n_modes();
        let rows = nodes.iter().flat_map(|i| 3 * i..3 * i + 3);
        let row = |row: usize| (0..nf).map(move |j| body.modes().shape[(row, j)]);
        Self { rows: rows.flat_map(row).collect(), nf }
    }

    /// Takes the node that moves most in each mode.
    pub(super) fn of_modes(body: &FlexBody) -> Self {
        let shape = body.modes().shape.as_ref();
        let square = |i: usize, j: usize| (0..3).map(|k| shape[(3 * i + k, j)].powi(2)).sum::<f64>();
        let most = (0..body.n_modes()).map(|j| largest_of(body.n_nodes(), |i| square(i, j)));
        Self::new(body, &distinct(most.collect()))
    }

    /// Returns the displacements of the nodes.
    pub(super) fn displacements<'s>(&'s self, q: &'s [f64]) -> impl Iterator<Item = Vector3<f64>> + 's {
        let product = move |row: &[f64]| row.iter().zip(q).map(|(a, q)| a * q).sum::<f64>();
        let displacement = move |rows: &[f64]| {
            let mut rows = rows.chunks_exact(q.len());
            Vector3::from_fn(|_, _| rows.next().map_or(0.0, product))
        };
        self.rows.chunks_exact(3 * self.nf.max(1)).map(displacement)
    }

    /// Returns the longest displacement.
    pub(super) fn longest(&self, q: &[f64]) -> f64 {
        longest(self.displacements(q))
    }
}

/// Returns, for every mode, the nodes that move most along the principal directions of its displacements,
/// which are the eigenvectors of sum_i psi_i psi_i' and turn with the body. Ascending, without duplicates.
pub(super) fn along_principal_directions(body: &FlexBody) -> Vec<usize> {
    let shape = &body.modes().shape;
    let of_mode = |j: usize| {
        let displacement = |i: usize| Vector3::from_fn(|k, _| shape[(3 * i + k, j)]);
        let sum = (0..body.n_nodes()).fold(Matrix3::zeros(), |sum: Matrix3<f64>, i| {
            sum + displacement(i) * displacement(i).transpose()
        });
        let directions = sum.symmetric_eigen().eigenvectors;
        [0, 1, 2].map(|k| largest_of(body.n_nodes(), |i| directions.column(k).dot(&displacement(i)).abs()))
    };
    distinct((0..body.n_modes()).flat_map(of_mode).collect())
}

/// Returns the first index of the largest value.
fn largest_of(count: usize, value: impl Fn(usize) -> f64) -> usize {
    (1..count).fold(0, |best, i| if value(i) > value(best) { i } else { best })
}

fn distinct(mut nodes: Vec<usize>) -> Vec<usize> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Returns the length of the longest displacement.
pub(super) fn longest(displacements: impl Iterator<Item = Vector3<f64>>) -> f64 {
    displacements.map(|d| d.norm()).fold(0.0, larger)
}

/// Returns the longest displacement of any node for the modal coordinates `q`.
pub(super) fn longest_of_all(shape: MatRef<'_, f64>, q: &[f64]) -> f64 {
    let component = |row: usize| -> f64 { q.iter().enumerate().map(|(j, q)| shape[(row, j)] * q).sum() };
    longest((0..shape.nrows() / 3).map(|i| Vector3::from_fn(|k, _| component(3 * i + k))))
}

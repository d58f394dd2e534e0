//! The exact condensation: one pass over the mass matrix turns nodes and shapes into the primary data.
//!
//! All of theory section 2 is one weighted Gram matrix X' Ms X of the columns X = [1, x, y, z, psi_1x, psi_1y,
//! psi_1z, psi_2x, ...]. Columns are taken in blocks of a fixed width, rows in chunks of a fixed length; chunks
//! belong to groups that depend on the number of nodes only, and groups are summed in order. The result is
//! therefore the same to the last bit at any number of threads, and no sum is longer than a chunk, the chunks
//! of a group or the groups: rounding does not grow with the model.

use super::Invariants;
use crate::linalg::SymmetricMatrix;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// Rows per dense product: the longest plain sum. Shorter chunks cost time, longer ones digits.
pub(super) const CHUNK: usize = 128;
/// Upper bound of the number of partial sums kept until they are added in order.
pub(super) const MAX_GROUPS: usize = 64;
/// Columns per pass over the mass matrix: one gathered row is four cache lines.
const WIDTH: usize = 32;

/// A symmetric mass on the nodes, the same for every direction.
pub(super) trait NodalMass: Sync {
    /// Row `i` of Ms X for the node-wise block `x` (n rows of W columns).
    fn row_times<const W: usize>(&self, i: usize, x: &[[f64; W]]) -> [f64; W];
}

/// The consistent mass Ms.
impl NodalMass for SymmetricMatrix {
    #[inline]
    fn row_times<const W: usize>(&self, i: usize, x: &[[f64; W]]) -> [f64; W] {
        let mut sum = [0.0; W];
        let (columns, values) = self.row(i);
        for (&j, &value) in columns.iter().zip(values) {
            for (s, x) in sum.iter_mut().zip(&x[j as usize]) {
                *s += value * x;
            }
        }
        sum
    }
}

/// A diagonal (lumped) mass: one number per node.
impl NodalMass for [f64] {
    #[inline]
    fn row_times<const W: usize>(&self, i: usize, x: &[[f64; W]]) -> [f64; W] {
        x[i].map(|x| self[i] * x)
    }
}

/// Condenses the nodal equations of motion exactly into the primary data (theory section 2).
///
/// m = 1' Ms 1, c_k = 1' Ms x_k, J_kl = x_k' Ms x_l, C1_k = 1' Ms Psi_k, Ibar_kl = x_k' Ms Psi_l,
/// S_kl = Psi_k' Ms Psi_l, for M = Ms kron I3.
///
/// * `mass`: Ms (n x n). Unit: mass.
/// * `positions`: n node positions in the frame that the result refers to. Unit: length. Any origin is
///   right; digits are kept best with the origin at the centre of mass ([`super::choose_frame`]).
/// * `shapes`: 3n x nf, row 3 i + k is component k of node i along the axes of the same frame; any basis.
/// * `modal_stiffness`: Psi' K Psi (nf x nf), passed through.
///
/// J and the diagonal blocks S_kk are exactly symmetric and S_lk = S_kl' exactly. The result does not depend on
/// the number of threads.
///
/// ```
/// use faer::{Mat, mat};
/// use flexbody::invariants::condense;
/// use flexbody::linalg::{CscMatrix, SymmetricMatrix};
///
/// // A bar of mass 6 along x from -1 to 1, one linear element, and its stretch as the only mode.
/// let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 2.0)];
/// let mass = SymmetricMatrix::new(CscMatrix::from_triplets(2, 2, &entries)).expect("symmetric");
/// let shapes = mat![[-1.0], [0.0], [0.0], [1.0], [0.0], [0.0f64]];
/// let body = condense(&mass, &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], shapes.as_ref(), Mat::zeros(1, 1));
/// assert_eq!((body.mass, body.inertia()[(2, 2)]), (6.0, 2.0)); // m l^2 / 12
/// assert_eq!(body.w1()[(2, 2)], 4.0); // I_zz(q) = 2 (1 + q)^2 = 2 + 4 q + 2 q^2
/// ```
///
/// # Panics
/// When the sizes disagree.
pub fn condense(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    assert_eq!(mass.n(), positions.len(), "rows of Ms and positions");
    condense_with(mass, positions, shapes, modal_stiffness)
}

/// [`condense`] for any nodal mass.
pub(super) fn condense_with<M: NodalMass + ?Sized>(
    mass: &M,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let nf = shapes.ncols();
    assert_eq!(shapes.nrows(), 3 * positions.len(), "rows of the shapes: three per position");
    assert_eq!(
        (modal_stiffness.nrows(), modal_stiffness.ncols()),
        (nf, nf),
        "modal stiffness: one row per mode"
    );
    let gram = weighted_gram::<WIDTH, M>(mass, Columns { positions, shapes });
    from_gram(gram.as_ref(), modal_stiffness)
}

/// The primary data from the Gram matrix of [`Columns`].
pub(super) fn from_gram(gram: MatRef<'_, f64>, modal_stiffness: Mat<f64>) -> Invariants {
    let nf = modal_stiffness.ncols();
    let psi = |k: usize, p: usize| 4 + 3 * p + k;
    let (mass, first_moment, second_moment) = rigid_part(gram);
    Invariants {
        mass,
        first_moment,
        second_moment,
        c1: Mat::from_fn(3, nf, |k, p| gram[(0, psi(k, p))]),
        ibar: array(|k| array(|l| (0..nf).map(|p| gram[(1 + k, psi(l, p))]).collect())),
        s: array(|k| array(|l| Mat::from_fn(nf, nf, |p, q| gram[(psi(k, p), psi(l, q))]))),
        modal_stiffness,
    }
}

/// m, c and J of rigid motion alone.
pub(super) fn condense_rigid<M: NodalMass + ?Sized>(
    mass: &M,
    positions: &[[f64; 3]],
) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let no_modes = Mat::<f64>::zeros(3 * positions.len(), 0);
    rigid_part(weighted_gram::<4, M>(mass, Columns { positions, shapes: no_modes.as_ref() }).as_ref())
}

fn rigid_part(gram: MatRef<'_, f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let first_moment = Vector3::from_fn(|k, _| gram[(0, 1 + k)]);
    (gram[(0, 0)], first_moment, Matrix3::from_fn(|k, l| gram[(1 + k, 1 + l)]))
}

/// An array of three from its index.
fn array<T>(f: impl FnMut(usize) -> T) -> [T; 3] {
    std::array::from_fn(f)
}

/// The columns X = [1, x, y, z, psi_1x, psi_1y, psi_1z, psi_2x, ...].
#[derive(Clone, Copy)]
pub(super) struct Columns<'a> {
    pub positions: &'a [[f64; 3]],
    pub shapes: MatRef<'a, f64>,
}

impl Columns<'_> {
    pub fn count(&self) -> usize {
        4 + 3 * self.shapes.ncols()
    }

    #[inline]
    pub fn get(&self, i: usize, column: usize) -> f64 {
        match column {
            0 => 1.0,
            1..4 => self.positions[i][column - 1],
            _ => self.shapes[(3 * i + (column - 4) % 3, (column - 4) / 3)],
        }
    }

    /// Node-wise copy of a block of at most W columns, padded with zeros.
    pub fn by_node<const W: usize>(&self, block: Range<usize>) -> Vec<[f64; W]> {
        let mut rows = vec![[0.0; W]; self.positions.len()];
        rows.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, rows)| {
            for (slot, column) in block.clone().enumerate() {
                for (i, row) in rows.iter_mut().enumerate() {
                    row[slot] = self.get(CHUNK * chunk + i, column);
                }
            }
        });
        rows
    }

    /// Column-wise copy of the rows `nodes` into the columns of `target`.
    pub fn by_column(&self, nodes: Range<usize>, mut target: MatMut<'_, f64>) {
        for column in 0..target.ncols() {
            for (row, i) in nodes.clone().enumerate() {
                target[(row, column)] = self.get(i, column);
            }
        }
    }
}

/// X' Ms X, exactly symmetric.
fn weighted_gram<const W: usize, M: NodalMass + ?Sized>(mass: &M, columns: Columns<'_>) -> Mat<f64> {
    let n_columns = columns.count();
    let mut gram = Mat::<f64>::zeros(n_columns, n_columns);
    for start in (0..n_columns).step_by(W) {
        // Rows of X' beyond the block are the transpose of a later block.
        let end = (start + W).min(n_columns);
        let block = gram_block::<W, M>(mass, columns, start..end);
        for column in start..end {
            for row in 0..=column {
                gram[(row, column)] = block[(row, column - start)];
                gram[(column, row)] = gram[(row, column)];
            }
        }
    }
    gram
}

/// Columns 0..block.end of X against Ms X[block]: a matrix of block.end rows and W columns.
fn gram_block<const W: usize, M: NodalMass + ?Sized>(
    mass: &M,
    columns: Columns<'_>,
    block: Range<usize>,
) -> Mat<f64> {
    let n = columns.positions.len();
    let n_left = block.end;
    let x = columns.by_node::<W>(block);
    let group = CHUNK * n.div_ceil(CHUNK).div_ceil(MAX_GROUPS).max(1);
    let partial: Vec<Mat<f64>> = (0..n.div_ceil(group))
        .into_par_iter()
        .map(|g| {
            // faer aligns what it allocates: the dense kernels meet the same alignment in every run.
            let mut left = Mat::<f64>::zeros(CHUNK, n_left);
            let mut product = Mat::<f64>::zeros(W, CHUNK);
            let mut sum = Mat::<f64>::zeros(n_left, W);
            let nodes = g * group..((g + 1) * group).min(n);
            for first in nodes.clone().step_by(CHUNK) {
                let chunk = first..(first + CHUNK).min(nodes.end);
                let rows = chunk.len();
                columns.by_column(chunk.clone(), left.subrows_mut(0, rows));
                for (slot, i) in chunk.enumerate() {
                    let row = mass.row_times(i, &x);
                    for (w, value) in row.into_iter().enumerate() {
                        product[(w, slot)] = value;
                    }
                }
                let (left, product) = (left.subrows(0, rows), product.subcols(0, rows));
                matmul(&mut sum, Accum::Add, left.transpose(), product.transpose(), 1.0, Par::Seq);
            }
            sum
        })
        .collect();
    let mut total = Mat::<f64>::zeros(n_left, W);
    for part in &partial {
        total += part;
    }
    total
}

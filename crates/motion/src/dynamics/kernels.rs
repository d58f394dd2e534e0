//! Products of constant matrices with vectors, and dot products, in vector registers.
//!
//! No operations are contracted, and every sum has an order that depends on sizes only: results are bitwise
//! equal on every machine.

use faer::{Mat, MatRef};
use nalgebra::DMatrix;

/// Number of rows of a panel: eight AVX registers of sums, enough to hide the latency of an addition.
pub(super) const WIDTH: usize = 32;

/// Number of lanes of a dot product.
const LANES: usize = 8;

/// Matrix (rows x n, n > 0) cut into panels of [`WIDTH`] rows, the last padded with zeros. A product
/// streams the memory once and keeps the sums of a panel in registers.
#[derive(Debug, Clone)]
pub(super) struct Panels {
    columns: usize,
    /// Column j of panel p at p n + j.
    panels: Vec<[f64; WIDTH]>,
}

impl Panels {
    pub(super) fn new(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let column = |first: usize, j: usize| {
            std::array::from_fn(|r| if first + r < rows { entry(first + r, j) } else { 0.0 })
        };
        let panels = (0..rows).step_by(WIDTH).flat_map(|first| (0..columns).map(move |j| (first, j)));
        Self { columns, panels: panels.map(|(first, j)| column(first, j)).collect() }
    }

    /// Creates panels of square matrices (n x n) stacked vertically, at least one.
    pub(super) fn stacked(blocks: &[Mat<f64>]) -> Self {
        let n = blocks[0].nrows();
        Self::new(blocks.len() * n, n, |row, j| blocks[row / n][(row % n, j)])
    }

    /// Returns the number of rows padded to whole panels, the length of a product.
    pub(super) fn padded_rows(&self) -> usize {
        self.panels.len() / self.columns * WIDTH
    }

    /// Returns the entries of a row, column by column.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = f64> + '_ {
        let columns = &self.panels[row / WIDTH * self.columns..][..self.columns];
        columns.iter().map(move |column| column[row % WIDTH])
    }

    /// Computes y = A x.
    #[inline(always)] // compiled once per instruction set
    pub(super) fn times(&self, x: &[f64], y: &mut [f64]) {
        let targets = y.as_chunks_mut::<WIDTH>().0;
        for (panel, target) in self.panels.chunks_exact(self.columns).zip(targets) {
            let mut sum = [0.0; WIDTH];
            for (column, x) in panel.iter().zip(x) {
                for (sum, a) in sum.iter_mut().zip(column) {
                    *sum += a * x;
                }
            }
            *target = sum;
        }
    }
}

/// Returns a' b.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sum = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in sum.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let [s0, s1, s2, s3, s4, s5, s6, s7] = sum;
    ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7)) + rest
}

/// Computes y += factor x.
#[inline(always)]
pub(super) fn add_scaled(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

// Symmetric matrix of the modes, in its cheapest form.

/// Symmetric modal matrix K_ff, D or m_ff (nf x nf).
#[derive(Debug, Clone)]
pub(super) enum ModalMatrix {
    /// Diagonal of a diagonal matrix.
    Diagonal(Vec<f64>),
    /// Full matrix, row-major.
    Full { n: usize, entries: Vec<f64> },
}

impl ModalMatrix {
    /// Takes the symmetric part of `a`; stores only the diagonal if no other entry is larger than
    /// `rounding` times sqrt(|a_ii a_jj|).
    pub(super) fn new(a: MatRef<'_, f64>, rounding: f64) -> Self {
        let n = a.nrows();
        let size: Vec<f64> = (0..n).map(|i| a[(i, i)].abs().sqrt()).collect();
        let is_rounding = |i: usize, j: usize| i == j || a[(i, j)].abs() <= rounding * size[i] * size[j];
        if (0..n).all(|i| (0..n).all(|j| is_rounding(i, j))) {
            return Self::Diagonal((0..n).map(|i| a[(i, i)]).collect());
        }
        Self::Full {
            n,
            entries: (0..n * n).map(|at| 0.5 * (a[(at / n, at % n)] + a[(at % n, at / n)])).collect(),
        }
    }

    pub(super) fn get(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Diagonal(diagonal) if i == j => diagonal[i],
            Self::Diagonal(_) => 0.0,
            Self::Full { n, entries } => entries[i * n + j],
        }
    }

    /// Returns (A x)_i.
    pub(super) fn row_product(&self, i: usize, x: &[f64]) -> f64 {
        match self {
            Self::Diagonal(diagonal) => diagonal[i] * x[i],
            Self::Full { n, entries } => dot(&entries[i * n..][..*n], x),
        }
    }

    /// Computes y += factor A x.
    #[inline(always)] // compiled once per instruction set
    pub(super) fn add_product(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        match self {
            Self::Diagonal(diagonal) => {
                for ((y, a), x) in y.iter_mut().zip(diagonal).zip(x) {
                    *y += factor * (a * x);
                }
            }
            Self::Full { n, entries } => {
                for (y, row) in y.iter_mut().zip(entries.chunks_exact(*n)) {
                    *y += factor * dot(row, x);
                }
            }
        }
    }

    /// Returns x' A x.
    pub(super) fn quadratic(&self, x: &[f64]) -> f64 {
        match self {
            Self::Diagonal(diagonal) => diagonal.iter().zip(x).map(|(a, x)| a * x * x).sum(),
            Self::Full { n, entries } => {
                entries.chunks_exact(*n).zip(x).map(|(row, xi)| xi * dot(row, x)).sum()
            }
        }
    }
}

/// Modal mass m_ff and its factor.
#[derive(Debug, Clone)]
pub(super) enum ModalMass {
    /// Identity, for mass-normalised modes.
    Identity,
    /// Any other modal mass.
    Full {
        matrix: ModalMatrix,
        /// L of m_ff = L L' (row-major, its lower triangle), if m_ff is positive definite.
        factor: Option<Vec<f64>>,
    },
}

impl ModalMass {
    /// Creates the identity if no entry differs from it by more than `rounding`.
    pub(super) fn new(a: MatRef<'_, f64>, rounding: f64) -> Self {
        let n = a.nrows();
        let is_identity = |i: usize, j: usize| (a[(i, j)] - f64::from(i == j)).abs() <= rounding;
        if (0..n).all(|i| (0..n).all(|j| is_identity(i, j))) {
            return Self::Identity;
        }
        let lower = DMatrix::from_fn(n, n, |i, j| 0.5 * (a[(i, j)] + a[(j, i)])).cholesky();
        // Column-major of L' is row-major of L.
        let factor = lower.map(|cholesky| cholesky.l().transpose().as_slice().to_vec());
        Self::Full { matrix: ModalMatrix::new(a, 0.0), factor }
    }

    pub(super) fn get(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Identity => f64::from(i == j),
            Self::Full { matrix, .. } => matrix.get(i, j),
        }
    }

    /// Computes y += m_ff x.
    #[inline(always)]
    pub(super) fn add_product(&self, x: &[f64], y: &mut [f64]) {
        match self {
            Self::Identity => add_scaled(1.0, x, y),
            Self::Full { matrix, .. } => matrix.add_product(1.0, x, y),
        }
    }

    /// Returns x' m_ff x.
    pub(super) fn quadratic(&self, x: &[f64]) -> f64 {
        match self {
            Self::Identity => dot(x, x),
            Self::Full { matrix, .. } => matrix.quadratic(x),
        }
    }

    /// Computes x <- L^-1 x; returns `None` if m_ff is not positive definite.
    #[inline(always)]
    pub(super) fn solve_lower(&self, x: &mut [f64]) -> Option<()> {
        let Self::Full { factor, .. } = self else { return Some(()) };
        let n = x.len();
        for (i, row) in factor.as_ref()?.chunks_exact(n).enumerate() {
            x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
        }
        Some(())
    }

    /// Computes x <- L^-T x; returns `None` if m_ff is not positive definite.
    #[inline(always)]
    pub(super) fn solve_upper(&self, x: &mut [f64]) -> Option<()> {
        let Self::Full { factor, .. } = self else { return Some(()) };
        let n = x.len();
        for (i, row) in factor.as_ref()?.chunks_exact(n).enumerate().rev() {
            x[i] /= row[i];
            let (before, from) = x.split_at_mut(i);
            add_scaled(-from[0], &row[..i], before);
        }
        Some(())
    }
}

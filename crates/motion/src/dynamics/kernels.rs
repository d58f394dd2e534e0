//! Products of constant matrices with vectors, and dot products, in vector registers.
//!
//! No operations are contracted, and every sum has an order that depends on sizes only: results are bitwise
//! equal on every machine.

use faer::Mat;

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

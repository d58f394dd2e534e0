//! Block products in double-double arithmetic: A X and X'Y of exact entries, with fixed partitions.

use super::SymmetricMatrix;
use super::compensated::{DoubleDouble, accumulate, accumulate_pair, with_fma};
use super::contiguous::contiguous;
use super::parallel;
use faer::MatRef;

/// Number of columns of a block.
pub const LANES: usize = 8;

/// Number of rows per parallel task and per partial sum. The partition fixes the order of the sums.
const ROWS_PER_TASK: usize = 1024;

/// Block of n rows and up to [`LANES`] columns of double-double numbers; unused columns are zero.
#[derive(Debug, Clone)]
pub struct CompensatedBlock {
    hi: Vec<[f64; LANES]>,
    lo: Vec<[f64; LANES]>,
}

impl CompensatedBlock {
    /// Returns the entry in `row` and `column`.
    pub fn get(&self, row: usize, column: usize) -> DoubleDouble {
        DoubleDouble { hi: self.hi[row][column], lo: self.lo[row][column] }
    }

    /// Adds another block of equal size.
    pub fn add(&mut self, other: &Self) {
        for row in 0..self.hi.len() {
            for c in 0..LANES {
                let sum = self.get(row, c) + other.get(row, c);
                (self.hi[row][c], self.lo[row][c]) = (sum.hi, sum.lo);
            }
        }
    }
}

/// Returns (A kron I_block) X for X of `block * A.n()` rows and at most [`LANES`] columns.
///
/// With r entries in the row, the error of an entry is at most 4 u^2 (r + 1) (|A| |X|), u = 2^-53.
///
/// # Panics
/// If the shapes disagree.
pub fn multiply_compensated(a: &SymmetricMatrix, block: usize, x: MatRef<'_, f64>) -> CompensatedBlock {
    let n = a.n() * block;
    assert!(x.nrows() == n && x.ncols() <= LANES, "shapes of a compensated product");
    // Pack the columns row by row.
    let mut packed = vec![[0.0; LANES]; n];
    for c in 0..x.ncols() {
        for (row, value) in packed.iter_mut().zip(x.col(c).iter()) {
            row[c] = *value;
        }
    }
    let (mut hi, mut lo) = (vec![[0.0; LANES]; n], vec![[0.0; LANES]; n]);
    let tasks = hi.chunks_mut(ROWS_PER_TASK).zip(lo.chunks_mut(ROWS_PER_TASK)).enumerate();
    parallel::for_each(tasks, |(chunk, (hi, lo))| {
        with_fma(
            #[inline(always)]
            || {
                for (r, (hi, lo)) in hi.iter_mut().zip(lo).enumerate() {
                    let row = chunk * ROWS_PER_TASK + r;
                    let (node, component) = (row / block, row % block);
                    let (columns, values) = a.row(node);
                    for (&j, &value) in columns.iter().zip(values) {
                        accumulate(hi, lo, value, &packed[j as usize * block + component]);
                    }
                }
            },
        );
    });
    CompensatedBlock { hi, lo }
}

/// Returns A'Y for A (n x m), as m rows of [`LANES`] numbers.
///
/// The error of an entry is at most 4 u^2 [`sum_length`] |A|'|Y|.
///
/// # Panics
/// If the numbers of rows differ.
pub fn gram_compensated(a: MatRef<'_, f64>, y: &CompensatedBlock) -> Vec<[DoubleDouble; LANES]> {
    let n = a.nrows();
    assert_eq!(n, y.hi.len(), "rows of a compensated Gram product");
    let partial: Vec<Vec<[DoubleDouble; LANES]>> =
        parallel::map(parallel::ranges(n, ROWS_PER_TASK), |rows| {
            let column = |c: usize| {
                let (mut hi, mut lo) = ([0.0; LANES], [0.0; LANES]);
                let factors = contiguous(a.col(c));
                with_fma(
                    #[inline(always)]
                    || {
                        for r in rows.clone() {
                            accumulate_pair(&mut hi, &mut lo, factors[r], (&y.hi[r], &y.lo[r]));
                        }
                    },
                );
                std::array::from_fn(|w| DoubleDouble { hi: hi[w], lo: lo[w] })
            };
            (0..a.ncols()).map(column).collect()
        });
    // Add the partial sums in fixed order.
    let mut total = vec![[DoubleDouble::default(); LANES]; a.ncols()];
    for part in &partial {
        for (sum, part) in total.iter_mut().zip(part) {
            for (sum, part) in sum.iter_mut().zip(part) {
                *sum = *sum + *part;
            }
        }
    }
    total
}

/// Returns X' A X as rows of a symmetric matrix, computed in panels of [`LANES`] columns.
///
/// # Panics
/// If the shapes disagree.
pub fn projection_compensated(a: &SymmetricMatrix, x: MatRef<'_, f64>) -> Vec<Vec<DoubleDouble>> {
    let count = x.ncols();
    let mut projection = vec![vec![DoubleDouble::default(); count]; count];
    for start in (0..count).step_by(LANES) {
        let width = LANES.min(count - start);
        let product = multiply_compensated(a, 1, x.subcols(start, width));
        let gram = gram_compensated(x.subcols(0, start + width), &product);
        for c in 0..width {
            for i in 0..=start + c {
                projection[i][start + c] = gram[i][c];
                projection[start + c][i] = gram[i][c];
            }
        }
    }
    projection
}

/// Returns an upper bound of the number of additions that affect a term of a sum over `n` rows, with a margin for the
/// surrounding operations.
pub fn sum_length(n: usize) -> f64 {
    (ROWS_PER_TASK.min(n) + n.div_ceil(ROWS_PER_TASK) + 16) as f64
}

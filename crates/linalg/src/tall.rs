//! Products of tall, skinny blocks (n x m, n large) with fixed partitions. Partial results of fixed row chunks are
//! added in a fixed order, so that the bits do not depend on the number of threads.

use super::columns::{contiguous, contiguous_mut};
use super::few_columns::{MAX_FEW_COLUMNS, add_few_combinations, gram_of_few};
use super::parallel;
use faer::linalg::matmul::matmul;
use faer::prelude::ReborrowMut;
use faer::{Accum, ColMut, ColRef, Mat, MatMut, MatRef, Par};
use libm::{cos, log};
use rayon::prelude::*;
use std::mem::MaybeUninit;
use std::ops::Range;

/// Number of rows per partial product.
const ROWS_PER_PARTIAL_PRODUCT: usize = 4096;

/// Number of zeros that a parallel task writes.
const ZEROS_PER_TASK: usize = 1 << 16;

/// Tall block that grows by columns. All threads take part in the first write to new memory.
#[derive(Debug, Clone, Default)]
pub struct Tall {
    entries: Vec<f64>,
    rows: usize,
}

impl Tall {
    /// Creates a block of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        let mut block = Self::with_capacity(rows, columns);
        block.add_zeros(columns);
        block
    }

    /// Creates a block without columns, with memory reserved for `columns`.
    pub fn with_capacity(rows: usize, columns: usize) -> Self {
        Self { entries: Vec::with_capacity(rows * columns), rows }
    }

    /// Returns a copy, made by all threads.
    pub fn copied(x: MatRef<'_, f64>) -> Self {
        let mut block = Self::with_capacity(x.nrows(), x.ncols());
        block.push(x);
        block
    }

    /// Appends columns, copied by all threads.
    ///
    /// # Panics
    /// If the row counts differ.
    pub fn push(&mut self, x: MatRef<'_, f64>) {
        assert_eq!(x.nrows(), self.rows, "rows of columns to append");
        x.col_iter().for_each(|column| self.push_multiple(1.0, column));
    }

    /// Appends a multiple of a column, computed by all threads.
    ///
    /// # Panics
    /// If the row counts differ.
    pub fn push_multiple(&mut self, scale: f64, x: ColRef<'_, f64>) {
        assert_eq!(x.nrows(), self.rows, "rows of a column to append");
        self.entries
            .par_extend(contiguous(x).par_iter().with_min_len(ROWS_PER_PARTIAL_PRODUCT).map(|x| scale * x));
    }

    /// Appends columns of zeros.
    pub fn add_zeros(&mut self, columns: usize) {
        self.entries.par_extend(
            rayon::iter::repeat_n(0.0, self.rows * columns).with_min_len(ROWS_PER_PARTIAL_PRODUCT),
        );
    }

    /// Keeps at most the first `columns` columns. The memory of the others stays reserved.
    pub fn truncate(&mut self, columns: usize) {
        self.entries.truncate(self.rows * columns);
    }

    /// Returns the number of columns.
    pub fn ncols(&self) -> usize {
        self.entries.len() / self.rows.max(1)
    }

    /// Returns the whole block.
    pub fn as_ref(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.entries, self.rows, self.ncols())
    }

    /// Returns the whole block for writing.
    pub fn as_mut(&mut self) -> MatMut<'_, f64> {
        let columns = self.ncols();
        MatMut::from_column_major_slice_mut(&mut self.entries, self.rows, columns)
    }

    /// Returns a range of columns.
    pub fn columns(&self, which: Range<usize>) -> MatRef<'_, f64> {
        self.as_ref().subcols(which.start, which.len())
    }

    /// Returns a range of columns for writing.
    pub fn columns_mut(&mut self, which: Range<usize>) -> MatMut<'_, f64> {
        self.as_mut().subcols_mut(which.start, which.len())
    }

    /// Returns the first columns.
    pub fn first(&self, columns: usize) -> MatRef<'_, f64> {
        self.columns(0..columns)
    }

    /// Returns the first columns for writing. If there are too few, the block is replaced by zeros with that number of
    /// columns.
    pub fn first_mut(&mut self, columns: usize) -> MatMut<'_, f64> {
        if columns > self.ncols() {
            *self = Self::zeros(self.rows, columns);
        }
        self.columns_mut(0..columns)
    }
}

/// Returns zeros (n x m), written by all threads. [`Mat::zeros`] writes them on one thread, and the system clears
/// memory at the first access, which takes longer than most computations with the block.
#[allow(unsafe_code)]
pub fn zeros(rows: usize, columns: usize) -> Mat<f64> {
    let mut block = Mat::<f64>::with_capacity(rows, columns);
    let stride = block.col_stride().unsigned_abs();
    // SAFETY: faer reserves `stride` numbers for each of the requested columns, and no other reference to them exists;
    // uninitialised numbers are accessed as `MaybeUninit`.
    let spare = unsafe {
        std::slice::from_raw_parts_mut(block.as_ptr_mut().cast::<MaybeUninit<f64>>(), stride * columns)
    };
    parallel::for_each(spare.chunks_mut(ZEROS_PER_TASK), |part| part.fill(MaybeUninit::new(0.0)));
    // SAFETY: all numbers have been written.
    unsafe { block.set_dims(rows, columns) };
    block
}

/// Returns a copy, made by all threads.
pub fn copied(x: MatRef<'_, f64>) -> Mat<f64> {
    side_by_side(&[x])
}

/// Returns A' B (m x k) of tall blocks A (n x m) and B (n x k).
///
/// # Panics
/// If the row counts differ.
pub fn gram(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    assert_eq!(a.nrows(), b.nrows(), "rows of a Gram product");
    let n = a.nrows();
    let partial = parallel::map(0..n.div_ceil(ROWS_PER_PARTIAL_PRODUCT).max(1), |chunk| {
        let start = chunk * ROWS_PER_PARTIAL_PRODUCT;
        let rows = ROWS_PER_PARTIAL_PRODUCT.min(n - start);
        let (a, b) = (a.subrows(start, rows), b.subrows(start, rows));
        if b.ncols() <= MAX_FEW_COLUMNS {
            return gram_of_few(a, b);
        }
        let mut part = Mat::zeros(a.ncols(), b.ncols());
        matmul(part.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
        part
    });
    sum_pairwise(&partial)
}

/// Returns a_j' b_j for the columns of equal-shaped blocks A and B (n x m).
///
/// # Panics
/// If the shapes differ.
pub fn column_products(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Vec<f64> {
    assert_eq!(a.ncols(), b.ncols(), "columns of a product by columns");
    (0..a.ncols()).map(|j| gram(a.subcols(j, 1), b.subcols(j, 1))[(0, 0)]).collect()
}

/// Range of norms that are computed from sums of squares without overflow or underflow.
const SAFE_NORMS: std::ops::RangeInclusive<f64> = 1e-140..=1e140;

/// Returns the Euclidean norms of the columns of a tall block.
pub fn column_norms(a: MatRef<'_, f64>) -> Vec<f64> {
    let chunks = a.nrows().div_ceil(ROWS_PER_PARTIAL_PRODUCT);
    let squares = |k: usize| -> f64 {
        let (chunk, column) = (k % chunks, k / chunks);
        let part = a.col(column).subrows(
            chunk * ROWS_PER_PARTIAL_PRODUCT,
            ROWS_PER_PARTIAL_PRODUCT.min(a.nrows() - chunk * ROWS_PER_PARTIAL_PRODUCT),
        );
        // Eight sums side by side over each chunk of rows.
        let (lanes, rest) = contiguous(part).as_chunks::<8>();
        let mut sums = [0.0; 8];
        lanes.iter().for_each(|x| (0..8).for_each(|w| sums[w] += x[w] * x[w]));
        sums.iter().sum::<f64>() + rest.iter().map(|x| x * x).sum::<f64>()
    };
    // Sums of squares in fixed order; norms outside the safe range are computed with scaling.
    let parts = parallel::values(chunks * a.ncols(), 1, squares);
    let norm = |j: usize| {
        let norm = parts[j * chunks..(j + 1) * chunks].iter().sum::<f64>().sqrt();
        if SAFE_NORMS.contains(&norm) { norm } else { a.col(j).norm_l2() }
    };
    (0..a.ncols()).map(norm).collect()
}

/// Returns x' diag(w) x.
///
/// # Panics
/// If the lengths differ.
pub fn weighted_square(x: ColRef<'_, f64>, weights: &[f64]) -> f64 {
    assert_eq!(x.nrows(), weights.len(), "one weight for each row");
    let part = |(x, w): (&[f64], &[f64])| x.iter().zip(w).map(|(x, w)| x * x * w).sum::<f64>();
    let tasks = contiguous(x).chunks(ROWS_PER_PARTIAL_PRODUCT).zip(weights.chunks(ROWS_PER_PARTIAL_PRODUCT));
    parallel::map(tasks, part).iter().sum()
}

/// Divides x by `size`.
pub fn divide(x: ColMut<'_, f64>, size: f64) {
    parallel::for_each(contiguous_mut(x).chunks_mut(ROWS_PER_PARTIAL_PRODUCT), |x| {
        x.iter_mut().for_each(|x| *x /= size)
    });
}

/// Returns the pairwise sum of equal-shaped matrices: its error grows with the logarithm of their number.
fn sum_pairwise(parts: &[Mat<f64>]) -> Mat<f64> {
    match parts {
        [] => Mat::zeros(0, 0),
        [one] => one.clone(),
        _ => {
            let (left, right) = parts.split_at(parts.len() / 2);
            sum_pairwise(left) + sum_pairwise(right)
        }
    }
}

/// Subtracts V H from W for tall V (n x m), W (n x k) and small H (m x k).
///
/// # Panics
/// If the shapes do not match.
pub fn subtract_combination(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    add_product(w, Accum::Add, v, h, -1.0);
}

/// Adds V H to W for tall V (n x m), W (n x k) and small H (m x k).
///
/// # Panics
/// If the shapes do not match.
pub fn add_combination(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    add_product(w, Accum::Add, v, h, 1.0);
}

/// Returns V H (n x k) for tall V (n x m) and small H (m x k).
///
/// # Panics
/// If the shapes do not match.
pub fn combine(v: MatRef<'_, f64>, h: MatRef<'_, f64>) -> Mat<f64> {
    let mut out = zeros(v.nrows(), h.ncols());
    combine_into(out.as_mut(), v, h);
    out
}

/// Computes W = V H for tall V (n x m), W (n x k) and small H (m x k).
///
/// # Panics
/// If the shapes do not match.
pub fn combine_into(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    add_product(w, Accum::Replace, v, h, 1.0);
}

/// Replaces the first k columns of V by V H, for tall V (n x m) and small H (m x k) with k <= m.
///
/// # Panics
/// If the shapes do not match.
pub fn combine_in_place(v: MatMut<'_, f64>, h: MatRef<'_, f64>) {
    assert!(v.ncols() == h.nrows() && h.ncols() <= h.nrows(), "tall product in place");
    let chunks = v.nrows().div_ceil(ROWS_PER_PARTIAL_PRODUCT);
    parallel::for_each(split_rows(v, chunks), |mut part| {
        let mut combined = Mat::zeros(part.nrows(), h.ncols());
        add_product_of_rows(combined.as_mut(), Accum::Replace, part.as_ref(), h, 1.0);
        part.rb_mut().subcols_mut(0, h.ncols()).copy_from(combined);
    });
}

/// Subtracts s_j x_j from y_j for the columns of equal-shaped blocks.
///
/// # Panics
/// If the shapes do not match.
pub fn subtract_columns(y: MatMut<'_, f64>, scales: &[f64], x: MatRef<'_, f64>) {
    assert!(
        y.nrows() == x.nrows() && y.ncols() == x.ncols() && x.ncols() == scales.len(),
        "columns to subtract"
    );
    parallel::for_each(y.col_iter_mut().zip(x.col_iter()).zip(scales), |((y, x), scale)| {
        y.iter_mut().zip(x.iter()).for_each(|(y, x)| *y -= scale * x);
    });
}

/// Returns the columns of all blocks, in order.
///
/// # Panics
/// If the row counts differ.
pub fn side_by_side(blocks: &[MatRef<'_, f64>]) -> Mat<f64> {
    let n = blocks.first().map_or(0, |block| block.nrows());
    assert!(blocks.iter().all(|block| block.nrows() == n), "rows of blocks side by side");
    let columns: Vec<_> = blocks.iter().flat_map(|block| block.col_iter()).collect();
    let mut joined = zeros(n, columns.len());
    parallel::for_each(joined.col_iter_mut().zip(columns), |(mut to, from)| to.copy_from(from));
    joined
}

fn add_product(w: MatMut<'_, f64>, accum: Accum, v: MatRef<'_, f64>, h: MatRef<'_, f64>, alpha: f64) {
    assert!(w.nrows() == v.nrows() && v.ncols() == h.nrows() && w.ncols() == h.ncols(), "tall product");
    let chunks = w.nrows().div_ceil(ROWS_PER_PARTIAL_PRODUCT);
    parallel::for_each(split_rows(w, chunks).into_iter().enumerate(), |(chunk, part)| {
        let v = v.subrows(chunk * ROWS_PER_PARTIAL_PRODUCT, part.nrows());
        add_product_of_rows(part, accum, v, h, alpha);
    });
}

/// Computes the product for the rows of one chunk, on one thread.
fn add_product_of_rows(
    mut w: MatMut<'_, f64>,
    accum: Accum,
    v: MatRef<'_, f64>,
    h: MatRef<'_, f64>,
    alpha: f64,
) {
    if w.ncols() > MAX_FEW_COLUMNS {
        return matmul(w, accum, v, h, alpha, Par::Seq);
    }
    if accum == Accum::Replace {
        w.fill(0.0);
    }
    add_few_combinations(w, v, h, alpha);
}

/// Cuts a block into `chunks` pieces of [`ROWS_PER_PARTIAL_PRODUCT`] rows; the last one may be shorter.
fn split_rows(mut w: MatMut<'_, f64>, chunks: usize) -> Vec<MatMut<'_, f64>> {
    let mut pieces = Vec::with_capacity(chunks);
    for _ in 0..chunks {
        let rows = ROWS_PER_PARTIAL_PRODUCT.min(w.nrows());
        let (head, tail) = w.split_at_row_mut(rows);
        pieces.push(head);
        w = tail;
    }
    pieces
}

// Reproducible random numbers by row and column, independent of the number of threads.

/// Returns a uniform number in (-1, 1): a SplitMix64 hash of (seed, row, column).
pub fn uniform(seed: u64, row: u64, column: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0xA076_1D64_78BD_642F)
        .wrapping_add(row.wrapping_mul(0x9E37_79B9_7F4A_7C15))
        .wrapping_add(column.wrapping_mul(0xD1B5_4A32_D192_ED03))
        .wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Returns a normal number with mean zero and variance one (Box and Muller, Ann. Math. Stat. 29 (1958) 610).
pub(crate) fn normal(row: u64, column: u64) -> f64 {
    // In (0, 1], since zero has no logarithm.
    let radius = 0.5 * (1.0 - uniform(1, row, column));
    let angle = std::f64::consts::PI * uniform(2, row, column);
    (-2.0 * log(radius.max(f64::MIN_POSITIVE))).sqrt() * cos(angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(rows: usize, columns: usize) -> Tall {
        let mut block = Tall::zeros(rows, columns);
        let mut all = block.as_mut();
        (0..columns).for_each(|j| (0..rows).for_each(|i| all[(i, j)] = ((i * 7 + j * 13) as f64).sin()));
        block
    }

    #[test]
    fn norms_are_those_of_the_columns_at_any_size() {
        let rows = ROWS_PER_PARTIAL_PRODUCT + 13;
        for size in [1.0, 1e-200, 1e200] {
            let mut a = block(rows, 3);
            a.as_mut().col_iter_mut().for_each(|mut column| column *= faer::Scale(size));
            for (norm, column) in column_norms(a.as_ref()).into_iter().zip(a.as_ref().col_iter()) {
                assert!((norm / column.norm_l2() - 1.0).abs() < 1e-13, "{norm:e}");
            }
        }
        assert_eq!(column_norms(Tall::zeros(5, 2).as_ref()), [0.0, 0.0]);
        let mut a = block(rows, 1);
        a.as_mut()[(rows - 1, 0)] = f64::NAN;
        assert!(column_norms(a.as_ref())[0].is_nan());
    }

    #[test]
    fn columns_come_and_go() {
        let given = block(ROWS_PER_PARTIAL_PRODUCT + 3, 3);
        let mut grown = Tall::with_capacity(ROWS_PER_PARTIAL_PRODUCT + 3, 4);
        assert_eq!(grown.ncols(), 0);
        grown.push(given.first(2));
        grown.push(given.columns(2..3));
        assert_eq!(grown.as_ref(), given.as_ref());
        grown.truncate(1);
        grown.add_zeros(1);
        assert_eq!((grown.ncols(), grown.first(1)), (2, given.first(1)));
        grown.push_multiple(-0.5, given.as_ref().col(2));
        assert_eq!(grown.as_ref().col(2), -0.5 * given.as_ref().col(2));
        assert!(grown.columns(1..2).col(0).iter().all(|x| *x == 0.0));
    }

    #[test]
    fn blocks_of_any_shape_are_zeros_and_copies() {
        for (rows, columns) in [(0, 0), (0, 3), (5, 0), (1, 1), (7, 3), (ROWS_PER_PARTIAL_PRODUCT + 3, 5)] {
            let block = zeros(rows, columns);
            assert_eq!(block, Mat::<f64>::zeros(rows, columns), "{rows} {columns}");
            let given = Mat::from_fn(rows, columns, |i, j| (i + 10 * j) as f64);
            assert_eq!(copied(given.as_ref()), given);
            // Copied by columns and by rows.
            assert_eq!(copied(given.as_ref().transpose()), given.transpose());
        }
    }

    #[test]
    fn combinations_in_place_are_combinations() {
        let mut v = block(2 * ROWS_PER_PARTIAL_PRODUCT + 5, 4);
        let h = Mat::from_fn(4, 3, |i, j| (i as f64 - 1.5) * (j as f64 + 0.5));
        let expected = combine(v.as_ref(), h.as_ref());
        let last = v.columns(3..4).to_owned();
        combine_in_place(v.as_mut(), h.as_ref());
        assert_eq!(v.first(3), expected);
        assert_eq!(v.columns(3..4), last, "what is not written stays");
    }

    #[test]
    fn multiples_of_columns_are_subtracted() {
        let (x, mut y) = (block(9, 2), block(9, 2));
        subtract_columns(y.as_mut(), &[1.0, -2.0], x.as_ref());
        for i in 0..9 {
            assert_eq!((y.as_ref()[(i, 0)], y.as_ref()[(i, 1)]), (0.0, 3.0 * x.as_ref()[(i, 1)]));
        }
    }

    #[test]
    fn normal_numbers_have_the_moments_of_theirs() {
        let n = 40_000;
        let moment = |power: i32| (0..n).map(|i| normal(i / 7, i % 7).powi(power)).sum::<f64>() / n as f64;
        assert!(moment(1).abs() < 0.02 && (moment(2) - 1.0).abs() < 0.03);
        assert!(moment(3).abs() < 0.06 && (moment(4) - 3.0).abs() < 0.2);
    }
}

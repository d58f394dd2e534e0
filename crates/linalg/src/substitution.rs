//! Substitution with the panels of a front for a few right-hand sides at a time. The speed is limited by reading the
//! factor from memory. Panels and right-hand sides are row-major; several rows of the panel are processed together and
//! read once. Large panels are cut into fixed pieces of rows.

use super::front::{PANEL_COLUMNS, Real, Trapezoid};
use super::parallel::{self, instructions_for_rows, prefetch};
use faer::traits::ComplexField;
use faer::traits::math_utils::recip;
use pulp::bytemuck::{cast_slice, cast_slice_mut};
use pulp::{Scalar, Simd, WithSimd};

/// Number of rows in a piece of parallel work.
const ROWS_PER_TASK: usize = 512;

/// Number of entries of a panel below which it is not divided into tasks.
pub(super) const MIN_PARALLEL_ENTRIES: usize = 300_000;

/// Forward substitution with the columns of a Cholesky factor. `front` holds a row of `K` right-hand sides for every
/// row of the front. The leading rows become the solution; the contribution of these is subtracted from the rows below.
pub(super) fn forward<T: Real, const K: usize>(l: &Trapezoid<T>, front: &mut [[T; K]]) {
    let arch = instructions_for_rows(size_of::<[T; K]>());
    for (p, panel) in l.panels.iter().enumerate() {
        let width = l.panel_width(p);
        let (x, below) = front[p * PANEL_COLUMNS..].split_at_mut(width);
        let (square, rest) = panel.split_at(width * width);
        arch.dispatch(Step::SolveLower(square, x));
        let x = &*x;
        if rest.len() < MIN_PARALLEL_ENTRIES {
            arch.dispatch(Step::SubtractProduct(rest, x, below));
        } else {
            let pieces = rest.chunks(ROWS_PER_TASK * width).zip(below.chunks_mut(ROWS_PER_TASK));
            parallel::for_each(pieces, |(l, y)| arch.dispatch(Step::SubtractProduct(l, x, y)));
        }
    }
}

/// Back substitution with the transpose for the leading rows of `front`. The rows below hold their solution.
pub(super) fn backward<T: Real, const K: usize>(l: &Trapezoid<T>, front: &mut [[T; K]]) {
    let arch = instructions_for_rows(size_of::<[T; K]>());
    for (p, panel) in l.panels.iter().enumerate().rev() {
        let width = l.panel_width(p);
        let (x, below) = front[p * PANEL_COLUMNS..].split_at_mut(width);
        let (square, rest) = panel.split_at(width * width);
        if rest.len() < MIN_PARALLEL_ENTRIES {
            arch.dispatch(Step::SubtractTransposed(rest, below, x));
        } else {
            let pieces = rest.chunks(ROWS_PER_TASK * width).zip(below.chunks(ROWS_PER_TASK));
            let sums = parallel::map(pieces, |(l, y)| {
                let mut sum = vec![[T::default(); K]; width];
                arch.dispatch(Step::SubtractTransposed(l, y, &mut sum));
                sum
            });
            for sum in &sums {
                for (x, part) in x.iter_mut().zip(sum) {
                    x.iter_mut().zip(part).for_each(|(x, part)| *x += *part);
                }
            }
        }
        arch.dispatch(Step::SolveTransposed(square, x));
    }
}

/// Subtracts L x from y; L is stored row by row.
pub(super) fn subtract_product<const K: usize>(l: &[f64], x: &[[f64; K]], y: &mut [[f64; K]]) {
    instructions_for_rows(size_of::<[f64; K]>()).dispatch(Step::SubtractProduct(l, x, y));
}

/// Subtracts L' y from x; L is stored row by row.
pub(super) fn subtract_transposed<const K: usize>(l: &[f64], y: &[[f64; K]], x: &mut [[f64; K]]) {
    instructions_for_rows(size_of::<[f64; K]>()).dispatch(Step::SubtractTransposed(l, y, x));
}

/// Replaces x by L^-1 x, for a square that holds the rows of a lower triangle.
pub(super) fn solve_lower<const K: usize>(l: &[f64], x: &mut [[f64; K]]) {
    instructions_for_rows(size_of::<[f64; K]>()).dispatch(Step::SolveLower(l, x));
}

/// Replaces x by L^-T x, for a square that holds the rows of a lower triangle.
pub(super) fn solve_transposed<const K: usize>(l: &[f64], x: &mut [[f64; K]]) {
    instructions_for_rows(size_of::<[f64; K]>()).dispatch(Step::SolveTransposed(l, x));
}

/// One pass over a part of a panel. The rows of L belong to the longer block of right-hand sides (y), its columns to
/// the other (x).
enum Step<'a, T, const K: usize> {
    /// Replaces x by L^-1 x for the leading square of a panel.
    SolveLower(&'a [T], &'a mut [[T; K]]),
    /// Subtracts L x from y.
    SubtractProduct(&'a [T], &'a [[T; K]], &'a mut [[T; K]]),
    /// Subtracts L' y from x.
    SubtractTransposed(&'a [T], &'a [[T; K]], &'a mut [[T; K]]),
    /// Replaces x by L^-T x for the leading square of a panel.
    SolveTransposed(&'a [T], &'a mut [[T; K]]),
}

// All functions below are inlined into one function per instruction set. A row of right-hand sides is a few vectors
// that stay in registers, and every number of L is broadcast to a vector. Without this the compiler vectorises along
// the rows of L, which costs shuffles.

impl<T: Real, const K: usize> WithSimd for Step<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // Number of rows of L in a group: enough sums to hide the latency of a multiplication, few enough for the
        // registers.
        match size_of::<[T; K]>() / size_of::<T::SimdVec<S>>() {
            1 => Kernels::<T, S, 1>(T::simd_ctx(simd)).run::<8, K>(self),
            2 => Kernels::<T, S, 2>(T::simd_ctx(simd)).run::<4, K>(self),
            4 => Kernels::<T, S, 4>(T::simd_ctx(simd)).run::<2, K>(self),
            // Rows shorter than a vector, and machines without vectors.
            _ => Kernels::<T, Scalar, K>(T::simd_ctx(Scalar)).run::<1, K>(self),
        }
    }
}

/// Number of columns of L between two calls of [`fetch`].
const FETCHED_COLUMNS: usize = 8;

/// Prefetches the `R` [`FETCHED_COLUMNS`] numbers of L from `from` on. The hardware does not recognise several rows
/// read side by side as a stream; these requests, one row group ahead and in the order of memory, form one.
#[inline(always)]
fn fetch<T: Real, const R: usize>(l: &[T], from: usize) {
    for at in (from..from + R * FETCHED_COLUMNS).step_by(64 / size_of::<T>()) {
        prefetch(l.as_ptr().wrapping_add(at));
    }
}

/// Right-hand sides of a row, as vectors.
type Row<T, S, const N: usize> = [<T as ComplexField>::SimdVec<S>; N];

/// Kernels for rows of `N` vectors of the instruction set `S`.
struct Kernels<T: Real, S: Simd, const N: usize>(T::SimdCtx<S>);

impl<T: Real, S: Simd, const N: usize> Kernels<T, S, N> {
    /// Runs a step with `R` rows of L at a time.
    #[inline(always)]
    fn run<const R: usize, const K: usize>(&self, step: Step<'_, T, K>) {
        match step {
            Step::SolveLower(l, x) => {
                let x = Self::rows_mut(x);
                // Odd rows come first, where there is the least to subtract.
                let odd = x.len() % R;
                (0..odd).for_each(|base| self.solve_lower::<1>(l, x, base));
                (odd..x.len()).step_by(R).for_each(|base| self.solve_lower::<R>(l, x, base));
            }
            Step::SubtractProduct(l, x, y) => {
                let (x, (y, odd)) = (Self::rows(x), Self::rows_mut(y).as_chunks_mut());
                let (l, odd_l) = l.split_at(y.len() * R * x.len());
                self.subtract_product::<R>(l, x, y);
                self.subtract_product::<1>(odd_l, x, odd.as_chunks_mut().0);
            }
            Step::SubtractTransposed(l, y, x) => {
                let (x, (y, odd)) = (Self::rows_mut(x), Self::rows(y).as_chunks());
                let (l, odd_l) = l.split_at(y.len() * R * x.len());
                self.subtract_transposed::<R>(l, y, x);
                self.subtract_transposed::<1>(odd_l, odd.as_chunks().0, x);
            }
            Step::SolveTransposed(l, x) => {
                let x = Self::rows_mut(x);
                let odd = x.len() % R;
                (odd..x.len()).step_by(R).rev().for_each(|base| self.solve_transposed::<R>(l, x, base));
                (0..odd).rev().for_each(|base| self.solve_transposed::<1>(l, x, base));
            }
        }
    }

    #[inline(always)]
    fn rows<const K: usize>(x: &[[T; K]]) -> &[Row<T, S, N>] {
        cast_slice::<T, T::SimdVec<S>>(x.as_flattened()).as_chunks().0
    }

    #[inline(always)]
    fn rows_mut<const K: usize>(x: &mut [[T; K]]) -> &mut [Row<T, S, N>] {
        cast_slice_mut::<T, T::SimdVec<S>>(x.as_flattened_mut()).as_chunks_mut().0
    }

    #[inline(always)]
    fn solve_lower<const R: usize>(&self, l: &[T], x: &mut [Row<T, S, N>], base: usize) {
        let width = x.len();
        let l = &l[base * width..];
        let (solved, open) = x.split_at_mut(base);
        let sums = self.products::<R>(l, width, solved);
        for i in 0..R {
            let mut row = open[i];
            self.subtract(&mut row, &sums[i]);
            for j in 0..i {
                self.add_multiple(&mut row, -l[i * width + base + j], &open[j]);
            }
            self.divide(&mut row, l[i * width + base + i]);
            open[i] = row;
        }
    }

    #[inline(always)]
    fn solve_transposed<const R: usize>(&self, l: &[T], x: &mut [Row<T, S, N>], base: usize) {
        let width = x.len();
        let l = &l[base * width..];
        let (open, rest) = x.split_at_mut(base);
        let Some(block) = rest.first_chunk_mut::<R>() else { return };
        for i in (0..R).rev() {
            self.divide(&mut block[i], l[i * width + base + i]);
            let solved = block[i];
            for j in 0..i {
                self.add_multiple(&mut block[j], -l[i * width + base + j], &solved);
            }
        }
        self.subtract_rows(l, width, block, open);
    }

    #[inline(always)]
    fn subtract_product<const R: usize>(&self, l: &[T], x: &[Row<T, S, N>], y: &mut [[Row<T, S, N>; R]]) {
        for (i, y) in y.iter_mut().enumerate() {
            let sums = self.products::<R>(&l[i * R * x.len()..], x.len(), x);
            for (y, sum) in y.iter_mut().zip(&sums) {
                self.subtract(y, sum);
            }
        }
    }

    #[inline(always)]
    fn subtract_transposed<const R: usize>(&self, l: &[T], y: &[[Row<T, S, N>; R]], x: &mut [Row<T, S, N>]) {
        for (i, y) in y.iter().enumerate() {
            self.subtract_rows(&l[i * R * x.len()..], x.len(), y, x);
        }
    }

    /// Returns the products of the first `R` rows of L, `stride` numbers apart, with x.
    #[inline(always)]
    fn products<const R: usize>(&self, l: &[T], stride: usize, x: &[Row<T, S, N>]) -> [Row<T, S, N>; R] {
        let rows: [&[T]; R] = std::array::from_fn(|q| &l[q * stride..][..x.len()]);
        let mut sums = [[T::simd_splat(&self.0, &T::default()); N]; R];
        for (i, part) in x.chunks(FETCHED_COLUMNS).enumerate() {
            fetch::<T, R>(l, R * stride + i * FETCHED_COLUMNS * R);
            for (j, x) in (i * FETCHED_COLUMNS..x.len()).zip(part) {
                for q in 0..R {
                    self.add_multiple(&mut sums[q], rows[q][j], x);
                }
            }
        }
        sums
    }

    /// Subtracts the transpose of the first `R` rows of L, `stride` numbers apart, times y from x.
    #[inline(always)]
    fn subtract_rows<const R: usize>(
        &self,
        l: &[T],
        stride: usize,
        y: &[Row<T, S, N>; R],
        x: &mut [Row<T, S, N>],
    ) {
        let width = x.len();
        let rows: [&[T]; R] = std::array::from_fn(|q| &l[q * stride..][..width]);
        let mut minus = *y;
        for y in minus.as_flattened_mut() {
            *y = T::simd_neg(&self.0, *y);
        }
        for (i, part) in x.chunks_mut(FETCHED_COLUMNS).enumerate() {
            fetch::<T, R>(l, R * stride + i * FETCHED_COLUMNS * R);
            for (j, x) in (i * FETCHED_COLUMNS..width).zip(part) {
                for q in 0..R {
                    self.add_multiple(x, rows[q][j], &minus[q]);
                }
            }
        }
    }

    /// Adds l x to sum.
    #[inline(always)]
    fn add_multiple(&self, sum: &mut Row<T, S, N>, l: T, x: &Row<T, S, N>) {
        let l = T::simd_splat(&self.0, &l);
        for (sum, &x) in sum.iter_mut().zip(x) {
            *sum = T::simd_mul_add(&self.0, l, x, *sum);
        }
    }

    #[inline(always)]
    fn subtract(&self, x: &mut Row<T, S, N>, y: &Row<T, S, N>) {
        for (x, &y) in x.iter_mut().zip(y) {
            *x = T::simd_sub(&self.0, *x, y);
        }
    }

    #[inline(always)]
    fn divide(&self, x: &mut Row<T, S, N>, l: T) {
        let inverse = T::simd_splat(&self.0, &recip(&l));
        for x in x {
            *x = T::simd_mul(&self.0, *x, inverse);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns an entry of a well-conditioned factor.
    fn entry(i: usize, j: usize) -> f64 {
        let noise = ((i * 37 + j * 101) % 211) as f64 / 211.0 - 0.5;
        if i == j { 2.0 + noise } else { 0.05 * noise }
    }

    /// Compares forward and back substitution with their definition, row by row in double precision.
    fn check<T: Real, const K: usize>(width: usize, rows: usize, tolerance: f64) {
        let height = width + rows;
        let mut l = Trapezoid::<T>::zeros(height, width);
        for j in 0..width {
            (j..height).for_each(|i| l.add(i, j, T::of(entry(i, j))));
        }
        let l_at = |i, j| T::of(entry(i, j)).wide();
        let start = |i: usize, k: usize| T::of(((i * 13 + k * 7) % 29) as f64 / 29.0 - 0.4);
        let front: Vec<[T; K]> = (0..height).map(|i| std::array::from_fn(|k| start(i, k))).collect();
        let exact: Vec<[f64; K]> = front.iter().map(|row| row.map(Real::wide)).collect();
        let close = |found: &[[T; K]], expected: &[[f64; K]], what: &str| {
            for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
                for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
                    let error = (found.wide() - expected).abs();
                    assert!(
                        error <= tolerance,
                        "{what}, {width} + {rows} rows: row {i}, column {k}: {error:e}"
                    );
                }
            }
        };

        let mut expected = exact.clone();
        for i in 0..height {
            let (done, rest) = expected.split_at_mut(i);
            for (j, x) in done[..i.min(width)].iter().enumerate() {
                (0..K).for_each(|k| rest[0][k] -= l_at(i, j) * x[k]);
            }
            if i < width {
                (0..K).for_each(|k| rest[0][k] /= l_at(i, i));
            }
        }
        let mut found = front.clone();
        forward(&l, &mut found);
        close(&found, &expected, "forward");

        let mut expected = exact;
        for j in (0..width).rev() {
            let (open, done) = expected.split_at_mut(j + 1);
            for (i, y) in (j + 1..height).zip(done) {
                (0..K).for_each(|k| open[j][k] -= l_at(i, j) * y[k]);
            }
            (0..K).for_each(|k| open[j][k] /= l_at(j, j));
        }
        let mut found = front;
        backward(&l, &mut found);
        close(&found, &expected, "backward");
    }

    #[test]
    fn both_substitutions_match_their_definition() {
        for width in [1, 3, 5, 127, 128, 131, 300] {
            // The tallest panels are cut into pieces.
            for rows in [0, 1, 7, 600, 2500] {
                check::<f64, 4>(width, rows, 1e-13);
                check::<f64, 8>(width, rows, 1e-13);
                check::<f32, 4>(width, rows, 3e-5);
                check::<f32, 8>(width, rows, 3e-5);
            }
        }
    }
}

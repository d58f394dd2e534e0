//! Products of a tall block with a few columns, as in orthogonalisation. General matrix products pack their operands
//! first, which here takes longer than the products. Sums run over blocks of rows, and within these over lanes, in a
//! fixed order.

use super::columns::{contiguous, contiguous_mut};
use super::parallel::prefetch;
use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, MatRef};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Largest number of columns for which these products are faster than general ones.
pub(super) const MAX_FEW_COLUMNS: usize = 8;

/// Number of rows in a block: the rows of the few columns and of some others stay in the first-level cache.
const ROWS_PER_BLOCK: usize = 256;

/// Number of columns of the tall block in a tile of a product.
const GRAM_TILE_COLUMNS: usize = 3;
/// Number of columns of the tall block in a tile of a combination.
const COMBINATION_TILE_COLUMNS: usize = 4;

/// Returns A' B (m x k) for A (n x m) and a few columns B (n x k).
pub(super) fn gram_of_few(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut sums = Mat::zeros(a.ncols(), b.ncols());
    Arch::new().dispatch(Tiles::<_, GRAM_TILE_COLUMNS>(Gram { a, b, sums: sums.as_mut() }));
    sums
}

/// Adds alpha V H to W for V (n x m), a few columns W (n x k) and small H (m x k).
pub(super) fn add_few_combinations(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>, alpha: f64) {
    Arch::new().dispatch(Tiles::<_, COMBINATION_TILE_COLUMNS>(Combination { w, v, h, alpha }));
}

/// Returns the blocks of rows.
fn blocks(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rows).step_by(ROWS_PER_BLOCK).map(move |first| first..rows.min(first + ROWS_PER_BLOCK))
}

/// Returns the offset, in numbers, from the current rows of `columns` columns from `first` on to the rows that are read
/// next: the current rows of the next columns, or the next rows of the first columns.
fn ahead(a: MatRef<'_, f64>, first: usize, columns: usize) -> isize {
    let next = if first + columns < a.ncols() { 0 } else { ROWS_PER_BLOCK as isize };
    let moved = if next == 0 { columns as isize } else { -(first as isize) };
    moved * a.col_stride() + next
}

/// Returns some rows of the columns from `first` on.
#[inline(always)]
fn columns_of<'a, const N: usize>(a: MatRef<'a, f64>, first: usize, rows: &Range<usize>) -> [&'a [f64]; N] {
    std::array::from_fn(|k| &contiguous(a.col(first + k))[rows.clone()])
}

/// Splits columns of equal length into vectors and a rest.
#[inline(always)]
fn vectors<S: Simd, const N: usize>(columns: [&[f64]; N]) -> ([&[S::f64s]; N], [&[f64]; N]) {
    let split = columns.map(S::as_simd_f64s);
    let count = split[0].0.len();
    (split.map(|(vectors, _)| &vectors[..count]), split.map(|(_, rest)| rest))
}

/// Returns true if the machine has registers for the sums of twice as many columns.
fn has_long_vectors<S: Simd>() -> bool {
    size_of::<S::f64s>() == 64
}

/// Product of a tall block with a few columns, computed tile by tile.
trait Tiled {
    /// Returns the tall block.
    fn tall(&self) -> MatRef<'_, f64>;

    /// Returns the number of the few columns.
    fn few(&self) -> usize;

    /// Adds the contribution of `A` columns of the tall block from `first` on and `B` of the few columns from `column`
    /// on, over some rows.
    fn add_tile<S: Simd, const A: usize, const B: usize>(
        &mut self,
        simd: S,
        first: usize,
        column: usize,
        rows: &Range<usize>,
    );
}

/// Loop over all tiles: `G` columns of the tall block at a time as long as enough are left, and as many of the few
/// columns as the registers hold sums for.
struct Tiles<T, const G: usize>(T);

// Structures with loops are dispatched instead of closures: a closure may be compiled outside the function that has the
// instruction set.
impl<T: Tiled, const G: usize> WithSimd for Tiles<T, G> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let (n, m) = self.0.tall().shape();
        for rows in blocks(n) {
            let mut first = 0;
            while first < m {
                if m - first >= G {
                    self.add_columns::<S, G>(simd, first, &rows);
                    first += G;
                } else {
                    self.add_columns::<S, 1>(simd, first, &rows);
                    first += 1;
                }
            }
        }
    }
}

impl<T: Tiled, const G: usize> Tiles<T, G> {
    /// Adds the tiles of `A` columns of the tall block with all of the few columns.
    #[inline(always)]
    fn add_columns<S: Simd, const A: usize>(&mut self, simd: S, first: usize, rows: &Range<usize>) {
        let k = self.0.few();
        let mut column = 0;
        while column < k {
            match k - column {
                8.. if has_long_vectors::<S>() => {
                    self.0.add_tile::<S, A, 8>(simd, first, column, rows);
                    column += 8;
                }
                4.. => {
                    self.0.add_tile::<S, A, 4>(simd, first, column, rows);
                    column += 4;
                }
                _ => {
                    self.0.add_tile::<S, A, 1>(simd, first, column, rows);
                    column += 1;
                }
            }
        }
    }
}

/// Product A' B, added to the sums.
struct Gram<'a> {
    a: MatRef<'a, f64>,
    b: MatRef<'a, f64>,
    sums: MatMut<'a, f64>,
}

impl Tiled for Gram<'_> {
    fn tall(&self) -> MatRef<'_, f64> {
        self.a
    }

    fn few(&self) -> usize {
        self.b.ncols()
    }

    #[inline(always)]
    fn add_tile<S: Simd, const A: usize, const B: usize>(
        &mut self,
        simd: S,
        first: usize,
        column: usize,
        rows: &Range<usize>,
    ) {
        let ahead = ahead(self.a, first, A);
        let sums = products::<S, A, B>(
            simd,
            columns_of(self.a, first, rows),
            columns_of(self.b, column, rows),
            ahead,
        );
        for (q, sums) in sums.iter().enumerate() {
            for (c, sum) in sums.iter().enumerate() {
                self.sums[(first + q, column + c)] += sum;
            }
        }
    }
}

/// Returns the products of all pairs of columns of equal length. Prefetches the numbers that are `ahead` of those of A.
#[inline(always)]
fn products<S: Simd, const A: usize, const B: usize>(
    simd: S,
    a: [&[f64]; A],
    b: [&[f64]; B],
    ahead: isize,
) -> [[f64; B]; A] {
    let (a_vectors, a_rest) = vectors::<S, A>(a);
    let (b_vectors, b_rest) = vectors::<S, B>(b);
    // One vector of partial sums for each pair of columns.
    let mut sums = [[simd.splat_f64s(0.0); B]; A];
    for i in 0..a_vectors[0].len() {
        for a in &a_vectors {
            prefetch_vectors(&a[i..=i], ahead);
        }
        for c in 0..B {
            let b = b_vectors[c][i];
            for q in 0..A {
                sums[q][c] = simd.mul_add_f64s(a_vectors[q][i], b, sums[q][c]);
            }
        }
    }
    // Sums over the lanes, and the rows that do not fill a vector.
    let mut totals = [[0.0; B]; A];
    for q in 0..A {
        for c in 0..B {
            totals[q][c] = simd.reduce_sum_f64s(sums[q][c]);
            for (a, b) in a_rest[q].iter().zip(b_rest[c]) {
                totals[q][c] += a * b;
            }
        }
    }
    totals
}

/// Combination W += alpha V H.
struct Combination<'a> {
    w: MatMut<'a, f64>,
    v: MatRef<'a, f64>,
    h: MatRef<'a, f64>,
    alpha: f64,
}

impl Tiled for Combination<'_> {
    fn tall(&self) -> MatRef<'_, f64> {
        self.v
    }

    fn few(&self) -> usize {
        self.w.ncols()
    }

    #[inline(always)]
    fn add_tile<S: Simd, const V: usize, const W: usize>(
        &mut self,
        simd: S,
        first: usize,
        column: usize,
        rows: &Range<usize>,
    ) {
        let factors: [[f64; W]; V] =
            std::array::from_fn(|q| std::array::from_fn(|c| self.alpha * self.h[(first + q, column + c)]));
        let ahead = ahead(self.v, first, V);
        let v = columns_of::<V>(self.v, first, rows);
        let mut columns_of_tile = self.w.rb_mut().subcols_mut(column, W).col_iter_mut();
        let w = [(); W]
            .map(|()| &mut contiguous_mut(columns_of_tile.next().expect("so many columns"))[rows.clone()]);
        add_multiples::<S, V, W>(simd, w, v, &factors, ahead);
    }
}

/// Adds V times `factors` to W for columns of equal length. Prefetches the numbers that are `ahead` of those of V.
#[inline(always)]
fn add_multiples<S: Simd, const V: usize, const W: usize>(
    simd: S,
    w: [&mut [f64]; W],
    v: [&[f64]; V],
    factors: &[[f64; W]; V],
    ahead: isize,
) {
    let (v_vectors, v_rest) = vectors::<S, V>(v);
    let (v_pairs, v_odd) = chunks(v_vectors);
    let (mut w_pairs, mut w_odd) = ([(); W].map(|()| &mut [][..]), [(); W].map(|()| &mut [][..]));
    let mut w_rest = [(); W].map(|()| &mut [][..]);
    for (c, w) in w.into_iter().enumerate() {
        let (vectors, rest) = S::as_mut_simd_f64s(w);
        let (pairs, odd) = vectors.as_chunks_mut::<2>();
        (w_pairs[c], w_odd[c], w_rest[c]) = (pairs, odd.as_chunks_mut::<1>().0, rest);
    }
    add_to_vectors::<S, 2, V, W>(simd, w_pairs, v_pairs, factors, ahead);
    add_to_vectors::<S, 1, V, W>(simd, w_odd, v_odd.map(|odd| odd.as_chunks().0), factors, ahead);
    for (c, w) in w_rest.iter_mut().enumerate() {
        for (i, w) in w.iter_mut().enumerate() {
            for q in 0..V {
                *w += factors[q][c] * v_rest[q][i];
            }
        }
    }
}

/// Splits columns of vectors into pairs and a rest.
#[inline(always)]
fn chunks<V, const N: usize>(columns: [&[V]; N]) -> ([&[[V; 2]]; N], [&[V]; N]) {
    let split = columns.map(<[V]>::as_chunks);
    (split.map(|(pairs, _)| pairs), split.map(|(_, odd)| odd))
}

/// Adds V times `factors` to W for groups of `R` vectors, whose sums are computed together.
#[inline(always)]
fn add_to_vectors<S: Simd, const R: usize, const V: usize, const W: usize>(
    simd: S,
    w: [&mut [[S::f64s; R]]; W],
    v: [&[[S::f64s; R]]; V],
    factors: &[[f64; W]; V],
    ahead: isize,
) {
    let count = v[0].len();
    let v = v.map(|v| &v[..count]);
    for i in 0..count {
        v.iter().for_each(|v| prefetch_vectors(&v[i], ahead));
        let mut sums: [[S::f64s; R]; W] = std::array::from_fn(|c| w[c][i]);
        for q in 0..V {
            for c in 0..W {
                let factor = simd.splat_f64s(factors[q][c]);
                for r in 0..R {
                    sums[c][r] = simd.mul_add_f64s(factor, v[q][i][r], sums[c][r]);
                }
            }
        }
        for c in 0..W {
            w[c][i] = sums[c];
        }
    }
}

/// Prefetches the numbers that are `ahead` of some vectors.
#[inline(always)]
fn prefetch_vectors<V>(vectors: &[V], ahead: isize) {
    for vector in vectors {
        prefetch((&raw const *vector).cast::<f64>().wrapping_offset(ahead));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(rows: usize, columns: usize, seed: f64) -> Mat<f64> {
        Mat::from_fn(rows, columns, |i, j| (seed + (i * 7 + j * 13) as f64).sin())
    }

    /// Both products match their definition, with full and partial vectors, tiles and blocks of rows.
    #[test]
    fn products_with_a_few_columns_match_their_definition() {
        for rows in [0, 1, 7, 8, 29, ROWS_PER_BLOCK, ROWS_PER_BLOCK + 21] {
            for (m, k) in [(0, 2), (1, 1), (2, 3), (3, 4), (7, 5), (8, 8), (13, 8)] {
                let (a, b) = (block(rows, m, 0.3), block(rows, k, 1.7));
                let gram = gram_of_few(a.as_ref(), b.as_ref());
                let off = (&gram - a.transpose() * &b).norm_max();
                assert!(off <= 1e-12, "{rows} rows, {m} and {k} columns: {off:e}");
                let h = block(m, k, 2.9);
                let mut w = b.clone();
                add_few_combinations(w.as_mut(), a.as_ref(), h.as_ref(), -0.5);
                let off = (&w - (&b - faer::Scale(0.5) * (&a * &h))).norm_max();
                assert!(off <= 1e-13, "{rows} rows, {m} and {k} columns: {off:e}");
            }
        }
    }
}

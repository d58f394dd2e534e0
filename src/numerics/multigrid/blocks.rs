//! Sparse matrices of small dense blocks in single precision, applied to [`WIDTH`] columns at a time. Every row
//! is one sum in storage order: the same bits on any number of threads.

use pulp::bytemuck::cast_slice;
use pulp::{Arch, Scalar, Simd, WithSimd};
use rayon::prelude::*;

/// Columns that are worked on together: one or two vectors in single precision. Matrices are read once for all of
/// them; with 8 or 32 columns each takes a third longer.
pub(super) const WIDTH: usize = 16;

/// The rows of a node in [`WIDTH`] columns.
pub(super) type Rows<const R: usize> = [[f32; WIDTH]; R];

/// Pseudo-random numbers between -1/2 and 1/2: where iterations start.
pub(super) fn noise(k: usize) -> f32 {
    ((k.wrapping_mul(2_654_435_761) >> 9) & 0xffff) as f32 / 65536.0 - 0.5
}

/// The entries of a row: columns, ascending, with their blocks.
pub(super) type Entries<const R: usize, const C: usize> = Vec<(u32, [[f32; C]; R])>;

/// Block rows per parallel task.
const NODES: usize = 512;

/// A matrix of blocks with `R` rows and `C` columns.
#[derive(Debug, Clone)]
pub(super) struct BlockMatrix<const R: usize, const C: usize> {
    pointers: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<[[f32; C]; R]>,
}

impl<const R: usize, const C: usize> BlockMatrix<R, C> {
    pub(super) fn from_rows(rows: Vec<Entries<R, C>>) -> Self {
        let entries = rows.iter().map(Vec::len).sum();
        let (mut pointers, mut columns) = (vec![0], Vec::with_capacity(entries));
        let mut blocks = Vec::with_capacity(entries);
        for row in rows {
            for (column, block) in row {
                columns.push(column);
                blocks.push(block);
            }
            pointers.push(columns.len());
        }
        Self { pointers, columns, blocks }
    }

    pub(super) fn n_rows(&self) -> usize {
        self.pointers.len() - 1
    }

    /// Columns and blocks of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (usize, &[[f32; C]; R])> {
        let range = self.pointers[row]..self.pointers[row + 1];
        self.columns[range.clone()].iter().map(|&column| column as usize).zip(&self.blocks[range])
    }

    /// The transpose of a matrix with `n` block columns.
    pub(super) fn transposed(&self, n: usize) -> BlockMatrix<C, R> {
        let mut pointers = vec![0usize; n + 1];
        self.columns.iter().for_each(|&column| pointers[column as usize + 1] += 1);
        for row in 0..n {
            pointers[row + 1] += pointers[row];
        }
        let mut next = pointers.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut blocks = vec![[[0.0; R]; C]; self.columns.len()];
        for row in 0..self.n_rows() {
            for (column, block) in self.row(row) {
                let at = &mut next[column];
                columns[*at] = row as u32;
                blocks[*at] = std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]));
                *at += 1;
            }
        }
        BlockMatrix { pointers, columns, blocks }
    }

    /// What `make` makes of each row, by its number, and of its rows of A x.
    pub(super) fn apply(
        &self,
        x: &[Rows<C>],
        make: impl Fn(usize, &Rows<R>) -> Rows<R> + Sync,
    ) -> Vec<Rows<R>> {
        let arch = Arch::new();
        let made = |row: usize| arch.dispatch(RowProduct { matrix: self, row, x, make: &make });
        (0..self.n_rows()).into_par_iter().with_min_len(NODES).map(made).collect()
    }
}

/// [`BlockMatrix::apply`] for one row.
struct RowProduct<'a, F, const R: usize, const C: usize> {
    matrix: &'a BlockMatrix<R, C>,
    row: usize,
    x: &'a [Rows<C>],
    make: &'a F,
}

// Neither a closure, which is compiled apart from the function that has the instruction set, nor loops over the
// columns, which the compiler cuts into vectors of several lengths.
impl<F, const R: usize, const C: usize> WithSimd for RowProduct<'_, F, R, C>
where
    F: Fn(usize, &Rows<R>) -> Rows<R>,
{
    type Output = Rows<R>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Rows<R> {
        match size_of::<[f32; WIDTH]>() / size_of::<S::f32s>() {
            1 => self.run::<S, 1>(simd),
            2 => self.run::<S, 2>(simd),
            4 => self.run::<S, 4>(simd),
            // Machines without vectors, or with longer ones.
            _ => self.run::<Scalar, WIDTH>(Scalar),
        }
    }
}

/// A row of [`WIDTH`] columns as `N` vectors.
type Row<S, const N: usize> = [<S as Simd>::f32s; N];

impl<F, const R: usize, const C: usize> RowProduct<'_, F, R, C>
where
    F: Fn(usize, &Rows<R>) -> Rows<R>,
{
    #[inline(always)]
    fn run<S: Simd, const N: usize>(self, simd: S) -> Rows<R> {
        let x = cast_slice::<f32, S::f32s>(self.x.as_flattened().as_flattened());
        let x: &[[Row<S, N>; C]] = x.as_chunks::<N>().0.as_chunks::<C>().0;
        let product = row_times::<S, N, R, C>(simd, self.matrix, self.row, x);
        let mut rows = [[0.0; WIDTH]; R];
        rows.iter_mut().zip(&product).for_each(|(to, from)| to.copy_from_slice(cast_slice(from)));
        (self.make)(self.row, &rows)
    }
}

/// Vectors that sums may take, of the 16 of most machines.
const REGISTERS: usize = 12;

/// The product of a row. Short rows have several sums, which do not wait for each other.
#[inline(always)]
fn row_times<S: Simd, const N: usize, const R: usize, const C: usize>(
    simd: S,
    matrix: &BlockMatrix<R, C>,
    row: usize,
    x: &[[Row<S, N>; C]],
) -> [Row<S, N>; R] {
    const SUMS: usize = 3;
    let sums = (REGISTERS / (R * N)).clamp(1, SUMS);
    let range = matrix.pointers[row]..matrix.pointers[row + 1];
    let mut parts = [[[simd.splat_f32s(0.0); N]; R]; SUMS];
    for (&column, block) in matrix.columns[range.clone()].iter().zip(&matrix.blocks[range]) {
        let x = &x[column as usize];
        for c in 0..C {
            for r in 0..R {
                let factor = simd.splat_f32s(block[r][c]);
                let sum = &mut parts[c % sums][r];
                (0..N).for_each(|n| sum[n] = simd.mul_add_f32s(factor, x[c][n], sum[n]));
            }
        }
    }
    let [mut total, others @ ..] = parts;
    for part in &others[..sums - 1] {
        for (total, part) in total.as_flattened_mut().iter_mut().zip(part.as_flattened()) {
            *total = simd.add_f32s(*total, *part);
        }
    }
    total
}

/// (A - theta M) x for one row, with a theta for each column.
pub(super) struct PencilProduct<'a, const B: usize> {
    pub a: &'a BlockMatrix<B, B>,
    /// Entries of M beside those of A.
    pub mass: &'a [f32],
    pub theta: [f32; WIDTH],
    pub row: usize,
    pub x: &'a [Rows<B>],
}

impl<const B: usize> WithSimd for PencilProduct<'_, B> {
    type Output = Rows<B>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Rows<B> {
        match size_of::<[f32; WIDTH]>() / size_of::<S::f32s>() {
            1 => self.run::<S, 1>(simd),
            2 => self.run::<S, 2>(simd),
            4 => self.run::<S, 4>(simd),
            _ => self.run::<Scalar, WIDTH>(Scalar),
        }
    }
}

impl<const B: usize> PencilProduct<'_, B> {
    #[inline(always)]
    fn run<S: Simd, const N: usize>(self, simd: S) -> Rows<B> {
        let Self { a, mass, theta, row, x } = self;
        let x = cast_slice::<f32, S::f32s>(x.as_flattened().as_flattened());
        let x: &[[Row<S, N>; B]] = x.as_chunks::<N>().0.as_chunks::<B>().0;
        let theta: &[Row<S, N>] = cast_slice::<f32, S::f32s>(&theta).as_chunks::<N>().0;
        let theta = &theta[0];
        let range = a.pointers[row]..a.pointers[row + 1];
        let zero = [[simd.splat_f32s(0.0); N]; B];
        let (mut stiff, mut heavy) = (zero, zero);
        let entries = a.columns[range.clone()].iter().zip(&a.blocks[range.clone()]).zip(&mass[range]);
        for ((&column, block), &mass) in entries {
            let x = &x[column as usize];
            let mass = simd.splat_f32s(mass);
            for c in 0..B {
                for r in 0..B {
                    let factor = simd.splat_f32s(block[r][c]);
                    (0..N).for_each(|n| stiff[r][n] = simd.mul_add_f32s(factor, x[c][n], stiff[r][n]));
                }
                (0..N).for_each(|n| heavy[c][n] = simd.mul_add_f32s(mass, x[c][n], heavy[c][n]));
            }
        }
        let mut rows = [[0.0; WIDTH]; B];
        for (b, row) in rows.iter_mut().enumerate() {
            let product: Row<S, N> =
                std::array::from_fn(|n| simd.sub_f32s(stiff[b][n], simd.mul_f32s(theta[n], heavy[b][n])));
            row.copy_from_slice(cast_slice(&product));
        }
        rows
    }
}

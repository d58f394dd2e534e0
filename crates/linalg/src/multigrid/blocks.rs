//! Sparse matrices of small dense blocks in single precision, multiplied by [`WIDTH`] columns at a time. Every row is
//! one sum in storage order, so that the bits do not depend on the number of threads.

use crate::parallel;
use pulp::bytemuck::cast_slice;
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Number of columns that are processed together; the matrix is read once for all of them. With 8, each column takes a
/// third longer; with 32, the loss by unused columns exceeds the gain.
pub(super) const WIDTH: usize = 16;

/// Rows of a node in [`WIDTH`] columns.
pub(super) type Rows<const R: usize> = [[f32; WIDTH]; R];

/// Returns pseudo-random numbers between -1/2 and 1/2, the start of iterations.
pub(super) fn noise(k: usize) -> f32 {
    ((k.wrapping_mul(2_654_435_761) >> 9) & 0xffff) as f32 / 65536.0 - 0.5
}

/// Entries of a row: columns, ascending, with their blocks.
pub(super) type Entries<const R: usize, const C: usize> = Vec<(u32, [[f32; C]; R])>;

/// Number of block rows per parallel task.
const BLOCK_ROWS_PER_TASK: usize = 512;

/// Matrix of blocks with `R` rows and `C` columns.
#[derive(Debug, Clone)]
pub(super) struct BlockMatrix<const R: usize, const C: usize> {
    pointers: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<[[f32; C]; R]>,
}

impl<const R: usize, const C: usize> BlockMatrix<R, C> {
    /// Builds the matrix from its rows, copied by all threads.
    pub(super) fn from_rows(mut rows: Vec<Entries<R, C>>) -> Self {
        let mut pointers = vec![0];
        pointers.extend(rows.iter().scan(0, |end, row| {
            *end += row.len();
            Some(*end)
        }));
        let entries = rows.iter().map(Vec::len).sum();
        let (mut columns, mut blocks) = (vec![0; entries], vec![[[0.0; C]; R]; entries]);
        let (mut free_columns, mut free_blocks) = (&mut columns[..], &mut blocks[..]);
        let mut tasks = Vec::with_capacity(rows.len().div_ceil(BLOCK_ROWS_PER_TASK));
        for rows in rows.chunks_mut(BLOCK_ROWS_PER_TASK) {
            let length = rows.iter().map(Vec::len).sum();
            let (part_columns, part_blocks);
            (part_columns, free_columns) = free_columns.split_at_mut(length);
            (part_blocks, free_blocks) = free_blocks.split_at_mut(length);
            tasks.push((rows, part_columns, part_blocks));
        }
        parallel::for_each(tasks, |(rows, columns, blocks)| {
            let entries = rows.iter_mut().flat_map(std::mem::take);
            for ((entry, column), block) in entries.zip(columns).zip(blocks) {
                (*column, *block) = entry;
            }
        });
        Self { pointers, columns, blocks }
    }

    pub(super) fn n_rows(&self) -> usize {
        self.pointers.len() - 1
    }

    /// Returns columns and blocks of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (usize, &[[f32; C]; R])> {
        let range = self.pointers[row]..self.pointers[row + 1];
        self.columns[range.clone()].iter().map(|&column| column as usize).zip(&self.blocks[range])
    }

    /// Returns the transpose of a matrix with `n` block columns.
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

    /// Returns `make(node, rows of A x)` for every block row.
    pub(super) fn apply(
        &self,
        x: &[Rows<C>],
        make: impl Fn(usize, &Rows<R>) -> Rows<R> + Sync,
    ) -> Vec<Rows<R>> {
        let arch = Arch::new();
        let made = |row: usize| arch.dispatch(Dispatched(RowProduct { matrix: self, row, x, make: &make }));
        parallel::values(self.n_rows(), BLOCK_ROWS_PER_TASK, made)
    }
}

impl<const B: usize> BlockMatrix<B, B> {
    /// Returns (A - theta M) x with a theta for each column. `mass` holds the entry of M for each block of A.
    pub(super) fn apply_pencil(&self, mass: &[f32], theta: &[f32; WIDTH], x: &[Rows<B>]) -> Vec<Rows<B>> {
        let arch = Arch::new();
        let made = |row: usize| arch.dispatch(Dispatched(PencilProduct { a: self, mass, theta, row, x }));
        parallel::values(self.n_rows(), BLOCK_ROWS_PER_TASK, made)
    }
}

/// Work of [`BlockMatrix::apply`] for one row.
struct RowProduct<'a, F, const R: usize, const C: usize> {
    matrix: &'a BlockMatrix<R, C>,
    row: usize,
    x: &'a [Rows<C>],
    make: &'a F,
}

/// Row of [`WIDTH`] columns as `N` vectors.
type Row<S, const N: usize> = [<S as Simd>::f32s; N];

/// Returns the rows of nodes as vectors.
#[inline(always)]
fn as_vectors<S: Simd, const N: usize, const C: usize>(x: &[Rows<C>]) -> &[[Row<S, N>; C]] {
    let x = cast_slice::<f32, S::f32s>(x.as_flattened().as_flattened());
    x.as_chunks::<N>().0.as_chunks::<C>().0
}

/// Returns the vectors of a node as its rows.
#[inline(always)]
fn as_rows<S: Simd, const N: usize, const R: usize>(vectors: &[Row<S, N>; R]) -> Rows<R> {
    let mut rows = [[0.0; WIDTH]; R];
    rows.iter_mut().zip(vectors).for_each(|(to, from)| to.copy_from_slice(cast_slice(from)));
    rows
}

/// Computation with `N` vectors for each row.
trait ByVectors {
    type Made;

    fn make<S: Simd, const N: usize>(self, simd: S) -> Self::Made;
}

/// Runs a computation with the vectors of the machine.
struct Dispatched<T>(T);

// Dispatches a structure with explicit vectors: a closure would be compiled outside the function that has the
// instruction set, and the compiler cuts loops over the columns into vectors of several lengths.
impl<T: ByVectors> WithSimd for Dispatched<T> {
    type Output = T::Made;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> T::Made {
        match size_of::<[f32; WIDTH]>() / size_of::<S::f32s>() {
            1 => self.0.make::<S, 1>(simd),
            2 => self.0.make::<S, 2>(simd),
            4 => self.0.make::<S, 4>(simd),
            // Machines without vectors, or with longer ones.
            _ => self.0.make::<Scalar, WIDTH>(Scalar),
        }
    }
}

impl<F, const R: usize, const C: usize> ByVectors for RowProduct<'_, F, R, C>
where
    F: Fn(usize, &Rows<R>) -> Rows<R>,
{
    type Made = Rows<R>;

    #[inline(always)]
    fn make<S: Simd, const N: usize>(self, simd: S) -> Rows<R> {
        let product = row_times::<S, N, R, C>(simd, self.matrix, self.row, as_vectors::<S, N, C>(self.x));
        (self.make)(self.row, &as_rows::<S, N, R>(&product))
    }
}

/// Number of vector registers for sums, of the 16 of most machines.
const SUM_REGISTERS: usize = 12;

/// Returns the product of a row. Short rows use several independent sums to hide the latency.
#[inline(always)]
fn row_times<S: Simd, const N: usize, const R: usize, const C: usize>(
    simd: S,
    matrix: &BlockMatrix<R, C>,
    row: usize,
    x: &[[Row<S, N>; C]],
) -> [Row<S, N>; R] {
    const INDEPENDENT_SUMS: usize = 3;
    let sums = (SUM_REGISTERS / (R * N)).clamp(1, INDEPENDENT_SUMS);
    let range = matrix.pointers[row]..matrix.pointers[row + 1];
    let mut parts = [[[simd.splat_f32s(0.0); N]; R]; INDEPENDENT_SUMS];
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

/// Work of [`BlockMatrix::apply_pencil`] for one row.
struct PencilProduct<'a, const B: usize> {
    a: &'a BlockMatrix<B, B>,
    mass: &'a [f32],
    theta: &'a [f32; WIDTH],
    row: usize,
    x: &'a [Rows<B>],
}

impl<const B: usize> ByVectors for PencilProduct<'_, B> {
    type Made = Rows<B>;

    #[inline(always)]
    fn make<S: Simd, const N: usize>(self, simd: S) -> Rows<B> {
        let Self { a, mass, theta, row, x } = self;
        let x = as_vectors::<S, N, B>(x);
        let theta: Row<S, N> = std::array::from_fn(|n| cast_slice::<f32, S::f32s>(theta)[n]);
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
        let product: [Row<S, N>; B] = std::array::from_fn(|b| {
            std::array::from_fn(|n| simd.sub_f32s(stiff[b][n], simd.mul_f32s(theta[n], heavy[b][n])))
        });
        as_rows::<S, N, B>(&product)
    }
}

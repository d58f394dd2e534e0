//! Sparse matrices of small dense blocks in single precision, applied to eight columns at a time. Every row
//! is one sum in storage order: the same bits on any number of threads.

use pulp::Arch;
use rayon::prelude::*;

/// Columns that are worked on together: one vector of eight numbers in single precision.
pub const WIDTH: usize = 8;

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

    /// Calls `take` with the number of each row, its rows of y and those of A x.
    pub(super) fn apply(
        &self,
        x: &[Rows<C>],
        y: &mut [Rows<R>],
        take: impl Fn(usize, &mut Rows<R>, &Rows<R>) + Sync,
    ) {
        let arch = Arch::new();
        y.par_chunks_mut(NODES).enumerate().for_each(|(task, y)| {
            arch.dispatch(
                #[inline(always)]
                || {
                    for (k, y) in y.iter_mut().enumerate() {
                        let row = task * NODES + k;
                        take(row, y, &self.row_times(row, x));
                    }
                },
            );
        });
    }

    #[inline(always)]
    fn row_times(&self, row: usize, x: &[Rows<C>]) -> Rows<R> {
        let range = self.pointers[row]..self.pointers[row + 1];
        let mut sum = [[0.0f32; WIDTH]; R];
        for (&column, block) in self.columns[range.clone()].iter().zip(&self.blocks[range]) {
            let x = &x[column as usize];
            for r in 0..R {
                for c in 0..C {
                    for w in 0..WIDTH {
                        sum[r][w] += block[r][c] * x[c][w];
                    }
                }
            }
        }
        sum
    }
}

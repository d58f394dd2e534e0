//! Factor L D L' of a sparse positive semidefinite matrix, or of a complex sum of such matrices, computed row by row
//! (Davis, ACM TOMS 31 (2005) 587). It suits repeated solutions of one vector on one thread without allocation. For
//! large models and blocks of vectors, use [`Cholesky`](super::Cholesky).

use super::ordering::{nested_dissection, node_graph};
use super::{Pencil, SymmetricMatrix};
use nalgebra::Complex;
use std::ops::{AddAssign, Div, Mul, SubAssign};

/// Marks a root of the elimination tree: no parent.
const NO_PARENT: u32 = u32::MAX;

/// Factor A = P' L D L' P. If A is singular, it is the factor of A with some diagonal entries doubled.
#[derive(Debug, Clone)]
pub struct SparseLdl<T = f64> {
    /// Row at each position of the elimination order.
    order: Vec<u32>,
    col_ptr: Vec<usize>,
    /// Positions below the diagonal of L, column by column.
    row_idx: Vec<u32>,
    values: Vec<T>,
    inverse_pivots: Vec<T>,
    null_rows: Vec<usize>,
}

impl SparseLdl {
    /// Factors a positive semidefinite matrix. A pivot up to `floor` times the diagonal entry of its row counts as
    /// zero, and is replaced by that entry (by one in an empty row).
    ///
    /// Returns `None` if a pivot lies below minus this limit (the matrix is indefinite), or if the matrix is too large
    /// for the ordering.
    pub fn new(a: &SymmetricMatrix, floor: f64) -> Option<Self> {
        let sum = MatrixSum::new(vec![(1.0, a, 1)]);
        let mut rows = RowByRow::new(&sum, Structure::new(&sum, &Pencil::new(a, a, 1))?);
        let mut null_rows = Vec::new();
        for k in 0..a.n() {
            rows.gather(k);
            let (diagonal, pivot) = rows.eliminate(k);
            if pivot > floor * diagonal {
                rows.pivots[k] = pivot;
            } else if pivot >= -floor * diagonal && diagonal >= 0.0 {
                null_rows.push(rows.structure.order[k] as usize);
                rows.pivots[k] = if diagonal > 0.0 { diagonal } else { 1.0 };
            } else {
                return None;
            }
        }
        null_rows.sort_unstable();
        Some(rows.finish(null_rows))
    }
}

impl<T: Scalar> SparseLdl<T> {
    /// Factors a sum of semidefinite matrices whose factors lie in one quadrant of the complex plane, such as M + z D +
    /// z^2 K for z^2 to the right of the imaginary axis. No pivoting is needed for stability (Higham, Math. Comp. 67
    /// (1998) 1591). The elimination order is that of `pencil`, whose matrices are part of the sum.
    ///
    /// Returns `None` if a pivot vanishes up to rounding (the sum is singular), or if the sum is too large for the
    /// ordering.
    pub fn of_sum(sum: &MatrixSum<'_, T>, pencil: &Pencil<'_>) -> Option<Self> {
        let mut rows = RowByRow::new(sum, Structure::new(sum, pencil)?);
        for k in 0..sum.n() {
            rows.gather(k);
            let (diagonal, pivot) = rows.eliminate(k);
            let small = f64::EPSILON * f64::EPSILON * diagonal.square();
            // The comparison also rejects NaN.
            if pivot.square().partial_cmp(&small) != Some(std::cmp::Ordering::Greater) {
                return None;
            }
            rows.pivots[k] = pivot;
        }
        Some(rows.finish(Vec::new()))
    }

    /// Returns the number of rows.
    pub fn n(&self) -> usize {
        self.order.len()
    }

    /// Returns the number of entries of L below the diagonal.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Returns the rows with a zero pivot, ascending; their number is the dimension of the null space. For each of
    /// these rows j the solution for e_j is a null vector, and together they span the null space. For right-hand sides
    /// in the range of A, the solution of A x = b is the one that is zero in these rows.
    pub fn null_rows(&self) -> &[usize] {
        &self.null_rows
    }

    /// Replaces x by (A kron I_block)^-1 x.
    ///
    /// # Panics
    /// If `x` or `scratch` does not have block n entries, or the block is not 1, 2 or 3.
    pub fn solve_in_place(&self, block: usize, x: &mut [T], scratch: &mut [T]) {
        match block {
            1 => self.solve_block::<1>(x, scratch),
            2 => self.solve_block::<2>(x, scratch),
            3 => self.solve_block::<3>(x, scratch),
            _ => panic!("blocks of 1, 2 or 3 components, not {block}"),
        }
    }

    fn solve_block<const B: usize>(&self, x: &mut [T], scratch: &mut [T]) {
        let n = self.n();
        assert!(x.len() == n * B && scratch.len() == n * B, "sizes of a solve");
        let (x, y) = (x.as_chunks_mut::<B>().0, scratch.as_chunks_mut::<B>().0);
        // To elimination order.
        for (y, &row) in y.iter_mut().zip(&self.order) {
            *y = x[row as usize];
        }
        // Forward substitution with L, then division by the pivots and back substitution with L'.
        for j in 0..n {
            let from = y[j];
            let column = self.col_ptr[j]..self.col_ptr[j + 1];
            for (&i, &l) in self.row_idx[column.clone()].iter().zip(&self.values[column]) {
                y[i as usize].iter_mut().zip(from).for_each(|(y, from)| *y -= l * from);
            }
        }
        for j in (0..n).rev() {
            let mut sum = y[j].map(|y| y * self.inverse_pivots[j]);
            let column = self.col_ptr[j]..self.col_ptr[j + 1];
            for (&i, &l) in self.row_idx[column.clone()].iter().zip(&self.values[column]) {
                sum.iter_mut().zip(y[i as usize]).for_each(|(sum, y)| *sum -= l * y);
            }
            y[j] = sum;
        }
        // Back to the order of the rows.
        for (y, &row) in y.iter().zip(&self.order) {
            x[row as usize] = *y;
        }
    }
}

/// Structure of L, before its numbers are computed.
struct Structure {
    /// Row at each position of the elimination order, and position of each row.
    order: Vec<u32>,
    place: Vec<u32>,
    /// Parent of each column in the elimination tree.
    parent: Vec<u32>,
    /// Start of each column of L.
    col_ptr: Vec<usize>,
}

impl Structure {
    /// Computes the structure for a sum in the order of `pencil`; `None` if it is too large for the ordering.
    fn new<T: Scalar>(a: &MatrixSum<'_, T>, pencil: &Pencil<'_>) -> Option<Self> {
        let n = a.n();
        let block = pencil.block() as u32;
        // Elimination order of the rows, and its inverse.
        let nodes = nested_dissection(&mut node_graph(pencil)?)?;
        let order: Vec<u32> =
            nodes.iter().flat_map(|&node| (0..block).map(move |k| block * node + k)).collect();
        let mut place = vec![0u32; n];
        order.iter().enumerate().for_each(|(k, &row)| place[row as usize] = k as u32);
        let (mut parent, mut met) = (vec![NO_PARENT; n], vec![NO_PARENT; n]);
        let mut col_ptr = vec![0usize; n + 1];
        // The entries of row k of L are the paths in the tree from the entries of row k of A.
        for k in 0..n as u32 {
            met[k as usize] = k;
            a.for_row(order[k as usize] as usize, |column, _| {
                let mut i = place[column];
                while i < k && met[i as usize] != k {
                    let at = i as usize;
                    col_ptr[at + 1] += 1;
                    met[at] = k;
                    if parent[at] == NO_PARENT {
                        parent[at] = k;
                    }
                    i = parent[at];
                }
            });
        }
        // Counts of the columns become their starts.
        (0..n).for_each(|j| col_ptr[j + 1] += col_ptr[j]);
        Some(Self { order, place, parent, col_ptr })
    }
}

/// Factorisation in progress: the columns of L grow row by row.
struct RowByRow<'a, T> {
    a: &'a MatrixSum<'a, T>,
    structure: Structure,
    /// End of the computed part of each column.
    end: Vec<usize>,
    row_idx: Vec<u32>,
    values: Vec<T>,
    pivots: Vec<T>,
    /// Current row; zero outside it.
    sums: Vec<T>,
    /// Columns in which the current row has entries, in reverse order of elimination.
    reach: Vec<usize>,
    /// Row that reached each column last, and the path in the tree from one entry.
    met: Vec<u32>,
    path: Vec<usize>,
}

impl<'a, T: Scalar> RowByRow<'a, T> {
    fn new(a: &'a MatrixSum<'a, T>, structure: Structure) -> Self {
        let (n, entries) = (a.n(), structure.col_ptr[a.n()]);
        Self {
            a,
            end: structure.col_ptr[..n].to_vec(),
            row_idx: vec![0; entries],
            values: vec![T::ZERO; entries],
            pivots: vec![T::ZERO; n],
            sums: vec![T::ZERO; n],
            reach: Vec::new(),
            met: vec![NO_PARENT; n],
            path: Vec::new(),
            structure,
        }
    }

    fn finish(self, null_rows: Vec<usize>) -> SparseLdl<T> {
        let Self { structure: Structure { order, col_ptr, .. }, row_idx, values, pivots, .. } = self;
        let inverse_pivots = pivots.into_iter().map(T::reciprocal).collect();
        SparseLdl { order, col_ptr, row_idx, values, inverse_pivots, null_rows }
    }

    /// Loads row k of A, and finds the columns of L that it reaches.
    fn gather(&mut self, k: usize) {
        let Self { a, structure: Structure { order, place, parent, .. }, sums, reach, met, path, .. } = self;
        met[k] = k as u32;
        reach.clear();
        a.for_row(order[k] as usize, |column, value| {
            let mut i = place[column] as usize;
            if i > k {
                return;
            }
            sums[i] += value;
            while met[i] != k as u32 {
                path.push(i);
                met[i] = k as u32;
                i = parent[i] as usize;
            }
            // Reversed, so that each path comes before the paths that it ends in.
            reach.extend(path.drain(..).rev());
        });
    }

    /// Computes row k of L. Returns the diagonal entry of A and the pivot.
    fn eliminate(&mut self, k: usize) -> (T, T) {
        let Self { structure, end, row_idx, values, pivots, sums, reach, .. } = self;
        let diagonal = std::mem::replace(&mut sums[k], T::ZERO);
        let mut pivot = diagonal;
        for &i in reach.iter().rev() {
            let sum = std::mem::replace(&mut sums[i], T::ZERO);
            for at in structure.col_ptr[i]..end[i] {
                sums[row_idx[at] as usize] -= values[at] * sum;
            }
            let entry = sum / pivots[i];
            pivot -= entry * sum;
            (row_idx[end[i]], values[end[i]]) = (k as u32, entry);
            end[i] += 1;
        }
        (diagonal, pivot)
    }
}

/// Real or complex number.
pub trait Scalar: Copy + Mul<Output = Self> + Div<Output = Self> + AddAssign + SubAssign {
    /// Number zero.
    const ZERO: Self;
    /// Number one.
    const ONE: Self;
    /// Returns the product with a real number.
    fn times(self, real: f64) -> Self;
    /// Returns 1 / x.
    fn reciprocal(self) -> Self;
    /// Returns |x|^2.
    fn square(self) -> f64;
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn times(self, real: f64) -> Self {
        self * real
    }
    fn reciprocal(self) -> Self {
        self.recip()
    }
    fn square(self) -> f64 {
        self * self
    }
}

impl Scalar for Complex<f64> {
    const ZERO: Self = Self::new(0.0, 0.0);
    const ONE: Self = Self::new(1.0, 0.0);
    fn times(self, real: f64) -> Self {
        self * real
    }
    fn reciprocal(self) -> Self {
        self.inv()
    }
    fn square(self) -> f64 {
        self.norm_sqr()
    }
}

/// Sum of a_k A_k kron I, stored as factors, matrices and sizes of the identities.
#[derive(Debug, Clone)]
pub struct MatrixSum<'a, T> {
    terms: Vec<(T, &'a SymmetricMatrix, usize)>,
}

impl<'a, T: Scalar> MatrixSum<'a, T> {
    /// Creates the sum of `terms`.
    ///
    /// # Panics
    /// If there are no terms, or their sizes differ.
    pub fn new(terms: Vec<(T, &'a SymmetricMatrix, usize)>) -> Self {
        assert!(
            terms.windows(2).all(|pair| pair[0].1.n() * pair[0].2 == pair[1].1.n() * pair[1].2),
            "sizes of a sum"
        );
        assert!(!terms.is_empty(), "a sum of something");
        Self { terms }
    }

    /// Returns the number of rows.
    pub fn n(&self) -> usize {
        self.terms[0].1.n() * self.terms[0].2
    }

    /// Calls `see` with column and value of every entry of a row, matrix by matrix.
    pub fn for_row(&self, row: usize, mut see: impl FnMut(usize, T)) {
        for (factor, matrix, block) in &self.terms {
            let (columns, values) = matrix.row(row / block);
            for (&column, &value) in columns.iter().zip(values) {
                see(block * column as usize + row % block, factor.times(value));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CscMatrix, multiply_vector};
    use nalgebra::Complex;

    fn number(i: usize) -> f64 {
        ((i * 37 + 11) % 101) as f64 / 101.0 - 0.4
    }

    /// Returns the sum of v v' for vectors of a few entries each: semidefinite, with a rank of at most `vectors`.
    fn gram(n: usize, vectors: usize) -> SymmetricMatrix {
        let mut triplets = Vec::new();
        for v in 0..vectors {
            let entries: Vec<(u32, f64)> =
                (0..4).map(|k| (((v * 7 + k * (3 + v % 5)) % n) as u32, 1.0 + number(v + 13 * k))).collect();
            for &(i, a) in &entries {
                triplets.extend(entries.iter().map(|&(j, b)| (i, j, a * b)));
            }
        }
        SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &triplets))
    }

    fn residual(a: &SymmetricMatrix, block: usize, x: &[f64], b: &[f64]) -> f64 {
        let mut product = vec![0.0; x.len()];
        multiply_vector(a, block, x, &mut product);
        product.iter().zip(b).map(|(p, b)| (p - b).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn solutions_fulfil_their_equations() {
        for n in [1, 2, 9, 60] {
            let a = gram(n, 3 * n).with_diagonal(|_, d| d + 0.5).expect("a full diagonal");
            let factor = SparseLdl::new(&a, 1e-9).expect("definite");
            assert_eq!((factor.n(), factor.null_rows()), (n, &[][..]));
            for block in 1..=3 {
                let b: Vec<f64> = (0..n * block).map(number).collect();
                let (mut x, mut scratch) = (b.clone(), vec![0.0; b.len()]);
                factor.solve_in_place(block, &mut x, &mut scratch);
                assert!(residual(&a, block, &x, &b) < 1e-12, "{n} rows, {block} components");
            }
        }
    }

    #[test]
    fn null_vectors_are_found_and_ranges_are_solved() {
        // Rank 40 of 60 rows; the last row is empty.
        let whole = gram(59, 40);
        let entries: Vec<(u32, u32, f64)> = (0..59)
            .flat_map(|j| {
                let (rows, values) = whole.row(j);
                rows.iter().zip(values).map(move |(&i, &v)| (i, j as u32, v)).collect::<Vec<_>>()
            })
            .collect();
        let a = SymmetricMatrix::new(CscMatrix::from_triplets(60, 60, &entries)).expect("symmetric");
        let factor = SparseLdl::new(&a, 1e-9).expect("semidefinite");
        assert_eq!(factor.null_rows().len(), 20);
        assert!(factor.null_rows().contains(&59));
        let mut scratch = vec![0.0; 60];
        for &row in factor.null_rows() {
            let mut z = vec![0.0; 60];
            z[row] = 1.0;
            factor.solve_in_place(1, &mut z, &mut scratch);
            let size = z.iter().map(|z| z * z).sum::<f64>().sqrt();
            assert!(residual(&a, 1, &z, &[0.0; 60]) < 1e-11 * size, "row {row}");
        }
        let any: Vec<f64> = (0..60).map(number).collect();
        let mut b = vec![0.0; 60];
        multiply_vector(&a, 1, &any, &mut b);
        let mut x = b.clone();
        factor.solve_in_place(1, &mut x, &mut scratch);
        assert!(residual(&a, 1, &x, &b) < 1e-11);
        assert!(factor.null_rows().iter().all(|&row| x[row].abs() < 1e-11));
    }

    #[test]
    fn complex_sums_are_solved() {
        let (stiffness, mass) = (gram(60, 180), gram(20, 80));
        let z = Complex::new(0.142, 0.136);
        let one = Complex::new(1.0, 0.0);
        let pencil = Pencil::new(&stiffness, &mass, 3);
        for damping in [0.0, 0.3] {
            let terms = vec![(one, &mass, 3), (z * z + z * damping, &stiffness, 1)];
            let sum = MatrixSum::new(terms);
            let factor = SparseLdl::of_sum(&sum, &pencil).expect("regular");
            let b: Vec<Complex<f64>> = (0..60).map(|i| Complex::new(number(i), number(i + 7))).collect();
            let (mut x, mut scratch) = (b.clone(), b.clone());
            factor.solve_in_place(1, &mut x, &mut scratch);
            for (i, b) in b.iter().enumerate() {
                let mut left = *b;
                sum.for_row(i, |j, entry| left -= entry * x[j]);
                assert!(left.norm() < 1e-12, "row {i}: {left}");
            }
        }
        let twice = MatrixSum::new(vec![(1.0, &stiffness, 1), (-1.0, &stiffness, 1)]);
        assert!(SparseLdl::of_sum(&twice, &pencil).is_none());
    }

    #[test]
    fn indefinite_matrices_are_refused() {
        for values in [[1.0, 2.0, 1.0], [1.0, 0.0, -1.0], [0.0, 1.0, 0.0]] {
            let [p, q, r] = values;
            let triplets = [(0, 0, p), (0, 1, q), (1, 0, q), (1, 1, r)];
            let a = SymmetricMatrix::new(CscMatrix::from_triplets(2, 2, &triplets)).expect("symmetric");
            assert!(SparseLdl::new(&a, 1e-9).is_none(), "{values:?}");
        }
    }
}

//! Compressed sparse matrices: the general form that readers deliver, and the symmetric form of all computations. Their
//! numbers are owned, or borrowed from a lender such as a memory-mapped file.

use super::parallel;
use std::fmt::{Debug, Formatter};
use std::ops::{Deref, Range};
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::sync::Arc;

/// Number of columns per parallel task.
const COLUMNS_PER_TASK: usize = 4096;

/// Sparse matrix in compressed column form. Rows ascend within each column, without duplicates. Zeros are stored only
/// if [`CscMatrix::from_parts`] received them. The default has no rows and no columns.
#[derive(Debug, Clone, PartialEq)]
pub struct CscMatrix {
    n_rows: usize,
    n_cols: usize,
    col_ptr: Vec<usize>,
    row_idx: Stored<u32>,
    values: Stored<f64>,
}

impl Default for CscMatrix {
    fn default() -> Self {
        Self { n_rows: 0, n_cols: 0, col_ptr: vec![0], row_idx: Vec::new().into(), values: Vec::new().into() }
    }
}

impl CscMatrix {
    /// Creates a matrix from its three arrays, zeros included.
    ///
    /// # Panics
    /// If the arrays do not describe a matrix: lengths that disagree, rows out of range or not strictly ascending
    /// within a column. Readers check and report errors before they call this function.
    pub fn from_parts(
        n_rows: usize,
        n_cols: usize,
        col_ptr: Vec<usize>,
        row_idx: impl Into<Stored<u32>>,
        values: impl Into<Stored<f64>>,
    ) -> Self {
        let (row_idx, values) = (row_idx.into(), values.into());
        assert_eq!(col_ptr.len(), n_cols + 1, "column pointers");
        assert_eq!(col_ptr[0], 0, "first column pointer");
        assert_eq!(*col_ptr.last().expect("n_cols + 1 >= 1"), row_idx.len(), "entries");
        assert_eq!(row_idx.len(), values.len(), "values");
        parallel::for_each(parallel::ranges(n_cols, COLUMNS_PER_TASK), |columns| {
            for j in columns {
                let rows = &row_idx[col_ptr[j]..col_ptr[j + 1]];
                assert!(rows.is_sorted_by(|a, b| a < b), "rows of column {j} not ascending");
                assert!(rows.last().is_none_or(|&r| (r as usize) < n_rows), "row out of range");
            }
        });
        Self { n_rows, n_cols, col_ptr, row_idx, values }
    }

    /// Builds a matrix from (row, column, value) triplets. Duplicates are summed in the given order; zeros are dropped,
    /// including sums that cancel.
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn from_triplets(n_rows: usize, n_cols: usize, triplets: &[(u32, u32, f64)]) -> Self {
        // Count the entries of each column, then distribute them.
        let mut count = vec![0usize; n_cols + 1];
        for &(r, c, v) in triplets {
            assert!((r as usize) < n_rows && (c as usize) < n_cols, "triplet out of range");
            if v != 0.0 {
                count[c as usize + 1] += 1;
            }
        }
        for j in 0..n_cols {
            count[j + 1] += count[j];
        }
        let mut next = count.clone();
        let mut entries = vec![(0u32, 0.0f64); count[n_cols]];
        for &(r, c, v) in triplets {
            if v != 0.0 {
                entries[next[c as usize]] = (r, v);
                next[c as usize] += 1;
            }
        }
        let (mut col_ptr, mut row_idx, mut values) = (vec![0usize], Vec::new(), Vec::new());
        for j in 0..n_cols {
            let column = &mut entries[count[j]..count[j + 1]];
            column.sort_by_key(|e| e.0); // stable: duplicates keep their order
            for same in column.chunk_by(|a, b| a.0 == b.0) {
                let sum: f64 = same.iter().map(|e| e.1).sum();
                if sum != 0.0 {
                    row_idx.push(same[0].0);
                    values.push(sum);
                }
            }
            col_ptr.push(row_idx.len());
        }
        Self::made(n_rows, n_cols, col_ptr, row_idx, values)
    }

    /// Creates a matrix from arrays that are known to be valid.
    fn made(n_rows: usize, n_cols: usize, col_ptr: Vec<usize>, row_idx: Vec<u32>, values: Vec<f64>) -> Self {
        Self { n_rows, n_cols, col_ptr, row_idx: row_idx.into(), values: values.into() }
    }

    /// Converts a compressed matrix of the `sprs` crate (row or column storage).
    pub fn from_sprs(matrix: &sprs::CsMat<f64>) -> Self {
        let csc = matrix.to_csc();
        let (n_rows, n_cols) = (csc.rows(), csc.cols());
        let mut triplets = Vec::with_capacity(csc.nnz());
        for (value, (r, c)) in csc.iter() {
            triplets.push((r as u32, c as u32, *value));
        }
        Self::from_triplets(n_rows, n_cols, &triplets)
    }

    /// Returns the number of rows.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Returns the number of columns.
    pub fn n_cols(&self) -> usize {
        self.n_cols
    }

    /// Returns true if the numbers are borrowed, for example from a file.
    pub fn is_lent(&self) -> bool {
        matches!((&self.row_idx, &self.values), (Stored::Lent(_), Stored::Lent(_)))
    }

    /// Returns the number of stored entries.
    pub fn nnz(&self) -> usize {
        self.values.len()
    }

    /// Returns the `n_cols + 1` column pointers.
    pub fn col_ptr(&self) -> &[usize] {
        &self.col_ptr
    }

    /// Returns the row of each entry.
    pub fn row_idx(&self) -> &[u32] {
        &self.row_idx
    }

    /// Returns the value of each entry.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns rows and values of column `j`.
    pub fn column(&self, j: usize) -> (&[u32], &[f64]) {
        let range = self.col_ptr[j]..self.col_ptr[j + 1];
        (&self.row_idx[range.clone()], &self.values[range])
    }

    /// Returns row, column and value of every stored entry, column by column.
    pub fn triplets(&self) -> impl Iterator<Item = (u32, u32, f64)> + '_ {
        (0..self.n_cols).flat_map(move |j| {
            let (rows, values) = self.column(j);
            rows.iter().zip(values).map(move |(&row, &value)| (row, j as u32, value))
        })
    }

    /// Returns the entry at (`row`, `col`); zero if it is not stored.
    pub fn get(&self, row: usize, col: usize) -> f64 {
        let (rows, values) = self.column(col);
        rows.binary_search(&(row as u32)).map_or(0.0, |k| values[k])
    }

    /// Returns the square matrix with row and column i moved to `to[i]`. Rows with `to[i] == u32::MAX`, which must have
    /// no entries, are left out.
    ///
    /// # Panics
    /// If `to` is not a permutation of the remaining rows, or a row that is left out has entries.
    pub fn permuted(&self, to: &[u32]) -> Self {
        assert!(self.n_rows == self.n_cols && to.len() == self.n_cols, "permutation of a square matrix");
        let stays = |new: &u32| *new != u32::MAX;
        let n = to.iter().filter(|new| stays(new)).count();
        // Inverse permutation, then column pointers, then the columns in parallel.
        let mut from = vec![u32::MAX; n];
        for (old, &new) in to.iter().enumerate().filter(|(_, new)| stays(new)) {
            from[new as usize] = old as u32;
        }
        let mut col_ptr = vec![0usize; n + 1];
        for (new, &old) in from.iter().enumerate() {
            col_ptr[new + 1] = col_ptr[new] + self.column(old as usize).0.len();
        }
        let (mut row_idx, mut values) = (vec![0u32; self.nnz()], vec![0.0; self.nnz()]);
        let cuts: Vec<usize> = (0..n).step_by(COLUMNS_PER_TASK).chain([n]).collect();
        parallel::for_each(split_columns(&col_ptr, &cuts, &mut row_idx, &mut values), |block| {
            let mut entries: Vec<(u32, f64)> = Vec::new();
            let mut at = 0;
            for &old in &from[block.columns] {
                let (rows, vals) = self.column(old as usize);
                entries.clear();
                entries.extend(rows.iter().zip(vals).map(|(&r, &v)| (to[r as usize], v)));
                entries.sort_unstable_by_key(|e| e.0);
                for &(row, value) in &entries {
                    block.rows[at] = row;
                    block.values[at] = value;
                    at += 1;
                }
            }
        });
        Self::made(n, n, col_ptr, row_idx, values)
    }

    /// Returns true if pattern and values are exactly symmetric.
    pub fn is_symmetric(&self) -> bool {
        let n = self.n_cols;
        // Each task has one cursor per column, so that few long ranges are best.
        let length = n.div_ceil(16).max(COLUMNS_PER_TASK);
        let surplus = |columns| self.lower_surplus(columns).ok_or(());
        self.n_rows == n
            && parallel::try_map(parallel::ranges(n, length), surplus)
                .is_ok_and(|all| all.iter().sum::<i64>() == 0)
    }

    /// Returns the number of entries below the diagonal minus that above it, in some columns. Returns `None` if an
    /// entry below has no equal one at the mirrored position.
    fn lower_surplus(&self, columns: Range<usize>) -> Option<i64> {
        let mut surplus = 0;
        // Ascending columns j meet the mirrored entries (j, i) of column i in ascending order.
        let mut cursor = vec![0u32; self.n_cols];
        for j in columns.clone() {
            let (rows, values) = self.column(j);
            let below = rows.partition_point(|&r| r as usize <= j);
            surplus -= rows[..below].iter().filter(|&&r| r as usize != j).count() as i64;
            surplus += (rows.len() - below) as i64;
            for (&i, &value) in rows[below..].iter().zip(&values[below..]) {
                let (mirrored, mirrored_values) = self.column(i as usize);
                let at = &mut cursor[i as usize];
                if *at == 0 {
                    *at = mirrored.partition_point(|&r| (r as usize) < columns.start) as u32;
                }
                if mirrored.get(*at as usize) != Some(&(j as u32)) || mirrored_values[*at as usize] != value {
                    return None;
                }
                *at += 1;
            }
        }
        Some(surplus)
    }

    /// Returns the transpose.
    pub fn transpose(&self) -> Self {
        let mut col_ptr = vec![0usize; self.n_rows + 1];
        for &r in self.row_idx.iter() {
            col_ptr[r as usize + 1] += 1;
        }
        for i in 0..self.n_rows {
            col_ptr[i + 1] += col_ptr[i];
        }
        let mut next = col_ptr.clone();
        let mut row_idx = vec![0u32; self.nnz()];
        let mut values = vec![0.0; self.nnz()];
        for j in 0..self.n_cols {
            let (rows, vals) = self.column(j);
            for (&r, &v) in rows.iter().zip(vals) {
                let at = &mut next[r as usize];
                row_idx[*at] = j as u32;
                values[*at] = v;
                *at += 1;
            }
        }
        Self::made(self.n_cols, self.n_rows, col_ptr, row_idx, values)
    }
}

impl CscMatrix {
    /// Removes the entries that are zero.
    fn drop_zeros(&mut self) {
        if self.values.iter().all(|value| *value != 0.0) {
            return;
        }
        let (row_idx, values) = (self.row_idx.to_mut(), self.values.to_mut());
        let (mut from, mut to) = (0, 0);
        for j in 0..self.n_cols {
            let end = self.col_ptr[j + 1];
            while from < end {
                if values[from] != 0.0 {
                    (row_idx[to], values[to]) = (row_idx[from], values[from]);
                    to += 1;
                }
                from += 1;
            }
            self.col_ptr[j + 1] = to;
        }
        row_idx.truncate(to);
        values.truncate(to);
    }
}

/// Symmetric sparse matrix with both triangles stored. Column j is also row j, so that products gather row by row with
/// an order of sums that does not depend on the number of threads.
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricMatrix(CscMatrix);

impl SymmetricMatrix {
    /// Wraps a matrix whose pattern and values are exactly symmetric; `None` for any other.
    pub fn new(matrix: CscMatrix) -> Option<Self> {
        Self::try_from(matrix).ok()
    }

    /// Returns the mean of a nearly symmetric matrix and its transpose, without entries that cancel. If both have one
    /// pattern, this needs no additional memory.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn symmetrised(mut matrix: CscMatrix) -> Self {
        assert_eq!(matrix.n_rows, matrix.n_cols, "square");
        let mut cursor: Vec<usize> = matrix.col_ptr[..matrix.n_cols].to_vec();
        for j in 0..matrix.n_cols {
            for at in matrix.col_ptr[j]..matrix.col_ptr[j + 1] {
                let i = matrix.row_idx[at] as usize;
                if i <= j {
                    continue;
                }
                // Ascending columns j meet the mirrored entries (j, i) of column i in ascending order.
                let mirrored = cursor[i];
                if mirrored == matrix.col_ptr[i + 1] || matrix.row_idx[mirrored] as usize != j {
                    // Entries that are already means keep their values.
                    return Self::symmetrised_by_transpose(&matrix);
                }
                cursor[i] += 1;
                let values = matrix.values.to_mut();
                let mean = 0.5 * (values[at] + values[mirrored]);
                (values[at], values[mirrored]) = (mean, mean);
            }
            // A remaining entry above the diagonal has none below.
            let end = matrix.col_ptr[j + 1];
            let above = matrix.row_idx[cursor[j]..end].first().is_some_and(|&row| (row as usize) < j);
            if above {
                return Self::symmetrised_by_transpose(&matrix);
            }
        }
        matrix.drop_zeros();
        Self(matrix)
    }

    fn symmetrised_by_transpose(matrix: &CscMatrix) -> Self {
        let transpose = matrix.transpose();
        let n = matrix.n_cols;
        let (mut col_ptr, mut row_idx, mut values) = (vec![0usize], Vec::new(), Vec::new());
        for j in 0..n {
            let (ra, va) = matrix.column(j);
            let (rb, vb) = transpose.column(j);
            // Merge two ascending columns.
            let (mut a, mut b) = (0, 0);
            while a < ra.len() || b < rb.len() {
                let row = match (ra.get(a), rb.get(b)) {
                    (Some(&x), Some(&y)) => x.min(y),
                    (Some(&x), None) => x,
                    (None, Some(&y)) => y,
                    (None, None) => break,
                };
                let mut sum = 0.0;
                if ra.get(a) == Some(&row) {
                    sum += va[a];
                    a += 1;
                }
                if rb.get(b) == Some(&row) {
                    sum += vb[b];
                    b += 1;
                }
                if sum != 0.0 {
                    row_idx.push(row);
                    values.push(0.5 * sum);
                }
            }
            col_ptr.push(row_idx.len());
        }
        Self(CscMatrix::made(n, n, col_ptr, row_idx, values))
    }

    /// Returns the number of rows and columns.
    pub fn n(&self) -> usize {
        self.0.n_cols
    }

    /// Returns the matrix in compressed column (and row) form.
    pub fn as_csc(&self) -> &CscMatrix {
        &self.0
    }

    /// Returns columns and values of row `i`.
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        self.0.column(i)
    }

    /// Returns the diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        parallel::values(self.n(), COLUMNS_PER_TASK, |i| self.0.get(i, i))
    }

    /// Returns the submatrix of some rows, ascending, and the corresponding columns.
    ///
    /// # Panics
    /// If the rows do not ascend or exceed the matrix.
    pub fn principal(&self, rows: &[usize]) -> Self {
        assert!(rows.is_sorted_by(|a, b| a < b), "rows ascend");
        let n = rows.len();
        let (mut col_ptr, mut row_idx, mut values) = (vec![0usize], Vec::new(), Vec::new());
        for &row in rows {
            let (columns, entries) = self.row(row);
            for (&j, &v) in columns.iter().zip(entries) {
                if let Ok(local) = rows.binary_search(&(j as usize)) {
                    row_idx.push(local as u32);
                    values.push(v);
                }
            }
            col_ptr.push(row_idx.len());
        }
        Self(CscMatrix::made(n, n, col_ptr, row_idx, values))
    }

    /// Returns D A D for a diagonal D.
    ///
    /// # Panics
    /// If the size of D differs.
    pub fn scaled(&self, diagonal: &[f64]) -> Self {
        assert_eq!(diagonal.len(), self.n(), "one factor per row");
        let mut matrix = self.0.clone();
        let values = matrix.values.to_mut();
        for j in 0..self.n() {
            let range = self.0.col_ptr[j]..self.0.col_ptr[j + 1];
            for (&i, v) in self.0.row_idx[range.clone()].iter().zip(&mut values[range]) {
                // Multiply the factors first, so that both sides of the diagonal have the same bits.
                *v *= diagonal[i as usize] * diagonal[j];
            }
        }
        Self(matrix)
    }

    /// Returns the matrix with each stored diagonal entry a_ii replaced by `f(i, a_ii)`; `None` if a diagonal entry is
    /// not stored.
    pub fn with_diagonal(&self, f: impl Fn(usize, f64) -> f64) -> Option<Self> {
        let mut matrix = self.clone();
        let values = matrix.0.values.to_mut();
        for i in 0..self.n() {
            let at = self.0.col_ptr[i] + self.row(i).0.binary_search(&(i as u32)).ok()?;
            values[at] = f(i, self.0.values[at]);
        }
        Some(matrix)
    }

    /// Returns the matrix with every positive diagonal entry multiplied by `factor`, and every other diagonal entry
    /// replaced by one.
    pub(super) fn with_raised_diagonal(&self, factor: f64) -> Self {
        if self.diagonal().iter().all(|&d| d > 0.0)
            && let Some(raised) = self.with_diagonal(|_, d| d * factor)
        {
            return raised;
        }
        let mut triplets = Vec::with_capacity(self.0.nnz() + self.n());
        for j in 0..self.n() {
            let (rows, values) = self.row(j);
            triplets.extend(
                rows.iter().zip(values).filter(|(r, _)| **r as usize != j).map(|(&r, &v)| (r, j as u32, v)),
            );
            let diagonal = self.0.get(j, j);
            triplets.push((j as u32, j as u32, if diagonal > 0.0 { diagonal * factor } else { 1.0 }));
        }
        Self(CscMatrix::from_triplets(self.n(), self.n(), &triplets))
    }
}

impl TryFrom<CscMatrix> for SymmetricMatrix {
    /// The rejected matrix, unchanged.
    type Error = CscMatrix;

    /// Wraps a matrix whose pattern and values are exactly symmetric, and returns any other.
    fn try_from(matrix: CscMatrix) -> Result<Self, CscMatrix> {
        if matrix.is_symmetric() { Ok(Self(matrix)) } else { Err(matrix) }
    }
}

/// Consecutive columns of a matrix under construction.
pub struct ColumnBlock<'a> {
    /// Range of the columns.
    pub columns: Range<usize>,
    /// Row indices of these columns.
    pub rows: &'a mut [u32],
    /// Values of these columns.
    pub values: &'a mut [f64],
}

/// Splits the entries of a matrix at the columns `cuts`.
pub fn split_columns<'a>(
    col_ptr: &[usize],
    cuts: &[usize],
    mut row_idx: &'a mut [u32],
    mut values: &'a mut [f64],
) -> Vec<ColumnBlock<'a>> {
    let mut blocks = Vec::with_capacity(cuts.len());
    for cut in cuts.windows(2) {
        let share = col_ptr[cut[1]] - col_ptr[cut[0]];
        let (rows, rows_left) = row_idx.split_at_mut(share);
        let (vals, values_left) = values.split_at_mut(share);
        (row_idx, values) = (rows_left, values_left);
        blocks.push(ColumnBlock { columns: cut[0]..cut[1], rows, values: vals });
    }
    blocks
}

/// Owner of borrowed numbers, which must never change.
pub trait Lender<T>: AsRef<[T]> + Send + Sync + UnwindSafe + RefUnwindSafe {}

impl<T, L: AsRef<[T]> + Send + Sync + UnwindSafe + RefUnwindSafe> Lender<T> for L {}

/// List of numbers. Borrowed numbers are copied before they are changed.
#[derive(Clone)]
pub enum Stored<T: 'static> {
    /// Owned numbers.
    Owned(Vec<T>),
    /// Numbers borrowed from a lender.
    Lent(Arc<dyn Lender<T>>),
}

impl<T: Clone> Stored<T> {
    /// Returns the numbers for writing; copies borrowed ones first.
    fn to_mut(&mut self) -> &mut Vec<T> {
        if let Self::Lent(lent) = self {
            *self = Self::Owned((**lent).as_ref().to_vec());
        }
        match self {
            Self::Owned(values) => values,
            Self::Lent(_) => unreachable!("a copy was taken"),
        }
    }
}

impl<T> Deref for Stored<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match self {
            Self::Owned(values) => values,
            Self::Lent(lent) => (**lent).as_ref(),
        }
    }
}

impl<T> From<Vec<T>> for Stored<T> {
    fn from(values: Vec<T>) -> Self {
        Self::Owned(values)
    }
}

impl<T: PartialEq> PartialEq for Stored<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Debug> Debug for Stored<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_that_cancel_are_not_stored() {
        let entries = [(0, 0, 2.0), (1, 0, 0.5), (1, 0, -0.5), (1, 1, 0.0), (0, 1, 0.25), (0, 1, 0.25)];
        let matrix = CscMatrix::from_triplets(2, 2, &entries);
        assert_eq!((matrix.nnz(), matrix.get(0, 0), matrix.get(0, 1)), (2, 2.0, 0.5));
        let skew = CscMatrix::from_triplets(2, 2, &[(0, 0, 1.0), (0, 1, 3.0), (1, 0, -3.0)]);
        assert_eq!(SymmetricMatrix::symmetrised(skew).as_csc().nnz(), 1);
    }

    #[test]
    fn the_mean_with_the_transpose_is_the_same_in_place_and_beside_the_matrix() {
        let value = |k: u32| if k.is_multiple_of(13) { 0.0 } else { f64::from(k).sin() };
        let band = |i: u32, j: u32| (i, j, value(31 * i + 7 * j));
        let all = |i: u32| (i.saturating_sub(3)..(i + 4).min(50)).map(move |j| band(i, j));
        let mut entries: Vec<_> = (0..50).flat_map(all).collect();
        // The following two cancel.
        entries.retain(|(i, j, _)| (*i, *j) != (20, 21) && (*i, *j) != (21, 20));
        entries.extend([(20, 21, 1.5), (21, 20, -1.5)]);
        let both = CscMatrix::from_triplets(50, 50, &entries);
        for extra in [vec![], vec![(0, 40, 2.0)], vec![(40, 0, 2.0)], vec![(49, 0, 1.0), (3, 30, 1.0)]] {
            let more: Vec<_> = entries.iter().copied().chain(extra).collect();
            let matrix = CscMatrix::from_triplets(50, 50, &more);
            let beside = SymmetricMatrix::symmetrised_by_transpose(&matrix);
            assert_eq!(SymmetricMatrix::symmetrised(matrix), beside);
        }
        let mean = SymmetricMatrix::symmetrised(both);
        assert!(mean.as_csc().is_symmetric());
        assert_eq!(mean.as_csc().get(20, 21), 0.0);
    }

    /// Returns the entries of a banded symmetric matrix of several tasks.
    fn banded(n: usize) -> Vec<(u32, u32, f64)> {
        let value = |i: usize, j: usize| ((i.min(j) * 7 + i.max(j)) as f64).sin() + 2.0;
        (0..n)
            .flat_map(|j| [j, j + 1, j + 5, j + 3000].map(|i| (i, j)))
            .filter(|&(i, _)| i < n)
            .flat_map(|(i, j)| [(i as u32, j as u32, value(i, j)), (j as u32, i as u32, value(i, j))])
            .collect()
    }

    #[test]
    fn symmetry_is_found_and_every_single_flaw_is_too() {
        const N: usize = 3 * COLUMNS_PER_TASK + 17;
        let entries = banded(N);
        let matrix = CscMatrix::from_triplets(N, N, &entries);
        assert!(matrix.is_symmetric());
        assert_eq!(matrix, matrix.transpose());
        for at in [
            (1, 0),
            (N - 1, N - 2),
            (3000 + 4095, 4095),
            (4096, 4096 + 5),
            (COLUMNS_PER_TASK, COLUMNS_PER_TASK - 1),
        ] {
            let at = (at.0 as u32, at.1 as u32);
            let missing: Vec<_> = entries.iter().filter(|e| (e.0, e.1) != at).copied().collect();
            assert!(!CscMatrix::from_triplets(N, N, &missing).is_symmetric(), "{at:?} missing");
            let changed = entries.iter().map(|&(r, c, v)| (r, c, if (r, c) == at { v + 1e-15 } else { v }));
            assert!(
                !CscMatrix::from_triplets(N, N, &changed.collect::<Vec<_>>()).is_symmetric(),
                "{at:?} changed"
            );
        }
        let wide = CscMatrix::from_triplets(2, 3, &[(0, 0, 1.0)]);
        assert!(!wide.is_symmetric());
        let given_back = SymmetricMatrix::try_from(wide.clone()).unwrap_err();
        assert_eq!(given_back, wide);
    }

    #[test]
    fn a_permuted_matrix_has_its_entries_where_they_belong() {
        const N: usize = COLUMNS_PER_TASK + 100;
        let matrix = CscMatrix::from_triplets(N, N, &banded(N));
        let to: Vec<u32> = (0..N).map(|i| (i * 3001 % N) as u32).collect(); // 3001 is prime to N
        let permuted = matrix.permuted(&to);
        assert!(permuted.is_symmetric());
        for j in (0..N).step_by(13) {
            let (rows, values) = matrix.column(j);
            assert_eq!(permuted.column(to[j] as usize).0.len(), rows.len());
            for (&i, &v) in rows.iter().zip(values) {
                assert_eq!(permuted.get(to[i as usize] as usize, to[j] as usize), v);
            }
        }
    }
}

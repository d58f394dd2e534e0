//! Symmetric pencil K - sigma M with M = Ms kron I_block, the input of the eigen-solver; and the elimination of its
//! dependent rows: u = T y, K -> T' K T, M -> T' M T.

use super::tall::zeros;
use super::{CscMatrix, SymmetricMatrix, combine, gram, multiply, parallel};
use faer::{Mat, MatMut, MatRef};

/// Stiffness K (N x N) and mass M = Ms kron I_block (Ms: N/block x N/block), with their products.
#[derive(Debug, Clone, Copy)]
pub struct Pencil<'a> {
    stiffness: &'a SymmetricMatrix,
    mass: &'a SymmetricMatrix,
    block: usize,
}

impl<'a> Pencil<'a> {
    /// Creates the pencil of `stiffness` and `mass` kron I_block.
    ///
    /// # Panics
    /// If the sizes do not match.
    pub fn new(stiffness: &'a SymmetricMatrix, mass: &'a SymmetricMatrix, block: usize) -> Self {
        assert_eq!(stiffness.n(), mass.n() * block, "sizes of a pencil");
        Self { stiffness, mass, block }
    }

    /// Returns the number of rows N.
    pub fn n(&self) -> usize {
        self.stiffness.n()
    }

    /// Returns K.
    pub fn stiffness(&self) -> &'a SymmetricMatrix {
        self.stiffness
    }

    /// Returns Ms.
    pub fn mass(&self) -> &'a SymmetricMatrix {
        self.mass
    }

    /// Returns the number of components per node.
    pub fn block(&self) -> usize {
        self.block
    }

    /// Returns K X.
    pub fn apply_stiffness(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = zeros(x.nrows(), x.ncols());
        self.stiffness_times(x, y.as_mut());
        y
    }

    /// Returns M X.
    pub fn apply_mass(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = zeros(x.nrows(), x.ncols());
        self.mass_times(x, y.as_mut());
        y
    }

    /// Computes Y = K X.
    pub fn stiffness_times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>) {
        multiply(self.stiffness, 1, x, y);
    }

    /// Computes Y = M X.
    pub fn mass_times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>) {
        multiply(self.mass, self.block, x, y);
    }

    /// Returns the diagonal of M, row by row.
    pub fn mass_diagonal(&self) -> Vec<f64> {
        self.mass.diagonal().into_iter().flat_map(|m| std::iter::repeat_n(m, self.block)).collect()
    }
}

/// Number of columns per parallel task.
const COLUMNS_PER_TASK: usize = 2048;

/// Transformation T (N x m). The free rows of u are y, dependent rows are linear combinations of free ones, all others
/// are zero.
#[derive(Debug, Clone)]
pub struct Elimination {
    n: usize,
    free: Vec<u32>,
    dependents: Vec<Dependents>,
    /// Role of each row: its index in y, or its place among the dependent rows.
    kinds: Vec<RowRole>,
}

/// Rows that depend on common free rows: u\[rows\] = W u\[on\].
#[derive(Debug, Clone)]
pub struct Dependents {
    /// Indices of the dependent rows.
    pub rows: Vec<usize>,
    /// Indices of the free rows on which they depend.
    pub on: Vec<usize>,
    /// Weights W (rows x on).
    pub weights: Mat<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum RowRole {
    Zero,
    Free(u32),
    Dependent(u32, u32),
}

/// Reduced pencil (T' K T, T' M T), owned.
#[derive(Debug, Clone)]
pub struct ReducedPencil {
    stiffness: SymmetricMatrix,
    mass: SymmetricMatrix,
    block: usize,
}

impl ReducedPencil {
    /// Returns the bytes of both matrices.
    pub fn bytes(&self) -> u64 {
        12 * (self.stiffness.as_csc().nnz() + self.mass.as_csc().nnz()) as u64
    }

    /// Returns the matrices as a pencil.
    pub fn pencil(&self) -> Pencil<'_> {
        Pencil::new(&self.stiffness, &self.mass, self.block)
    }
}

impl Elimination {
    /// Builds T for `n` rows: the rows `zero` are zero, `dependents` depend on others, and all other rows are free.
    ///
    /// # Panics
    /// If a row is given twice, or a row depends on one that is not free.
    pub fn new(n: usize, zero: &[usize], dependents: Vec<Dependents>) -> Self {
        let mut kinds = vec![RowRole::Free(0); n];
        let mut set = |row: usize, kind: RowRole| {
            assert_eq!(kinds[row], RowRole::Free(0), "row {row} is eliminated twice");
            kinds[row] = kind;
        };
        zero.iter().for_each(|&row| set(row, RowRole::Zero));
        for (group, dependent) in dependents.iter().enumerate() {
            let rows = dependent.rows.iter().enumerate();
            rows.for_each(|(place, &row)| set(row, RowRole::Dependent(group as u32, place as u32)));
        }
        let mut free = Vec::new();
        for (row, kind) in kinds.iter_mut().enumerate() {
            if let RowRole::Free(place) = kind {
                *place = free.len() as u32;
                free.push(row as u32);
            }
        }
        let on_free =
            dependents.iter().flat_map(|d| &d.on).all(|&row| matches!(kinds[row], RowRole::Free(_)));
        assert!(on_free, "a row depends on one that is not free");
        Self { n, free, dependents, kinds }
    }

    /// Returns the number m of free rows.
    pub fn len(&self) -> usize {
        self.free.len()
    }

    /// Returns true if no row is free.
    pub fn is_empty(&self) -> bool {
        self.free.is_empty()
    }

    /// Returns y, the free rows of u (N x k).
    pub fn free_rows(&self, u: MatRef<'_, f64>) -> Mat<f64> {
        Mat::from_fn(self.len(), u.ncols(), |i, j| u[(self.free[i] as usize, j)])
    }

    /// Returns T y (N x k).
    pub fn expand(&self, y: MatRef<'_, f64>) -> Mat<f64> {
        let mut u = Mat::zeros(self.n, y.ncols());
        for j in 0..y.ncols() {
            for (i, &row) in self.free.iter().enumerate() {
                u[(row as usize, j)] = y[(i, j)];
            }
        }
        for Dependents { rows, on, weights } in &self.dependents {
            let given = Mat::from_fn(on.len(), y.ncols(), |i, j| u[(on[i], j)]);
            let sums = combine(weights.as_ref(), given.as_ref());
            for j in 0..y.ncols() {
                rows.iter().enumerate().for_each(|(i, &row)| u[(row, j)] = sums[(i, j)]);
            }
        }
        u
    }

    /// Returns T' f (m x k).
    pub fn restrict(&self, f: MatRef<'_, f64>) -> Mat<f64> {
        let mut out = self.free_rows(f);
        for Dependents { rows, on, weights } in &self.dependents {
            let given = Mat::from_fn(rows.len(), f.ncols(), |i, j| f[(rows[i], j)]);
            let sums = gram(weights.as_ref(), given.as_ref());
            for j in 0..f.ncols() {
                for (i, &row) in on.iter().enumerate() {
                    out[(self.place(row), j)] += sums[(i, j)];
                }
            }
        }
        out
    }

    /// Returns the reduced pencil. It keeps the block size of `pencil` if nodes are eliminated as a whole.
    ///
    /// # Panics
    /// If the pencil does not have N rows.
    pub fn reduced(&self, pencil: &Pencil<'_>) -> ReducedPencil {
        assert_eq!(pencil.n(), self.n, "rows of the pencil");
        let block = pencil.block();
        let whole = self.kinds.chunks(block).all(|node| {
            node.iter().all(|kind| matches!(kind, RowRole::Free(_)))
                || node.iter().all(|kind| *kind == RowRole::Zero)
        });
        let stiffness = self.congruence(pencil.stiffness(), 1);
        if whole {
            let zero: Vec<usize> =
                (0..self.n / block).filter(|node| self.kinds[node * block] == RowRole::Zero).collect();
            let nodes = Self::new(self.n / block, &zero, Vec::new());
            ReducedPencil { stiffness, mass: nodes.congruence(pencil.mass(), 1), block }
        } else {
            ReducedPencil { stiffness, mass: self.congruence(pencil.mass(), block), block: 1 }
        }
    }

    /// Returns T' (A kron I_block) T.
    fn congruence(&self, a: &SymmetricMatrix, block: usize) -> SymmetricMatrix {
        let m = self.len();
        // Dependent rows that contain each free row, with their weights.
        let mut taken: Vec<Vec<(usize, f64)>> = vec![Vec::new(); m];
        for Dependents { rows, on, weights } in &self.dependents {
            for (i, &row) in rows.iter().enumerate() {
                for (j, &free) in on.iter().enumerate() {
                    taken[self.place(free)].push((row, weights[(i, j)]));
                }
            }
        }
        // Each chunk sums its columns in dense scratch space and stores the touched rows in order.
        let chunk = |first: usize| {
            let mut column = ColumnSums { sums: vec![0.0; m], met: vec![false; m], rows: Vec::new() };
            let (mut lengths, mut row_idx, mut values) = (Vec::new(), Vec::new(), Vec::new());
            let last = (first + COLUMNS_PER_TASK).min(m);
            for (&free_row, others) in self.free[first..last].iter().zip(&taken[first..last]) {
                for (row, weight) in std::iter::once((free_row as usize, 1.0)).chain(others.iter().copied()) {
                    let (nodes, entries) = a.row(row / block);
                    for (&node, &value) in nodes.iter().zip(entries) {
                        self.add(&mut column, node as usize * block + row % block, weight * value);
                    }
                }
                column.rows.sort_unstable();
                lengths.push(column.rows.len());
                for &row in &column.rows {
                    row_idx.push(row);
                    values.push(std::mem::take(&mut column.sums[row as usize]));
                    column.met[row as usize] = false;
                }
                column.rows.clear();
            }
            (lengths, row_idx, values)
        };
        let chunks = parallel::map((0..m).step_by(COLUMNS_PER_TASK), chunk);
        let (mut col_ptr, mut row_idx, mut values) = (vec![0usize], Vec::new(), Vec::new());
        for (lengths, rows, entries) in chunks {
            for length in lengths {
                col_ptr.push(col_ptr[col_ptr.len() - 1] + length);
            }
            row_idx.extend(rows);
            values.extend(entries);
        }
        let matrix = CscMatrix::from_parts(m, m, col_ptr, row_idx, values);
        // Without dependent rows the result is exactly symmetric. Otherwise sums may round differently on both sides of
        // the diagonal.
        SymmetricMatrix::try_from(matrix).unwrap_or_else(SymmetricMatrix::symmetrised)
    }

    /// Adds T' of a vector with `value` in one row and zeros elsewhere.
    fn add(&self, column: &mut ColumnSums, row: usize, value: f64) {
        match self.kinds[row] {
            RowRole::Zero => {}
            RowRole::Free(place) => column.add(place, value),
            RowRole::Dependent(group, i) => {
                let Dependents { on, weights, .. } = &self.dependents[group as usize];
                for (j, &free) in on.iter().enumerate() {
                    column.add(self.place(free) as u32, weights[(i as usize, j)] * value);
                }
            }
        }
    }

    fn place(&self, row: usize) -> usize {
        match self.kinds[row] {
            RowRole::Free(place) => place as usize,
            _ => unreachable!("checked at construction: row {row} is free"),
        }
    }
}

/// Scratch space for the sums of one column.
struct ColumnSums {
    sums: Vec<f64>,
    met: Vec<bool>,
    rows: Vec<u32>,
}

impl ColumnSums {
    fn add(&mut self, row: u32, value: f64) {
        let i = row as usize;
        if !self.met[i] {
            self.met[i] = true;
            self.rows.push(row);
        }
        self.sums[i] += value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a symmetric band matrix.
    fn band(n: usize, seed: usize) -> SymmetricMatrix {
        let value = |i: usize, j: usize| ((i.min(j) * 7 + i.max(j) * 3 + seed) as f64).sin() + 1.5;
        let entries: Vec<(u32, u32, f64)> = (0..n)
            .flat_map(|j| [j, j + 1, j + 4].map(|i| (i, j)))
            .filter(|&(i, _)| i < n)
            .flat_map(|(i, j)| [(i as u32, j as u32, value(i, j)), (j as u32, i as u32, value(i, j))])
            .filter(|&(i, j, _)| i != j)
            .chain((0..n).map(|i| (i as u32, i as u32, 9.0)))
            .collect();
        SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric")
    }

    #[test]
    fn the_reduced_pencil_is_that_of_the_explicit_transformation() {
        let nodes = 40;
        for block in 1..=3 {
            let n = nodes * block;
            let (k, m) = (band(n, 1), band(nodes, 2));
            let pencil = Pencil::new(&k, &m, block);
            let zero: Vec<usize> = (block..3 * block).collect();
            let on: Vec<usize> = (10..30).collect();
            let weights = Mat::from_fn(2, on.len(), |i, j| ((3 * i + j) as f64).cos());
            let group = Dependents { rows: vec![31, 9], on, weights };
            for dependents in [Vec::new(), vec![group]] {
                let kept = dependents.is_empty();
                let elimination = Elimination::new(n, &zero, dependents);
                let t =
                    elimination.expand(Mat::<f64>::identity(elimination.len(), elimination.len()).as_ref());
                let reduced = elimination.reduced(&pencil);
                let reduced = reduced.pencil();
                assert_eq!(reduced.block(), if kept { block } else { 1 });
                let whole = Mat::<f64>::identity(elimination.len(), elimination.len());
                for (found, full) in [
                    (reduced.apply_stiffness(whole.as_ref()), pencil.apply_stiffness(t.as_ref())),
                    (reduced.apply_mass(whole.as_ref()), pencil.apply_mass(t.as_ref())),
                ] {
                    let expected = gram(t.as_ref(), full.as_ref());
                    assert!((&found - &expected).norm_max() < 1e-13 * expected.norm_max(), "block {block}");
                }
                let f = Mat::from_fn(n, 3, |i, j| ((i + 5 * j) as f64).sin());
                let difference = elimination.restrict(f.as_ref()) - gram(t.as_ref(), f.as_ref());
                assert!(difference.norm_max() < 1e-13, "block {block}");
            }
        }
    }
}

//! The exact condensation: one pass over the mass matrix turns nodes and shapes into the primary data.
//!
//! All of theory section 2 is one weighted Gram matrix X' Ms X of the columns X =
//! [1, x, y, z, psi_1x, psi_1y, psi_1z, psi_2x, ...]. Columns are taken in panels of a fixed width (20 modes:
//! one panel, so that the mass matrix is read once), rows in chunks of a fixed length; chunks belong to
//! groups that depend on the number of nodes only, and groups are summed in order. The result is therefore
//! the same to the last bit at any number of threads, and no sum is longer than a chunk, the chunks of a
//! group or the groups: rounding does not grow with the model.

use super::{Invariants, PrimaryData, TermGroups, s_of_modal_mass};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use flexbody_linalg::{SymmetricMatrix, parallel};
use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Number of rows per dense product, the longest plain sum. Shorter chunks cost time, longer chunks lose
/// digits.
pub(super) const ROWS_PER_PRODUCT: usize = 128;
/// Upper bound of the number of partial sums kept until they are added in order.
pub(super) const MAX_PARTIAL_SUMS: usize = 64;
/// Number of columns per pass over the mass matrix.
const PANEL_COLUMNS: usize = 64;
/// Number of columns per pass if there are more than twice as many. Each pass gathers all earlier columns
/// once more, so wider panels save work on many columns.
const WIDE_PANEL_COLUMNS: usize = 192;
/// Number of columns of a panel summed at a time, in registers.
const LANE_COLUMNS: usize = 16;

/// One lane of a row of a panel.
pub(super) type Lane = [f64; LANE_COLUMNS];

/// Symmetric mass on the nodes, equal for all directions.
pub(super) trait NodalMass: Sync {
    /// Returns the number of rows.
    fn count(&self) -> usize;

    /// Returns lane `lane` of row `i` of Ms X, for `x` with `lanes` lanes per node.
    fn row_times(&self, i: usize, x: &[Lane], lanes: usize, lane: usize) -> Lane;
}

/// The consistent mass Ms.
impl NodalMass for SymmetricMatrix {
    fn count(&self) -> usize {
        self.n()
    }

    #[inline(always)] // compiled once per instruction set
    fn row_times(&self, i: usize, x: &[Lane], lanes: usize, lane: usize) -> Lane {
        let mut sum = [0.0; LANE_COLUMNS];
        let (columns, values) = self.row(i);
        for (&j, &value) in columns.iter().zip(values) {
            for (s, x) in sum.iter_mut().zip(&x[j as usize * lanes + lane]) {
                *s += value * x;
            }
        }
        sum
    }
}

/// Diagonal (lumped) mass: one number per node.
impl NodalMass for [f64] {
    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)] // compiled once per instruction set
    fn row_times(&self, i: usize, x: &[Lane], lanes: usize, lane: usize) -> Lane {
        x[i * lanes + lane].map(|x| self[i] * x)
    }
}

/// Condenses the nodal equations of motion exactly into the primary data (theory section 2).
///
/// m = 1' Ms 1, c_k = 1' Ms x_k, J_kl = x_k' Ms x_l, C1_k = 1' Ms Psi_k, Ibar_kl = x_k' Ms Psi_l,
/// S_kl = Psi_k' Ms Psi_l, for M = Ms kron I3.
///
/// * `mass`: Ms (n x n). Unit: mass.
/// * `positions`: node positions in the frame of the result. Unit: length. Any origin is valid; an origin
///   at the centre of mass ([`super::choose_frame`]) keeps most digits. Rows of Ms beyond the positions are
///   vectors that rigid motion does not move (bubbles): their entries of 1 and x are zero.
/// * `shapes`: any basis (3n x nf); row 3 i + k is component k of row i of Ms along the axes of the frame
///   of `positions`.
/// * `modal_stiffness`: Psi' K Psi (nf x nf), passed through.
///
/// J and the diagonal blocks S_kk are exactly symmetric and S_lk = S_kl' exactly. The result does not depend
/// on the number of threads.
///
/// ```
/// use faer::{Mat, mat};
/// use flexbody_body::invariants::condense;
/// use flexbody_linalg::{CscMatrix, SymmetricMatrix};
///
/// // A bar of mass 6 along x from -1 to 1, one linear element, and its stretch as the only mode.
/// let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 2.0)];
/// let mass = SymmetricMatrix::new(CscMatrix::from_triplets(2, 2, &entries)).expect("symmetric");
/// let shapes = mat![[-1.0], [0.0], [0.0], [1.0], [0.0], [0.0f64]];
/// let body = condense(&mass, &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], shapes.as_ref(), Mat::zeros(1, 1));
/// assert_eq!((body.mass(), body.inertia()[(2, 2)]), (6.0, 2.0)); // m l^2 / 12
/// assert_eq!(body.w1().map(|w1| w1[(2, 2)]), Some(4.0)); // I_zz(q) = 2 (1 + q)^2 = 2 + 4 q + 2 q^2
/// ```
///
/// # Panics
/// When the sizes disagree.
pub fn condense(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    condense_with(mass, positions, shapes, modal_stiffness)
}

/// Condenses as [`condense`] does, for any nodal mass.
pub(super) fn condense_with<M: NodalMass + ?Sized>(
    mass: &M,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let columns = SolidColumns { positions, shapes };
    columns.assert_sizes(mass, modal_stiffness.as_ref());
    let gram = weighted_gram(mass, columns);
    from_gram(gram.as_ref(), modal_stiffness)
}

/// Returns the primary data from the Gram matrix of [`SolidColumns`].
pub(super) fn from_gram(gram: MatRef<'_, f64>, modal_stiffness: Mat<f64>) -> Invariants {
    let nf = modal_stiffness.ncols();
    let psi = |k: usize, p: usize| 4 + 3 * p + k;
    let (mass, first_moment, second_moment) = rigid_part(gram);
    Invariants(PrimaryData {
        mass,
        first_moment,
        second_moment,
        c1: Mat::from_fn(3, nf, |k, p| gram[(0, psi(k, p))]),
        ibar: array(|k| array(|l| (0..nf).map(|p| gram[(1 + k, psi(l, p))]).collect())),
        s: array(|k| array(|l| Mat::from_fn(nf, nf, |p, q| gram[(psi(k, p), psi(l, q))]))),
        modal_stiffness,
        general: None,
        groups: TermGroups::ALL,
    })
}

/// Returns m, c and J of rigid motion alone.
pub(super) fn condense_rigid<M: NodalMass + ?Sized>(
    mass: &M,
    positions: &[[f64; 3]],
) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let no_modes = Mat::<f64>::zeros(3 * mass.count(), 0);
    rigid_part(weighted_gram(mass, SolidColumns { positions, shapes: no_modes.as_ref() }).as_ref())
}

fn rigid_part(gram: MatRef<'_, f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let first_moment = Vector3::from_fn(|k, _| gram[(0, 1 + k)]);
    (gram[(0, 0)], first_moment, Matrix3::from_fn(|k, l| gram[(1 + k, 1 + l)]))
}

/// Returns an array of three values computed from the index.
fn array<T>(f: impl FnMut(usize) -> T) -> [T; 3] {
    std::array::from_fn(f)
}

/// The columns X = [1, x, y, z, psi_1x, psi_1y, psi_1z, psi_2x, ...]; 1, x, y, z are zero beyond the
/// positions.
#[derive(Clone, Copy)]
pub(super) struct SolidColumns<'a> {
    pub positions: &'a [[f64; 3]],
    pub shapes: MatRef<'a, f64>,
}

impl SolidColumns<'_> {
    /// # Panics
    /// When the sizes of mass, positions, shapes and modal stiffness disagree.
    fn assert_sizes<M: NodalMass + ?Sized>(&self, mass: &M, modal_stiffness: MatRef<'_, f64>) {
        let nf = self.shapes.ncols();
        assert!(mass.count() >= self.positions.len(), "a row of Ms for every position");
        assert_eq!(self.shapes.nrows(), 3 * mass.count(), "rows of the shapes: three per row of Ms");
        assert_eq!(modal_stiffness.shape(), (nf, nf), "modal stiffness: one row per mode");
    }

    pub(super) fn count(&self) -> usize {
        4 + 3 * self.shapes.ncols()
    }

    /// Returns the number of rows of X.
    pub(super) fn rows(&self) -> usize {
        self.shapes.nrows() / 3
    }

    #[inline]
    pub(super) fn get(&self, i: usize, column: usize) -> f64 {
        match column {
            0..4 if i >= self.positions.len() => 0.0,
            0 => 1.0,
            1..4 => self.positions[i][column - 1],
            _ => self.shapes[(3 * i + (column - 4) % 3, (column - 4) / 3)],
        }
    }

    /// Copies a range of columns of the nodes `first`, `first + 1`, ... into rows of `width` values, until
    /// `rows` is full.
    pub(super) fn by_node(&self, first: usize, columns: Range<usize>, width: usize, rows: &mut [f64]) {
        for (slot, column) in columns.enumerate() {
            for (k, row) in rows.chunks_exact_mut(width).enumerate() {
                row[slot] = self.get(first + k, column);
            }
        }
    }
}

/// Zeros that begin at a cache line, so that the dense kernels meet the same alignment in every run.
struct Aligned {
    values: Vec<f64>,
    start: usize,
}

impl Aligned {
    const LINE: usize = 8;

    pub(super) fn zeros(len: usize) -> Self {
        let values = vec![0.0; len + Self::LINE];
        let start = values.as_ptr().align_offset(64).min(Self::LINE);
        Self { values, start }
    }

    fn get(&self) -> &[f64] {
        &self.values[self.start..self.values.len() + self.start - Self::LINE]
    }

    fn get_mut(&mut self) -> &mut [f64] {
        let end = self.values.len() + self.start - Self::LINE;
        &mut self.values[self.start..end]
    }
}

/// Returns X' Ms X, exactly symmetric.
fn weighted_gram<M: NodalMass + ?Sized>(mass: &M, columns: SolidColumns<'_>) -> Mat<f64> {
    let n_columns = columns.count();
    let mut gram = Mat::<f64>::zeros(n_columns, n_columns);
    let width = if n_columns > 2 * WIDE_PANEL_COLUMNS { WIDE_PANEL_COLUMNS } else { PANEL_COLUMNS };
    for start in (0..n_columns).step_by(width) {
        // Rows of X' beyond the panel are the transpose of a later panel.
        let end = (start + width).min(n_columns);
        let panel = gram_panel(mass, columns, start..end);
        fill_symmetric(&mut gram, start..end, |row, column| panel[(row, column - start)]);
    }
    gram
}

/// Fills a range of columns of a symmetric matrix down to the diagonal, and the mirrored entries.
pub(super) fn fill_symmetric(
    matrix: &mut Mat<f64>,
    columns: Range<usize>,
    value: impl Fn(usize, usize) -> f64,
) {
    for column in columns {
        for row in 0..=column {
            matrix[(row, column)] = value(row, column);
            matrix[(column, row)] = matrix[(row, column)];
        }
    }
}

/// Returns the number of nodes per group, which depends on the number of nodes `n` only.
pub(super) fn group_length(n: usize) -> usize {
    ROWS_PER_PRODUCT * n.div_ceil(ROWS_PER_PRODUCT).div_ceil(MAX_PARTIAL_SUMS).max(1)
}

/// Sums the contributions of the groups of `n` nodes to a matrix of the given size, in the order of the
/// groups.
fn sum_of_groups(
    n: usize,
    (rows, columns): (usize, usize),
    contribution: impl Fn(Range<usize>) -> Mat<f64> + Sync,
) -> Mat<f64> {
    let partial = parallel::map(parallel::ranges(n, group_length(n)), contribution);
    let mut total = Mat::<f64>::zeros(rows, columns);
    for part in &partial {
        total += part;
    }
    total
}

/// Returns X[0..panel.end]' Ms X[panel]: at least panel.end rows, and one column per column of the panel.
fn gram_panel<M: NodalMass + ?Sized>(mass: &M, columns: SolidColumns<'_>, panel: Range<usize>) -> Mat<f64> {
    let n = columns.rows();
    let lanes = panel.len().div_ceil(LANE_COLUMNS);
    let (before, width) = (panel.start, lanes * LANE_COLUMNS);
    // Columns of the panel, node by node.
    let mut x = Aligned::zeros(n * width);
    parallel::for_each(x.get_mut().chunks_mut(ROWS_PER_PRODUCT * width).enumerate(), |(chunk, rows)| {
        columns.by_node(chunk * ROWS_PER_PRODUCT, panel.clone(), width, rows);
    });
    let x = x.get();
    let x_lanes = x.as_chunks::<LANE_COLUMNS>().0;
    let arch = Arch::new();
    sum_of_groups(n, (before + width, width), |nodes| {
        let mut product = Aligned::zeros(ROWS_PER_PRODUCT * width);
        let mut earlier = Aligned::zeros(ROWS_PER_PRODUCT * before);
        let mut sum = Mat::<f64>::zeros(before + width, width);
        for first in nodes.clone().step_by(ROWS_PER_PRODUCT) {
            let rows = ROWS_PER_PRODUCT.min(nodes.end - first);
            // Ms X of a chunk of rows.
            let product = &mut product.get_mut()[..rows * width];
            let targets = product.as_chunks_mut::<LANE_COLUMNS>().0;
            arch.dispatch(MassTimes { mass, first, x: x_lanes, lanes, targets });
            // Rows of nodes are columns of the transpose.
            let transposed = |values, width| MatRef::from_column_major_slice(values, width, rows);
            let product = transposed(product, width).transpose();
            let (top, bottom) = sum.as_mut().split_at_row_mut(before);
            // Products of the earlier columns, and of the panel itself, with this chunk.
            if before > 0 {
                let earlier = &mut earlier.get_mut()[..rows * before];
                columns.by_node(first, 0..before, before, earlier);
                matmul(top, Accum::Add, transposed(earlier, before), product, 1.0, Par::Seq);
            }
            let rows_of_x = transposed(&x[first * width..][..rows * width], width);
            matmul(bottom, Accum::Add, rows_of_x, product, 1.0, Par::Seq);
        }
        sum
    })
}

/// Computes rows `first`, `first + 1`, ... of Ms X until `targets` is full. (A structure and not a closure:
/// a closure may be compiled apart from the function that has the instruction set, and then without it.)
pub(super) struct MassTimes<'a, M: ?Sized> {
    pub mass: &'a M,
    pub first: usize,
    pub x: &'a [Lane],
    pub lanes: usize,
    pub targets: &'a mut [Lane],
}

impl<M: NodalMass + ?Sized> WithSimd for MassTimes<'_, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (k, row) in self.targets.chunks_exact_mut(self.lanes).enumerate() {
            for (lane, target) in row.iter_mut().enumerate() {
                *target = self.mass.row_times(self.first + k, self.x, self.lanes, lane);
            }
        }
    }
}

// Condensation without S, from the products of M with rigid motion alone, for a body that holds neither W2
// nor W3.

/// Condenses mass-normalised modes without W2 and W3: multiplies four columns by Ms instead of 4 + 3 nf,
/// and assumes m_ff = I. m, c, J, C1, C2 and W1 agree with [`condense`](super::condense()) to rounding.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_linear(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let nf = shapes.ncols();
    of_rigid_products(mass, SolidColumns { positions, shapes }, modal_stiffness, &Mat::identity(nf, nf))
}

/// Returns the primary data without W2 and W3 from the products of the mass with rigid motion; m_ff is `modal_mass`.
///
/// # Panics
/// When the sizes disagree.
pub(super) fn of_rigid_products<M: NodalMass + ?Sized>(
    mass: &M,
    columns: SolidColumns<'_>,
    modal_stiffness: Mat<f64>,
    modal_mass: &Mat<f64>,
) -> Invariants {
    let nf = columns.shapes.ncols();
    columns.assert_sizes(mass, modal_stiffness.as_ref());
    let products = rigid_products(mass, columns);
    let psi = |k: usize, p: usize| 4 + 3 * p + k;
    // J is symmetric except for rounding: use one half of it.
    let rigid = Mat::from_fn(4, 4, |i, j| products[(i.min(j), i.max(j))]);
    let (mass, first_moment, second_moment) = rigid_part(rigid.as_ref());
    Invariants(PrimaryData {
        mass,
        first_moment,
        second_moment,
        c1: Mat::from_fn(3, nf, |k, p| products[(psi(k, p), 0)]),
        ibar: [0, 1, 2].map(|k| [0, 1, 2].map(|l| (0..nf).map(|p| products[(psi(l, p), 1 + k)]).collect())),
        s: s_of_modal_mass(nf, Some(modal_mass), None),
        modal_stiffness,
        general: None,
        groups: TermGroups { w1: true, ..TermGroups::NONE },
    })
}

/// Returns X' Ms [1, x, y, z], in the partition of the full condensation; columns beyond the fourth have no
/// meaning.
fn rigid_products<M: NodalMass + ?Sized>(mass: &M, columns: SolidColumns<'_>) -> Mat<f64> {
    let (n, count) = (columns.rows(), columns.count());
    let mut x: Vec<Lane> = vec![[0.0; LANE_COLUMNS]; n];
    parallel::for_each(x.chunks_mut(ROWS_PER_PRODUCT).enumerate(), |(chunk, rows)| {
        columns.by_node(chunk * ROWS_PER_PRODUCT, 0..4, LANE_COLUMNS, rows.as_flattened_mut());
    });
    let arch = Arch::new();
    sum_of_groups(n, (count, LANE_COLUMNS), |nodes| {
        let mut block = Aligned::zeros(ROWS_PER_PRODUCT * count);
        let mut product = [[0.0; LANE_COLUMNS]; ROWS_PER_PRODUCT];
        let mut sum = Mat::<f64>::zeros(count, LANE_COLUMNS);
        for first in nodes.clone().step_by(ROWS_PER_PRODUCT) {
            let rows = ROWS_PER_PRODUCT.min(nodes.end - first);
            let product = &mut product[..rows];
            arch.dispatch(MassTimes { mass, first, x: &x, lanes: 1, targets: product });
            let block = &mut block.get_mut()[..rows * count];
            columns.by_node(first, 0..count, count, block);
            // Rows of nodes are columns of the transpose.
            let transposed = |values, width| MatRef::from_column_major_slice(values, width, rows);
            let product = transposed(product.as_flattened(), LANE_COLUMNS).transpose();
            matmul(&mut sum, Accum::Add, transposed(block, count), product, 1.0, Par::Seq);
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_linalg::CscMatrix;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Mass that counts the lanes of rows that are multiplied.
    struct Counted(SymmetricMatrix, AtomicUsize);

    impl NodalMass for Counted {
        fn count(&self) -> usize {
            self.0.n()
        }

        fn row_times(&self, i: usize, x: &[Lane], lanes: usize, lane: usize) -> Lane {
            self.1.fetch_add(1, Ordering::Relaxed);
            self.0.row_times(i, x, lanes, lane)
        }
    }

    #[test]
    fn rigid_motion_alone_is_multiplied_and_gives_the_same() {
        let (n, nf) = (300, 12);
        let at = |i: usize| u32::try_from(i % n).expect("a small number");
        let wave = |i: usize| (1.7 * i as f64).sin();
        let entries: Vec<(u32, u32, f64)> = (0..n)
            .flat_map(|i| [(at(i), at(i), 3.0 + wave(i)), (at(i), at(i + 1), 0.5), (at(i + 1), at(i), 0.5)])
            .collect();
        let matrix = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric");
        let mass = Counted(matrix, AtomicUsize::new(0));
        let positions: Vec<[f64; 3]> = (0..n).map(|i| [0, 7, 11].map(|k| wave(i + k))).collect();
        let shapes = Mat::from_fn(3 * n, nf, |row, p| wave(row * (p + 2)));
        let columns = SolidColumns { positions: &positions, shapes: shapes.as_ref() };
        let stiffness = || Mat::zeros(nf, nf);
        let linear = of_rigid_products(&mass, columns, stiffness(), &Mat::identity(nf, nf));
        assert_eq!(mass.1.swap(0, Ordering::Relaxed), n, "one lane holds four columns");
        let whole = condense_with(&mass, &positions, shapes.as_ref(), stiffness());
        assert_eq!(mass.1.load(Ordering::Relaxed), n * (4 + 3 * nf).div_ceil(LANE_COLUMNS));
        let near = |a: f64, b: f64, size: f64| assert!((a - b).abs() <= 1e-13 * size, "{a} is not {b}");
        near(linear.mass(), whole.mass(), whole.mass());
        for k in 0..3 {
            near(linear.first_moment()[k], whole.first_moment()[k], whole.mass());
            for l in 0..3 {
                near(linear.second_moment()[(k, l)], whole.second_moment()[(k, l)], whole.mass());
                (0..nf).for_each(|p| {
                    near(linear.ibar().unwrap()[k][l][p], whole.ibar().unwrap()[k][l][p], whole.mass())
                });
            }
            (0..nf).for_each(|p| near(linear.c1()[(k, p)], whole.c1()[(k, p)], whole.mass()));
        }
        assert_eq!(linear.modal_mass(), Mat::<f64>::identity(nf, nf));
        assert_eq!((linear.w1().is_some(), linear.w2(), linear.w3()), (true, None, None));
    }
}

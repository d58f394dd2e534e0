//! The condensation in double-double arithmetic, with a guaranteed bound of the rounding in every invariant.
//!
//! The guarantee covers the numbers in a flex-body file: nodes, modes and axes as stored, M and K as given.
//! The distance of these modes from the exact ones is a separate bound (`/modes/shape_error`).

use super::condense::{
    MAX_PARTIAL_SUMS, ROWS_PER_PRODUCT, SolidColumns, fill_symmetric, from_gram, group_length,
};
use super::derived::CYCLIC;
use super::{CauchySchwarz, Invariants};
use faer::{Mat, MatMut, MatRef};
use flexbody_linalg::{
    CompensatedBlock, DoubleDouble, LANES, SymmetricMatrix, accumulate, accumulate_pair, gram_compensated,
    larger, multiply_compensated, parallel, sum_length, with_fma,
};
use libm::log10;
use nalgebra::Matrix3;
use std::ops::Range;

/// Number of columns per pass over the mass matrix: their sums fill half of the vector registers.
const COLUMNS_PER_PASS: usize = 16;

/// Unit roundoff of f64.
const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Factor that covers the rounding of the bounds themselves.
const ROUNDING_MARGIN: f64 = 1.0 + 1e-6;

/// Returns the digits that a relative error leaves: -log10 of the error, between zero (also for NaN) and
/// -log10(2^-53) = 15.95, the digits of a number that is stored as f64.
pub fn digits_of_error(error: f64) -> f64 {
    (-log10(larger(error, UNIT_ROUNDOFF))).max(0.0)
}

/// Invariants with guaranteed digits, by their names in the file.
pub const DIGITS: [&str; 13] = [
    "mass",
    "first_moment",
    "second_moment",
    "C1",
    "Ibar",
    "S",
    "modal_stiffness",
    "I0",
    "W1",
    "W2",
    "W3",
    "C2",
    "modal_mass",
];

/// Invariants with bounds of their rounding errors.
#[derive(Debug, Clone, PartialEq)]
pub struct CertifiedInvariants {
    /// Invariants, each number the f64 nearest to its double-double value.
    pub invariants: Invariants,
    /// Guaranteed digits of each of [`DIGITS`]: -log10 of the largest error of an entry relative to its
    /// Cauchy-Schwarz bound. The digits include the rounding of I0, W1, W2, W3, C2 and m_ff, which are
    /// formed in f64 from the others.
    pub digits: [f64; DIGITS.len()],
}

/// Condenses as [`condense`](super::condense()) and computes K_ff = Psi' K Psi, with compensated products
/// and guaranteed digits.
///
/// * `mass`, `positions`, `shapes`: the arguments of [`condense`](super::condense()), in body axes.
/// * `stiffness`: K (3n x 3n; of a plane body 2n x 2n), model axes.
/// * `axes`: columns are the body axes in model axes.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_certified(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    stiffness: &SymmetricMatrix,
    axes: &Matrix3<f64>,
) -> CertifiedInvariants {
    assert!(mass.n() >= positions.len(), "a row of Ms for every position");
    assert!(
        shapes.nrows() == 3 * mass.n() && (stiffness.n() == shapes.nrows() || stiffness.n() == 2 * mass.n()),
        "rows of shapes: three per row of Ms; of the stiffness three or two"
    );
    let (gram, gram_error) = mass_gram(mass, SolidColumns { positions, shapes });
    let (modal, modal_error) = modal_stiffness(stiffness, axes, shapes);
    let invariants = from_gram(gram.as_ref(), modal);
    let errors = from_gram(gram_error.as_ref(), modal_error);
    let digits = digits(&invariants, &errors);
    CertifiedInvariants { invariants, digits }
}

/// Returns X' Ms X and an upper bound of the error of each entry.
fn mass_gram(mass: &SymmetricMatrix, columns: SolidColumns<'_>) -> (Mat<f64>, Mat<f64>) {
    let (n, count) = (mass.n(), columns.count());
    let mut gram = Mat::<f64>::zeros(count, count);
    for start in (0..count).step_by(COLUMNS_PER_PASS) {
        // Rows of X' beyond the block are the transpose of a later block.
        let end = (start + COLUMNS_PER_PASS).min(count);
        let block = gram_block(mass, columns, start..end);
        fill_symmetric(&mut gram, start..end, |row, column| block[row][column - start].hi);
    }
    // sum_ij |x_i| |M_ij| |y_j| <= sqrt(sum_i rho_i x_i^2) sqrt(sum_i rho_i y_i^2) with rho_i the row sums of
    // |M|.
    let weights: Vec<f64> = (0..n).map(|i| mass.row(i).1.iter().map(|v| v.abs()).sum()).collect();
    let size: Vec<f64> = (0..count)
        .map(|c| (0..n).map(|i| weights[i] * columns.get(i, c) * columns.get(i, c)).sum::<f64>().sqrt())
        .collect();
    let longest = (0..n).map(|i| mass.row(i).0.len()).max().unwrap_or(0);
    let group = group_length(n);
    let terms = 8.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * (group + MAX_PARTIAL_SUMS + longest + 16) as f64;
    let error = Mat::from_fn(count, count, |i, j| {
        ROUNDING_MARGIN * (UNIT_ROUNDOFF * gram[(i, j)].abs() + terms * size[i] * size[j])
    });
    (gram, error)
}

/// Returns a node-wise copy of a block of at most [`COLUMNS_PER_PASS`] columns, padded with zeros.
fn by_node(columns: SolidColumns<'_>, block: Range<usize>) -> Vec<[f64; COLUMNS_PER_PASS]> {
    let mut rows = vec![[0.0; COLUMNS_PER_PASS]; columns.rows()];
    parallel::for_each(rows.chunks_mut(ROWS_PER_PRODUCT).enumerate(), |(chunk, rows)| {
        columns.by_node(ROWS_PER_PRODUCT * chunk, block.clone(), COLUMNS_PER_PASS, rows.as_flattened_mut());
    });
    rows
}

/// Copies the rows `nodes` column-wise into `target`.
fn by_column(columns: SolidColumns<'_>, nodes: Range<usize>, mut target: MatMut<'_, f64>) {
    for column in 0..target.ncols() {
        for (row, i) in nodes.clone().enumerate() {
            target[(row, column)] = columns.get(i, column);
        }
    }
}

/// Returns X[0..block.end]' Ms X[block]: block.end rows.
fn gram_block(
    mass: &SymmetricMatrix,
    columns: SolidColumns<'_>,
    block: Range<usize>,
) -> Vec<[DoubleDouble; COLUMNS_PER_PASS]> {
    let (n, n_left) = (mass.n(), block.end);
    let x = by_node(columns, block);
    let partial = parallel::map(parallel::ranges(n, group_length(n)), |nodes| {
        let mut left = Mat::<f64>::zeros(ROWS_PER_PRODUCT, n_left);
        let mut sums = vec![[[0.0; COLUMNS_PER_PASS]; 2]; n_left];
        let mut product = vec![[[0.0; COLUMNS_PER_PASS]; 2]; ROWS_PER_PRODUCT];
        for first in nodes.clone().step_by(ROWS_PER_PRODUCT) {
            let chunk = first..(first + ROWS_PER_PRODUCT).min(nodes.end);
            let rows = chunk.len();
            // Rows of the chunk of X, column-wise.
            by_column(columns, chunk.clone(), left.subrows_mut(0, rows));
            with_fma(
                #[inline(always)]
                || {
                    // Ms X of the chunk in double-double arithmetic.
                    for (target, i) in product.iter_mut().zip(chunk) {
                        let (mut hi, mut lo) = ([0.0; COLUMNS_PER_PASS], [0.0; COLUMNS_PER_PASS]);
                        let (neighbours, values) = mass.row(i);
                        for (&j, &value) in neighbours.iter().zip(values) {
                            accumulate(&mut hi, &mut lo, value, &x[j as usize]);
                        }
                        *target = [hi, lo];
                    }
                    // Add the products X' (Ms X) of the chunk.
                    for (c, sum) in sums.iter_mut().enumerate() {
                        let [mut hi, mut lo] = *sum;
                        for (&a, [y, z]) in left.col_as_slice(c)[..rows].iter().zip(&product) {
                            accumulate_pair(&mut hi, &mut lo, a, (y, z));
                        }
                        *sum = [hi, lo];
                    }
                },
            );
        }
        sums
    });
    // Add the groups in a fixed order: the result does not depend on the number of threads.
    let mut total = vec![[DoubleDouble::default(); COLUMNS_PER_PASS]; n_left];
    for part in &partial {
        for (sum, [hi, lo]) in total.iter_mut().zip(part) {
            for w in 0..COLUMNS_PER_PASS {
                sum[w] = sum[w] + DoubleDouble { hi: hi[w], lo: lo[w] };
            }
        }
    }
    total
}

/// Returns Psi' K Psi and an upper bound of the error of each entry, for shapes in body axes and K in model
/// axes.
fn modal_stiffness(
    stiffness: &SymmetricMatrix,
    axes: &Matrix3<f64>,
    shapes: MatRef<'_, f64>,
) -> (Mat<f64>, Mat<f64>) {
    let (n, nf) = (stiffness.n(), shapes.ncols());
    // Rows of the stiffness per node: two for a plane body.
    let d = n / (shapes.nrows() / 3).max(1);
    // Represent the turned shapes as sums of two blocks of f64.
    let turned = |row: usize, p: usize| {
        (0..3).fold(DoubleDouble::default(), |sum, l| {
            sum + DoubleDouble::product(axes[(row % d, l)], shapes[(row / d * 3 + l, p)])
        })
    };
    let (mut hi, mut lo) = (Mat::zeros(n, nf), Mat::zeros(n, nf));
    let mut size = vec![0.0; nf];
    let weights: Vec<f64> = (0..n).map(|i| stiffness.row(i).1.iter().map(|v| v.abs()).sum()).collect();
    for p in 0..nf {
        for row in 0..n {
            let value = turned(row, p);
            (hi[(row, p)], lo[(row, p)]) = (value.hi, value.lo);
            let terms: f64 = (0..3).map(|l| (axes[(row % d, l)] * shapes[(row / d * 3 + l, p)]).abs()).sum();
            size[p] += weights[row] * terms * terms;
        }
        size[p] = size[p].sqrt();
    }
    let longest = (0..n).map(|i| stiffness.row(i).0.len()).max().unwrap_or(0);
    let terms = 16.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * (sum_length(n) + longest as f64 + 32.0);
    let mut value = Mat::<f64>::zeros(nf, nf);
    for start in (0..nf).step_by(LANES) {
        let width = LANES.min(nf - start);
        let mut product: CompensatedBlock =
            multiply_compensated(stiffness, 1, hi.as_ref().subcols(start, width));
        product.add(&multiply_compensated(stiffness, 1, lo.as_ref().subcols(start, width)));
        let (large, small) =
            (gram_compensated(hi.as_ref(), &product), gram_compensated(lo.as_ref(), &product));
        fill_symmetric(&mut value, start..start + width, |row, column| {
            (large[row][column - start] + small[row][column - start]).hi
        });
    }
    let error = Mat::from_fn(nf, nf, |i, j| {
        ROUNDING_MARGIN * (UNIT_ROUNDOFF * value[(i, j)].abs() + terms * size[i] * size[j])
    });
    (value, error)
}

/// Returns -log10 of the worst error of each of [`DIGITS`] relative to its scale; `errors` holds an upper
/// bound for each entry.
fn digits(value: &Invariants, errors: &Invariants) -> [f64; DIGITS.len()] {
    let nf = value.n_modes();
    let entries = EntryErrors { value, errors, bound: CauchySchwarz::of(value), nf };
    let EntryErrors { errors: e, bound, .. } = &entries;
    let j = &e.0.second_moment;
    let ratios = [
        worst_ratio(1, 1, |_, _| (e.0.mass, value.0.mass.abs())),
        worst_ratio(3, 1, |k, _| (e.0.first_moment[k], bound.first_moment(k))),
        worst_ratio(3, 3, |k, l| (j[(k, l)], bound.second_moment(k, l))),
        worst_ratio(3, nf, |k, p| (e.0.c1[(k, p)], bound.c1(p))),
        worst_ratio(9, nf, |kl, p| (e.0.ibar[kl / 3][kl % 3][p], bound.ibar(kl / 3, p))),
        worst_ratio(9 * nf, nf, |row, q| {
            let (kl, p) = (row / nf, row % nf);
            (e.0.s[kl / 3][kl % 3][(p, q)], bound.s(p, q))
        }),
        worst_ratio(nf, nf, |p, q| entries.stiffness(p, q)),
        worst_ratio(3, 3, |k, l| entries.inertia(k, l)),
        worst_ratio(3, 3 * nf, |k, column| entries.w1(k, column)),
        worst_ratio(3 * nf, 3 * nf, |row, column| entries.w2(row, column)),
        worst_ratio(3 * nf, nf, |row, q| entries.w3(row, q)),
        worst_ratio(3, nf, |k, p| entries.c2(k, p)),
        worst_ratio(nf, nf, |p, q| (entries.s(&[(0, 0), (1, 1), (2, 2)], p, q), bound.s(p, q))),
    ];
    ratios.map(digits_of_error)
}

/// Returns the largest error of the entries of a matrix relative to their scales; an error of zero counts
/// as zero for any scale.
fn worst_ratio(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> (f64, f64)) -> f64 {
    let mut largest = 0.0;
    for i in 0..rows {
        for j in 0..columns {
            let (error, scale) = entry(i, j);
            largest = larger(largest, if error == 0.0 { 0.0 } else { error / scale });
        }
    }
    largest
}

/// Errors of entries formed in f64 from the primary data, with their scales.
struct EntryErrors<'a> {
    value: &'a Invariants,
    errors: &'a Invariants,
    bound: CauchySchwarz,
    nf: usize,
}

/// Returns the error of a sum of rounded data: the sum of their errors plus the rounding of the sum itself.
fn error_of_sum(errors: f64, magnitudes: f64) -> f64 {
    ROUNDING_MARGIN * (errors + 2.0 * UNIT_ROUNDOFF * magnitudes)
}

impl EntryErrors<'_> {
    /// Returns the error of a sum or difference of two entries of Ibar.
    fn ibar(&self, a: (usize, usize), b: (usize, usize), p: usize) -> f64 {
        let error = |(k, l): (usize, usize)| self.errors.0.ibar[k][l][p];
        let magnitude = |(k, l): (usize, usize)| self.value.0.ibar[k][l][p].abs();
        error_of_sum(error(a) + error(b), magnitude(a) + magnitude(b))
    }

    /// Returns the error of a sum or difference of entries of blocks of S.
    fn s(&self, terms: &[(usize, usize)], p: usize, q: usize) -> f64 {
        let total = |m: &Invariants| terms.iter().map(|&(k, l)| m.0.s[k][l][(p, q)].abs()).sum::<f64>();
        error_of_sum(total(self.errors), total(self.value))
    }

    fn stiffness(&self, p: usize, q: usize) -> (f64, f64) {
        let k_ff = &self.value.0.modal_stiffness;
        let scale = (k_ff[(p, p)].abs() * k_ff[(q, q)].abs()).sqrt();
        (self.errors.0.modal_stiffness[(p, q)], scale)
    }

    fn inertia(&self, k: usize, l: usize) -> (f64, f64) {
        let (j, value) = (&self.errors.0.second_moment, &self.value.0.second_moment);
        let (_, a, b) = CYCLIC[k];
        let moment = || error_of_sum(j[(a, a)] + j[(b, b)], value[(a, a)] + value[(b, b)]);
        (if k == l { moment() } else { j[(k, l)] }, self.bound.inertia(k, l))
    }

    fn w1(&self, k: usize, column: usize) -> (f64, f64) {
        let (l, p) = (column / self.nf, column % self.nf);
        let (_, a, b) = CYCLIC[k];
        let error = if k == l { 2.0 * self.ibar((a, a), (b, b), p) } else { self.ibar((k, l), (l, k), p) };
        (error, self.bound.w1(k, l, p))
    }

    fn w2(&self, row: usize, column: usize) -> (f64, f64) {
        let nf = self.nf;
        let (k, p, l, q) = (row / nf, row % nf, column / nf, column % nf);
        let (_, a, b) = CYCLIC[k];
        let error = if k == l { self.s(&[(a, a), (b, b)], p, q) } else { self.errors.0.s[l][k][(p, q)] };
        (error, self.bound.s(p, q))
    }

    fn w3(&self, row: usize, q: usize) -> (f64, f64) {
        let ((_, l, m), p) = (CYCLIC[row / self.nf], row % self.nf);
        (self.s(&[(l, m), (m, l)], p, q), self.bound.s(p, q))
    }

    fn c2(&self, k: usize, p: usize) -> (f64, f64) {
        let (_, l, m) = CYCLIC[k];
        (self.ibar((l, m), (m, l), p), self.bound.c2(k, p))
    }
}

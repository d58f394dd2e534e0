//! Double-double arithmetic: a number is the unevaluated sum of two, with 106 bits; block products of exact entries with
//! fixed partitions, and small symmetric eigenproblems.
//!
//! The crate `twofloat` is not used: its sums take six times as long, because its products call the fused multiply-add
//! as a function and its sums do not vectorise. Algorithms and error bounds: M. Joldes, J.-M. Muller, V. Popescu,
//! *Tight and rigorous error bounds for basic building blocks of double-word arithmetic*, ACM Trans. Math. Softw. 44
//! (2017). With u = 2^-53, relative errors are at most 3 u^2 for a sum, 4 u^2 for a product and 15 u^2 for a quotient,
//! without overflow or underflow.

use super::columns::contiguous;
use super::{SymmetricMatrix, parallel};
use faer::{Mat, MatRef};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number hi + lo, where hi is the sum rounded to the nearest f64.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DoubleDouble {
    /// Number rounded to f64.
    pub hi: f64,
    /// Remainder.
    pub lo: f64,
}

/// Returns s and e with a + b = s + e exactly.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// Returns s and e with a + b = s + e exactly, for |a| >= |b|.
#[inline(always)]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

/// Returns p and e with a b = p + e exactly.
#[inline(always)]
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    (p, a.mul_add(b, -p))
}

impl DoubleDouble {
    /// Returns a + b exactly.
    pub fn sum(a: f64, b: f64) -> Self {
        let (hi, lo) = two_sum(a, b);
        Self { hi, lo }
    }

    /// Returns a b exactly.
    pub fn product(a: f64, b: f64) -> Self {
        let (hi, lo) = two_product(a, b);
        Self { hi, lo }
    }

    /// Returns the square root; NaN for negative numbers.
    pub fn sqrt(self) -> Self {
        if self.hi == 0.0 {
            return self;
        }
        // One Newton step from the root of the leading part.
        let root = self.hi.sqrt();
        let (p, e) = two_product(root, root);
        let (hi, lo) = fast_two_sum(root, ((self.hi - p) - e + self.lo) / (2.0 * root));
        Self { hi, lo }
    }

    /// Returns a lower bound in f64, at most three units in the last place below the number.
    pub fn below(self) -> f64 {
        self.hi.next_down().next_down()
    }

    /// Returns an upper bound in f64, at most three units in the last place above the number.
    pub fn above(self) -> f64 {
        self.hi.next_up().next_up()
    }
}

impl From<f64> for DoubleDouble {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (s, e) = two_sum(self.hi, other.hi);
        let (t, f) = two_sum(self.lo, other.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Self { hi, lo }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let (p, e) = two_product(self.hi, other.hi);
        let cross = self.hi.mul_add(other.lo, self.lo * other.lo);
        let (hi, lo) = fast_two_sum(p, e + self.lo.mul_add(other.hi, cross));
        Self { hi, lo }
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        let (p, e) = two_product(self.hi, factor);
        let (hi, lo) = fast_two_sum(p, self.lo.mul_add(factor, e));
        Self { hi, lo }
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.hi / other.hi;
        let rest = self - other * quotient;
        let (hi, lo) = fast_two_sum(quotient, (rest.hi + rest.lo) / other.hi);
        Self { hi, lo }
    }
}

/// Adds a x to hi + lo, lane by lane, with exact products.
///
/// After N additions the error of a lane is at most 4 u^2 (N + 1) times its sum of all |a x|.
#[inline(always)]
pub fn accumulate<const W: usize>(hi: &mut [f64; W], lo: &mut [f64; W], a: f64, x: &[f64; W]) {
    for w in 0..W {
        let (p, e) = two_product(a, x[w]);
        let (s, t) = two_sum(hi[w], p);
        (hi[w], lo[w]) = fast_two_sum(s, t + (e + lo[w]));
    }
}

/// Adds a (x + y) to hi + lo, lane by lane, for |y| <= u |x|. After N additions the error of a lane is at most
/// 4 u^2 (N + 3) times its sum of all |a x|.
#[inline(always)]
pub fn accumulate_pair<const W: usize>(
    hi: &mut [f64; W],
    lo: &mut [f64; W],
    a: f64,
    (x, y): (&[f64; W], &[f64; W]),
) {
    for w in 0..W {
        let (p, e) = two_product(a, x[w]);
        let (s, t) = two_sum(hi[w], p);
        (hi[w], lo[w]) = fast_two_sum(s, t + (a.mul_add(y[w], e) + lo[w]));
    }
}

/// Runs `work` compiled for the instruction set of this processor. The result has the same bits on every processor.
pub fn with_fma<R>(work: impl FnOnce() -> R) -> R {
    struct Work<F>(F);
    impl<R, F: FnOnce() -> R> pulp::NullaryFnOnce for Work<F> {
        type Output = R;
        #[inline(always)]
        fn call(self) -> R {
            (self.0)()
        }
    }
    pulp::Arch::new().dispatch(Work(work))
}

/// Number of columns of a block.
pub const LANES: usize = 8;

/// Number of rows per parallel task and per partial sum. The partition fixes the order of the sums.
const ROWS_PER_TASK: usize = 1024;

/// Block of n rows and up to [`LANES`] columns of double-double numbers; unused columns are zero.
#[derive(Debug, Clone)]
pub struct CompensatedBlock {
    hi: Vec<[f64; LANES]>,
    lo: Vec<[f64; LANES]>,
}

impl CompensatedBlock {
    /// Returns the entry in `row` and `column`.
    pub fn get(&self, row: usize, column: usize) -> DoubleDouble {
        DoubleDouble { hi: self.hi[row][column], lo: self.lo[row][column] }
    }

    /// Adds another block of equal size.
    pub fn add(&mut self, other: &Self) {
        for row in 0..self.hi.len() {
            for c in 0..LANES {
                let sum = self.get(row, c) + other.get(row, c);
                (self.hi[row][c], self.lo[row][c]) = (sum.hi, sum.lo);
            }
        }
    }
}

/// Returns (A kron I_block) X for X of `block * A.n()` rows and at most [`LANES`] columns.
///
/// With r entries in the row, the error of an entry is at most 4 u^2 (r + 1) (|A| |X|), u = 2^-53.
///
/// # Panics
/// If the shapes disagree.
pub fn multiply_compensated(a: &SymmetricMatrix, block: usize, x: MatRef<'_, f64>) -> CompensatedBlock {
    let n = a.n() * block;
    assert!(x.nrows() == n && x.ncols() <= LANES, "shapes of a compensated product");
    // Pack the columns row by row.
    let mut packed = vec![[0.0; LANES]; n];
    for c in 0..x.ncols() {
        for (row, value) in packed.iter_mut().zip(x.col(c).iter()) {
            row[c] = *value;
        }
    }
    let (mut hi, mut lo) = (vec![[0.0; LANES]; n], vec![[0.0; LANES]; n]);
    let tasks = hi.chunks_mut(ROWS_PER_TASK).zip(lo.chunks_mut(ROWS_PER_TASK)).enumerate();
    parallel::for_each(tasks, |(chunk, (hi, lo))| {
        with_fma(
            #[inline(always)]
            || {
                for (r, (hi, lo)) in hi.iter_mut().zip(lo).enumerate() {
                    let row = chunk * ROWS_PER_TASK + r;
                    let (node, component) = (row / block, row % block);
                    let (columns, values) = a.row(node);
                    for (&j, &value) in columns.iter().zip(values) {
                        accumulate(hi, lo, value, &packed[j as usize * block + component]);
                    }
                }
            },
        );
    });
    CompensatedBlock { hi, lo }
}

/// Returns A'Y for A (n x m), as m rows of [`LANES`] numbers.
///
/// The error of an entry is at most 4 u^2 [`sum_length`] |A|'|Y|.
///
/// # Panics
/// If the numbers of rows differ.
pub fn gram_compensated(a: MatRef<'_, f64>, y: &CompensatedBlock) -> Vec<[DoubleDouble; LANES]> {
    let n = a.nrows();
    assert_eq!(n, y.hi.len(), "rows of a compensated Gram product");
    let partial: Vec<Vec<[DoubleDouble; LANES]>> =
        parallel::map(parallel::ranges(n, ROWS_PER_TASK), |rows| {
            let column = |c: usize| {
                let (mut hi, mut lo) = ([0.0; LANES], [0.0; LANES]);
                let factors = contiguous(a.col(c));
                with_fma(
                    #[inline(always)]
                    || {
                        for r in rows.clone() {
                            accumulate_pair(&mut hi, &mut lo, factors[r], (&y.hi[r], &y.lo[r]));
                        }
                    },
                );
                std::array::from_fn(|w| DoubleDouble { hi: hi[w], lo: lo[w] })
            };
            (0..a.ncols()).map(column).collect()
        });
    // Add the partial sums in fixed order.
    let mut total = vec![[DoubleDouble::default(); LANES]; a.ncols()];
    for part in &partial {
        for (sum, part) in total.iter_mut().zip(part) {
            for (sum, part) in sum.iter_mut().zip(part) {
                *sum = *sum + *part;
            }
        }
    }
    total
}

/// Returns X' A X as rows of a symmetric matrix, computed in panels of [`LANES`] columns.
///
/// # Panics
/// If the shapes disagree.
pub fn projection_compensated(a: &SymmetricMatrix, x: MatRef<'_, f64>) -> Vec<Vec<DoubleDouble>> {
    let count = x.ncols();
    let mut projection = vec![vec![DoubleDouble::default(); count]; count];
    for start in (0..count).step_by(LANES) {
        let width = LANES.min(count - start);
        let product = multiply_compensated(a, 1, x.subcols(start, width));
        let gram = gram_compensated(x.subcols(0, start + width), &product);
        for c in 0..width {
            for i in 0..=start + c {
                projection[i][start + c] = gram[i][c];
                projection[start + c][i] = gram[i][c];
            }
        }
    }
    projection
}

/// Returns an upper bound of the number of additions that affect a term of a sum over `n` rows, with a margin for the
/// surrounding operations.
pub fn sum_length(n: usize) -> f64 {
    (ROWS_PER_TASK.min(n) + n.div_ceil(ROWS_PER_TASK) + 16) as f64
}

/// Largest number of Jacobi sweeps. Convergence is quadratic and the input is nearly diagonal, so that few are needed.
const MAX_JACOBI_SWEEPS: usize = 30;

/// Off-diagonal entries count as zero below this part of the diagonal.
const NEGLIGIBLE_OFF_DIAGONAL: f64 = 1e-33;

/// Rows of a full matrix.
type Rows = Vec<Vec<DoubleDouble>>;

/// Eigenpairs of a small pencil.
#[derive(Debug, Clone)]
pub struct SmallEigen {
    /// Eigenvalues, ascending.
    pub values: Vec<DoubleDouble>,
    /// Eigenvectors, rounded to f64: one column per eigenvalue, orthonormal in the second matrix.
    pub vectors: Mat<f64>,
}

/// Computes the eigenpairs of P x = kappa Q x. P and Q are rows of full matrices, symmetric positive definite and
/// scaled so that their diagonals dominate. Returns `None` if they are not positive definite or not finite.
///
/// The method is Cholesky of Q, then Jacobi on L^-1 P L^-T. For such matrices both are accurate relative to every
/// single eigenvalue (J. Demmel, K. Veselic, *Jacobi's method is more accurate than QR*, SIAM J. Matrix Anal. Appl. 13,
/// 1992): the relative error is a small multiple of the order of the pencil times 2^-106.
pub fn small_pencil(mut p: Rows, q: &Rows) -> Option<SmallEigen> {
    let n = q.len();
    let l = cholesky(q)?;
    // P <- L^-1 P L^-T: solve with L for the rows, then for the columns.
    for _ in 0..2 {
        solve_lower(&l, &mut p);
        p = transposed(&p);
    }
    // Rows of `turned` are the eigenvectors J of the transformed matrix.
    let mut turned = identity(n);
    jacobi(&mut p, &mut turned)?;
    // X = L^-T J, and X' = J' L^-1.
    let mut inverse = identity(n);
    solve_lower(&l, &mut inverse);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| p[a][a].hi.total_cmp(&p[b][b].hi).then(p[a][a].lo.total_cmp(&p[b][b].lo)));
    let entry = |row: usize, place: usize| {
        let terms = turned[order[place]].iter().zip(&inverse);
        terms.fold(DoubleDouble::default(), |sum, (&j, inverse)| sum + j * inverse[row]).hi
    };
    let vectors = Mat::from_fn(n, n, entry);
    Some(SmallEigen { values: order.iter().map(|&i| p[i][i]).collect(), vectors })
}

fn identity(n: usize) -> Rows {
    let entry = |i: usize, j: usize| DoubleDouble::from(if i == j { 1.0 } else { 0.0 });
    (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
}

fn transposed(a: &Rows) -> Rows {
    (0..a.len()).map(|i| a.iter().map(|row| row[i]).collect()).collect()
}

/// Solves in place: A <- L^-1 A.
fn solve_lower(l: &Rows, a: &mut Rows) {
    for (i, factors) in l.iter().enumerate() {
        let (above, below) = a.split_at_mut(i);
        for (row, &factor) in above.iter().zip(factors) {
            for (target, &value) in below[0].iter_mut().zip(row) {
                *target = *target - factor * value;
            }
        }
        for value in &mut below[0] {
            *value = *value / factors[i];
        }
    }
}

/// Returns the lower Cholesky factor; `None` if A is not positive definite.
fn cholesky(a: &Rows) -> Option<Rows> {
    let n = a.len();
    let mut l = vec![vec![DoubleDouble::default(); n]; n];
    for i in 0..n {
        for j in 0..=i {
            let known = l[i][..j].iter().zip(&l[j][..j]);
            let sum = known.fold(a[i][j], |sum, (&x, &y)| sum - x * y);
            if i == j {
                if !(sum.hi > 0.0 && sum.hi.is_finite()) {
                    return None;
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    Some(l)
}

/// Diagonalises A by cyclic Jacobi rotations, which are also applied to the rows of `turned`. Returns `None` if they do
/// not converge to positive numbers.
fn jacobi(a: &mut Rows, turned: &mut Rows) -> Option<()> {
    let n = a.len();
    for _ in 0..MAX_JACOBI_SWEEPS {
        let mut rotated = false;
        for i in 0..n {
            for j in 0..i {
                let size = (a[i][i].hi * a[j][j].hi).sqrt();
                if !(size > 0.0 && size.is_finite() && a[i][j].hi.is_finite()) {
                    return None;
                }
                if a[i][j].hi.abs() > NEGLIGIBLE_OFF_DIAGONAL * size {
                    let (c, s) = rotate(a, i, j);
                    let (above, below) = turned.split_at_mut(i);
                    for (x, y) in below[0].iter_mut().zip(&mut above[j]) {
                        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                    }
                    rotated = true;
                }
            }
        }
        if !rotated {
            return Some(());
        }
    }
    None
}

/// Rotates rows and columns i and j so that entry (i, j) becomes zero. Returns cosine and sine.
fn rotate(a: &mut Rows, i: usize, j: usize) -> (DoubleDouble, DoubleDouble) {
    let one = DoubleDouble::from(1.0);
    let off = a[i][j];
    // t = tan(angle) is the smaller root of t^2 + 2 z t - 1 = 0.
    let z = (a[j][j] - a[i][i]) / (off * 2.0);
    let size = if z.hi < 0.0 { -z } else { z };
    // Beyond 1e30, z^2 + 1 equals z^2 to all digits and could overflow.
    let t = if size.hi > 1e30 { one / (size * 2.0) } else { one / (size + (z * z + one).sqrt()) };
    let t = if z.hi < 0.0 { -t } else { t };
    let c = one / (t * t + one).sqrt();
    let s = t * c;
    a[i][i] = a[i][i] - t * off;
    a[j][j] = a[j][j] + t * off;
    a[i][j] = DoubleDouble::default();
    a[j][i] = DoubleDouble::default();
    for k in (0..a.len()).filter(|&k| k != i && k != j) {
        let (x, y) = (a[k][i], a[k][j]);
        let (x, y) = (c * x - s * y, s * x + c * y);
        (a[k][i], a[i][k]) = (x, x);
        (a[k][j], a[j][k]) = (y, y);
    }
    (c, s)
}

//! A block Krylov basis of (K + tau M)^-1 M, M-orthonormal and M-orthogonal to the rigid modes.

use super::problem::EigenProblem;
use faer::prelude::{IntoConst, ReborrowMut};
use faer::{ColRef, Mat, MatRef};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Solve, Tall, combine, combine_in_place, dense_cholesky, divide, full_qr, gram, solve_upper,
    subtract_combination, uniform, weighted_square,
};
use libm::{exp2, log2};

/// Part of a vector's squared norm in the diagonal of M below which its squared M-norm counts as zero: such a vector
/// lies in the null space of M, and its M-norm is the rounding of the product.
const NULL_SPACE_FRACTION: f64 = 1e-13;

/// Part of a vector's M-norm below which its remainder after projection counts as zero: such a vector lies in the
/// basis, and the remainder is rounding.
const DEPENDENT_FRACTION: f64 = 1e-13;

/// Multiple of [`NULL_SPACE_FRACTION`] and [`DEPENDENT_FRACTION`] below which columns are orthonormalised one by one.
const ONE_BY_ONE_MULTIPLE: f64 = 1e4;

/// Smallest part of a column that may remain after projection off the columns before it without loss of a digit.
const MIN_REMAINDER: f64 = 0.1;

/// Basis V (N x m), the projected operator T = V' M OP V, and M times the newest block.
pub(super) struct Krylov<'a> {
    problem: &'a EigenProblem<'a>,
    context: Context<'a>,
    v: Tall,
    /// Projected operator; its number of rows is the capacity of the basis.
    t: Mat<f64>,
    /// Number of columns of the newest block, to which the operator has not been applied.
    fresh: usize,
    /// M times the newest block.
    m_fresh: Mat<f64>,
    /// Coupling B (fresh x previous block): OP V = V T + V_fresh B E'.
    coupling: Mat<f64>,
    /// First column of the basis that the operator couples to the newest block.
    first_coupled: usize,
    random: u64,
    mass_diagonal: Vec<f64>,
}

/// An M-orthonormalised block W and M W.
struct Block {
    w: Mat<f64>,
    mw: Mat<f64>,
    /// Coefficients that were subtracted: W_given = V h + W b.
    h: Mat<f64>,
    b: Mat<f64>,
}

impl<'a> Krylov<'a> {
    /// Creates an empty basis for at most `capacity` vectors.
    pub(super) fn new(problem: &'a EigenProblem<'a>, capacity: usize, context: &Context<'a>) -> Self {
        let n = problem.pencil.n();
        Self {
            problem,
            context: *context,
            v: Tall::with_capacity(n, capacity),
            t: Mat::zeros(capacity, capacity),
            fresh: 0,
            m_fresh: Mat::zeros(0, 0),
            coupling: Mat::zeros(0, 0),
            first_coupled: 0,
            random: 0,
            mass_diagonal: problem.pencil.mass_diagonal(),
        }
    }

    /// Sets the seed of the next random block.
    pub(super) fn choose_random(&mut self, seed: u64) {
        self.random = seed;
    }

    /// Returns the number of vectors to which the operator has been applied: the valid size of T.
    pub(super) fn projected(&self) -> usize {
        self.size() - self.fresh
    }

    /// Returns the number of vectors of the basis.
    fn size(&self) -> usize {
        self.v.ncols()
    }

    /// Returns the number of vectors that can still be added.
    pub(super) fn free_columns(&self) -> usize {
        self.t.nrows() - self.size()
    }

    /// Returns true when the newest block is empty: the basis spans an invariant subspace.
    pub(super) fn exhausted(&self) -> bool {
        self.fresh == 0
    }

    /// Returns T (projected x projected).
    pub(super) fn t(&self) -> MatRef<'_, f64> {
        self.t.as_ref().submatrix(0, 0, self.projected(), self.projected())
    }

    /// Returns the norms |B s_last| of the columns of S (projected x k): the M-norms of the Ritz residuals of the
    /// operator.
    pub(super) fn residual_norms(&self, s: MatRef<'_, f64>) -> Vec<f64> {
        let last = self.coupling.ncols();
        let tail = s.subrows(self.projected() - last, last);
        let r = combine(self.coupling.as_ref(), tail);
        (0..s.ncols()).map(|j| r.col(j).norm_l2()).collect()
    }

    /// Returns OP V S / theta = V S + V_fresh (B S_last) / theta, column by column, for the Ritz vectors S (projected x
    /// k) with values theta. This is one inverse iteration on them that needs no solve, because OP V = V T + V_fresh B
    /// E' holds already. It damps the remainders of higher modes, and removes components in the null space of M from
    /// the vectors.
    pub(super) fn inverse_iterated(&self, s: MatRef<'_, f64>, theta: &[f64]) -> Mat<f64> {
        let (size, last) = (self.projected(), self.coupling.ncols());
        let residual = combine(self.coupling.as_ref(), s.subrows(size - last, last));
        let coefficients = Mat::from_fn(size + residual.nrows(), s.ncols(), |i, j| {
            if i < size { s[(i, j)] } else { residual[(i - size, j)] / theta[j] }
        });
        combine(self.v.as_ref(), coefficients.as_ref())
    }

    /// Returns V S for S (projected x k).
    pub(super) fn combination(&self, s: MatRef<'_, f64>) -> Mat<f64> {
        combine(self.v.first(self.projected()), s)
    }

    /// Appends the orthonormalised block `x`. Columns that depend on the basis are dropped.
    pub(super) fn append(&mut self, x: Mat<f64>) {
        let block = self.orthonormalise(x, 0);
        self.first_coupled = 0;
        self.coupling = Mat::zeros(block.w.ncols(), 0);
        self.push(block);
    }

    /// Appends a deterministic random block of `width` columns. One application of the operator removes its components
    /// in the null space of M.
    pub(super) fn append_random(&mut self, width: usize, factor: &dyn Solve) {
        let n = self.problem.pencil.n();
        let seed = self.random;
        self.random += 1;
        // The columns are scaled to an M-norm of about one, by a power of two, so that the squares of the result are in
        // range in any units.
        let heaviest = self.mass_diagonal.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let unit = exp2((-0.5 * log2(heaviest)).round());
        let x = Mat::from_fn(n, width, |i, j| unit * uniform(seed, i as u64, j as u64));
        self.context.count(|work| work.mass_columns += width as u64);
        let mut y = self.problem.pencil.apply_mass(x.as_ref());
        self.context.count(|work| work.solved_columns += width as u64);
        factor.solve_in_place(y.as_mut());
        self.append(y);
    }

    /// Performs one Lanczos step: applies the operator to the newest block and appends the new directions.
    pub(super) fn step(&mut self, factor: &dyn Solve) {
        let old = self.fresh;
        let at = self.size() - old;
        let mut w = std::mem::replace(&mut self.m_fresh, Mat::zeros(0, 0));
        self.context.count(|work| work.solved_columns += old as u64);
        factor.solve_in_place(w.as_mut());
        let block = self.orthonormalise(w, self.first_coupled);
        self.first_coupled = at;
        for j in 0..old {
            for i in 0..self.size() {
                // The diagonal block of h is symmetric up to rounding; the mean keeps T exactly symmetric.
                let value = if i >= at {
                    0.5 * (block.h[(i, j)] + block.h[(at + j, i - at)])
                } else {
                    block.h[(i, j)]
                };
                self.t[(i, at + j)] = value;
                self.t[(at + j, i)] = value;
            }
        }
        self.coupling = block.b.clone();
        self.push(block);
    }

    /// Performs a thick restart: keeps the Ritz vectors V S (S: projected x k) with values theta, and the newest block.
    pub(super) fn restart(&mut self, s: MatRef<'_, f64>, theta: &[f64]) {
        let projected = self.projected();
        let fresh = self.v.columns(projected..self.size()).to_owned();
        combine_in_place(self.v.columns_mut(0..projected), s);
        self.v.truncate(s.ncols());
        self.v.push(fresh.as_ref());
        self.t.fill(0.0);
        for (i, &value) in theta.iter().enumerate() {
            self.t[(i, i)] = value;
        }
        self.first_coupled = 0;
    }

    /// Continues with the operator of another shift, tau' = tau + `difference`, in the same space (the rational Krylov
    /// method: Ruhe, Linear Algebra Appl. 197/198 (1994) 283). With the newest block F, W = [V, F] and H = [T; B E']
    /// satisfy (K + tau M) W H = M V, so that
    ///
    /// (K + tau' M) W H = M W A, A = [I; 0] + (tau' - tau) H.
    ///
    /// With A = Q R, Q = [Q1, Q2] orthogonal, W Q1 is the basis and W Q2 its newest block: with Q_1, Q_2 the first rows
    /// of Q1, Q2, one for each column of T, T' = (I - Q_1' R^-1) / (tau' - tau) and B' = -Q_2' R^-1 / (tau' - tau).
    pub(super) fn change_shift(&mut self, difference: f64) {
        let (size, all, last) = (self.projected(), self.size(), self.coupling.ncols());
        let h = |i: usize, j: usize| match (i < size, j + last >= size) {
            (true, _) => self.t[(i, j)],
            (false, true) => self.coupling[(i - size, j + last - size)],
            (false, false) => 0.0,
        };
        let a = Mat::from_fn(all, size, |i, j| f64::from(u8::from(i == j)) + difference * h(i, j));
        // A = Q R.
        let (q, r) = full_qr(a);
        // Q_1' R^-1 over Q_2' R^-1.
        let inverse = solve_upper(&r.transpose().to_owned(), &Mat::identity(size, size));
        let product = combine(q.as_ref().subrows(0, size).transpose(), inverse.as_ref());
        let t = |i: usize, j: usize| (f64::from(u8::from(i == j)) - product[(i, j)]) / difference;
        // T', made exactly symmetric, and B'.
        for (i, j) in (0..size * size).map(|k| (k % size, k / size)) {
            self.t[(i, j)] = 0.5 * (t(i, j) + t(j, i));
        }
        self.coupling = Mat::from_fn(all - size, size, |i, j| -product[(size + i, j)] / difference);
        // The rotated basis W Q, with the product of its newest block.
        combine_in_place(self.v.as_mut(), q.as_ref());
        self.context.count(|work| work.mass_columns += (all - size) as u64);
        self.m_fresh = self.problem.pencil.apply_mass(self.v.columns(size..all));
        self.first_coupled = 0;
    }

    fn push(&mut self, block: Block) {
        self.fresh = block.w.ncols();
        self.v.push(block.w.as_ref());
        self.m_fresh = block.mw;
    }

    /// Orthonormalises a block in two passes: block Gram-Schmidt against the rigid modes and the basis, then column by
    /// column inside the block. The first pass leaves out the columns before `first_coupled`, where the operator leaves
    /// only rounding. The second pass works on unit vectors, so that even a direction that lost ten digits in the first
    /// pass is orthogonal to rounding at the end. Only columns that are entirely rounding are dropped.
    fn orthonormalise(&self, mut w: Mat<f64>, first_coupled: usize) -> Block {
        let pencil = &self.problem.pencil;
        let width = w.ncols();
        let basis = self.v.as_ref();
        let mut h = Mat::zeros(self.size(), width);
        let mut b = Mat::<f64>::identity(width, width);
        self.context.count(|work| work.mass_columns += w.ncols() as u64);
        let mut mw = pencil.apply_mass(w.as_ref());
        let mut norms = sizes(&gram(w.as_ref(), mw.as_ref()));
        for from in [first_coupled, 0] {
            let basis = basis.subcols(from, self.size() - from);
            // Projection off the rigid modes and the basis.
            let rigid = gram(self.problem.rigid, mw.as_ref());
            let part = gram(basis, mw.as_ref());
            subtract_combination(w.as_mut(), self.problem.rigid, rigid.as_ref());
            subtract_combination(w.as_mut(), basis, part.as_ref());
            let mut h = h.as_mut().subrows_mut(from, self.size() - from);
            h += combine(part.as_ref(), b.as_ref());
            self.context.count(|work| work.mass_columns += w.ncols() as u64);
            pencil.mass_times(w.as_ref(), mw.as_mut());
            // Orthonormalisation inside the block, with M W carried along.
            let null_limit =
                |w: ColRef<'_, f64>| NULL_SPACE_FRACTION * weighted_square(w, &self.mass_diagonal);
            let t = orthonormalise_at_once(&mut w, &mut mw, &norms, &null_limit)
                .unwrap_or_else(|| gram_schmidt(&mut w, &mut mw, &norms, &null_limit));
            // The carried products have lost a digit: they are computed again.
            if loses_digits(&t) {
                self.context.count(|work| work.mass_columns += w.ncols() as u64);
                pencil.mass_times(w.as_ref(), mw.as_mut());
            }
            norms = vec![1.0; w.ncols()];
            b = combine(t.as_ref(), b.as_ref());
        }
        // Columns beyond the capacity of the basis are left out.
        let free_columns = self.free_columns();
        if w.ncols() > free_columns {
            w = w.as_ref().subcols(0, free_columns).to_owned();
            mw = mw.as_ref().subcols(0, free_columns).to_owned();
            b = b.as_ref().subrows(0, free_columns).to_owned();
        }
        Block { w, mw, h, b }
    }
}

/// Returns true when Gram-Schmidt with the coefficients `t` has left less than a tenth of a column: the products with M
/// that were carried along have then lost a digit.
fn loses_digits(t: &Mat<f64>) -> bool {
    (0..t.ncols()).any(|j| {
        let before = t.col(j).norm_l2();
        let left = (0..t.nrows()).rev().map(|i| t[(i, j)].abs()).find(|entry| *entry > 0.0);
        left.is_some_and(|left| left < MIN_REMAINDER * before)
    })
}

/// Returns the square roots of the diagonal, with zero for negative entries.
fn sizes(gram: &Mat<f64>) -> Vec<f64> {
    (0..gram.ncols()).map(|j| gram[(j, j)].max(0.0).sqrt()).collect()
}

/// M-orthonormalises the columns of W in place by the Cholesky factor of their Gram matrix, and carries M W along. This
/// takes a few passes over the block, where Gram-Schmidt takes a few for each column. Returns T with W_old = W_new T.
///
/// Returns `None` and changes nothing unless every column is well above the limits of Gram-Schmidt for dropping it, and
/// keeps a tenth of its norm beside the columns before it. The columns are then orthonormal to a few digits less than
/// all.
fn orthonormalise_at_once(
    w: &mut Mat<f64>,
    mw: &mut Mat<f64>,
    norms: &[f64],
    null_limit: &dyn Fn(ColRef<'_, f64>) -> f64,
) -> Option<Mat<f64>> {
    let width = w.ncols();
    let g = gram(w.as_ref(), mw.as_ref());
    let sizes = sizes(&g);
    let is_clear = |j: usize| {
        sizes[j] > ONE_BY_ONE_MULTIPLE * DEPENDENT_FRACTION * norms[j]
            && g[(j, j)] > ONE_BY_ONE_MULTIPLE * null_limit(w.col(j))
    };
    let cosine = |i: usize, j: usize| 0.5 * (g[(i, j)] + g[(j, i)]) / (sizes[i] * sizes[j]);
    let l = (0..width).all(is_clear).then(|| dense_cholesky(Mat::from_fn(width, width, cosine)))??;
    let keeps = |j: usize| l[(j, j)] >= MIN_REMAINDER;
    (0..width).all(keeps).then(|| {
        let inverse = solve_upper(&l, &Mat::identity(width, width));
        let inverse = Mat::from_fn(width, width, |i, j| inverse[(i, j)] / sizes[i]);
        [&mut *w, &mut *mw].into_iter().for_each(|block| combine_in_place(block.as_mut(), inverse.as_ref()));
        Mat::from_fn(width, width, |i, j| l[(j, i)] * sizes[j])
    })
}

/// Returns w_i' (M w)_j.
fn dot(w: &Mat<f64>, mw: &Mat<f64>, i: usize, j: usize) -> f64 {
    gram(w.as_ref().subcols(i, 1), mw.as_ref().subcols(j, 1))[(0, 0)]
}

/// M-orthonormalises the columns of W in place, and carries M W along. A column is dropped if it keeps less than
/// [`DEPENDENT_FRACTION`] of its earlier norm, or if its square does not exceed `null_limit`. Returns T (new x old)
/// with W_old = W_new T.
fn gram_schmidt(
    w: &mut Mat<f64>,
    mw: &mut Mat<f64>,
    norms: &[f64],
    null_limit: &dyn Fn(ColRef<'_, f64>) -> f64,
) -> Mat<f64> {
    let width = w.ncols();
    let mut t = Mat::zeros(width, width);
    let mut kept = 0;
    for j in 0..width {
        // Two passes, because one pass may lose digits.
        for _ in 0..2 {
            let along = gram(w.as_ref().subcols(0, kept), mw.as_ref().subcols(j, 1));
            for block in [&mut *w, &mut *mw] {
                let (done, rest) = block.as_mut().split_at_col_mut(j);
                subtract_combination(
                    rest.subcols_mut(0, 1),
                    done.into_const().subcols(0, kept),
                    along.as_ref(),
                );
            }
            let mut column = t.as_mut().submatrix_mut(0, j, kept, 1);
            column += along;
        }
        let square = dot(w, mw, j, j);
        let norm = square.max(0.0).sqrt();
        if norm <= DEPENDENT_FRACTION * norms[j] || square <= null_limit(w.col(j)) {
            continue;
        }
        t[(kept, j)] = norm;
        for block in [&mut *w, &mut *mw] {
            if kept < j {
                let (mut done, rest) = block.as_mut().split_at_col_mut(j);
                done.rb_mut().col_mut(kept).copy_from(rest.col(0));
            }
            divide(block.col_mut(kept), norm);
        }
        kept += 1;
    }
    *w = w.as_ref().subcols(0, kept).to_owned();
    *mw = mw.as_ref().subcols(0, kept).to_owned();
    t.as_ref().subrows(0, kept).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_linalg::{Analysis, Cholesky, CscMatrix, Indefinite, Pencil, SymmetricMatrix};

    /// Returns four columns, the last of which is nearly the sum of the others, up to `apart`.
    fn block(apart: f64) -> Mat<f64> {
        let wave = |i: usize, j: usize| ((i * (2 * j + 3)) as f64).sin();
        Mat::from_fn(90, 4, |i, j| match j {
            3 => (0..3).map(|k| wave(i, k)).sum::<f64>() + apart * wave(i, 3),
            _ => 3f64.powi(j as i32) * wave(i, j),
        })
    }

    /// Returns M times a block, for masses from one to two.
    fn weighted(x: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(x.nrows(), x.ncols(), |i, j| (1.0 + (i % 5) as f64 / 5.0) * x[(i, j)])
    }

    fn all_seen(_: ColRef<'_, f64>) -> f64 {
        0.0
    }

    #[test]
    fn a_block_is_orthonormalised_alike_at_once_and_column_by_column() {
        let given = block(1.0);
        let norms = sizes(&gram(given.as_ref(), weighted(&given).as_ref()));
        let (mut w, mut mw) = (given.clone(), weighted(&given));
        let t = orthonormalise_at_once(&mut w, &mut mw, &norms, &all_seen).expect("far from dependent");
        assert!((gram(w.as_ref(), weighted(&w).as_ref()) - Mat::<f64>::identity(4, 4)).norm_max() < 1e-14);
        assert!((weighted(&w) - &mw).norm_max() < 1e-14);
        assert!((combine(w.as_ref(), t.as_ref()) - &given).norm_max() < 1e-13);
        let (mut slow, mut m_slow) = (given.clone(), weighted(&given));
        let t_slow = gram_schmidt(&mut slow, &mut m_slow, &norms, &all_seen);
        assert!((&slow - &w).norm_max() < 1e-13 && (&t_slow - &t).norm_max() < 1e-13);
    }

    /// Returns stiffness and mass of a chain of springs of varying stiffness, whose ends are fixed.
    fn chain(n: usize) -> [SymmetricMatrix; 2] {
        let spring = |i: usize| 1.0 + (i % 5) as f64;
        let entries = (0..n).flat_map(|i| {
            let off = (i + 1 < n).then_some([(i, i + 1), (i + 1, i)]).into_iter().flatten();
            let off = off.map(move |(row, column)| (row as u32, column as u32, -spring(i + 1)));
            off.chain([(i as u32, i as u32, spring(i) + spring(i + 1))])
        });
        let stiffness: Vec<_> = entries.collect();
        let mass: Vec<_> = (0..n as u32).map(|i| (i, i, 1.0 + f64::from(i % 3))).collect();
        [stiffness, mass].map(|t| SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &t)))
    }

    /// The relation behind all results, (K - sigma M)^-1 M V = V T + F B, holds after a change of the shift, and the
    /// basis is as orthonormal as before.
    #[test]
    fn a_basis_goes_over_to_another_shift() {
        let [k, m] = chain(300);
        let rigid = Mat::zeros(300, 0);
        let problem = EigenProblem {
            pencil: Pencil::new(&k, &m, 1),
            rigid: rigid.as_ref(),
            first_estimate: 1e-3,
            input_error: 0.0,
            order: None,
        };
        let analysis = Analysis::new(&problem.pencil).expect("small");
        let (tau, sigma) = (1e-3, 0.05);
        let first = Cholesky::<f64>::new(&analysis, &problem.pencil, tau).expect("positive definite");
        let second = Indefinite::<f64>::new(&analysis, &problem.pencil, sigma);
        let mut krylov = Krylov::new(&problem, 80, &Context::QUIET);
        krylov.append_random(3, &first);
        (0..12).for_each(|_| krylov.step(&first));
        krylov.change_shift(-sigma - tau);
        for step in 0..4 {
            let (size, all) = (krylov.projected(), krylov.size());
            let v = krylov.v.columns(0..size);
            let mut product = problem.pencil.apply_mass(v);
            Solve::solve_in_place(&second, product.as_mut());
            let last = krylov.coupling.ncols();
            let mut expected = combine(v, krylov.t());
            let newest = combine(krylov.v.columns(size..all), krylov.coupling.as_ref());
            let mut coupled = expected.as_mut().subcols_mut(size - last, last);
            coupled += newest;
            let scale = krylov.t().norm_max();
            let off = (&product - &expected).norm_max();
            assert!(off < 1e-12 * scale, "after {step} steps: {off:e} of {scale:e}");
            let mass = problem.pencil.apply_mass(krylov.v.as_ref());
            let off = (gram(krylov.v.as_ref(), mass.as_ref()) - Mat::<f64>::identity(all, all)).norm_max();
            assert!(off < 1e-13, "after {step} steps: {off:e}");
            assert!((krylov.m_fresh.as_ref() - mass.as_ref().subcols(size, all - size)).norm_max() < 1e-13);
            krylov.step(&second);
        }
    }

    #[test]
    fn what_may_be_dependent_is_left_to_gram_schmidt() {
        for apart in [0.0, 1e-9, 1e-3] {
            let given = block(apart);
            let norms = sizes(&gram(given.as_ref(), weighted(&given).as_ref()));
            let (mut w, mut mw) = (given.clone(), weighted(&given));
            assert!(orthonormalise_at_once(&mut w, &mut mw, &norms, &all_seen).is_none(), "{apart:e}");
            assert_eq!(w, given, "{apart:e}: changed");
        }
        // A column that vanished relative to its earlier norm, and a column in the null space of M.
        let given = block(1.0);
        let (mut w, mut mw) = (given.clone(), weighted(&given));
        assert!(orthonormalise_at_once(&mut w, &mut mw, &[1e12; 4], &all_seen).is_none());
        let norms = sizes(&gram(given.as_ref(), mw.as_ref()));
        assert!(orthonormalise_at_once(&mut w, &mut mw, &norms, &|_| 1.0).is_none());
    }
}

//! A block Krylov basis of (K + tau M)^-1 M, M-orthonormal and M-orthogonal to the rigid modes.

use super::problem::{Counters, EigenProblem};
use crate::linalg::{Cholesky, combine, gram, subtract_combination, symmetric_eigen};
use faer::{Mat, MatRef};

/// Directions of a new block whose scaled Gram eigenvalue is below this are dependent on the others.
const DEPENDENT: f64 = 1e-10;

/// A vector that keeps less than this part of its M-norm after projection lies in the basis; the rest is rounding.
const VANISHED: f64 = 1e-13;

/// Basis V (N x m), the projected operator T = V' M OP V, and the products with M of the newest block.
pub(super) struct Krylov<'a> {
    problem: &'a EigenProblem<'a>,
    factor: &'a Cholesky<'a>,
    v: Mat<f64>,
    m: usize,
    t: Mat<f64>,
    /// Columns of the newest block, not yet multiplied by the operator.
    fresh: usize,
    /// M times the newest block.
    m_fresh: Mat<f64>,
    /// Coupling B (fresh x previous block): OP V = V T + V_fresh B E'.
    coupling: Mat<f64>,
    random: u64,
}

/// An M-orthonormalised block W and M W.
struct Block {
    w: Mat<f64>,
    mw: Mat<f64>,
    /// The coefficients that were subtracted: W_given = V h + W b.
    h: Mat<f64>,
    b: Mat<f64>,
}

impl<'a> Krylov<'a> {
    /// An empty basis for at most `capacity` vectors.
    pub(super) fn new(problem: &'a EigenProblem<'a>, factor: &'a Cholesky<'a>, capacity: usize) -> Self {
        Self {
            problem,
            factor,
            v: Mat::zeros(problem.pencil.n(), capacity),
            m: 0,
            t: Mat::zeros(capacity, capacity),
            fresh: 0,
            m_fresh: Mat::zeros(0, 0),
            coupling: Mat::zeros(0, 0),
            random: 0,
        }
    }

    /// Vectors that the operator has been applied to: the size of T that is valid.
    pub(super) fn projected(&self) -> usize {
        self.m - self.fresh
    }

    /// Room left for new vectors.
    pub(super) fn room(&self) -> usize {
        self.v.ncols() - self.m
    }

    /// Whether the newest block is empty: the basis spans an invariant subspace.
    pub(super) fn exhausted(&self) -> bool {
        self.fresh == 0
    }

    /// T (projected x projected).
    pub(super) fn t(&self) -> MatRef<'_, f64> {
        self.t.as_ref().submatrix(0, 0, self.projected(), self.projected())
    }

    /// Norms |B s_last| of the columns of S (projected x k): the M-norms of the Ritz residuals of the operator.
    pub(super) fn residual_norms(&self, s: MatRef<'_, f64>) -> Vec<f64> {
        let last = self.coupling.ncols();
        let tail = s.subrows(self.projected() - last, last);
        let r = &self.coupling * tail;
        (0..s.ncols()).map(|j| r.col(j).norm_l2()).collect()
    }

    /// V S for S (projected x k).
    pub(super) fn combination(&self, s: MatRef<'_, f64>) -> Mat<f64> {
        combine(self.v.as_ref().subcols(0, self.projected()), s)
    }

    /// Appends `x` (any block), orthonormalised; columns dependent on the basis are dropped.
    pub(super) fn append(&mut self, x: Mat<f64>, counters: &mut Counters) {
        let block = self.orthonormalise(x, counters);
        self.coupling = Mat::zeros(block.w.ncols(), 0);
        self.push(block);
    }

    /// Appends a deterministic random block of `width` columns, filtered by one application of the operator, which
    /// removes what a singular M does not see.
    pub(super) fn append_random(&mut self, width: usize, counters: &mut Counters) {
        let n = self.problem.pencil.n();
        let seed = self.random;
        self.random += 1;
        let x = Mat::from_fn(n, width, |i, j| noise(seed, i as u64, j as u64));
        counters.mass_columns += width as u64;
        let mut y = self.problem.pencil.apply_mass(x.as_ref());
        counters.solved_columns += width as u64;
        self.factor.solve_in_place(y.as_mut());
        self.append(y, counters);
    }

    /// One Lanczos step: applies the operator to the newest block and appends what is new.
    pub(super) fn step(&mut self, counters: &mut Counters) {
        let old = self.fresh;
        let at = self.m - old;
        let mut w = std::mem::replace(&mut self.m_fresh, Mat::zeros(0, 0));
        counters.solved_columns += old as u64;
        self.factor.solve_in_place(w.as_mut());
        let block = self.orthonormalise(w, counters);
        for j in 0..old {
            for i in 0..self.m {
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

    /// Thick restart: keeps the Ritz vectors V S (S: projected x k) with values theta, and the newest block.
    pub(super) fn restart(&mut self, s: MatRef<'_, f64>, theta: &[f64]) {
        let kept = self.combination(s);
        let k = kept.ncols();
        let fresh = self.v.as_ref().subcols(self.projected(), self.fresh).to_owned();
        self.v.as_mut().subcols_mut(0, k).copy_from(&kept);
        self.v.as_mut().subcols_mut(k, self.fresh).copy_from(&fresh);
        self.t.fill(0.0);
        for (i, &value) in theta.iter().enumerate() {
            self.t[(i, i)] = value;
        }
        self.m = k + self.fresh;
    }

    fn push(&mut self, block: Block) {
        let width = block.w.ncols();
        self.v.as_mut().subcols_mut(self.m, width).copy_from(&block.w);
        self.m += width;
        self.fresh = width;
        self.m_fresh = block.mw;
    }

    /// Two full passes of block Gram-Schmidt against the rigid modes and the basis, then an orthonormalisation by
    /// the eigenvectors of the scaled Gram matrix (rank revealing), twice.
    fn orthonormalise(&self, mut w: Mat<f64>, counters: &mut Counters) -> Block {
        let pencil = &self.problem.pencil;
        let width = w.ncols();
        let basis = self.v.as_ref().subcols(0, self.m);
        let mut h = Mat::zeros(self.m, width);
        let mut norms = Vec::new();
        for pass in 0..2 {
            counters.mass_columns += width as u64;
            let mw = pencil.apply_mass(w.as_ref());
            if pass == 0 {
                norms = (0..width).map(|j| (w.col(j).transpose() * mw.col(j)).max(0.0).sqrt()).collect();
            }
            let rigid = gram(self.problem.rigid, mw.as_ref());
            let part = gram(basis, mw.as_ref());
            subtract_combination(w.as_mut(), self.problem.rigid, rigid.as_ref());
            subtract_combination(w.as_mut(), basis, part.as_ref());
            h += part;
        }
        let mut b = Mat::<f64>::identity(width, width);
        let mut mw = Mat::zeros(0, 0);
        for pass in 0..2 {
            counters.mass_columns += w.ncols() as u64;
            mw = pencil.apply_mass(w.as_ref());
            let g = gram(w.as_ref(), mw.as_ref());
            let smallest: Vec<f64> = match pass {
                0 => norms.iter().map(|norm| VANISHED * norm).collect(),
                _ => vec![0.0; w.ncols()],
            };
            let (to_new, to_old) = orthonormal_factors(g.as_ref(), &smallest);
            w = combine(w.as_ref(), to_new.as_ref());
            mw = combine(mw.as_ref(), to_new.as_ref());
            b = &to_old * &b;
        }
        let room = self.room();
        if w.ncols() > room {
            w = w.as_ref().subcols(0, room).to_owned();
            mw = mw.as_ref().subcols(0, room).to_owned();
            b = b.as_ref().subrows(0, room).to_owned();
        }
        Block { w, mw, h, b }
    }
}

/// For a Gram matrix G = W'MW: C with (W C)' M (W C) = I on the independent directions, and its left inverse B with
/// W = (W C) B there. Columns with a norm of at most `smallest` count as zero.
fn orthonormal_factors(g: MatRef<'_, f64>, smallest: &[f64]) -> (Mat<f64>, Mat<f64>) {
    let n = g.nrows();
    let norm = |i: usize| g[(i, i)].max(0.0).sqrt();
    let scale: Vec<f64> = (0..n).map(|i| if norm(i) > smallest[i] { norm(i) } else { 0.0 }).collect();
    let scaled = Mat::from_fn(n, n, |i, j| {
        let d = scale[i] * scale[j];
        if d > 0.0 { g[(i.max(j), i.min(j))] / d } else { 0.0 }
    });
    let Some(eigen) = symmetric_eigen(scaled.as_ref()) else {
        return (Mat::zeros(n, 0), Mat::zeros(0, n));
    };
    let largest = eigen.values.last().copied().unwrap_or(0.0);
    let kept: Vec<usize> =
        (0..n).rev().filter(|&i| eigen.values[i] > DEPENDENT * largest && largest > 0.0).collect();
    let to_new = Mat::from_fn(n, kept.len(), |i, c| {
        let j = kept[c];
        if scale[i] > 0.0 { eigen.vectors[(i, j)] / (scale[i] * eigen.values[j].sqrt()) } else { 0.0 }
    });
    let to_old = Mat::from_fn(kept.len(), n, |c, i| {
        let j = kept[c];
        eigen.vectors[(i, j)] * eigen.values[j].sqrt() * scale[i]
    });
    (to_new, to_old)
}

/// Reproducible uniform noise in (-1, 1) by place: a SplitMix64 hash of (seed, row, column).
fn noise(seed: u64, row: u64, column: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0xA076_1D64_78BD_642F)
        .wrapping_add(row.wrapping_mul(0x9E37_79B9_7F4A_7C15))
        .wrapping_add(column.wrapping_mul(0xD1B5_4A32_D192_ED03))
        .wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

//! The search space of a Davidson method: a basis that grows by blocks, with its products by K, its Gram
//! matrices and its Ritz pairs.

use super::counters::Counters;
use super::failure::EigenFailure;
use super::problem::EigenProblem;
use super::refine::{independent, leave_unbalanced, small_ritz};
use faer::Mat;
use flexbody_linalg::multigrid::Near;
use flexbody_linalg::{Tall, combine, combine_in_place, combine_into, gram, subtract_combination};
use std::ops::Range;

/// A basis M-orthogonal to the rigid modes, nearly M-orthonormal.
pub(super) struct SearchSpace<'a> {
    problem: &'a EigenProblem<'a>,
    /// M times the rigid modes.
    m_rigid: Mat<f64>,
    /// The basis, and K and M times it.
    x: Tall,
    kx: Tall,
    mx: Tall,
    /// Vectors that there is room for.
    capacity: usize,
    /// X'M X and X'K X.
    gm: Mat<f64>,
    gk: Mat<f64>,
    /// Ritz values, ascending.
    pub lambda: Vec<f64>,
    /// Coefficients of the Ritz vectors, which are M-orthonormal.
    ritz: Mat<f64>,
    /// Whether the basis is one of Ritz vectors.
    is_ritz: bool,
    /// M times vectors in work: kept, since memory that is taken anew is cleared first.
    work: Tall,
}

impl<'a> SearchSpace<'a> {
    /// The span of `x`, made M-orthogonal to the rigid modes, with room for so many vectors.
    pub(super) fn new(
        problem: &'a EigenProblem<'a>,
        x: Mat<f64>,
        room: usize,
        counters: &mut Counters,
    ) -> Result<Self, EigenFailure> {
        let n = problem.pencil.n();
        let mut own = Self {
            problem,
            m_rigid: problem.pencil.apply_mass(problem.rigid),
            x: Tall::with_room(n, room),
            kx: Tall::with_room(n, room),
            mx: Tall::with_room(n, room),
            capacity: room,
            gm: Mat::zeros(0, 0),
            gk: Mat::zeros(0, 0),
            lambda: Vec::new(),
            ritz: Mat::zeros(0, 0),
            is_ritz: false,
            work: Tall::with_room(n, x.ncols()),
        };
        let mut first = Tall::copied(x.as_ref());
        drop(x);
        own.extend(&mut first, 1, counters)?;
        Ok(own)
    }

    /// Vectors that there is room for beside those that it holds.
    pub(super) fn room(&self) -> usize {
        self.capacity - self.x.ncols()
    }

    /// Adds the span of `d`, made M-orthogonal to the rigid modes and to the basis in so many passes and
    /// M-orthonormal in itself. Directions that are only rounding are left out.
    ///
    /// # Panics
    /// Where there is no room for it.
    pub(super) fn extend(
        &mut self,
        d: &mut Tall,
        passes: usize,
        counters: &mut Counters,
    ) -> Result<(), EigenFailure> {
        let Self { problem, m_rigid, x, kx, mx, gm, gk, work, .. } = self;
        let (pencil, columns, used) = (&problem.pencil, d.ncols(), x.ncols());
        for _ in 0..passes {
            let along = gram(m_rigid.as_ref(), d.as_ref());
            subtract_combination(d.as_mut(), problem.rigid, along.as_ref());
            if used > 0 {
                let along = gram(mx.as_ref(), d.as_ref());
                subtract_combination(d.as_mut(), x.as_ref(), along.as_ref());
            }
        }
        counters.mass_columns += columns as u64;
        pencil.mass_times(d.as_ref(), work.first_mut(columns));
        let orthonormal = independent(&gram(d.as_ref(), work.first(columns)))?;
        let added = used..used + orthonormal.ncols();
        counters.stiffness_columns += added.len() as u64;
        [&mut *x, &mut *kx, &mut *mx].into_iter().for_each(|block| block.add_zeros(added.len()));
        combine_into(x.columns_mut(added.clone()), d.as_ref(), orthonormal.as_ref());
        combine_into(mx.columns_mut(added.clone()), work.first(columns), orthonormal.as_ref());
        pencil.stiffness_times(x.columns(added.clone()), kx.columns_mut(added.clone()));
        *gm = bordered(gm, &gram(x.as_ref(), mx.columns(added.clone())));
        *gk = bordered(gk, &gram(x.as_ref(), kx.columns(added)));
        (self.lambda, self.ritz) = small_ritz(gm, gk)?;
        self.is_ritz = false;
        Ok(())
    }

    /// Keeps the span of the lowest Ritz vectors, so many of them where there are more.
    pub(super) fn contract(&mut self, kept: usize) {
        let kept = kept.min(self.lambda.len());
        let lowest = self.ritz.as_ref().subcols(0, kept);
        for block in [&mut self.x, &mut self.kx, &mut self.mx] {
            combine_in_place(block.as_mut(), lowest);
            block.truncate(kept);
        }
        self.lambda.truncate(kept);
        self.gm = Mat::identity(kept, kept);
        self.gk = Mat::from_fn(kept, kept, |i, j| if i == j { self.lambda[i] } else { 0.0 });
        self.ritz = Mat::identity(kept, kept);
        self.is_ritz = true;
    }

    /// The rigid modes and the basis, as far as that is one of Ritz vectors.
    pub(super) fn near(&self) -> Near<'_> {
        Near {
            rigid: [self.problem.rigid, self.m_rigid.as_ref()],
            modes: self.x.as_ref(),
            k_modes: self.kx.as_ref(),
            m_modes: self.mx.as_ref(),
            eigenvalues: &self.lambda,
        }
    }

    /// Some of the Ritz vectors (N x k).
    pub(super) fn vectors(&self, which: Range<usize>) -> Mat<f64> {
        combine(self.x.as_ref(), self.ritz.as_ref().subcols(which.start, which.len()))
    }

    /// The same, made by all threads.
    pub(super) fn some_vectors(&self, which: Range<usize>) -> Tall {
        let mut own = Tall::zeros(self.problem.pencil.n(), which.len());
        combine_into(own.as_mut(), self.x.as_ref(), self.ritz.as_ref().subcols(which.start, which.len()));
        own
    }

    /// What some Ritz pairs leave unbalanced, K x - lambda M x, and its norm beside |K x| + |lambda M x|.
    pub(super) fn unbalanced(&mut self, which: Range<usize>) -> (Tall, Vec<f64>) {
        let Self { problem, kx, mx, lambda, ritz, work, .. } = self;
        let (count, lambda) = (which.len(), &lambda[which.clone()]);
        if self.is_ritz {
            let mut forces = Tall::copied(kx.columns(which.clone()));
            let (_, residuals) = leave_unbalanced(&mut forces, mx.columns(which), lambda);
            return (forces, residuals);
        }
        let ritz = ritz.as_ref().subcols(which.start, count);
        combine_into(work.first_mut(count), mx.as_ref(), ritz);
        let mut forces = Tall::zeros(problem.pencil.n(), count);
        combine_into(forces.as_mut(), kx.as_ref(), ritz);
        let (_, residuals) = leave_unbalanced(&mut forces, work.first(count), lambda);
        (forces, residuals)
    }
}

/// [A, B; B', C] for B above C: the last columns of the matrix.
fn bordered(a: &Mat<f64>, last: &Mat<f64>) -> Mat<f64> {
    let m = a.ncols();
    Mat::from_fn(last.nrows(), last.nrows(), |i, j| match (i < m, j < m) {
        (true, true) => a[(i, j)],
        (_, false) => last[(i, j - m)],
        (false, true) => last[(j, i - m)],
    })
}

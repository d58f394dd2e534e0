//! Deflation: projection off known modes, in single precision.

use super::blocks::{Rows, WIDTH};
use crate::parallel;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Number of rows per partial product.
const ROWS_PER_PARTIAL_PRODUCT: usize = 4096;

/// Distance of two eigenvalues, relative to one of them, up to which only M-orthogonality is applied: (K - theta
/// M)-orthogonality would divide by a small number.
const NEAR_EIGENVALUE_DISTANCE: f64 = 0.1;

/// Modes from which corrections are kept apart.
pub struct DeflationSpace<'a> {
    /// Rigid modes, M-orthonormal, and M times these.
    pub rigid: [MatRef<'a, f64>; 2],
    /// Approximate modes, M-orthonormal.
    pub modes: MatRef<'a, f64>,
    /// K times the approximate modes.
    pub k_modes: MatRef<'a, f64>,
    /// M times the approximate modes.
    pub m_modes: MatRef<'a, f64>,
    /// Eigenvalues of the approximate modes, ascending.
    pub eigenvalues: &'a [f64],
}

/// Modes of a [`DeflationSpace`], in single precision.
pub(super) struct Deflation<'a> {
    rigid: usize,
    eigenvalues: &'a [f64],
    /// Rigid and approximate modes, scaled to a largest entry of one.
    x: Mat<f32>,
    /// M times the modes, divided by the scale of `x`.
    mx: Mat<f32>,
    /// K / `unit` times the approximate modes, divided by the scale of `x`.
    kx: Mat<f32>,
    /// Scale of K: the highest eigenvalue.
    unit: f64,
}

impl<'a> Deflation<'a> {
    pub(super) fn new(near: &DeflationSpace<'a>) -> Self {
        let [rigid, m_rigid] = near.rigid;
        let sizes: Vec<f64> =
            [rigid, near.modes].iter().flat_map(|x| x.col_iter()).map(|x| x.norm_max()).collect();
        let highest = near.eigenvalues.last().copied().unwrap_or(0.0);
        let unit = if highest > 0.0 { highest } else { 1.0 };
        Self {
            rigid: rigid.ncols(),
            eigenvalues: near.eigenvalues,
            x: narrow(&[rigid, near.modes], &sizes, |size| 1.0 / size),
            mx: narrow(&[m_rigid, near.m_modes], &sizes, |size| size),
            kx: narrow(&[near.k_modes], &sizes[rigid.ncols()..], |size| size / unit),
            unit,
        }
    }

    /// Projects each column z, which belongs to the given pair with eigenvalue theta. It becomes M-orthogonal to the
    /// rigid modes, to the mode of its pair and to modes near it, and (K - theta M)-orthogonal to the other modes. The
    /// remaining equation is then also correct along the other modes, whereas M-orthogonality would drop their coupling
    /// to the correction (deflated conjugate gradients: Saad, Yeung, Erhel and Guyomarc'h, SIAM J. Sci. Comput. 21
    /// (2000) 1909).
    pub(super) fn project<const B: usize>(&self, z: &mut [Rows<B>], pairs: &[Option<usize>; WIDTH]) {
        let nodes = ROWS_PER_PARTIAL_PRODUCT / B;
        // Partial products of a chunk of rows with M X and K X.
        let products = |(chunk, z): (usize, &[Rows<B>])| {
            let (start, rows) = (chunk * nodes * B, z.len() * B);
            let z = MatRef::from_row_major_slice(z.as_flattened().as_flattened(), rows, WIDTH);
            [&self.mx, &self.kx].map(|block| {
                let mut part = Mat::zeros(block.ncols(), WIDTH);
                let block = block.as_ref().subrows(start, rows).transpose();
                matmul(part.as_mut(), Accum::Replace, block, z, 1.0, Par::Seq);
                part
            })
        };
        // Products with M X and K X, summed in fixed order; then subtract X times the coefficients.
        let parts: Vec<[Mat<f32>; 2]> = parallel::map(z.chunks(nodes).enumerate(), products);
        let sum = |block: usize, i: usize, w: usize| -> f64 {
            parts.iter().map(|part| f64::from(part[block][(i, w)])).sum()
        };
        // Coefficients: conjugate for modes apart from the pair, M-orthogonal for all others.
        let along = Mat::from_fn(self.x.ncols(), WIDTH, |i, w| {
            let (heavy, mode) = (sum(0, i, w), i.checked_sub(self.rigid));
            let conjugate = mode.zip(pairs[w]).and_then(|(mode, pair)| {
                let theta = self.eigenvalues[pair];
                let distance = self.eigenvalues[mode] - theta;
                let is_apart = mode != pair && distance.abs() > NEAR_EIGENVALUE_DISTANCE * theta.abs();
                is_apart.then(|| (self.unit * sum(1, mode, w) - theta * heavy) / distance)
            });
            conjugate.unwrap_or(heavy) as f32
        });
        // z <- z - X times the coefficients.
        parallel::for_each(z.chunks_mut(nodes).enumerate(), |(chunk, z)| {
            let (start, rows) = (chunk * nodes * B, z.len() * B);
            let z = MatMut::from_row_major_slice_mut(z.as_flattened_mut().as_flattened_mut(), rows, WIDTH);
            matmul(z, Accum::Add, self.x.as_ref().subrows(start, rows), along.as_ref(), -1.0, Par::Seq);
        });
    }
}

/// Returns the columns of the blocks, each multiplied by `scale(size)`; zero for columns of size zero.
fn narrow(blocks: &[MatRef<'_, f64>], sizes: &[f64], scale: impl Fn(f64) -> f64 + Sync) -> Mat<f32> {
    let columns: Vec<_> = blocks.iter().flat_map(|block| block.col_iter()).collect();
    let mut narrowed = Mat::zeros(blocks[0].nrows(), columns.len());
    parallel::for_each(narrowed.col_iter_mut().zip(columns).zip(sizes), |((to, from), &size)| {
        let scale = if size > 0.0 { scale(size) } else { 0.0 };
        to.iter_mut().zip(from.iter()).for_each(|(to, from)| *to = (scale * from) as f32);
    });
    narrowed
}

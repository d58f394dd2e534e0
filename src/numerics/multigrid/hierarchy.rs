//! All levels: the cycle through them, and rough modes from the coarsest.

use super::blocks::{BlockMatrix, Rows, WIDTH};
use super::coarsening::{Motions, SymmetricBlocks};
use super::level::{Coarse, Level};
use crate::numerics::linalg::{Pencil, Solve, dense_cholesky, gram, largest, solve_lower, solve_upper};
use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;

/// Rows up to which a level is solved with a dense factor.
const BOTTOM: usize = 1500;

/// Levels at the most: each has a tenth of the rows of the one above, or less.
const MOST_LEVELS: usize = 10;

/// Coupling beside the diagonal from which on neighbours count as strongly coupled: on the finest level, and
/// on the others.
const STRONG: f64 = 0.02;
const STRONG_BELOW: f64 = 0.01;

/// Inverse iterations that make the rough modes of the coarsest level.
const ROUGH_ROUNDS: usize = 6;

/// Nodes per parallel task.
const NODES: usize = 1024;

/// A hierarchy of levels, of nodes of any size.
pub trait Levels: Solve {
    /// Rows of every level, the finest first.
    fn rows(&self) -> Vec<usize>;

    /// The lowest modes that the coarsest level has with the masses of the diagonal of M, as vectors of the
    /// finest one (N x `count`, or as many columns as that level has rows): a start for a search. They are
    /// not orthonormal. `None` where they are linearly dependent.
    fn rough_modes(&self, mass_diagonal: &[f64], count: usize) -> Option<Mat<f64>>;
}

/// The levels of K + tau M for the rigid modes of a body; `None` where there are none: nodes with rotations,
/// a body in space that has not six rigid modes or one in the plane that has not three, a matrix whose blocks
/// are not positive definite in single precision.
pub fn levels(pencil: &Pencil<'_>, rigid: MatRef<'_, f64>, tau: f64) -> Option<Box<dyn Levels>> {
    match (pencil.block(), rigid.ncols()) {
        (3, 6) => Some(Box::new(Hierarchy::<3, 6>::new(pencil, rigid, tau)?)),
        (2, 3) => Some(Box::new(Hierarchy::<2, 3>::new(pencil, rigid, tau)?)),
        _ => None,
    }
}

/// K + tau M, divided by its size, on levels of groups of nodes.
#[derive(Debug)]
struct Hierarchy<const B: usize, const C: usize> {
    fine: Level<B, C>,
    coarser: Vec<Level<C, C>>,
    /// Lower Cholesky factor of the matrix of the coarsest level.
    bottom: Mat<f64>,
    /// Largest diagonal entry of K: divided by it, numbers stay within single precision in any units.
    size: f64,
    tau: f64,
}

/// (K + tau M) / size, node by node.
struct Shifted<'a, const B: usize> {
    pencil: &'a Pencil<'a>,
    tau: f64,
    scale: f64,
}

impl<const B: usize> SymmetricBlocks<B> for Shifted<'_, B> {
    fn nodes(&self) -> usize {
        self.pencil.mass().n()
    }

    fn visit(&self, node: usize, mut take: impl FnMut(usize, &[[f64; B]; B])) {
        let mut rows: [(&[u32], &[f64]); B] =
            std::array::from_fn(|b| self.pencil.stiffness().row(node * B + b));
        let (mut others, mut masses) = self.pencil.mass().row(node);
        loop {
            let stiff = rows.iter().filter_map(|row| row.0.first()).min().map(|&column| column as usize / B);
            let heavy = others.first().map(|&other| other as usize);
            let Some(next) = stiff.into_iter().chain(heavy).min() else { return };
            let mut block = [[0.0; B]; B];
            for (own, (columns, values)) in block.iter_mut().zip(&mut rows) {
                while let Some((&column, after)) = columns.split_first()
                    && column as usize / B == next
                {
                    own[column as usize % B] = self.scale * values[0];
                    (*columns, *values) = (after, &values[1..]);
                }
            }
            if heavy == Some(next) {
                (0..B).for_each(|b| block[b][b] += self.scale * self.tau * masses[0]);
                (others, masses) = (&others[1..], &masses[1..]);
            }
            take(next, &block);
        }
    }
}

impl<const B: usize, const C: usize> Hierarchy<B, C> {
    fn new(pencil: &Pencil<'_>, rigid: MatRef<'_, f64>, tau: f64) -> Option<Self> {
        let size = largest(pencil.stiffness().diagonal());
        let has_size = size > 0.0 && size.is_finite();
        if !has_size {
            return None;
        }
        let shifted = Shifted::<B> { pencil, tau, scale: 1.0 / size };
        let (fine, mut next) = Level::new(&shifted, &unit_motions(rigid), STRONG)?;
        let mut coarser = Vec::new();
        while next.a.n_rows() * C > BOTTOM {
            if coarser.len() == MOST_LEVELS {
                return None;
            }
            let Coarse { a, motions } = next;
            let (level, after) = Level::new(&a, &motions, STRONG_BELOW)?;
            coarser.push(level);
            next = after;
        }
        Some(Self { fine, coarser, bottom: dense_cholesky(dense(&next.a))?, size, tau })
    }

    /// One cycle for (K + tau M) / size x = b.
    fn cycle(&self, b: &[Rows<B>]) -> Vec<Rows<B>> {
        self.fine.cycle(b, |coarse| self.coarse_cycle(&self.coarser, coarse))
    }

    fn coarse_cycle(&self, levels: &[Level<C, C>], b: Vec<Rows<C>>) -> Vec<Rows<C>> {
        let Some((level, below)) = levels.split_first() else { return self.solve_bottom(&b) };
        level.cycle(&b, |coarse| self.coarse_cycle(below, coarse))
    }

    fn solve_bottom(&self, b: &[Rows<C>]) -> Vec<Rows<C>> {
        let dense = Mat::from_fn(b.len() * C, WIDTH, |i, w| f64::from(b[i / C][i % C][w]));
        packed(self.inverse_of_bottom(&dense).as_ref())
    }

    fn inverse_of_bottom(&self, b: &Mat<f64>) -> Mat<f64> {
        solve_upper(&self.bottom, &solve_lower(&self.bottom, b))
    }

    /// Vectors of the coarsest level as such of the finest.
    fn on_finest(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut out = Mat::zeros(self.fine.nodes() * B, x.ncols());
        by_width(x, out.as_mut(), |part, out| {
            let down = |rows: Vec<Rows<C>>, level: &Level<C, C>| level.prolonged(&rows);
            let rows = self.coarser.iter().rev().fold(packed(part), down);
            unpack(&self.fine.prolonged(&rows), out, 1.0);
        });
        out
    }

    /// The transpose of [`Self::on_finest`].
    fn on_coarsest(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut out = Mat::zeros(self.bottom.nrows(), x.ncols());
        by_width(x, out.as_mut(), |part, out| {
            let up = |rows: Vec<Rows<C>>, level: &Level<C, C>| level.restricted(&rows);
            let rows = self.coarser.iter().fold(self.fine.restricted(&packed(part)), up);
            unpack(&rows, out, 1.0);
        });
        out
    }
}

impl<const B: usize, const C: usize> Solve for Hierarchy<B, C> {
    fn shift(&self) -> f64 {
        self.tau
    }

    /// One cycle: roughly (K + tau M)^-1 X, for columns of about unit size.
    fn solve_in_place(&self, x: MatMut<'_, f64>) {
        let b = x.as_ref().to_owned();
        by_width(b.as_ref(), x, |b, x| unpack(&self.cycle(&packed(b)), x, 1.0 / self.size));
    }
}

impl<const B: usize, const C: usize> Levels for Hierarchy<B, C> {
    fn rows(&self) -> Vec<usize> {
        let coarser = self.coarser.iter().map(|level| level.nodes() * C);
        [self.fine.nodes() * B].into_iter().chain(coarser).chain([self.bottom.nrows()]).collect()
    }

    fn rough_modes(&self, mass_diagonal: &[f64], count: usize) -> Option<Mat<f64>> {
        let n = self.bottom.nrows();
        let count = count.min(n);
        let noise = |k: usize| ((k.wrapping_mul(2_654_435_761) >> 9) & 0xffff) as f64 / 65536.0 - 0.5;
        let mut x = Mat::from_fn(n, count, |i, j| noise(i * count + j));
        for _ in 0..ROUGH_ROUNDS {
            // x <- A^-1 M x, with M = P' D P and x made M-orthonormal.
            let fine = self.on_finest(x.as_ref());
            let moved = Mat::from_fn(fine.nrows(), count, |i, j| mass_diagonal[i] * fine[(i, j)]);
            let l = dense_cholesky(gram(fine.as_ref(), moved.as_ref()))?;
            let force = self.on_coarsest(moved.as_ref());
            let orthonormal = solve_lower(&l, &force.transpose().to_owned()).transpose().to_owned();
            x = self.inverse_of_bottom(&orthonormal);
        }
        Some(self.on_finest(x.as_ref()))
    }
}

/// Rigid modes node by node, each with a largest entry of one.
fn unit_motions<const B: usize, const C: usize>(rigid: MatRef<'_, f64>) -> Motions<B, C> {
    let scale: [f64; C] = std::array::from_fn(|c| 1.0 / rigid.col(c).norm_max());
    let motion = |node: usize| -> [[f64; C]; B] {
        std::array::from_fn(|b| std::array::from_fn(|c| scale[c] * rigid[(node * B + b, c)]))
    };
    (0..rigid.nrows() / B).map(motion).collect()
}

/// The matrix of a level, symmetric to the last bit.
fn dense<const C: usize>(a: &BlockMatrix<C, C>) -> Mat<f64> {
    let n = a.n_rows() * C;
    let mut dense = Mat::zeros(n, n);
    for row in 0..a.n_rows() {
        for (column, block) in a.row(row) {
            for (i, values) in block.iter().enumerate() {
                for (j, &value) in values.iter().enumerate() {
                    dense[(row * C + i, column * C + j)] = f64::from(value);
                }
            }
        }
    }
    Mat::from_fn(n, n, |i, j| 0.5 * (dense[(i, j)] + dense[(j, i)]))
}

/// Calls `work` with up to [`WIDTH`] columns of x and of y at a time.
fn by_width(x: MatRef<'_, f64>, mut y: MatMut<'_, f64>, work: impl Fn(MatRef<'_, f64>, MatMut<'_, f64>)) {
    for first in (0..x.ncols()).step_by(WIDTH) {
        let width = WIDTH.min(x.ncols() - first);
        work(x.subcols(first, width), y.rb_mut().subcols_mut(first, width));
    }
}

/// Up to [`WIDTH`] columns, node by node; the missing ones are zero.
fn packed<const B: usize>(x: MatRef<'_, f64>) -> Vec<Rows<B>> {
    let rows = |node: usize| {
        let mut rows = [[0.0; WIDTH]; B];
        for (b, row) in rows.iter_mut().enumerate() {
            (0..x.ncols()).for_each(|w| row[w] = x[(node * B + b, w)] as f32);
        }
        rows
    };
    (0..x.nrows() / B).into_par_iter().with_min_len(NODES).map(rows).collect()
}

fn unpack<const B: usize>(rows: &[Rows<B>], mut x: MatMut<'_, f64>, scale: f64) {
    for w in 0..x.ncols() {
        for (node, rows) in rows.iter().enumerate() {
            for (b, row) in rows.iter().enumerate() {
                x[(node * B + b, w)] = scale * f64::from(row[w]);
            }
        }
    }
}

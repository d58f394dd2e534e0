//! Inertia of K - sigma M by L B L' with pivoting inside the panels of each front. A count alone does not keep the
//! factor.

use super::dense::largest;
use super::factor::{Analysis, Scaled};
use super::front::{
    MIN_PARALLEL_MULTIPLICATIONS, PANEL_COLUMNS, ROWS_PER_PIECE, Real, Trapezoid, divide_rows,
    drop_negligible, extend_add, subtract_eliminated, subtract_from_rest,
};
use super::{Pencil, parallel};
use dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::lblt::factor as lblt;
use faer::{Mat, MatRef, Par, Spec};
use std::cmp::Ordering::{Equal, Greater, Less};
use std::convert::Infallible;

/// Numbers of negative and zero eigenvalues of K - sigma M. If M is positive semidefinite, the negative ones equal the
/// number of eigenvalues of the pencil below sigma (Sylvester).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Number of negative eigenvalues: modes below sigma.
    pub negative: usize,
    /// Number of zero pivots.
    pub zero: usize,
    /// Backward error of the factorisation relative to the scaled matrix: twice the unit roundoff times the largest
    /// diagonal entry of |L| |B| |L|', which bounds all other entries (Higham, Accuracy and Stability, section 11.1). A
    /// large value means that element growth made the factor and the count useless.
    pub backward_error: f64,
}

/// Contribution of a front to its parent.
pub(super) struct Contribution<T> {
    schur: Trapezoid<T>,
    /// Diagonal of |L| |B| |L|' so far, for the rows of the contribution.
    growth: Vec<f64>,
}

/// Columns of a front after their elimination.
pub(super) struct Eliminated<T> {
    /// L below the leading squares of the panels.
    pub columns: Trapezoid<T>,
    /// Factored leading squares, one per panel.
    pub blocks: Vec<Blocks<T>>,
    /// Largest diagonal entry of |L| |B| |L|' in these columns.
    growth: f64,
}

impl<T: Real> Eliminated<T> {
    /// Returns the numbers of negative and of zero pivots, and the growth.
    pub(crate) fn counts(&self) -> (usize, usize, f64) {
        let (negative, zero) =
            self.blocks.iter().fold((0, 0), |(n, z), block| (n + block.negative, z + block.zero));
        (negative, zero, self.growth)
    }

    /// Returns the columns, with the unit triangles of the leading squares copied into them, and the rest of these
    /// squares.
    pub(crate) fn into_factor(mut self) -> (Trapezoid<T>, Vec<Blocks<T>>) {
        for (panel, block) in self.columns.panels.iter_mut().zip(&mut self.blocks) {
            let width = block.order.len();
            for (i, row) in panel[..width * width].chunks_exact_mut(width).enumerate() {
                row.iter_mut().zip(block.row(i)).for_each(|(to, from)| *to = from);
            }
            block.l = Mat::new();
        }
        (self.columns, self.blocks)
    }
}

/// Assembles the front of supernode `s` from the entries of `matrix` and the contributions of its children, and
/// eliminates its columns.
pub(super) fn eliminate_front<T: Real>(
    analysis: &Analysis,
    matrix: &Scaled<'_>,
    s: usize,
    children: Vec<Contribution<T>>,
) -> (Eliminated<T>, Contribution<T>) {
    let (mut columns, mut rest) = analysis.new_front::<T>(s);
    matrix.assemble(s, &mut columns);
    let mut growth = vec![0.0; columns.height()];
    for (&c, child) in analysis.tree.children(s).iter().zip(children) {
        let places = analysis.places(c as usize);
        extend_add(&mut columns, &mut rest, &child.schur, &places);
        for (&place, g) in places.iter().zip(&child.growth) {
            growth[place] += g;
        }
    }
    let width = columns.width();
    let blocks = eliminate(&mut columns, &mut rest, &mut growth);
    let pivot_growth = largest(growth[..width].iter().copied());
    let handed_on = Contribution { schur: rest, growth: growth.split_off(width) };
    (Eliminated { columns, blocks, growth: pivot_growth }, handed_on)
}

impl Inertia {
    /// Factors K - sigma M as L B L' (B has 1x1 and 2x2 blocks), counts, and drops the factor.
    pub fn new(analysis: &Analysis, pencil: &Pencil<'_>, sigma: f64) -> Self {
        let tree = &analysis.tree;
        let matrix = analysis.scaled(pencil, sigma);
        let mut counts = vec![(0usize, 0usize, 0.0f64); tree.len()];
        let visit = |s: usize, count: &mut (usize, usize, f64), children: Vec<Contribution<f64>>| {
            let (eliminated, handed_on) = eliminate_front(analysis, &matrix, s, children);
            *count = eliminated.counts();
            Ok::<_, Infallible>(handed_on)
        };
        let Ok(()) = analysis.walk.up(tree, &mut counts, &visit);
        Self::of_fronts::<f64>(counts)
    }

    /// Sums the negative pivots and zero pivots of all fronts, and takes their largest growth.
    pub(super) fn of_fronts<T: Real>(counts: impl IntoIterator<Item = (usize, usize, f64)>) -> Self {
        let (mut negative, mut zero, mut growth) = (0, 0, Vec::new());
        for (n, z, g) in counts {
            negative += n;
            zero += z;
            growth.push(g);
        }
        Self { negative, zero, backward_error: largest(growth) * 2.0 * T::ROUNDOFF }
    }
}

/// Eliminates the columns `pivots` of a front. Returns the factored leading squares of its panels.
fn eliminate<T: Real>(
    pivots: &mut Trapezoid<T>,
    rest: &mut Trapezoid<T>,
    growth: &mut [f64],
) -> Vec<Blocks<T>> {
    let (height, width) = (pivots.height(), pivots.width());
    // L B, in the layout of L.
    let mut scaled = Trapezoid::zeros(height, width);
    let mut squares = Vec::with_capacity(pivots.panels.len());
    for p in 0..pivots.panels.len() {
        let (first, width) = (p * PANEL_COLUMNS, pivots.panel_width(p));
        let mut panel = std::mem::take(&mut pivots.panels[p]);
        let left: Vec<MatRef<'_, T>> = (0..p).map(|q| pivots.below(q, first)).collect();
        let right: Vec<MatRef<'_, T>> = (0..p).map(|q| scaled.below(q, first)).collect();
        // Panel p: subtract the panels before it, factor its square, divide the rows below.
        subtract_eliminated(&mut panel, width, &left, &right);
        let (square, below) = panel.split_at_mut(width * width);
        let blocks = Blocks::new(MatRef::from_row_major_slice(&*square, width, width));
        let (in_block, later) = growth[first..].split_at_mut(width);
        blocks.divide_below(below, &mut scaled.panels[p][width * width..], later);
        for (i, &place) in blocks.order.iter().enumerate() {
            let row: Vec<T> = blocks.row(i).collect();
            in_block[place] += blocks.growth(&row);
        }
        pivots.panels[p] = panel;
        squares.push(blocks);
    }
    subtract_from_rest(pivots, &scaled, rest);
    squares
}

/// Number of sums that are computed side by side.
const SUM_LANES: usize = 8;

/// Factorisation P A P' = L B L' of the leading square of a panel.
pub(super) struct Blocks<T> {
    /// Unit lower triangle below the diagonal.
    l: Mat<T>,
    /// Row of A at each place.
    pub order: Vec<usize>,
    diagonal: Vec<f64>,
    /// True if B has 2x2 blocks.
    has_pairs: bool,
    /// Off-diagonal entry at the start of each 2x2 block of B, zero elsewhere.
    coupling: Vec<f64>,
    negative: usize,
    zero: usize,
}

impl<T: Real> Blocks<T> {
    fn new(square: MatRef<'_, T>) -> Self {
        let n = square.nrows();
        let mut l = square.to_owned();
        let mut subdiagonal = faer::Mat::<T>::zeros(n, 1);
        let (mut order, mut inverse) = (vec![0usize; n], vec![0usize; n]);
        let params = Spec::default();
        let mut memory = MemBuffer::new(lblt::cholesky_in_place_scratch::<usize, T>(n, Par::Seq, params));
        lblt::cholesky_in_place(
            l.as_mut(),
            subdiagonal.as_mut().col_mut(0).as_diagonal_mut(),
            &mut order,
            &mut inverse,
            Par::Seq,
            MemStack::new(&mut memory),
            params,
        );
        let diagonal: Vec<f64> = (0..n).map(|j| l[(j, j)].wide()).collect();
        let coupling: Vec<f64> =
            (0..n).map(|j| if j + 1 < n { subdiagonal[(j, 0)].wide() } else { 0.0 }).collect();
        let (negative, zero) = count(&diagonal, &coupling);
        let has_pairs = coupling.iter().any(|off| *off != 0.0);
        Self { l, order, diagonal, has_pairs, coupling, negative, zero }
    }

    /// Returns row `i` of the unit triangle.
    fn row(&self, i: usize) -> impl Iterator<Item = T> + '_ {
        (0..self.order.len()).map(move |j| match j.cmp(&i) {
            Less => self.l[(i, j)],
            Equal => T::of(1.0),
            Greater => T::default(),
        })
    }

    /// Replaces the rows `below` the square by rows of L, stores their L B in `scaled`, and adds their part of the
    /// diagonal of |L| |B| |L|' to `growth`.
    fn divide_below(&self, below: &mut [T], scaled: &mut [T], growth: &mut [f64]) {
        let width = self.order.len();
        let piece = |rows: &mut [T], scaled: &mut [T], growth: &mut [f64]| {
            // Columns in the order of the pivots.
            let mut old = vec![T::default(); width];
            for row in rows.chunks_exact_mut(width) {
                old.copy_from_slice(row);
                for (new, &from) in row.iter_mut().zip(&self.order) {
                    *new = old[from];
                }
            }
            // L B by substitution with the unit triangle.
            divide_rows(rows, self.l.as_ref(), true);
            drop_negligible(rows);
            scaled.copy_from_slice(rows);
            // L, in double precision, and its growth.
            let mut wide = vec![0.0; width];
            for (row, g) in rows.chunks_exact_mut(width).zip(growth) {
                wide.iter_mut().zip(&*row).for_each(|(to, from)| *to = from.wide());
                self.divide(&mut wide);
                row.iter_mut().zip(&wide).for_each(|(to, from)| *to = T::of(*from));
                *g += self.growth(row);
            }
            drop_negligible(rows);
        };
        let length = ROWS_PER_PIECE * width;
        let cost = below.len() * width;
        let pieces =
            below.chunks_mut(length).zip(scaled.chunks_mut(length)).zip(growth.chunks_mut(ROWS_PER_PIECE));
        if cost < MIN_PARALLEL_MULTIPLICATIONS {
            pieces.for_each(|((rows, scaled), growth)| piece(rows, scaled, growth));
        } else {
            parallel::for_each(pieces, |((rows, scaled), growth)| piece(rows, scaled, growth));
        }
    }

    /// Replaces a row of L B by the row of L: multiplies it by B^-1.
    pub(crate) fn divide(&self, row: &mut [f64]) {
        if !self.has_pairs {
            row.iter_mut().zip(&self.diagonal).for_each(|(x, d)| *x /= d);
            return;
        }
        let mut j = 0;
        while j < row.len() {
            let off = self.coupling[j];
            if off == 0.0 {
                row[j] /= self.diagonal[j];
                j += 1;
            } else {
                // Divide by the coupling, which dominates such a block.
                let (a, d) = (self.diagonal[j] / off, self.diagonal[j + 1] / off);
                let determinant = a * d - 1.0;
                let (x, y) = (row[j] / off, row[j + 1] / off);
                row[j] = (d * x - y) / determinant;
                row[j + 1] = (a * y - x) / determinant;
                j += 2;
            }
        }
    }

    /// Returns |l|' |B| |l| of a row of L.
    fn growth(&self, row: &[T]) -> f64 {
        let (lanes, rest) = row.as_chunks::<SUM_LANES>();
        let (diagonal, last) = self.diagonal.as_chunks::<SUM_LANES>();
        let mut sums = [0.0; SUM_LANES];
        for (l, d) in lanes.iter().zip(diagonal) {
            (0..SUM_LANES).for_each(|w| sums[w] += l[w].wide() * l[w].wide() * d[w].abs());
        }
        let rest = rest.iter().zip(last).map(|(l, d)| l.wide() * l.wide() * d.abs());
        let squares = sums.iter().sum::<f64>() + rest.sum::<f64>();
        if !self.has_pairs {
            return squares;
        }
        let pairs = row.windows(2).zip(&self.coupling);
        squares + pairs.map(|(l, off)| 2.0 * (l[0].wide() * l[1].wide() * off).abs()).sum::<f64>()
    }
}

/// Returns the numbers of negative and zero eigenvalues of the block diagonal B.
fn count(diagonal: &[f64], coupling: &[f64]) -> (usize, usize) {
    let (mut negative, mut zero) = (0, 0);
    let mut j = 0;
    while j < diagonal.len() {
        let off = coupling[j];
        if off == 0.0 {
            negative += usize::from(diagonal[j] < 0.0);
            zero += usize::from(diagonal[j] == 0.0 || diagonal[j].is_nan());
            j += 1;
            continue;
        }
        let (d1, d2) = (diagonal[j], diagonal[j + 1]);
        // The signs of the two eigenvalues follow from determinant and trace, divided by the coupling to avoid
        // overflow.
        let determinant = (d1 / off) * (d2 / off) - 1.0;
        if determinant < 0.0 {
            negative += 1;
        } else if determinant > 0.0 {
            negative += 2 * usize::from(d1 < 0.0);
        } else {
            negative += usize::from(d1 + d2 < 0.0);
            zero += 1;
        }
        j += 2;
    }
    (negative, zero)
}

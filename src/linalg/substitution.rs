//! Substitution with the panels of a front for a few right-hand sides at a time: bound by the speed at which memory
//! delivers the factor. Panels and right-hand sides are row-major; four rows of the panel are taken together, read once
//! from end to end. Large panels are cut into fixed pieces of rows.

use super::front::{PANEL, Real, Trapezoid};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

/// Rows of a piece of parallel work.
const ROWS: usize = 512;

/// Numbers of a panel below which cutting it is not worth the tasks.
const WORTH_TASKS: usize = 300_000;

/// Forward substitution with the columns of a Cholesky factor: `front` holds a row of `K` right-hand sides for every
/// row of the front; the leading rows become the solution, the others what is left for the parent.
pub(super) fn forward<T: Real, const K: usize>(l: &Trapezoid<T>, front: &mut [[T; K]]) {
    let arch = Arch::new();
    for (p, panel) in l.panels.iter().enumerate() {
        let width = l.panel_width(p);
        let (x, below) = front[p * PANEL..].split_at_mut(width);
        let (square, rest) = panel.split_at(width * width);
        arch.dispatch(SolveLower(square, x));
        let x = &*x;
        if rest.len() < WORTH_TASKS {
            arch.dispatch(SubtractProduct(rest, x, below));
        } else {
            let pieces = rest.par_chunks(ROWS * width).zip(below.par_chunks_mut(ROWS));
            pieces.for_each(|(l, y)| arch.dispatch(SubtractProduct(l, x, y)));
        }
    }
}

/// Back substitution with the transpose for the leading rows of `front`; the rows below hold their solution.
pub(super) fn backward<T: Real, const K: usize>(l: &Trapezoid<T>, front: &mut [[T; K]]) {
    let arch = Arch::new();
    for (p, panel) in l.panels.iter().enumerate().rev() {
        let width = l.panel_width(p);
        let (x, below) = front[p * PANEL..].split_at_mut(width);
        let (square, rest) = panel.split_at(width * width);
        if rest.len() < WORTH_TASKS {
            arch.dispatch(SubtractTransposed(rest, below, x));
        } else {
            let pieces = rest.par_chunks(ROWS * width).zip(below.par_chunks(ROWS));
            let sums: Vec<Vec<[T; K]>> = pieces
                .map(|(l, y)| {
                    let mut sum = vec![[T::default(); K]; width];
                    arch.dispatch(SubtractTransposed(l, y, &mut sum));
                    sum
                })
                .collect();
            for sum in &sums {
                for (x, part) in x.iter_mut().zip(sum) {
                    x.iter_mut().zip(part).for_each(|(x, part)| *x += *part);
                }
            }
        }
        arch.dispatch(SolveTransposed(square, x));
    }
}

// The kernels below are compiled once per instruction set: named types, because closures are not always inlined there.

/// y -= L x: the rows of L belong to those of y, its columns to those of x.
struct SubtractProduct<'a, T, const K: usize>(&'a [T], &'a [[T; K]], &'a mut [[T; K]]);

impl<T: Real, const K: usize> NullaryFnOnce for SubtractProduct<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(l, x, y) = self;
        let width = x.len();
        let mut quads = l.chunks_exact(4 * width);
        let mut targets = y.chunks_exact_mut(4);
        for (l, y) in (&mut quads).zip(&mut targets) {
            let sums = four_products(l, width, x);
            for (y, sum) in y.iter_mut().zip(&sums) {
                subtract(y, sum);
            }
        }
        for (l, y) in quads.remainder().chunks_exact(width).zip(targets.into_remainder()) {
            for (&l, x) in l.iter().zip(x) {
                subtract_multiple(y, l, x);
            }
        }
    }
}

/// Products of four consecutive rows of L, `stride` numbers apart, with x.
#[inline(always)]
fn four_products<T: Real, const K: usize>(l: &[T], stride: usize, x: &[[T; K]]) -> [[T; K]; 4] {
    let [a, b, c, d]: [&[T]; 4] = std::array::from_fn(|q| &l[q * stride..][..x.len()]);
    let mut sums = [[T::default(); K]; 4];
    for ((((x, a), b), c), d) in x.iter().zip(a).zip(b).zip(c).zip(d) {
        for k in 0..K {
            sums[0][k] = a.times_plus(x[k], sums[0][k]);
            sums[1][k] = b.times_plus(x[k], sums[1][k]);
            sums[2][k] = c.times_plus(x[k], sums[2][k]);
            sums[3][k] = d.times_plus(x[k], sums[3][k]);
        }
    }
    sums
}

/// x -= L' y.
struct SubtractTransposed<'a, T, const K: usize>(&'a [T], &'a [[T; K]], &'a mut [[T; K]]);

impl<T: Real, const K: usize> NullaryFnOnce for SubtractTransposed<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(l, y, x) = self;
        let width = x.len();
        let mut quads = l.chunks_exact(4 * width);
        let mut sources = y.chunks_exact(4);
        for (l, y) in (&mut quads).zip(&mut sources) {
            subtract_four(l, width, [y[0], y[1], y[2], y[3]], x);
        }
        for (l, y) in quads.remainder().chunks_exact(width).zip(sources.remainder()) {
            for (&l, x) in l.iter().zip(&mut *x) {
                subtract_multiple(x, l, y);
            }
        }
    }
}

/// x -= the transpose of four consecutive rows of L, `stride` numbers apart, times y.
#[inline(always)]
fn subtract_four<T: Real, const K: usize>(l: &[T], stride: usize, y: [[T; K]; 4], x: &mut [[T; K]]) {
    let y = y.map(|row| row.map(|v| -v));
    let [a, b, c, d]: [&[T]; 4] = std::array::from_fn(|q| &l[q * stride..][..x.len()]);
    for ((((x, a), b), c), d) in x.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        for k in 0..K {
            let first = b.times_plus(y[1][k], a.times_plus(y[0][k], x[k]));
            x[k] = d.times_plus(y[3][k], c.times_plus(y[2][k], first));
        }
    }
}

/// x <- L^-1 x for the leading square of a panel.
struct SolveLower<'a, T, const K: usize>(&'a [T], &'a mut [[T; K]]);

impl<T: Real, const K: usize> NullaryFnOnce for SolveLower<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(l, x) = self;
        let width = x.len();
        let mut base = 0;
        while base < width {
            let count = 4.min(width - base);
            let (solved, rest) = x.split_at_mut(base);
            if count == 4 {
                let sums = four_products(&l[base * width..], width, solved);
                for (x, sum) in rest.iter_mut().zip(&sums) {
                    subtract(x, sum);
                }
            } else {
                for (i, x) in rest.iter_mut().enumerate() {
                    for (&l, y) in l[(base + i) * width..].iter().zip(&*solved) {
                        subtract_multiple(x, l, y);
                    }
                }
            }
            for i in base..base + count {
                for j in base..i {
                    let y = x[j];
                    subtract_multiple(&mut x[i], l[i * width + j], &y);
                }
                divide(&mut x[i], l[i * width + i]);
            }
            base += count;
        }
    }
}

/// x <- L^-T x for the leading square of a panel.
struct SolveTransposed<'a, T, const K: usize>(&'a [T], &'a mut [[T; K]]);

impl<T: Real, const K: usize> NullaryFnOnce for SolveTransposed<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self(l, x) = self;
        let width = x.len();
        let mut end = width;
        while end > 0 {
            // The odd rows come first in elimination order, so last here.
            let count = if end >= 4 { 4 } else { end };
            let base = end - count;
            for i in (base..end).rev() {
                divide(&mut x[i], l[i * width + i]);
                let y = x[i];
                for j in base..i {
                    subtract_multiple(&mut x[j], l[i * width + j], &y);
                }
            }
            if count == 4 {
                let (open, solved) = x.split_at_mut(base);
                subtract_four(&l[base * width..], width, [solved[0], solved[1], solved[2], solved[3]], open);
            }
            end = base;
        }
    }
}

#[inline(always)]
fn subtract<T: Real, const K: usize>(x: &mut [T; K], y: &[T; K]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x -= *y);
}

#[inline(always)]
fn subtract_multiple<T: Real, const K: usize>(x: &mut [T; K], l: T, y: &[T; K]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x -= l * *y);
}

#[inline(always)]
fn divide<T: Real, const K: usize>(x: &mut [T; K], l: T) {
    x.iter_mut().for_each(|x| *x /= l);
}

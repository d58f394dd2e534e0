//! Factor K - sigma M = L B L' with pivoting inside the panels of each front, kept for solutions: the dynamic stiffness
//! at a frequency in double precision, and inertia counts in single precision.

use super::columns::contiguous_mut;
use super::factor::{Analysis, COLUMNS_PER_SOLVE, Solve, substitute};
use super::front::{PANEL_COLUMNS, ROWS_PER_PIECE, Real, Trapezoid};
use super::inertia::{Blocks, Contribution, Inertia, eliminate_front};
use super::substitution::{
    MIN_PARALLEL_ENTRIES, solve_lower, solve_transposed, subtract_product, subtract_transposed,
};
use super::tall::{Tall, column_norms, normal, subtract_columns};
use super::{Pencil, parallel};
use faer::MatMut;
use faer::prelude::ReborrowMut;
use std::convert::Infallible;

/// Factor of the indefinite matrix K - sigma M with numbers of type `T`. Solutions are computed in double precision, so
/// that their error comes from the rounding of the factorisation alone.
pub struct Indefinite<'a, T = f64> {
    analysis: &'a Analysis,
    sigma: f64,
    /// Panels of L, with B and the row order of each leading square.
    fronts: Vec<(Trapezoid<T>, Vec<Blocks<T>>)>,
    /// Scale of each row.
    scale: Vec<f64>,
    inertia: Inertia,
}

impl<'a, T: Real> Indefinite<'a, T> {
    /// Factors K - sigma M. The caller must check the factor: by its [`Inertia`] (no zero pivot, and a small backward
    /// error) or by [`perturbation`](Self::perturbation).
    pub fn new(analysis: &'a Analysis, pencil: &Pencil<'_>, sigma: f64) -> Self {
        let tree = &analysis.tree;
        let matrix = analysis.scaled(pencil, sigma);
        let mut fronts: Vec<_> = (0..tree.len()).map(|_| None).collect();
        let visit = |s: usize, slot: &mut Option<_>, children: Vec<Contribution<T>>| {
            let (eliminated, handed_on) = eliminate_front(analysis, &matrix, s, children);
            *slot = Some((eliminated.counts(), eliminated.into_factor()));
            Ok::<_, Infallible>(handed_on)
        };
        let Ok(()) = analysis.walk.up(tree, &mut fronts, &visit);
        let (counts, fronts): (Vec<_>, Vec<_>) = fronts.into_iter().flatten().unzip();
        let inertia = Inertia::of_fronts::<T>(counts);
        Self { analysis, sigma, fronts, scale: matrix.scale, inertia }
    }

    /// Returns the signs of the pivots and the backward error of the factorisation.
    pub fn inertia(&self) -> Inertia {
        self.inertia
    }

    /// Replaces X (n x k) by (K - sigma M)^-1 X.
    pub fn solve_in_place(&self, mut x: MatMut<'_, f64>) {
        let forward = |s: usize, front: &mut [[f64; COLUMNS_PER_SOLVE]]| forward(&self.fronts[s], front);
        let backward = |s: usize, front: &mut [[f64; COLUMNS_PER_SOLVE]]| backward(&self.fronts[s], front);
        let mut start = 0;
        while start < x.ncols() {
            let width = COLUMNS_PER_SOLVE.min(x.ncols() - start);
            substitute(self.analysis, &self.scale, x.rb_mut().subcols_mut(start, width), forward, backward);
            start += width;
        }
    }

    /// Returns a bound below one if K - sigma M certainly has the inertia of this factor in spite of rounding.
    ///
    /// Let A be the matrix and F the product of the factors, both scaled to a diagonal of about one, and G = I - F^-1
    /// A. A matrix (1 - t) F + t A between the two is singular only if 1/t is an eigenvalue of G. A therefore has the
    /// inertia of F if no eigenvalue of G reaches one, which holds if the norm of some power of G is less than one. The
    /// mean square of G^p z over normal vectors z has the squared Frobenius norm of G^p as its expectation: if that
    /// were one, the mean square over `COLUMNS_PER_SOLVE` vectors would be less than 1 / `PERTURBATION_MARGIN`^2 with a
    /// probability of 10^-15. Powers are sharper than G itself, whose norm comes from the part of all other modes that
    /// it maps into the modes next to sigma, and is much larger than its eigenvalues.
    ///
    /// The bound is the measured norm times `PERTURBATION_MARGIN`. Returns `None` if no power is small enough.
    pub fn perturbation(&self, pencil: &Pencil<'_>) -> Option<f64> {
        let n = pencil.n();
        let [mut z, mut x, mut product, mut heavy] = [(); 4].map(|()| Tall::zeros(n, COLUMNS_PER_SOLVE));
        for_columns(&mut z, |i, j, z| *z = normal(i as u64, j as u64));
        let mut before = f64::INFINITY;
        for _ in 0..MAX_POWER {
            // z <- G z = z - S^-1 (K - sigma M)^-1 (K - sigma M) S z, with the solution by the factor.
            let (given, scale) = (z.as_ref(), &self.scale);
            for_columns(&mut x, |i, j, x| *x = scale[i] * given[(i, j)]);
            pencil.stiffness_times(x.as_ref(), product.as_mut());
            pencil.mass_times(x.as_ref(), heavy.as_mut());
            subtract_columns(product.as_mut(), &[self.sigma; COLUMNS_PER_SOLVE], heavy.as_ref());
            self.solve_in_place(product.as_mut());
            let solved = product.as_ref();
            for_columns(&mut z, |i, j, z| *z -= solved[(i, j)] / scale[i]);
            let squares = column_norms(z.as_ref()).into_iter().map(|norm| norm * norm);
            let bound = PERTURBATION_MARGIN * (squares.sum::<f64>() / COLUMNS_PER_SOLVE as f64).sqrt();
            if bound < 1.0 {
                return Some(bound);
            }
            // The comparison also fails for NaN.
            let falls = bound < MAX_BOUND_RATIO * before;
            if !falls {
                return None;
            }
            before = bound;
        }
        None
    }
}

impl Solve for Indefinite<'_> {
    fn shift(&self) -> f64 {
        -self.sigma
    }

    fn solve_in_place(&self, x: MatMut<'_, f64>) {
        Self::solve_in_place(self, x);
    }
}

/// Calls `change` with row, column and entry for all entries of a block, its columns in parallel.
fn for_columns(block: &mut Tall, change: impl Fn(usize, usize, &mut f64) + Sync) {
    parallel::for_each(block.as_mut().col_iter_mut().map(contiguous_mut).enumerate(), |(j, column)| {
        column.iter_mut().enumerate().for_each(|(i, entry)| change(i, j, entry));
    });
}

/// Factor from the measured norm to the bound of [`Indefinite::perturbation`]. The mean square of eight normal numbers
/// is less than 10^-4 with a probability of 10^-15; a smaller margin is less certain.
const PERTURBATION_MARGIN: f64 = 100.0;

/// Largest power of G that is evaluated.
const MAX_POWER: usize = 12;
/// Largest ratio of successive bounds at which the next power is evaluated.
const MAX_BOUND_RATIO: f64 = 0.5;

/// Number of rows of L that are converted to double precision together: they stay in the first-level cache.
const ROWS_CONVERTED_TOGETHER: usize = 32;

/// Calls `work` with a few rows of L in double precision, and the matching item of `below`.
fn for_rows<T: Real, B>(
    l: &[T],
    width: usize,
    below: impl Iterator<Item = B>,
    mut work: impl FnMut(&[f64], B),
) {
    let mut wide = Vec::with_capacity(ROWS_CONVERTED_TOGETHER * width);
    for (l, below) in l.chunks(ROWS_CONVERTED_TOGETHER * width).zip(below) {
        work(T::all_wide(l, &mut wide), below);
    }
}

/// Solves L y = front for the leading rows, in the pivot order of each panel, and subtracts their contribution from the
/// rows below.
fn forward<T: Real, const K: usize>(
    (columns, blocks): &(Trapezoid<T>, Vec<Blocks<T>>),
    values: &mut [[f64; K]],
) {
    for (p, block) in blocks.iter().enumerate() {
        let (first, width) = (p * PANEL_COLUMNS, columns.panel_width(p));
        let (pivots, below) = values[first..].split_at_mut(width);
        let mut y: Vec<[f64; K]> = block.order.iter().map(|&row| pivots[row]).collect();
        let (triangle, l) = columns.panels[p].split_at(width * width);
        solve_lower(T::all_wide(triangle, &mut Vec::new()), &mut y);
        pivots.copy_from_slice(&y);
        let piece = |l: &[T], below: &mut [[f64; K]]| {
            for_rows(l, width, below.chunks_mut(ROWS_CONVERTED_TOGETHER), |l, below| {
                subtract_product(l, &y, below)
            });
        };
        if l.len() < MIN_PARALLEL_ENTRIES {
            piece(l, below);
        } else {
            let pieces = l.chunks(ROWS_PER_PIECE * width).zip(below.chunks_mut(ROWS_PER_PIECE));
            parallel::for_each(pieces, |(l, below)| piece(l, below));
        }
    }
}

/// Solves B L' x = y for the leading rows, and returns them to the order of the front. The rows below are known.
fn backward<T: Real, const K: usize>(
    (columns, blocks): &(Trapezoid<T>, Vec<Blocks<T>>),
    values: &mut [[f64; K]],
) {
    for (p, block) in blocks.iter().enumerate().rev() {
        let (first, width) = (p * PANEL_COLUMNS, columns.panel_width(p));
        let (pivots, below) = values[first..].split_at_mut(width);
        // Blocks of B: y <- B^-1 y, one column at a time.
        let mut y = pivots.to_vec();
        let mut column = vec![0.0; width];
        for k in 0..K {
            column.iter_mut().zip(&y).for_each(|(to, from)| *to = from[k]);
            block.divide(&mut column);
            y.iter_mut().zip(&column).for_each(|(to, from)| to[k] = *from);
        }
        // Rows below: y <- y - L_below' x_below. Parts of parallel tasks are added in the order of the rows.
        let piece = |l: &[T], below: &[[f64; K]], y: &mut [[f64; K]]| {
            for_rows(l, width, below.chunks(ROWS_CONVERTED_TOGETHER), |l, below| {
                subtract_transposed(l, below, y)
            });
        };
        let (triangle, l) = columns.panels[p].split_at(width * width);
        if l.len() < MIN_PARALLEL_ENTRIES {
            piece(l, below, &mut y);
        } else {
            let pieces = l.chunks(ROWS_PER_PIECE * width).zip(below.chunks(ROWS_PER_PIECE));
            let parts = parallel::map(pieces, |(l, below)| {
                let mut part = vec![[0.0; K]; width];
                piece(l, below, &mut part);
                part
            });
            for part in parts {
                for (y, part) in y.iter_mut().zip(&part) {
                    y.iter_mut().zip(part).for_each(|(y, part)| *y += part);
                }
            }
        }
        // Unit triangle of the panel: L' x = y, then back from the order of the pivots.
        solve_transposed(T::all_wide(triangle, &mut Vec::new()), &mut y);
        for (&row, x) in block.order.iter().zip(&y) {
            pivots[row] = *x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CscMatrix, SymmetricMatrix, symmetric_eigen};
    use faer::Mat;

    /// Returns a chain of `n` masses with springs of varying stiffness and, at every seventh mass, a spring to a
    /// distant one.
    fn chain(n: usize) -> [SymmetricMatrix; 2] {
        let (mut k, mut m) = (Vec::new(), Vec::new());
        let mut spring = |i: usize, j: usize, c: f64| {
            let (i, j) = (i as u32, j as u32);
            k.extend([(i, i, c), (j, j, c), (i, j, -c), (j, i, -c)]);
        };
        for i in 0..n - 1 {
            spring(i, i + 1, 1.0 + (i % 5) as f64);
            if i % 7 == 0 && i + 13 < n {
                spring(i, i + 13, 0.3);
            }
        }
        for i in 0..n {
            m.push((i as u32, i as u32, 1.0 + (i % 3) as f64));
        }
        [k, m].map(|t| SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &t)))
    }

    /// Solutions satisfy their equations for shifts between, below and above all eigenvalues, with one and several
    /// panels in a front.
    #[test]
    fn solutions_fulfil_their_equations() {
        for (n, block) in [(1, 1), (9, 3), (90, 1), (300, 2)] {
            // One front of all rows: a full matrix.
            for full in [false, true] {
                let [mut k, m] = chain(n.max(2));
                let n = m.n();
                if full {
                    let all: Vec<_> = (0..n as u32)
                        .flat_map(|i| (0..n as u32).map(move |j| (i, j, 1.0 / f64::from(1 + i + j))))
                        .chain((0..n).flat_map(|j| {
                            let (rows, values) = k.row(j);
                            rows.iter().zip(values).map(|(&i, &v)| (i, j as u32, v)).collect::<Vec<_>>()
                        }))
                        .collect();
                    k = SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &all));
                }
                let spread: Vec<_> = (0..n)
                    .flat_map(|j| {
                        let (rows, values) = k.row(j);
                        let pairs = rows.iter().zip(values);
                        pairs
                            .flat_map(|(&i, &v)| (0..block).map(move |b| (i, b, v)))
                            .map(move |(i, b, v)| (i * block as u32 + b as u32, (j * block + b) as u32, v))
                            .collect::<Vec<_>>()
                    })
                    .collect();
                let k = SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n * block, n * block, &spread));
                let pencil = Pencil::new(&k, &m, block);
                let analysis = Analysis::new(&pencil).expect("small");
                for sigma in [0.0731, 1.37, 5.91, 400.0] {
                    let factor = Indefinite::<f64>::new(&analysis, &pencil, sigma);
                    let b = Mat::from_fn(n * block, 11, |i, j| ((i * 31 + j * 17) % 23) as f64 - 11.0);
                    let mut x = b.clone();
                    factor.solve_in_place(x.as_mut());
                    let product = pencil.apply_stiffness(x.as_ref())
                        - pencil.apply_mass(x.as_ref()) * faer::Scale(sigma);
                    let scale = 100.0 * (1.0 + sigma) * x.norm_max() + b.norm_max();
                    assert!((&product - &b).norm_max() < 1e-13 * scale, "{n} {block} {full} {sigma}");
                    // The count without a stored factor is equal.
                    assert_eq!(factor.inertia(), Inertia::new(&analysis, &pencil, sigma));
                    let dense = Mat::from_fn(n, n, |i, j| {
                        let at = |a: &SymmetricMatrix| a.as_csc().get(i, j);
                        let root = |i: usize| m.as_csc().get(i, i).sqrt();
                        (k.as_csc().get(i * block, j * block) - sigma * at(&m)) / root(i) / root(j)
                    });
                    let eigen = symmetric_eigen(dense.as_ref()).expect("finite");
                    let negative = eigen.values.iter().filter(|v| **v < 0.0).count();
                    assert_eq!(factor.inertia().negative, block * negative, "{n} {block} {full} {sigma}");
                }
            }
        }
    }

    /// Returns the eigenvalues of the chain, ascending.
    fn eigenvalues([k, m]: &[SymmetricMatrix; 2]) -> Vec<f64> {
        let root = |i: usize| m.as_csc().get(i, i).sqrt();
        let dense = Mat::from_fn(k.n(), k.n(), |i, j| k.as_csc().get(i, j) / root(i) / root(j));
        symmetric_eigen(dense.as_ref()).expect("finite").values
    }

    /// A count in single precision is never certain of a wrong number. It is certain if the shift lies well between two
    /// eigenvalues, and uncertain where rounding could move one across.
    #[test]
    fn counts_in_single_precision_know_how_far_they_go() {
        for n in [40, 700] {
            let matrices = chain(n);
            let eigenvalues = eigenvalues(&matrices);
            let pencil = Pencil::new(&matrices[0], &matrices[1], 1);
            let analysis = Analysis::new(&pencil).expect("small");
            let (mut sure, mut unsure) = (0, 0);
            for at in [0, 1, 3, n / 8, n / 2] {
                let (below, above) = (eigenvalues[at], eigenvalues[at + 1]);
                for part in [0.5, 1e-2, 1e-4, 1e-6, 1e-8] {
                    for sigma in [below + part * (above - below), above - part * (above - below)] {
                        let factor = Indefinite::<f32>::new(&analysis, &pencil, sigma);
                        let counted = factor.inertia().negative;
                        match factor.perturbation(&pencil) {
                            Some(rounding) => {
                                assert_eq!(counted, at + 1, "{n} rows, {sigma:e}: {rounding}");
                                sure += 1;
                            }
                            None => {
                                assert!(part < 0.1, "{n} rows, {sigma:e}: unsure in the middle of a gap");
                                unsure += 1;
                            }
                        }
                    }
                }
            }
            assert!(sure >= 10 && unsure >= 5, "{n} rows: {sure} sure, {unsure} unsure");
        }
    }

    /// The bound measures the rounding of the factor: almost none in double precision, and in single precision the norm
    /// of I - F^-1 A, computed with dense algebra.
    #[test]
    fn the_rounding_of_a_count_is_measured() {
        let matrices = chain(60);
        let pencil = Pencil::new(&matrices[0], &matrices[1], 1);
        let analysis = Analysis::new(&pencil).expect("small");
        let sigma = 1.37;
        let double = Indefinite::<f64>::new(&analysis, &pencil, sigma);
        assert!(double.perturbation(&pencil).expect("sure") < 1e-9);
        let single = Indefinite::<f32>::new(&analysis, &pencil, sigma);
        let measured = single.perturbation(&pencil).expect("sure") / PERTURBATION_MARGIN;
        let scale = |i: usize| single.scale[i];
        let unit = Mat::from_fn(60, 60, |i, j| if i == j { scale(i) } else { 0.0 });
        let mut g =
            pencil.apply_stiffness(unit.as_ref()) - pencil.apply_mass(unit.as_ref()) * faer::Scale(sigma);
        single.solve_in_place(g.as_mut());
        let g = Mat::from_fn(60, 60, |i, j| f64::from(u8::from(i == j)) - g[(i, j)] / scale(i));
        let true_norm = g.norm_l2();
        assert!(measured > 0.3 * true_norm && measured < 3.0 * true_norm, "{measured:e} {true_norm:e}");
    }
}

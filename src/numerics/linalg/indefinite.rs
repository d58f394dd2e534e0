//! K - sigma M = L B L' with pivoting inside the panels of each front, kept to solve with: the dynamic
//! stiffness at a frequency.

use super::factor::{Analysis, COLUMNS, substitute};
use super::front::PANEL;
use super::inertia::{Blocks, Contribution, Eliminated, Inertia, eliminate_front};
use super::{Pencil, front};
use faer::MatMut;
use faer::prelude::ReborrowMut;
use front::Trapezoid;
use std::convert::Infallible;

/// Factor of the indefinite matrix K - sigma M.
pub struct Indefinite<'a> {
    analysis: &'a Analysis,
    /// L below the leading squares, and these.
    fronts: Vec<(Trapezoid<f64>, Vec<Blocks>)>,
    /// Scale of each row.
    scale: Vec<f64>,
    inertia: Inertia,
}

impl<'a> Indefinite<'a> {
    /// Factors K - sigma M. Whether the factor is any good its [`Inertia`] tells: no zero pivot, and a small
    /// backward error.
    pub fn new(analysis: &'a Analysis, pencil: &Pencil<'_>, sigma: f64) -> Self {
        let tree = &analysis.tree;
        let matrix = analysis.scaled(pencil, sigma);
        let mut fronts: Vec<Option<Eliminated>> = (0..tree.len()).map(|_| None).collect();
        let visit = |s: usize, slot: &mut Option<Eliminated>, children: Vec<Contribution>| {
            let (eliminated, handed_on) = eliminate_front(analysis, &matrix, s, children);
            *slot = Some(eliminated);
            Ok::<_, Infallible>(handed_on)
        };
        let Ok(()) = analysis.walk.up(tree, &mut fronts, &visit);
        let fronts: Vec<Eliminated> = fronts.into_iter().flatten().collect();
        let counts = fronts.iter().map(|front| {
            let (negative, zero) = front.signs();
            (negative, zero, front.growth)
        });
        let inertia = Inertia::of_fronts(counts);
        let fronts = fronts.into_iter().map(|front| (front.columns, front.blocks)).collect();
        Self { analysis, fronts, scale: matrix.scale, inertia }
    }

    /// Signs of the pivots, and the backward error of the factorisation.
    pub fn inertia(&self) -> Inertia {
        self.inertia
    }

    /// Replaces X (n x k) by (K - sigma M)^-1 X.
    pub fn solve_in_place(&self, mut x: MatMut<'_, f64>) {
        let forward = |s: usize, front: &mut [[f64; COLUMNS]]| forward(&self.fronts[s], front);
        let backward = |s: usize, front: &mut [[f64; COLUMNS]]| backward(&self.fronts[s], front);
        let mut start = 0;
        while start < x.ncols() {
            let width = COLUMNS.min(x.ncols() - start);
            substitute(self.analysis, &self.scale, x.rb_mut().subcols_mut(start, width), forward, backward);
            start += width;
        }
    }
}

/// to -= factor from.
fn subtract<const K: usize>(to: &mut [f64; K], factor: f64, from: &[f64; K]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to -= factor * from);
}

/// Leading rows y with L y = front, in the order of the pivots of each panel, and what is left of the rows
/// below.
fn forward<const K: usize>((columns, blocks): &(Trapezoid<f64>, Vec<Blocks>), values: &mut [[f64; K]]) {
    for (p, block) in blocks.iter().enumerate() {
        let (first, width) = (p * PANEL, columns.panel_width(p));
        let (own, below) = values[first..].split_at_mut(width);
        let mut y: Vec<[f64; K]> = block.order.iter().map(|&row| own[row]).collect();
        for j in 0..width {
            let (done, rest) = y.split_at_mut(j + 1);
            for (i, y) in rest.iter_mut().enumerate() {
                subtract(y, block.l[(j + 1 + i, j)], &done[j]);
            }
        }
        own.copy_from_slice(&y);
        for (row, value) in columns.panels[p][width * width..].chunks_exact(width).zip(below) {
            for (l, y) in row.iter().zip(&y) {
                subtract(value, *l, y);
            }
        }
    }
}

/// Leading rows x with B L' x = y, back in the order of the front; the rows below are known.
fn backward<const K: usize>((columns, blocks): &(Trapezoid<f64>, Vec<Blocks>), values: &mut [[f64; K]]) {
    for (p, block) in blocks.iter().enumerate().rev() {
        let (first, width) = (p * PANEL, columns.panel_width(p));
        let (own, below) = values[first..].split_at_mut(width);
        let mut y = own.to_vec();
        let mut column = vec![0.0; width];
        for k in 0..K {
            column.iter_mut().zip(&y).for_each(|(to, from)| *to = from[k]);
            block.divide(&mut column);
            y.iter_mut().zip(&column).for_each(|(to, from)| to[k] = *from);
        }
        for (row, value) in columns.panels[p][width * width..].chunks_exact(width).zip(&*below) {
            for (l, y) in row.iter().zip(&mut y) {
                subtract(y, *l, value);
            }
        }
        for j in (0..width).rev() {
            let (rest, found) = y.split_at_mut(j + 1);
            for (i, x) in found.iter().enumerate() {
                subtract(&mut rest[j], block.l[(j + 1 + i, j)], x);
            }
        }
        for (&row, x) in block.order.iter().zip(&y) {
            own[row] = *x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::linalg::{CscMatrix, SymmetricMatrix, symmetric_eigen};
    use faer::Mat;

    /// A chain of `n` masses with springs of changing stiffness along it and, every seventh, one to a mass
    /// far away.
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
        [k, m].map(|t| SymmetricMatrix::symmetrised(&CscMatrix::from_triplets(n, n, &t)))
    }

    /// Solutions fulfil their equations between, below and above all eigenvalues, with one and several panels
    /// in a front.
    #[test]
    fn solutions_fulfil_their_equations() {
        for (n, block) in [(1, 1), (9, 3), (90, 1), (300, 2)] {
            // With a front of all rows: nothing is sparse.
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
                    k = SymmetricMatrix::symmetrised(&CscMatrix::from_triplets(n, n, &all));
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
                let k =
                    SymmetricMatrix::symmetrised(&CscMatrix::from_triplets(n * block, n * block, &spread));
                let pencil = Pencil::new(&k, &m, block);
                let analysis = Analysis::new(&pencil).expect("small");
                for sigma in [0.0731, 1.37, 5.91, 400.0] {
                    let factor = Indefinite::new(&analysis, &pencil, sigma);
                    let b = Mat::from_fn(n * block, 11, |i, j| ((i * 31 + j * 17) % 23) as f64 - 11.0);
                    let mut x = b.clone();
                    factor.solve_in_place(x.as_mut());
                    let product = pencil.apply_stiffness(x.as_ref())
                        - pencil.apply_mass(x.as_ref()) * faer::Scale(sigma);
                    let scale = 100.0 * (1.0 + sigma) * x.norm_max() + b.norm_max();
                    assert!((&product - &b).norm_max() < 1e-13 * scale, "{n} {block} {full} {sigma}");
                    // The count of another path.
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
}

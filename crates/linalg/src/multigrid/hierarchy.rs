//! Hierarchy of levels: the multigrid cycle, and rough modes from the coarsest level.

use super::blocks::{BlockMatrix, Rows, WIDTH, noise};
use super::coarsening::{Block, Motions, SymmetricBlocks};
use super::corrections::{CorrectionTarget, Corrections, Deflation, DeflationSpace, SmallPencil};
use super::level::{Coarse, Level};
use crate::{
    Pencil, SymmetricMatrix, combine, contiguous_mut, dense_cholesky, dense_inverse, gram, largest, parallel,
    solve_lower,
};
use faer::{Mat, MatMut, MatRef};
use std::ops::Range;

/// Largest number of rows of a level that is solved with a dense matrix.
const MAX_COARSEST_ROWS: usize = 1500;

/// Largest number of levels. Each has at most about a tenth of the rows of the finer one.
const MAX_LEVELS: usize = 10;

/// Coupling, relative to the diagonal, above which neighbours on the finest level are strongly coupled.
const FINEST_STRONG_COUPLING: f64 = 0.02;
/// Coupling, relative to the diagonal, above which neighbours on the coarser levels are strongly coupled.
const COARSER_STRONG_COUPLING: f64 = 0.01;

/// Number of inverse iterations for the rough modes of the coarsest level.
const COARSEST_INVERSE_ITERATIONS: usize = 6;

/// Number of inverse iterations, by cycles, for the rough modes on each level between the coarsest and the finest.
const LEVEL_INVERSE_ITERATIONS: usize = 3;

/// Number of nodes per parallel task.
const NODES_PER_TASK: usize = 1024;

/// Hierarchy of levels, for nodes of any size.
pub trait Levels {
    /// Returns the shift tau.
    fn shift(&self) -> f64;

    /// Returns approximations of the lowest modes as a start of a search: the lowest modes of the coarsest level with
    /// lumped masses, improved on the levels up to the finest (N x `count`, or as many columns as the coarsest level
    /// has rows). The vectors are not orthonormal. Returns `None` if they are linearly dependent.
    fn rough_modes(&self, count: usize) -> Option<Mat<f64>>;

    /// Replaces the residual forces of approximate modes, columns of about unit size, by corrections of the modes.
    /// Returns the number of columns of cycles.
    fn correct(
        &self,
        near: &DeflationSpace<'_>,
        targets: &[CorrectionTarget],
        forces: MatMut<'_, f64>,
    ) -> u64;
}

/// Returns true if a pencil with this block size, of a body with `rigid_modes` rigid modes, can have levels.
pub fn can_have_levels(pencil: &Pencil<'_>, rigid_modes: usize) -> bool {
    matches!((pencil.block(), rigid_modes), (3, 6) | (2, 3))
}

/// Builds the levels of K + tau M for the `rigid` modes of a body. Returns `None` if that is not possible: nodes have
/// rotations, a body in space does not have six rigid modes or one in the plane three, or diagonal blocks are not
/// positive definite in single precision.
pub fn levels(pencil: &Pencil<'_>, rigid: MatRef<'_, f64>, tau: f64) -> Option<Box<dyn Levels>> {
    match (pencil.block(), rigid.ncols()) {
        (3, 6) => Some(Box::new(Hierarchy::<3, 6>::new(pencil, rigid, tau)?)),
        (2, 3) => Some(Box::new(Hierarchy::<2, 3>::new(pencil, rigid, tau)?)),
        _ => None,
    }
}

/// Hierarchy for K + tau M, divided by the largest diagonal entry of K.
#[derive(Debug)]
struct Hierarchy<const B: usize, const C: usize> {
    fine: Level<B, C>,
    coarser: Vec<Level<C, C>>,
    /// Inverse of the matrix of the coarsest level.
    inverse_of_bottom: Mat<f64>,
    /// Masses of the groups of the coarsest level.
    masses: Vec<Block<C, C>>,
    /// M / `heaviest`, one entry for each block of the finest level.
    mass: Vec<f32>,
    /// Largest diagonal entry of M.
    heaviest: f64,
    /// Largest diagonal entry of K. Division by it keeps numbers within single precision in any units.
    size: f64,
    tau: f64,
}

/// Matrix (K + tau M) / size, node by node.
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
        // Merge the ascending columns of the B rows of K and of the row of M.
        loop {
            let stiff = rows.iter().filter_map(|row| row.0.first()).min().map(|&column| column as usize / B);
            let heavy = others.first().map(|&other| other as usize);
            let Some(next) = stiff.into_iter().chain(heavy).min() else { return };
            let mut block = [[0.0; B]; B];
            for (block_row, (columns, values)) in block.iter_mut().zip(&mut rows) {
                while let Some((&column, after)) = columns.split_first()
                    && column as usize / B == next
                {
                    block_row[column as usize % B] = self.scale * values[0];
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
        // Scale of K + tau M, so that single precision holds the entries in any units.
        let size = largest(pencil.stiffness().diagonal());
        let has_size = size > 0.0 && size.is_finite();
        if !has_size {
            return None;
        }
        let shifted = Shifted::<B> { pencil, tau, scale: 1.0 / size };
        // Masses have a scale of their own: rough modes depend only on their ratios.
        let heaviest = largest(pencil.mass().diagonal());
        let scaled = |mass: f64| {
            let mut block = [[0.0; B]; B];
            (0..B).for_each(|b| block[b][b] = mass / heaviest);
            block
        };
        let masses = pencil.mass().diagonal().into_iter().map(scaled).collect();
        // The finest level, with its masses in the order of its blocks.
        let (fine, mut next) = Level::new(&shifted, &unit_motions(rigid), masses, FINEST_STRONG_COUPLING)?;
        let mass = masses_beside(fine.matrix(), pencil.mass(), 1.0 / heaviest);
        let mut coarser = Vec::new();
        // Coarsen until a dense inverse is cheap.
        while next.a.n_rows() * C > MAX_COARSEST_ROWS {
            if coarser.len() == MAX_LEVELS {
                return None;
            }
            let Coarse { a, motions, masses } = next;
            let (level, after) = Level::new(&a, &motions, masses, COARSER_STRONG_COUPLING)?;
            coarser.push(level);
            next = after;
        }
        // The coarsest level is solved exactly.
        let inverse_of_bottom = dense_inverse(dense(&next.a))?;
        let masses = next.masses;
        Some(Self { fine, coarser, inverse_of_bottom, masses, mass, heaviest, size, tau })
    }

    /// Applies one cycle for (K + tau M) / size x = b.
    fn cycle(&self, b: &[Rows<B>]) -> Vec<Rows<B>> {
        self.fine.cycle(b, |coarse| self.coarse_cycle(&self.coarser, coarse))
    }

    fn coarse_cycle(&self, levels: &[Level<C, C>], b: Vec<Rows<C>>) -> Vec<Rows<C>> {
        let Some((level, below)) = levels.split_first() else { return self.solve_bottom(&b) };
        level.cycle(&b, |coarse| self.coarse_cycle(below, coarse))
    }

    fn solve_bottom(&self, b: &[Rows<C>]) -> Vec<Rows<C>> {
        let dense = Mat::from_fn(b.len() * C, WIDTH, |i, w| f64::from(b[i / C][i % C][w]));
        packed(combine(self.inverse_of_bottom.as_ref(), dense.as_ref()).as_ref())
    }

    /// Returns the lowest modes of the coarsest level, by inverse iterations from random vectors.
    fn bottom_modes(&self, count: usize) -> Option<Mat<f64>> {
        let n = self.inverse_of_bottom.nrows();
        // Start from random vectors.
        let mut x = Mat::from_fn(n, count.min(n), |i, j| f64::from(noise(i * count + j)));
        for _ in 0..COARSEST_INVERSE_ITERATIONS {
            let product = |i: usize, j: usize| -> f64 {
                let (group, masses) = (i / C, &self.masses[i / C][i % C]);
                (0..C).map(|c| masses[c] * x[(group * C + c, j)]).sum()
            };
            // M-orthonormalise by Cholesky of X'MX, then solve.
            let force = Mat::from_fn(n, x.ncols(), product);
            let l = dense_cholesky(gram(x.as_ref(), force.as_ref()))?;
            let orthonormal = solve_lower(&l, &force.transpose().to_owned()).transpose().to_owned();
            x = unit_columns(combine(self.inverse_of_bottom.as_ref(), orthonormal.as_ref()));
        }
        Some(x)
    }
}

impl<const B: usize, const C: usize> Levels for Hierarchy<B, C> {
    fn shift(&self) -> f64 {
        self.tau
    }

    fn rough_modes(&self, count: usize) -> Option<Mat<f64>> {
        // Rough modes of the coarsest level.
        let mut x = self.bottom_modes(count)?;
        for (at, level) in self.coarser.iter().enumerate().rev() {
            // Prolong to the next finer level, and improve there by inverse iterations.
            x = unit_columns(by_width(&x, level.nodes(), |x| level.prolonged(&x)));
            for _ in 0..LEVEL_INVERSE_ITERATIONS {
                let improved = |x: Vec<Rows<C>>| self.coarse_cycle(&self.coarser[at..], level.with_mass(&x));
                x = unit_columns(by_width(&x, level.nodes(), improved));
            }
        }
        Some(by_width(&x, self.fine.nodes(), |x| self.fine.prolonged(&x)))
    }

    fn correct(
        &self,
        near: &DeflationSpace<'_>,
        targets: &[CorrectionTarget],
        forces: MatMut<'_, f64>,
    ) -> u64 {
        let ratio = self.heaviest / self.size;
        let pencil = SmallPencil { a: self.fine.matrix(), mass: &self.mass, tau: self.tau, ratio };
        // Conjugate gradients on the finest level, with one cycle as the preconditioner.
        let cycle = |b: &[Rows<B>]| self.cycle(b);
        let deflation = Deflation::new(near);
        Corrections { pencil, cycle, deflation, eigenvalues: near.eigenvalues }.solve(targets, forces)
    }
}

/// Returns the scaled entries of M in the order of the blocks of `a`, which has a block wherever M has an entry.
fn masses_beside<const B: usize>(a: &BlockMatrix<B, B>, mass: &SymmetricMatrix, scale: f64) -> Vec<f32> {
    let row = |node: usize| {
        let (others, values) = mass.row(node);
        let mut entries = others.iter().zip(values).peekable();
        a.row(node).map(move |(column, _)| {
            let entry = entries.next_if(|(other, _)| **other as usize == column);
            entry.map_or(0.0, |(_, value)| (scale * value) as f32)
        })
    };
    parallel::concat(a.n_rows(), NODES_PER_TASK, |nodes| nodes.flat_map(row).collect())
}

/// Scales columns to a largest entry of one, within the range of single precision. Zero columns stay zero.
fn unit_columns(mut x: Mat<f64>) -> Mat<f64> {
    for mut column in x.col_iter_mut() {
        let size = column.norm_max();
        if size > 0.0 {
            column *= faer::Scale(size.recip());
        }
    }
    x
}

/// Returns the rigid modes node by node, each scaled to a largest entry of one.
fn unit_motions<const B: usize, const C: usize>(rigid: MatRef<'_, f64>) -> Motions<B, C> {
    let scale: [f64; C] = std::array::from_fn(|c| 1.0 / rigid.col(c).norm_max());
    let motion = |node: usize| -> [[f64; C]; B] {
        std::array::from_fn(|b| std::array::from_fn(|c| scale[c] * rigid[(node * B + b, c)]))
    };
    (0..rigid.nrows() / B).map(motion).collect()
}

/// Returns the matrix of a level, exactly symmetric.
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

/// Applies `work` to the columns of x, [`WIDTH`] at a time; the result has `nodes` nodes.
fn by_width<const R: usize, const S: usize>(
    x: &Mat<f64>,
    nodes: usize,
    work: impl Fn(Vec<Rows<R>>) -> Vec<Rows<S>>,
) -> Mat<f64> {
    let mut y = Mat::zeros(nodes * S, x.ncols());
    for columns in widths(x.ncols()) {
        let made = work(packed(x.as_ref().subcols(columns.start, columns.len())));
        unpack(&made, y.as_mut().subcols_mut(columns.start, columns.len()), 1.0);
    }
    y
}

/// Returns the ranges of columns that are processed together.
fn widths(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count).step_by(WIDTH).map(move |first| first..count.min(first + WIDTH))
}

/// Returns up to [`WIDTH`] columns, node by node; unused columns are zero.
fn packed<const B: usize>(x: MatRef<'_, f64>) -> Vec<Rows<B>> {
    let rows = |node: usize| {
        let mut rows = [[0.0; WIDTH]; B];
        for (b, row) in rows.iter_mut().enumerate() {
            (0..x.ncols()).for_each(|w| row[w] = x[(node * B + b, w)] as f32);
        }
        rows
    };
    parallel::values(x.nrows() / B, NODES_PER_TASK, rows)
}

fn unpack<const B: usize>(rows: &[Rows<B>], x: MatMut<'_, f64>, scale: f64) {
    parallel::for_each(x.col_iter_mut().map(contiguous_mut).enumerate(), |(w, column)| {
        for (node_rows, rows) in column.chunks_exact_mut(B).zip(rows) {
            node_rows.iter_mut().zip(rows).for_each(|(x, row)| *x = scale * f64::from(row[w]));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CscMatrix, symmetric_eigen};

    /// Grid of points of unit mass, with springs between neighbours, also across the cells: rigid motion has no energy.
    struct Lattice {
        places: Vec<[f64; 3]>,
        stiffness: SymmetricMatrix,
        mass: SymmetricMatrix,
    }

    impl Lattice {
        fn new(sides: [usize; 3]) -> Self {
            let number = |p: [usize; 3]| p[0] + sides[0] * (p[1] + sides[1] * p[2]);
            let points: Vec<[usize; 3]> = (0..sides.iter().product())
                .map(|k| [k % sides[0], k / sides[0] % sides[1], k / sides[0] / sides[1]])
                .collect();
            let mut entries = Vec::new();
            for &p in &points {
                for step in 0..27 {
                    let d = [step % 3, step / 3 % 3, step / 9].map(|s| s as i64 - 1);
                    let other: [i64; 3] = std::array::from_fn(|k| p[k] as i64 + d[k]);
                    let inside = (0..3).all(|k| (0..sides[k] as i64).contains(&other[k]));
                    if d == [0; 3] || !inside {
                        continue;
                    }
                    let (a, b) = (number(p), number(other.map(|x| x as usize)));
                    let length2 = d.iter().map(|x| (x * x) as f64).sum::<f64>();
                    for i in 0..3 {
                        for j in 0..3 {
                            let k = (d[i] * d[j]) as f64 / length2;
                            entries.push(((3 * a + i) as u32, (3 * a + j) as u32, k));
                            entries.push(((3 * a + i) as u32, (3 * b + j) as u32, -k));
                        }
                    }
                }
            }
            let n = points.len();
            let ones: Vec<_> = (0..n as u32).map(|i| (i, i, 1.0)).collect();
            let symmetric = |size: usize, entries: &[(u32, u32, f64)]| {
                SymmetricMatrix::symmetrised(CscMatrix::from_triplets(size, size, entries))
            };
            Self {
                places: points.iter().map(|p| p.map(|x| x as f64)).collect(),
                stiffness: symmetric(3 * n, &entries),
                mass: symmetric(n, &ones),
            }
        }

        fn pencil(&self) -> Pencil<'_> {
            Pencil::new(&self.stiffness, &self.mass, 3)
        }

        fn rigid(&self) -> Mat<f64> {
            let n = self.places.len() as f64;
            let centre: [f64; 3] = std::array::from_fn(|k| self.places.iter().map(|p| p[k]).sum::<f64>() / n);
            Mat::from_fn(3 * self.places.len(), 6, |row, column| {
                let (i, x) = (row % 3, self.places[row / 3]);
                if column < 3 {
                    return f64::from(u8::from(i == column));
                }
                // e x (x - c) about axis e.
                let axis = column - 3;
                match (3 + i - axis) % 3 {
                    1 => -(x[(axis + 2) % 3] - centre[(axis + 2) % 3]),
                    2 => x[(axis + 1) % 3] - centre[(axis + 1) % 3],
                    _ => 0.0,
                }
            })
        }
    }

    /// Applies one cycle for (K + tau M) x = b.
    fn solved(levels: &Hierarchy<3, 6>, b: &Mat<f64>) -> Mat<f64> {
        by_width(b, levels.fine.nodes(), |b| levels.cycle(&b)) * faer::Scale(1.0 / levels.size)
    }

    fn noise(n: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(n, columns, |i, j| ((i * 7919 + j * 104_729) % 1009) as f64 / 1009.0 - 0.5)
    }

    #[test]
    fn a_cycle_is_symmetric_and_damps_every_error() {
        let lattice = Lattice::new([20, 20, 20]);
        let (pencil, tau) = (lattice.pencil(), 1e-3);
        let levels = Hierarchy::<3, 6>::new(&pencil, lattice.rigid().as_ref(), tau).expect("levels");
        let coarser = levels.coarser.iter().map(|level| 6 * level.nodes());
        let rows: Vec<usize> = [3 * levels.fine.nodes()]
            .into_iter()
            .chain(coarser)
            .chain([levels.inverse_of_bottom.nrows()])
            .collect();
        assert!(rows.len() == 3 && rows.is_sorted_by(|a, b| a > &(4 * b)), "{rows:?}");
        // One full width of columns, and a second one with two columns.
        let mut x = noise(pencil.n(), WIDTH + 2);
        let products = gram(x.as_ref(), solved(&levels, &x).as_ref());
        let size = products.norm_max();
        for i in 0..x.ncols() {
            for j in 0..i {
                let off = (products[(i, j)] - products[(j, i)]).abs();
                assert!(off < 1e-4 * size, "({i}, {j}): {off:e} of {size:e}");
            }
        }
        // Errors e <- e - T A e in the norm of A.
        let applied = |x: &Mat<f64>| {
            pencil.apply_stiffness(x.as_ref()) + pencil.apply_mass(x.as_ref()) * faer::Scale(tau)
        };
        let mut before = f64::INFINITY;
        for _ in 0..6 {
            let force = applied(&x);
            let energy = gram(x.as_ref(), force.as_ref())[(0, 0)].sqrt();
            assert!(energy < 0.5 * before, "{energy:e} after {before:e}");
            before = energy;
            x -= solved(&levels, &force);
        }
    }

    #[test]
    fn rough_modes_are_near_the_lowest() {
        let lattice = Lattice::new([9, 8, 7]);
        let pencil = lattice.pencil();
        let levels = levels(&pencil, lattice.rigid().as_ref(), 1e-3).expect("levels");
        let x = levels.rough_modes(12).expect("vectors");
        let dense = Mat::from_fn(pencil.n(), pencil.n(), |i, j| lattice.stiffness.as_csc().get(i, j));
        let exact = symmetric_eigen(dense.as_ref()).expect("eigenvalues").values;
        let (gm, gk) =
            (gram(x.as_ref(), x.as_ref()), gram(x.as_ref(), pencil.apply_stiffness(x.as_ref()).as_ref()));
        let l = dense_cholesky(gm).expect("independent");
        let half = solve_lower(&l, &gk);
        let projected = solve_lower(&l, &half.transpose().to_owned());
        let found = symmetric_eigen(projected.as_ref()).expect("eigenvalues").values;
        // The last columns of the block are guards.
        for k in 6..10 {
            assert!(found[k] < 1.5 * exact[k], "mode {k}: {} {}", found[k], exact[k]);
        }
    }

    #[test]
    fn models_without_levels_have_none() {
        let lattice = Lattice::new([3, 3, 3]);
        let (pencil, rigid) = (lattice.pencil(), lattice.rigid());
        assert!(levels(&pencil, rigid.as_ref().subcols(0, 5), 1.0).is_none(), "five rigid modes");
        let rows = Pencil::new(&lattice.stiffness, &lattice.stiffness, 1);
        assert!(levels(&rows, rigid.as_ref(), 1.0).is_none(), "rows that belong to no node");
        assert!(levels(&pencil, rigid.as_ref(), f64::NAN).is_none(), "no number");
    }
}

//! Level of the hierarchy: its smoother, and the transfer to the next coarser level.

use super::blocks::{BlockMatrix, Rows, WIDTH, noise};
use super::coarsening::{
    Aggregates, Block, Motions, SymmetricBlocks, diagonal, galerkin, inverse, narrow, stored,
    strong_couplings,
};
use crate::{parallel, symmetric_eigen};
use faer::Mat;
use pulp::{Arch, Simd, WithSimd};

/// Factor of the prolongation smoother relative to the inverse of the largest eigenvalue: it gives the prolongation the
/// least energy.
const PROLONGATION_SMOOTHING: f64 = 4.0 / 3.0;

/// Level with blocks of `B` rows, above a level whose groups have `C` motions.
#[derive(Debug)]
pub(super) struct Level<const B: usize, const C: usize> {
    smoother: Smoother<B>,
    p: BlockMatrix<B, C>,
    r: BlockMatrix<C, B>,
    /// Mass of each node.
    masses: Vec<Block<B, B>>,
}

/// Data from which the next coarser level is made.
pub(super) struct Coarse<const C: usize> {
    pub a: BlockMatrix<C, C>,
    pub motions: Motions<C, C>,
    /// Masses of the groups along their motions before smoothing.
    pub masses: Vec<Block<C, C>>,
}

impl<const B: usize, const C: usize> Level<B, C> {
    /// Builds the level from a matrix and the motions of almost no energy. Neighbours are strongly coupled if their
    /// coupling exceeds `least_coupling` relative to the diagonal. Returns `None` if a diagonal block is not positive
    /// definite, or if the next level would not be smaller.
    pub(super) fn new(
        matrix: &impl SymmetricBlocks<B>,
        motions: &Motions<B, C>,
        masses: Vec<Block<B, B>>,
        least_coupling: f64,
    ) -> Option<(Self, Coarse<C>)> {
        let diagonal = diagonal(matrix);
        let inverse: Vec<[[f64; B]; B]> = diagonal.iter().map(inverse).collect::<Option<_>>()?;
        // Groups of strongly coupled nodes, with a basis of their motions.
        let groups = Aggregates::new(&strong_couplings(matrix, &diagonal, least_coupling), motions);
        if groups.count * C >= matrix.nodes() * B {
            return None;
        }
        // Smoothed prolongation P, and the coarse matrix P'AP.
        let smoother = Smoother::new(stored(matrix), inverse.iter().map(narrow).collect())?;
        let p = groups.smoothed(matrix, &inverse, PROLONGATION_SMOOTHING / f64::from(smoother.largest));
        let r = p.transposed(groups.count);
        let a = galerkin(matrix, &p, &r, diagonal[0][0][0] as f32);
        let coarse = Coarse { a, masses: groups.masses(&masses), motions: groups.motions };
        Some((Self { smoother, p, r, masses }, coarse))
    }

    pub(super) fn nodes(&self) -> usize {
        self.smoother.nodes()
    }

    pub(super) fn matrix(&self) -> &BlockMatrix<B, B> {
        self.smoother.matrix()
    }

    /// Applies one symmetric cycle for A x = b: smoothing, the coarser levels by `solve_coarse`, smoothing.
    pub(super) fn cycle(
        &self,
        b: &[Rows<B>],
        solve_coarse: impl FnOnce(Vec<Rows<C>>) -> Vec<Rows<C>>,
    ) -> Vec<Rows<B>> {
        let x = self.smoother.smoothed_from_zero(b);
        let coarse = solve_coarse(self.restricted(&self.smoother.residual(b, &x)));
        let x = self.p.apply(&coarse, |node, px| plus(&x[node], px));
        self.smoother.smooth(b, &x)
    }

    /// Returns M x with the masses of the nodes.
    pub(super) fn with_mass(&self, x: &[Rows<B>]) -> Vec<Rows<B>> {
        x.iter().zip(&self.masses).map(|(x, mass)| mass_times(mass, x)).collect()
    }

    /// Returns P' x.
    fn restricted(&self, x: &[Rows<B>]) -> Vec<Rows<C>> {
        self.r.apply(x, |_, rx| *rx)
    }

    /// Returns P y.
    pub(super) fn prolonged(&self, coarse: &[Rows<C>]) -> Vec<Rows<B>> {
        self.p.apply(coarse, |_, px| *px)
    }
}

#[inline(always)]
fn plus<const B: usize>(x: &Rows<B>, y: &Rows<B>) -> Rows<B> {
    std::array::from_fn(|i| std::array::from_fn(|w| x[i][w] + y[i][w]))
}

fn mass_times<const B: usize>(mass: &Block<B, B>, x: &Rows<B>) -> Rows<B> {
    let entry = |b: usize, w: usize| (0..B).map(|k| mass[b][k] * f64::from(x[k][w])).sum::<f64>() as f32;
    std::array::from_fn(|b| std::array::from_fn(|w| entry(b, w)))
}

// Matrix of a level, with the Chebyshev iteration that damps the errors that a coarser level cannot represent (Adams,
// Brezina, Hu and Tuminaro, J. Comput. Phys. 188 (2003) 593), preconditioned by the diagonal blocks of the nodes.

/// Number of nodes per parallel task.
const NODES_PER_TASK: usize = 1024;

/// Number of Lanczos steps for the bound of the spectrum.
const LANCZOS_STEPS: usize = 10;
/// Factor by which the result of the Lanczos steps is raised to become an upper bound.
const SPECTRAL_BOUND_FACTOR: f64 = 1.05;

/// Lower end of the damped part of the spectrum, relative to its upper end.
const DAMPED_SPECTRUM_START: f64 = 0.12;

/// Symmetric positive definite A with the inverses of its diagonal blocks.
#[derive(Debug)]
struct Smoother<const B: usize> {
    a: BlockMatrix<B, B>,
    inverse: Vec<[[f32; B]; B]>,
    /// Approximate upper bound of the eigenvalues of D^-1 A.
    pub largest: f32,
}

impl<const B: usize> Smoother<B> {
    /// Creates the smoother; `None` if the largest eigenvalue of D^-1 A is not finite and positive.
    pub(super) fn new(a: BlockMatrix<B, B>, inverse: Vec<[[f32; B]; B]>) -> Option<Self> {
        let mut smoother = Self { a, inverse, largest: 0.0 };
        smoother.largest = (SPECTRAL_BOUND_FACTOR * smoother.largest_eigenvalue()?) as f32;
        Some(smoother)
    }

    pub(super) fn nodes(&self) -> usize {
        self.a.n_rows()
    }

    pub(super) fn matrix(&self) -> &BlockMatrix<B, B> {
        &self.a
    }

    /// Returns D^-1 x of a node.
    #[inline(always)]
    fn divided(&self, node: usize, x: &Rows<B>) -> Rows<B> {
        let inverse = &self.inverse[node];
        let mut y = [[0.0; WIDTH]; B];
        for i in 0..B {
            for j in 0..B {
                for w in 0..WIDTH {
                    y[i][w] += inverse[i][j] * x[j][w];
                }
            }
        }
        y
    }

    /// Returns an approximation of the largest eigenvalue of D^-1 A, by Lanczos steps in the inner product of D from a
    /// random vector in each column. `None` if it is not finite and positive.
    fn largest_eigenvalue(&self) -> Option<f64> {
        let start = |node: usize| -> Rows<B> {
            std::array::from_fn(|b| std::array::from_fn(|w| noise((node * B + b) * WIDTH + w)))
        };
        // u = D v of the current and of the previous step.
        let mut u: Vec<Rows<B>> = (0..self.nodes()).map(start).collect();
        let mut u_before = vec![[[0.0; WIDTH]; B]; u.len()];
        let (mut diagonals, mut lengths) = (Vec::new(), Vec::new());
        for _ in 0..LANCZOS_STEPS {
            let mut v: Vec<Rows<B>> =
                parallel::values(u.len(), NODES_PER_TASK, |node| self.divided(node, &u[node]));
            // Normalise in the inner product of D: v' D v = 1.
            let length = products(&v, &u).map(f64::sqrt);
            let scale = length.map(|length| if length > 0.0 { (1.0 / length) as f32 } else { 0.0 });
            [&mut u, &mut v].into_iter().for_each(|x| scale_columns(x, &scale));
            // Next vector: A v without its parts along this vector and the one before.
            let mut next = self.a.apply(&v, |_, av| *av);
            let along = products(&v, &next);
            let weights = along.map(|along| along as f32);
            // The first step has no predecessor.
            let before = length.map(|length| if diagonals.is_empty() { 0.0 } else { length as f32 });
            parallel::for_each_mut(&mut next, NODES_PER_TASK, |node, next| {
                for b in 0..B {
                    for w in 0..WIDTH {
                        next[b][w] -= weights[w] * u[node][b][w] + before[w] * u_before[node][b][w];
                    }
                }
            });
            diagonals.push(along);
            lengths.push(length);
            u_before = std::mem::replace(&mut u, next);
        }
        // Largest eigenvalue of each tridiagonal matrix; the largest of all columns counts.
        let of_column = |w: usize| {
            let entry = |i: usize, j: usize| match i.abs_diff(j) {
                0 => diagonals[i][w],
                1 => lengths[i.max(j)][w],
                _ => 0.0,
            };
            let tridiagonal = Mat::from_fn(LANCZOS_STEPS, LANCZOS_STEPS, entry);
            symmetric_eigen(tridiagonal.as_ref())?.values.last().copied()
        };
        let found: Vec<f64> = (0..WIDTH).filter_map(of_column).collect();
        let largest = found.iter().copied().fold(0.0, f64::max);
        (found.len() == WIDTH && largest > 0.0 && largest.is_finite()).then_some(largest)
    }

    /// Makes two steps of the iteration for A x = b from x = 0.
    fn smoothed_from_zero(&self, b: &[Rows<B>]) -> Vec<Rows<B>> {
        let (arch, scale) = (Arch::new(), self.steps().first);
        let first = |node: usize| arch.dispatch(FirstStep { smoother: self, scale, node, b: &b[node] });
        let x: Vec<Rows<B>> = parallel::values(b.len(), NODES_PER_TASK, first);
        self.second_step(b, &x, |node| x[node])
    }

    /// Makes two steps of the iteration for A x = b.
    fn smooth(&self, b: &[Rows<B>], x: &[Rows<B>]) -> Vec<Rows<B>> {
        let scale = self.steps().first;
        let once = self.a.apply(x, |node, ax| {
            let force = self.divided(node, &minus(&b[node], ax));
            std::array::from_fn(|i| std::array::from_fn(|w| x[node][i][w] + scale * force[i][w]))
        });
        self.second_step(b, &once, |node| minus(&once[node], &x[node]))
    }

    /// Returns x + kept d + second D^-1 (b - A x), with the step d of each node that led to x.
    fn second_step(
        &self,
        b: &[Rows<B>],
        x: &[Rows<B>],
        step: impl Fn(usize) -> Rows<B> + Sync,
    ) -> Vec<Rows<B>> {
        let Steps { momentum, second, .. } = self.steps();
        self.a.apply(x, |node, ax| {
            let (force, d) = (self.divided(node, &minus(&b[node], ax)), step(node));
            let moved = |i: usize, w: usize| x[node][i][w] + momentum * d[i][w] + second * force[i][w];
            std::array::from_fn(|i| std::array::from_fn(|w| moved(i, w)))
        })
    }

    /// Returns the factors of the Chebyshev iteration on the damped part of the spectrum.
    fn steps(&self) -> Steps {
        // The damped part of the spectrum, by its middle and half its length.
        let high = f64::from(self.largest);
        let low = DAMPED_SPECTRUM_START * high;
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let rho = 1.0 / (2.0 * middle / half - half / middle);
        Steps {
            first: (1.0 / middle) as f32,
            momentum: (rho * half / middle) as f32,
            second: (2.0 * rho / half) as f32,
        }
    }

    /// Returns b - A x.
    pub(super) fn residual(&self, b: &[Rows<B>], x: &[Rows<B>]) -> Vec<Rows<B>> {
        self.a.apply(x, |node, ax| minus(&b[node], ax))
    }
}

/// First step from zero: scale D^-1 b of a node.
struct FirstStep<'a, const B: usize> {
    smoother: &'a Smoother<B>,
    scale: f32,
    node: usize,
    b: &'a Rows<B>,
}

impl<const B: usize> WithSimd for FirstStep<'_, B> {
    type Output = Rows<B>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Rows<B> {
        let mut x = self.smoother.divided(self.node, self.b);
        x.iter_mut().flatten().for_each(|value| *value *= self.scale);
        x
    }
}

/// Factor of the first step, of its repetition in the second step, and of the second correction.
struct Steps {
    first: f32,
    momentum: f32,
    second: f32,
}

#[inline(always)]
fn minus<const B: usize>(b: &Rows<B>, ax: &Rows<B>) -> Rows<B> {
    std::array::from_fn(|i| std::array::from_fn(|w| b[i][w] - ax[i][w]))
}

/// Returns the products of the columns of two blocks, as sums over fixed pieces in fixed order.
pub(super) fn products<const B: usize>(x: &[Rows<B>], y: &[Rows<B>]) -> [f64; WIDTH] {
    let piece = |(x, y): (&[Rows<B>], &[Rows<B>])| {
        let mut sums = [0.0; WIDTH];
        for (x, y) in x.iter().flatten().zip(y.iter().flatten()) {
            (0..WIDTH).for_each(|w| sums[w] += f64::from(x[w]) * f64::from(y[w]));
        }
        sums
    };
    let pieces: Vec<[f64; WIDTH]> =
        parallel::map(x.chunks(NODES_PER_TASK).zip(y.chunks(NODES_PER_TASK)), piece);
    pieces.iter().fold([0.0; WIDTH], |all, sums| std::array::from_fn(|w| all[w] + sums[w]))
}

fn scale_columns<const B: usize>(x: &mut [Rows<B>], scale: &[f32; WIDTH]) {
    parallel::for_each(x.chunks_mut(NODES_PER_TASK), |x| {
        for row in x.as_flattened_mut() {
            row.iter_mut().zip(scale).for_each(|(x, scale)| *x *= scale);
        }
    });
}

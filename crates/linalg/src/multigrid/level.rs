//! Level of the hierarchy: its smoother, and the transfer to the next coarser level.

use super::blocks::{BlockMatrix, Rows};
use super::coarsening::{
    Aggregates, Block, Motions, SymmetricBlocks, diagonal, galerkin, inverse, narrow, stored,
    strong_couplings,
};
use super::smoother::Smoother;

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
    pub(super) fn restricted(&self, x: &[Rows<B>]) -> Vec<Rows<C>> {
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

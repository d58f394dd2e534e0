//! Condensation products of a cluster: G = X' M X of X = [Phi, T_b Psi for each axis b, Psi], with the rigid modes Phi,
//! the modes Psi and the matrix T_b that turns displacements about the axis b. G holds every integral of positions and
//! shapes that the invariants consist of. The invariants are computed from M on this machine; G is compared with M, so
//! that wrong products of a cluster are detected.

use super::row_order::{RowOrder, TurnedRows};
use faer::{Mat, MatRef};
use flexbody_linalg::{combine, gram, larger, uniform};
use flexbody_model::FeModel;

/// Number of random columns for the check of G.
const RANDOM_COLUMNS: usize = 2;
/// Seed of the random columns.
const SEED: u64 = 21;

/// Largest difference of G v and X' M X v that rounding explains, in the measure of [`Condensed::difference`].
pub(super) const MAX_CONDENSED_DIFFERENCE: f64 = 1e-11;

/// Operator X, without stored columns.
pub(super) struct Condensed<'a> {
    model: &'a FeModel,
    turns: Vec<TurnedRows<'a>>,
    rigid: MatRef<'a, f64>,
    modes: MatRef<'a, f64>,
}

impl<'a> Condensed<'a> {
    pub(crate) fn new(
        model: &'a FeModel,
        order: &'a RowOrder,
        rigid: MatRef<'a, f64>,
        modes: MatRef<'a, f64>,
    ) -> Self {
        Self { model, turns: TurnedRows::of(model, order), rigid, modes }
    }

    /// Returns the number of columns of X.
    pub(crate) fn columns(&self) -> usize {
        self.block(self.turns.len() + 1)
    }

    /// Returns the largest difference of G v and X' M X v for random columns v, relative to sqrt(max G_ii) sqrt(v' G
    /// v): by the Cauchy-Schwarz inequality, the largest possible entry of G v.
    pub(crate) fn difference(&self, g: MatRef<'_, f64>) -> f64 {
        let v = Mat::from_fn(self.columns(), RANDOM_COLUMNS, |i, j| uniform(SEED, i as u64, j as u64));
        let momentum = self.model.pencil().apply_mass(self.combined(v.as_ref()).as_ref());
        let (computed, given) = (self.projected(momentum.as_ref()), g * &v);
        let largest = (0..g.nrows()).map(|i| g[(i, i)]).fold(0.0, f64::max);
        let relative = |j: usize| {
            let size = (largest * (v.col(j).transpose() * computed.col(j))).sqrt();
            (given.col(j) - computed.col(j)).norm_max() / size
        };
        (0..RANDOM_COLUMNS).map(relative).fold(0.0, larger)
    }

    /// Returns the first column of a block of X: turned modes for each axis, then the modes, after the rigid modes.
    fn block(&self, of: usize) -> usize {
        self.rigid.ncols() + of * self.modes.ncols()
    }

    /// Returns X v.
    fn combined(&self, v: MatRef<'_, f64>) -> Mat<f64> {
        let part = |of: usize| combine(self.modes, v.subrows(self.block(of), self.modes.ncols()));
        let mut sum = combine(self.rigid, v.subrows(0, self.rigid.ncols())) + part(self.turns.len());
        for (of, turned) in self.turns.iter().enumerate() {
            let shapes = part(of);
            for row in 0..sum.nrows() {
                let Some((from, sign)) = turned.source(row) else { continue };
                (0..v.ncols()).for_each(|j| sum[(row, j)] += sign * shapes[(from, j)]);
            }
        }
        sum
    }

    /// Returns X' w.
    fn projected(&self, w: MatRef<'_, f64>) -> Mat<f64> {
        let count = self.modes.ncols();
        let mut all = Mat::zeros(self.columns(), w.ncols());
        all.subrows_mut(0, self.rigid.ncols()).copy_from(gram(self.rigid, w));
        for (of, turned) in self.turns.iter().enumerate() {
            // The transpose of T_b is -T_b.
            let back = Mat::from_fn(w.nrows(), w.ncols(), |row, j| {
                turned.source(row).map_or(0.0, |(from, sign)| -sign * w[(from, j)])
            });
            all.subrows_mut(self.block(of), count).copy_from(gram(self.modes, back.as_ref()));
        }
        all.subrows_mut(self.block(self.turns.len()), count).copy_from(gram(self.modes, w));
        all
    }
}

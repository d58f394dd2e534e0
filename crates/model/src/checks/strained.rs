//! Rows of a stiffness that rigid motion strains, and what their forces say of the cause.

use crate::fe_model::assemble::Assembled;
use crate::rows::{centre_and_length, rigid_residuals};
use crate::wording::name_some;
use faer::Mat;
use flexbody_base::numbers::significant;
use flexbody_linalg::ties::sort_descending;
use flexbody_linalg::{Pencil, gram, largest};
use nalgebra::DMatrix;

/// Number of nodes with the largest forces among which exchanged coordinates are searched: each pair of them is tested.
const MAX_EXCHANGED: usize = 8;

/// Largest residual that a user may accept: elements that do not follow rotations exactly leave 1e-6 to 1e-4, while
/// coordinates in another order or unit leave 0.01 and more.
const MAX_ACCEPTED: f64 = 1e-3;

/// Part of the largest residual that the exchange of two nodes must leave: other errors of coordinates may remain.
const EXCHANGED_PART: f64 = 1e-3;

/// Rows that rigid motion strains beyond a limit.
pub(crate) struct Strained<'b> {
    pub body: &'b Assembled,
    /// Rigid motions, with rotations divided by a length.
    pub fields: &'b Mat<f64>,
    /// |K R| of all rows, relative to the row sum of |K|.
    pub residuals: &'b [f64],
    /// Largest residual that counts as rounding.
    pub limit: f64,
    /// Rows above the limit, in descending order of their residuals.
    pub rows: Vec<usize>,
    /// True if translations alone strain some rows.
    pub by_translations: bool,
}

impl<'b> Strained<'b> {
    /// Finds the strained rows and tests them by translations alone.
    pub(crate) fn new(body: &'b Assembled, fields: &'b Mat<f64>, residuals: &'b [f64], limit: f64) -> Self {
        let is_strained = |residual: &f64| residual.is_nan() || *residual > limit;
        let mut rows: Vec<usize> = (0..residuals.len()).filter(|&row| is_strained(&residuals[row])).collect();
        sort_descending(&mut rows, |&row| residuals[row]);
        let translations = fields.subcols(0, body.rows.dimension).to_owned();
        let by_translations = Self::residuals_of(body, &translations).iter().any(is_strained);
        Self { body, fields, residuals, limit, rows, by_translations }
    }

    fn residuals_of(body: &Assembled, fields: &Mat<f64>) -> Vec<f64> {
        let (_, length) = centre_and_length(&body.nodes.positions);
        rigid_residuals(&body.stiffness, fields, &body.rows.field_sizes(length))
    }

    /// Returns the strained rows in words, with the motions that strain them.
    pub(crate) fn message(&self) -> String {
        let Assembled { nodes, rows, .. } = self.body;
        let name = |&row: &usize| format!("{} ({:.1e})", rows.label(nodes, row), self.residuals[row]);
        let named: Vec<String> = self.rows.iter().map(name).collect();
        let motions = if self.by_translations { "" } else { ", by rotations alone" };
        format!(
            "K R is not zero for {} of {} rows{motions}: |K R| reaches {:.1e} of the row sum of |K| (allowed {:.0e}); worst: {}",
            self.rows.len(),
            self.residuals.len(),
            self.worst(),
            self.limit,
            name_some(&named)
        )
    }

    /// Returns true if rotations alone strain K so little that the user may accept it.
    pub(crate) fn may_be_accepted(&self) -> bool {
        !self.by_translations && self.worst() <= MAX_ACCEPTED
    }

    fn worst(&self) -> f64 {
        largest(self.residuals.iter().copied())
    }

    /// Returns the numbers of two nodes whose coordinates are exchanged: with these exchanged, rows are strained by nothing
    /// or by much less.
    pub(crate) fn exchanged(&self) -> Option<[i64; 2]> {
        let Assembled { nodes, rows, .. } = self.body;
        let mut worst: Vec<usize> = Vec::new();
        for vertex in self.rows.iter().map(|row| rows.vertex(*row)).filter(|vertex| rows.is_node(*vertex)) {
            if worst.len() < MAX_EXCHANGED && !worst.contains(&vertex) {
                worst.push(vertex);
            }
        }
        let left = self.limit.max(EXCHANGED_PART * self.worst());
        let mut positions = nodes.positions.clone();
        let (centre, length) = centre_and_length(&positions);
        let pairs = (0..worst.len()).flat_map(|second| (0..second).map(move |first| [first, second]));
        for [a, b] in pairs.map(|pair| pair.map(|at| worst[at])) {
            positions.swap(a, b);
            let fields = rows.rigid_fields(&positions, centre, length);
            if Self::residuals_of(self.body, &fields).iter().all(|residual| *residual <= left) {
                let mut pair = [nodes.ids[a], nodes.ids[b]];
                pair.sort_unstable();
                return Some(pair);
            }
            positions.swap(a, b);
        }
        None
    }

    /// Returns the highest frequency in hertz that the rigid body has by its strain, in words: the root of the largest
    /// quotient R'K R / R'M R of rigid motions. Returns `None` without a positive mass.
    pub(crate) fn highest_frequency(&self) -> Option<String> {
        let Assembled { data, stiffness, mass, .. } = self.body;
        let pencil = Pencil::new(stiffness, mass, 1);
        let of = |product: Mat<f64>| {
            let gram = gram(self.fields.as_ref(), product.as_ref());
            DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| 0.5 * (gram[(i, j)] + gram[(j, i)]))
        };
        let (energy, inertia) =
            (of(pencil.apply_stiffness(self.fields.as_ref())), of(pencil.apply_mass(self.fields.as_ref())));
        // L^-1 E L^-T of M = L L' has the quotients as eigenvalues.
        let factor = inertia.cholesky()?.l();
        let half = factor.solve_lower_triangular(&energy)?;
        let quotients = factor.solve_lower_triangular(&half.transpose())?.symmetric_eigenvalues();
        Some(significant(data.description.units.frequency_of(quotients.max().max(0.0)), 3))
    }
}

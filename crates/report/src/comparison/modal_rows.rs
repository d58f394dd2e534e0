//! Comparison of rows by the modes (rows x nf) of two bodies whose modes have other signs or another basis.

use super::relative_difference::relative;
use super::shapes::product;
use faer::{Mat, MatRef};
use flexbody_linalg::larger;
use std::borrow::Cow;
use std::ops::Range;

/// Rows by the modes of two bodies.
pub(super) struct ModalRows<'r> {
    a: &'r Mat<f64>,
    b: Cow<'r, Mat<f64>>,
    /// True if the rows of both bodies are in the modes of the first.
    has_one_basis: bool,
}

impl<'r> ModalRows<'r> {
    /// Creates the comparison; `basis` transforms the modes of the second body to those of the first. Several components of the
    /// rows stand side by side, each with all modes.
    pub(super) fn new(a: &'r Mat<f64>, b: &'r Mat<f64>, basis: Option<&Mat<f64>>) -> Self {
        let Some(basis) = basis else { return Self { a, b: Cow::Borrowed(b), has_one_basis: false } };
        let nf = basis.nrows();
        let mut turned = Mat::zeros(b.nrows(), b.ncols());
        for first in (0..b.ncols()).step_by(nf.max(1)) {
            let component = product(b.as_ref().subcols(first, nf), basis.as_ref());
            turned.as_mut().subcols_mut(first, nf).copy_from(&component);
        }
        Self { a, b: Cow::Owned(turned), has_one_basis: true }
    }

    /// Returns the largest difference of one of `rows` (index and factor) over a group of modes, relative to the largest norm.
    pub(super) fn difference(&self, rows: &[(usize, f64)], groups: &[Range<usize>]) -> f64 {
        relative(self.largest_difference(rows, groups), self.size(rows, groups))
    }

    /// Returns the largest norm of one of `rows` over a group of modes.
    pub(super) fn size(&self, rows: &[(usize, f64)], groups: &[Range<usize>]) -> f64 {
        let of_group = |group: &Range<usize>| {
            let [a, b] = [self.a, self.b.as_ref()].map(|of| norms(of.as_ref(), rows, group));
            a.into_iter().chain(b).fold(0.0, larger)
        };
        groups.iter().map(of_group).fold(0.0, larger)
    }

    /// Returns the largest difference of one of `rows` over a group of modes.
    ///
    /// Without a common basis the norms are compared, and the products of each row with the largest row of the group: no orthogonal
    /// change of basis alters them, and the products show a row whose sign relative to the others differs.
    pub(super) fn largest_difference(&self, rows: &[(usize, f64)], groups: &[Range<usize>]) -> f64 {
        let of_group = |group: &Range<usize>| {
            if self.has_one_basis {
                return self.in_one_basis(rows, group);
            }
            let [a, b] = [self.a, self.b.as_ref()].map(|of| norms(of.as_ref(), rows, group));
            let of_norms = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, larger);
            larger(of_norms, self.of_products(rows, group, &a))
        };
        groups.iter().map(of_group).fold(0.0, larger)
    }

    fn in_one_basis(&self, rows: &[(usize, f64)], group: &Range<usize>) -> f64 {
        let norm = |&(i, factor): &(usize, f64)| {
            let squares = group.clone().map(|j| (self.a[(i, j)] - self.b[(i, j)]).powi(2));
            factor * squares.sum::<f64>().sqrt()
        };
        rows.iter().map(norm).fold(0.0, larger)
    }

    /// Returns the largest difference of the products of the rows with the largest row of the first body, over the norm of that row.
    fn of_products(&self, rows: &[(usize, f64)], group: &Range<usize>, norms: &[f64]) -> f64 {
        let Some(at) = flexbody_linalg::ties::first_largest(0..rows.len(), |at| norms[*at]) else {
            return 0.0;
        };
        let (largest, factor) = rows[at];
        let product = |of: MatRef<'_, f64>, row: usize| {
            group.clone().map(|j| of[(row, j)] * of[(largest, j)]).sum::<f64>()
        };
        let difference = |&(row, own): &(usize, f64)| {
            own * factor * (product(self.a.as_ref(), row) - product(self.b.as_ref().as_ref(), row)).abs()
        };
        relative(rows.iter().map(difference).fold(0.0, larger), norms[at])
    }
}

/// Returns the norm of each row over a group of modes, times its factor.
fn norms(of: MatRef<'_, f64>, rows: &[(usize, f64)], group: &Range<usize>) -> Vec<f64> {
    let norm =
        |&(i, factor): &(usize, f64)| factor * group.clone().map(|j| of[(i, j)].powi(2)).sum::<f64>().sqrt();
    rows.iter().map(norm).collect()
}

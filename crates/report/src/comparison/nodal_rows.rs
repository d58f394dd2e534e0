//! Comparison of the nodal data of the modes other than displacements: rotations of nodes, internal rows,
//! moments of nodal rotary inertia.

use super::{BodyComparison, Pair, product, relative, turned};
use crate::mass_properties::gyration_radius;
use faer::{Mat, MatRef};
use flexbody_body::flex_body::{FlexBody, InternalRows};
use flexbody_body::invariants::InertiaStiffness;
use flexbody_linalg::larger;
use std::collections::HashMap;
use std::ops::Range;

impl BodyComparison {
    /// Compares nodal data other than displacements of bodies with the same nodes. `order` gives the node of
    /// `b` for each node of `a`; `basis` transforms the modes of `b` to those of `a`.
    pub(super) fn nodal_rows(
        &mut self,
        pair: &Pair<'_>,
        order: &[usize],
        basis: MatRef<'_, f64>,
        tolerance: f64,
    ) {
        self.rotations(pair, order, basis, tolerance);
        self.internal_rows(pair, basis, tolerance);
        self.moments(pair, order, tolerance);
    }

    fn rotations(&mut self, pair: &Pair<'_>, order: &[usize], basis: MatRef<'_, f64>, tolerance: f64) {
        let (a, b) = (pair.a.modes(), pair.b.modes());
        let has = |body: &FlexBody| body.modes().rotation.is_some();
        let neither = a.rotation.is_none() && b.rotation.is_none();
        if neither || self.leave_out(pair, "rotations of nodes", "/modes/rotation", has) {
            return;
        }
        let zero = || Mat::zeros(a.shape.nrows(), a.shape.ncols());
        let own = a.rotation.clone().unwrap_or_else(zero);
        let other = b.rotation.clone().unwrap_or_else(zero);
        let other = turned(other.as_ref(), &pair.change.axes, order);
        let other = product(other.as_ref(), basis);
        let radius = gyration_radius(pair.a.invariants());
        let of_group = |g: &Range<usize>| {
            let norm = |x: &Mat<f64>| x.as_ref().subcols(g.start, g.len()).norm_l2();
            // Modes without bending have rotations that are rounding; the displacements over the radius bound
            // the scale.
            relative(norm(&(&own - &other)), larger(norm(&own), norm(&a.shape) / radius))
        };
        let largest = pair.groups.iter().map(of_group).fold(0.0, larger);
        let meaning = "|theta_a - theta_b| / max(|theta_a|, |psi_a| / radius of gyration), nodal norm";
        self.row("nodal rotations", meaning, largest, tolerance);
    }

    fn internal_rows(&mut self, pair: &Pair<'_>, basis: MatRef<'_, f64>, tolerance: f64) {
        let has = |body: &FlexBody| body.modes().internal.is_some();
        if self.leave_out(pair, "rows without a node", "/modes/internal, /modes/internal_dof", has) {
            return;
        }
        let (a, b) = (&pair.a.modes().internal, &pair.b.modes().internal);
        let difference = match (a, b) {
            (None, None) => return,
            (Some(a), Some(b)) => internal_difference(a, &b.in_axes(&pair.change.axes), basis, &pair.groups),
            _ => f64::INFINITY,
        };
        let meaning = "rows without a node, by group of modes / largest of them; infinite: other labels";
        self.row("internal rows", meaning, difference, tolerance);
    }

    fn moments(&mut self, pair: &Pair<'_>, order: &[usize], tolerance: f64) {
        let (own, before) = (pair.a.inertia_stiffness(), pair.b.inertia_stiffness());
        let other = pair.b.inertia_stiffness_in(&pair.change.shift, &pair.change.axes);
        let (Some(own), Some(before), Some(other)) = (own, before, other) else { return };
        let largest_second =
            |own: &InertiaStiffness| own.moments.iter().map(|m| m.second.amax()).fold(0.0, larger);
        let (mut in_first, mut in_second) = (0.0, 0.0);
        for (x, &at) in own.moments.iter().zip(order) {
            let y = &other.moments[at];
            in_first = larger(in_first, (x.first - y.first).amax());
            in_second = larger(in_second, (x.second - y.second).amax());
        }
        let of_first = own.moments.iter().map(|m| m.first.amax()).fold(0.0, larger);
        let of_second = largest_second(own);
        let largest = larger(relative(in_first, of_first), relative(in_second, of_second));
        let moved = larger(largest_second(before), of_first * pair.change.shift.norm());
        let lost = 32.0 * f64::EPSILON * relative(moved, of_second);
        let meaning = "largest entry / largest of all nodes";
        self.row("moments of nodes", meaning, largest, tolerance + if lost > 0.0 { lost } else { 0.0 });
    }
}

/// Returns the largest difference of a group of modes, relative to the largest group; infinite if the labels
/// of the rows differ.
fn internal_difference(
    a: &InternalRows,
    b: &InternalRows,
    basis: MatRef<'_, f64>,
    groups: &[Range<usize>],
) -> f64 {
    let rows: HashMap<[i64; 2], usize> = b.dofs.iter().enumerate().map(|(i, label)| (*label, i)).collect();
    let order: Option<Vec<usize>> = a.dofs.iter().map(|label| rows.get(label).copied()).collect();
    let Some(order) = order.filter(|order| order.len() == b.dofs.len()) else { return f64::INFINITY };
    let other = Mat::from_fn(order.len(), b.shape.ncols(), |i, j| b.shape[(order[i], j)]);
    let difference = &a.shape - product(other.as_ref(), basis);
    let largest = |x: &Mat<f64>| {
        groups.iter().map(|g| x.as_ref().subcols(g.start, g.len()).norm_l2()).fold(0.0, larger)
    };
    relative(largest(&difference), largest(&a.shape))
}

//! Cross-checks between parts of a body that no theorem about a single part covers (theory section 10).
//! They detect a changed file with recomputed digests, as far as mechanics can.

use super::{MassStructure, Parts};
use crate::invariants::{CauchySchwarz, IdentityCheck, LumpedScheme};
use flexbody_linalg::{larger, largest};

/// Allowed rounding error between two ways to one sum, relative to its Cauchy-Schwarz bound.
const MAX_SUM_ROUNDING: f64 = 1e-12;

impl Parts {
    /// Checks masses, modes and damping against each other.
    pub(super) fn cross_checks(&self) -> Vec<IdentityCheck> {
        let row_sums =
            if self.source.mass_structure == MassStructure::General { None } else { self.row_sums() };
        let all = row_sums.into_iter().chain(self.damping_ratios());
        all.chain(self.inertia_stiffness_of_moments()).collect()
    }

    /// Checks that row sums preserve the mass, the centre of mass and the linear momentum of every mode.
    fn row_sums(&self) -> Option<IdentityCheck> {
        let lumped =
            &self.lumped.iter().find(|lumped| lumped.scheme == LumpedScheme::RowSum.name())?.invariants;
        let exact = &self.invariants;
        let bound = CauchySchwarz::of(exact);
        let relative =
            |difference: f64, bound: f64| if difference == 0.0 { 0.0 } else { difference.abs() / bound };
        let first = (0..3)
            .map(|k| relative(exact.first_moment()[k] - lumped.first_moment()[k], bound.first_moment(k)));
        // Rows without a position belong to no node.
        let modes = if self.modes.internal.is_none() { exact.n_modes() } else { 0 };
        let c1 = (0..modes).flat_map(|p| {
            let bound = &bound;
            (0..3).map(move |k| relative(exact.c1()[(k, p)] - lumped.c1()[(k, p)], bound.c1(p)))
        });
        let value = first.chain(c1).fold(relative(exact.mass() - lumped.mass(), exact.mass()), larger);
        Some(IdentityCheck::new(
            "row_sums",
            "m, c and C1 of the row sums of M are those of M",
            value,
            MAX_SUM_ROUNDING,
        ))
    }

    /// Checks that the stiffness of inertia follows from the moments of the nodes and their rotations.
    fn inertia_stiffness_of_moments(&self) -> Option<IdentityCheck> {
        let (inertia, rotation) = (self.inertia_stiffness.as_ref()?, self.modes.rotation.as_ref()?);
        let formula = "K = sum over the nodes of theta' (sym G - tr G I) theta";
        // Both rotations in a product are rounded.
        let limit = MAX_SUM_ROUNDING + 4.0 * self.storage.rounding();
        let value = inertia.deviation(rotation.as_ref(), self.dimension);
        Some(IdentityCheck::new("inertia_stiffness", formula, value, limit))
    }

    /// Checks that the damping ratios follow from the diagonal of the modal damping.
    fn damping_ratios(&self) -> Option<IdentityCheck> {
        let damping = self.modes.modal_damping.as_ref()?;
        let size = damping.norm_max();
        // A ratio is never negative: negative diagonal entries are rounding.
        let difference = |(j, lambda): (usize, &f64)| {
            let by_ratio = 2.0 * self.modes.damping_ratio[j] * lambda.sqrt();
            let difference = (by_ratio - damping[(j, j)].max(0.0)).abs();
            if difference == 0.0 { 0.0 } else { difference / size }
        };
        let value = largest(self.modes.eigenvalue.iter().enumerate().map(difference));
        Some(IdentityCheck::new("damping_ratios", "zeta_j = D_jj / (2 omega_j)", value, MAX_SUM_ROUNDING))
    }
}

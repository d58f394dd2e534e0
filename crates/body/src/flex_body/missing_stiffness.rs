//! Stress stiffness of spin that a body does not have, as an estimate: it judges results, and never enters a motion.

use super::{FlexBody, GeometricStiffness, LoadKind, SOFTENING, UnitLoad};
use crate::invariants::relative_norm;
use faer::{Mat, Scale};
use flexbody_base::error::Result;
use nalgebra::Vector3;

/// Bound of the relative change of stiffness by the stress of a spin w, over (w / Omega_1)^2, for a body without an estimate.
/// The true coefficient is 0.3 to 3.4 on nine solids and 200 random blocks, plates and frames, and 2.5 or less about 95 % of
/// their axes.
const STRESS_COEFFICIENT: f64 = 2.5;

impl FlexBody {
    /// Returns the stored estimate of the geometric stiffness of spin that the body does not have; empty if there is none.
    pub fn estimated_stiffness(&self) -> &[GeometricStiffness<Mat<f64>>] {
        &self.parts().estimated_stiffness
    }

    /// Returns true if the body has geometric stiffness of spin.
    pub fn has_spin_stiffness(&self) -> bool {
        self.geometric_stiffness().iter().any(|stiffness| stiffness.load.kind == LoadKind::Spin)
    }

    /// Returns the stress stiffness of spin that a motion of the body leaves out: the stored estimate of what the body does
    /// not have, or 2.5 w^2 times the mass of the modes if the body has neither an estimate nor geometric stiffness of spin.
    ///
    /// * `uses_given`: true if the motion uses the geometric stiffness of the body; otherwise that of spin is left out too.
    pub fn missing_stiffness(&self, uses_given: bool) -> Vec<GeometricStiffness<Mat<f64>>> {
        let is_left_out =
            |stiffness: &&GeometricStiffness<Mat<f64>>| !uses_given && stiffness.load.kind == LoadKind::Spin;
        let given = self.geometric_stiffness().iter().filter(is_left_out);
        let known: Vec<_> = self.estimated_stiffness().iter().chain(given).cloned().collect();
        if !known.is_empty() || self.has_spin_stiffness() {
            return known;
        }
        let of_axis = |component: &usize| {
            let (k, l) = LoadKind::SPIN[*component];
            (k == l).then(|| GeometricStiffness {
                load: UnitLoad { kind: LoadKind::Spin, component: *component },
                matrix: &self.invariants().modal_mass() * Scale(STRESS_COEFFICIENT),
            })
        };
        LoadKind::Spin.of_dimension(self.dimension()).iter().filter_map(of_axis).collect()
    }

    /// Returns this body with the [missing stiffness](FlexBody::missing_stiffness) as its geometric stiffness, beside its own
    /// if the motion uses that, for a comparison of motions.
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`].
    pub fn with_missing_stiffness(&self, uses_given: bool) -> Result<Self> {
        let missing = self.missing_stiffness(uses_given);
        let mut parts = self.parts().clone();
        parts.estimated_stiffness = Vec::new();
        parts.rotated_stiffness = Vec::new();
        if !uses_given {
            parts.geometric_stiffness = Vec::new();
        }
        for stiffness in missing {
            match parts.geometric_stiffness.iter_mut().find(|known| known.load == stiffness.load) {
                Some(known) => known.matrix += &stiffness.matrix,
                None => parts.geometric_stiffness.push(stiffness),
            }
        }
        Self::new(parts)
    }

    /// Returns the largest part of the stiffness of any motion that the [missing stiffness](FlexBody::missing_stiffness) adds
    /// or takes at the angular velocity `omega` (body axes). Returns `None` if nothing is missing, or if K_ff is not
    /// positive definite.
    pub fn missing_part(&self, omega: &Vector3<f64>, uses_given: bool) -> Option<f64> {
        let nf = self.n_modes();
        let missing = self.missing_stiffness(uses_given);
        if missing.is_empty() {
            return None;
        }
        let sum = missing.iter().fold(Mat::zeros(nf, nf), |sum: Mat<f64>, one| {
            let (k, l) = LoadKind::SPIN[one.load.component];
            sum + &one.matrix * Scale(omega[k] * omega[l])
        });
        relative_norm(sum.as_ref(), self.invariants().modal_stiffness().as_ref())
    }

    /// Returns the spin rate about axis `axis` of the model at which the missing stiffness changes 1 % of the stiffness of
    /// some motion. Returns `None` if no motion changes. Unit: 1/time.
    ///
    /// # Panics
    /// When `axis` is not below 3.
    pub fn missing_rate(&self, axis: usize) -> Option<f64> {
        let omega_body = self.frame().axes.transpose() * Vector3::ith(axis, 1.0);
        let part = self.missing_part(&omega_body, true)?;
        (part > 0.0).then(|| (SOFTENING / part).sqrt())
    }

    /// Returns the largest part of the stiffness of any motion that the missing stiffness changes at a spin of 1 about any of
    /// thirteen axes: those of the body, and the diagonals between them. Returns `None` if nothing is missing.
    pub fn largest_missing_part(&self) -> Option<f64> {
        let components = [-1.0, 0.0, 1.0];
        let triples = components.iter().flat_map(|x| components.iter().map(move |y| (*x, *y)));
        let all = triples.flat_map(|(x, y)| components.iter().map(move |z| Vector3::new(x, y, *z)));
        // One of each two opposite directions; a plane body turns about its normal.
        let is_first = |axis: &Vector3<f64>| axis.iter().find(|c| **c != 0.0).is_some_and(|c| *c > 0.0);
        let turns = |axis: &Vector3<f64>| self.dimension() == 3 || (axis.x == 0.0 && axis.y == 0.0);
        let parts = all.filter(is_first).filter(turns);
        parts.filter_map(|axis| self.missing_part(&axis.normalize(), true)).reduce(f64::max)
    }
}

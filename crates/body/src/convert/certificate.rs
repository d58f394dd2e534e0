//! Certificate of a body: proofs about its modes, and bounds of rounding.

use super::ModalModel;
use crate::flex_body::{Certificate, Guarantee};
use flexbody_eigen::{Proof, energy_noise};
use flexbody_model::rigid_count;

/// Number of standard deviations of its rounding error that an entry of Psi' K Psi may deviate: large
/// enough for all of many entries.
const ROUNDING_DEVIATIONS: f64 = 10.0;

impl ModalModel<'_> {
    /// Returns the certificate of the body.
    pub(super) fn certificate(&self, guarantee: Option<Guarantee>) -> Certificate {
        let Self { model, found, .. } = self;
        let completeness = &found.solution.completeness;
        let proved = completeness.proof == Proof::InertiaCount;
        Certificate {
            proved_modes: proved.then_some(completeness.modes_below),
            shift: completeness.shift,
            negative_pivots: completeness.negative_pivots,
            rigid_modes: rigid_count(model.dimension()),
            remark: completeness.remark.clone(),
            rigid_noise: found.rigid_noise,
            rigid_residual: model.rigid_residual(),
            eigenvalue_rounding: self.eigenvalue_rounding(),
            inertia_rounding: 0.0,
            guarantee,
            fixed_interface: found.fixed_interface.clone(),
        }
    }

    /// Returns a bound of the rounding errors of products with K in Psi' K Psi, relative to sqrt(lambda_p
    /// lambda_q).
    ///
    /// Rounding errors in the entries of K change psi_p' K psi_q by sum_ij dK_ij psi_ip psi_jq. The
    /// Cauchy-Schwarz inequality bounds the standard deviation by the geometric mean of those of psi_p' K
    /// psi_p and psi_q' K psi_q, since the matrix of the squares K_ij^2 is positive semidefinite like K.
    /// The largest of these relative to its eigenvalue bounds every entry.
    fn eigenvalue_rounding(&self) -> f64 {
        let noise = energy_noise(self.model.stiffness(), self.modes.vectors.as_ref(), f64::EPSILON);
        let relative =
            noise.iter().zip(&self.found.solution.eigenvalues).map(|(noise, lambda)| noise / lambda);
        ROUNDING_DEVIATIONS * relative.fold(0.0, f64::max)
    }
}

//! What is proved of the modes of a body, and what rounding leaves.

use super::ModalModel;
use crate::flex_body::{Certificate, Guarantee};
use flexbody_eigen::{Proof, energy_noise};
use flexbody_model::rigid_count;

/// How many standard deviations of its rounding an entry of Psi' K Psi may be off: none of many is.
const ROUNDINGS: f64 = 10.0;

impl ModalModel<'_> {
    /// The certificate of the body.
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

    /// What rounding of the products with K may leave in Psi' K Psi, relative to sqrt(lambda_p lambda_q).
    ///
    /// Errors of the size of a roundoff in the entries of K change psi_p' K psi_q by sum_ij dK_ij psi_ip psi_jq,
    /// whose standard deviation the Cauchy-Schwarz inequality bounds by the root of those of psi_p' K psi_p and
    /// psi_q' K psi_q: the matrix of the squares K_ij^2 is positive semidefinite like K. The largest of these
    /// relative to its eigenvalue bounds every entry.
    fn eigenvalue_rounding(&self) -> f64 {
        let noise = energy_noise(self.model.stiffness(), self.modes.vectors.as_ref(), f64::EPSILON);
        let relative =
            noise.iter().zip(&self.found.solution.eigenvalues).map(|(noise, lambda)| noise / lambda);
        ROUNDINGS * relative.fold(0.0, f64::max)
    }
}

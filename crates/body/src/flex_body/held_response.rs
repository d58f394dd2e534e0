//! Static response of a body to the motion of its carrier, as far as its modes contain it.
//!
//! The carrier accelerates the material by g(x) = a + B x along the axes of the body, with gravity, angular acceleration and
//! the centrifugal part in a and B. Of the force -M g, the held modes of (K_ff, m_ff) contain the generalised forces
//! h_j = psi_j'M g with the elastic energy sum h_j^2 / (2 lambda_j). What they do not contain, g'M g - sum h_j^2, has at most
//! that part over 2 lambda as energy, where all modes below lambda are in the basis. A Craig-Bampton basis contains the
//! responses to loads at its interfaces, and of the inertia only that in its fixed-interface modes.

use super::{Carrier, FlexBody};
use crate::invariants::Invariants;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::about_percent;
use nalgebra::{Matrix3, Vector3};

/// Largest share of the elastic energy that may be missing without a warning. It is a bound: the missing part of a
/// wave along a beam is six times less than its bound if one mode of the wave is in the basis.
const MAX_MISSING: f64 = 0.25;

/// Acceleration of the material of a rigid body, g(x) = a + B x, less gravity; axes and origin of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidAccelerations {
    /// a.
    pub constant: Vector3<f64>,
    /// B = alpha x + omega x (omega x ...). Unit: 1/time^2.
    pub gradient: Matrix3<f64>,
}

impl RigidAccelerations {
    /// Returns the accelerations for those of the origin less gravity, angular velocity and angular acceleration.
    pub fn new(origin: Vector3<f64>, omega: &Vector3<f64>, alpha: &Vector3<f64>) -> Self {
        let spin = omega.cross_matrix();
        Self { constant: origin, gradient: alpha.cross_matrix() + spin * spin }
    }

    /// Returns g'M g.
    fn square(&self, body: &Invariants) -> f64 {
        let Self { constant: a, gradient: b } = self;
        body.mass() * a.norm_squared()
            + 2.0 * a.dot(&(b * body.first_moment()))
            + (b * body.second_moment() * b.transpose()).trace()
    }

    /// Returns psi_j'M g of every mode; `None` for a body without W1.
    pub fn modal(&self, body: &Invariants) -> Option<Vec<f64>> {
        let (c1, ibar) = (body.c1(), body.ibar()?);
        let one = |j: usize| {
            let mut sum = (0..3).map(|l| c1[(l, j)] * self.constant[l]).sum::<f64>();
            for (k, row) in ibar.iter().enumerate() {
                for (l, values) in row.iter().enumerate() {
                    sum += self.gradient[(l, k)] * values[j];
                }
            }
            sum
        };
        Some((0..c1.ncols()).map(one).collect())
    }
}

impl FlexBody {
    /// Returns a warning if the modes of this carried body lack much of the static response to a motion of its carrier, by
    /// the largest energies over the motion. For a Craig-Bampton basis with the carrier; other bases have
    /// [`unresolved`](FlexBody::unresolved).
    ///
    /// * `original`: the body before it was carried.
    pub fn lacks_response(
        &self,
        carrier: &Carrier,
        original: &Self,
        motion: impl IntoIterator<Item = RigidAccelerations>,
    ) -> Option<Diagnostic> {
        let Carrier::Interface(name) = carrier else { return None };
        if self.is_complete() || !original.is_whole_craig_bampton(name) {
            return None;
        }
        let (values, vectors) = self.eigenpairs_in_frame()?;
        let highest = values.iter().copied().fold(0.0, f64::max);
        let fixed = original.certificate().fixed_interface.as_ref();
        let known = fixed.and_then(|fixed| fixed.next.or(fixed.eigenvalues.last().copied()));
        let complete_below = known.map_or(highest, |known| known.min(highest));
        let (mut missing, mut whole) = (0.0f64, 0.0f64);
        for field in motion {
            let modal = field.modal(self.invariants())?;
            let held = |p: usize| (0..modal.len()).map(|j| vectors[(j, p)] * modal[j]).sum::<f64>().powi(2);
            let held: Vec<f64> = (0..modal.len()).map(held).collect();
            let inside: f64 = held.iter().zip(&values).map(|(square, value)| square / value).sum();
            let outside =
                (field.square(self.invariants()) - held.iter().sum::<f64>()).max(0.0) / complete_below;
            missing = missing.max(outside);
            whole = whole.max(inside + outside);
        }
        (missing > MAX_MISSING * whole).then(|| {
            let message = format!(
                "the {} modes hold little of the static response to the acceleration of {carrier}: up to about {} of its elastic energy is missing",
                self.n_modes(),
                about_percent(missing / whole)
            );
            Diagnostic::new(Code::CarrierUnresolved, message).with_help(
                "ask for more modes: a Craig-Bampton basis holds the response to loads at its interfaces, and that to gravity, acceleration and spin only by its fixed-interface modes",
            )
        })
    }
}

//! Ranges of the motion of a body.

use crate::attached_mass::AttachedMass;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;

/// Ranges of the motion of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranges {
    /// Largest rotation rate. Unit: Hz.
    pub spin_hz: f64,
    /// Largest deflection of a node, in the unit of length of the body; `None` for that which the rotation causes.
    pub deflection: Option<f64>,
    /// Duration of the motions, in the unit of time of the body; `None` for five revolutions, but at most 1e5 periods of the
    /// first mode, and 30 if a deflection is stated.
    pub duration: Option<f64>,
    /// Mass attached to the body at an interface.
    pub attached: Option<AttachedMass>,
    /// True if joints prescribe the rotation, as those of a driven crank do.
    pub is_rotation_given: bool,
    /// Largest error of attitude (rad), deflection and stress in a motion; largest size of a term, relative to the term that
    /// it is compared with, that a guideline may leave out.
    pub limit: f64,
}

impl Ranges {
    /// Refuses ranges that are negative or not finite.
    pub(super) fn refuse(&self) -> Result<()> {
        let attached = self.attached.as_ref().map_or(0.0, |attached| attached.mass);
        let values = [
            ("rotation rate", self.spin_hz, 0.0),
            ("deflection", self.deflection.unwrap_or(1.0), f64::MIN_POSITIVE),
            ("duration", self.duration.unwrap_or(1.0), f64::MIN_POSITIVE),
            ("attached mass", attached, 0.0),
            ("limit", self.limit, f64::MIN_POSITIVE),
        ];
        match values.into_iter().find(|(_, value, least)| !value.is_finite() || value < least) {
            Some((name, value, _)) => {
                let message = format!("the {name} is {value}, expected a finite number that is not negative");
                Err(Diagnostic::new(Code::Usage, message).into())
            }
            None => Ok(()),
        }
    }
}

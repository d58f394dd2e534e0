//! Centre of mass and principal axes of a drawn body.

use crate::mass_properties::{centre_of_mass, inertia_about_com};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::principal_axes;

/// Centre of mass and principal axes, in model axes.
pub(super) struct Placed {
    pub centre_of_mass: [f64; 3],
    /// Principal axes, by ascending moments.
    pub principal: [[f64; 3]; 3],
}

impl Placed {
    pub(super) fn of(body: &FlexBody) -> Self {
        let (frame, invariants) = (body.frame(), body.invariants());
        let axes = frame.axes * principal_axes(&inertia_about_com(invariants));
        Self {
            centre_of_mass: frame.to_model(centre_of_mass(invariants).into()),
            principal: [0, 1, 2].map(|k| axes.column(k).into_owned().into()),
        }
    }

    /// Returns the end of an axis of the given length from the centre of mass.
    pub(super) fn axis_end(&self, axis: &[f64; 3], length: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.centre_of_mass[k] + length * axis[k])
    }
}

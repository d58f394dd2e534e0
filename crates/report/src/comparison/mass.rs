//! Comparison of mass, centre of mass and inertia.

use super::body_comparison::BodyComparison;
use super::pair::FrameChange;
use super::relative_difference::{lost_by_shift, relative};
use super::tolerances::Tolerances;
use crate::mass_properties::{centre_of_mass, gyration_radius, inertia_about_com};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::larger;

impl BodyComparison {
    /// Compares mass, centre of mass and inertia about it.
    pub(super) fn rigid(&mut self, a: &FlexBody, b: &FlexBody, tolerances: &Tolerances) {
        let (ia, ib) = (a.invariants(), b.invariants());
        self.row(
            "mass",
            "mass of the first body",
            relative(ib.mass() - ia.mass(), ia.mass()),
            tolerances.mass,
        );
        let radius = gyration_radius(ia);
        let com =
            |body: &FlexBody| body.frame().origin + body.frame().axes * centre_of_mass(body.invariants());
        let spacing = relative(com(a).amax().max(com(b).amax()), radius) * f64::EPSILON;
        self.row(
            "centre of mass",
            "distance / radius of gyration",
            relative((com(b) - com(a)).norm(), radius),
            tolerances.centre_of_mass + 8.0 * spacing,
        );
        let axes = FrameChange::new(a, b).axes;
        let (ja, jb) = (inertia_about_com(ia), axes.transpose() * inertia_about_com(ib) * axes);
        let mut largest = 0.0;
        for k in 0..3 {
            for l in 0..3 {
                let scale = (ja[(k, k)] * ja[(l, l)]).sqrt();
                largest = larger(largest, relative(jb[(k, l)] - ja[(k, l)], scale));
            }
        }
        let offset = centre_of_mass(ia).norm().max(centre_of_mass(ib).norm());
        let lost = lost_by_shift(ia.mass(), offset, ja.diagonal().min());
        self.row("inertia", "largest entry / sqrt(I_kk I_ll)", largest, tolerances.inertia + lost);
    }
}

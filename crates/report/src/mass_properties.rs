//! Mass, centre of mass and principal inertia of a body in any frame.

use crate::notation::numbers::significant;
use flexbody_body::flex_body::{FlexBody, ReferenceConditions};
use flexbody_body::invariants::Invariants;
use libm::atan2;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Largest product of inertia, relative to sqrt(I_kk I_ll), that counts as rounding of a principal frame.
/// Below it the diagonal is taken as the moments: an eigenvalue iteration would lose the digits of the small
/// moment of a slender body.
const DIAGONAL: f64 = 1e-12;

/// Tolerances for a frame to count as centred and as principal: the limits of the identities of the body.
const CENTRED: f64 = 1e-9;
const PRINCIPAL: f64 = 2e-9;

#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(super) struct MassProperties {
    /// Mass of the body. Unit: mass.
    pub mass: f64,
    /// Centre of mass in model coordinates. Unit: length.
    pub centre_of_mass: [f64; 3],
    /// Principal moments of inertia about the centre of mass, ascending. Unit: mass length^2.
    pub principal_inertia: [f64; 3],
    /// Inertia tensor about the centre of mass along model axes; products of inertia are entries of the tensor, I_xy =
    /// -int x y dm. Unit: mass length^2.
    pub inertia_model: [[f64; 3]; 3],
    /// Radius of gyration sqrt(I / m) of each principal moment; NaN (JSON null) for a negative moment. Unit:
    /// length.
    pub radii_of_gyration: [f64; 3],
    /// Origin of the body frame in model coordinates. Unit: length.
    pub frame_origin: [f64; 3],
    /// Rows of the matrix whose columns are the body axes in model axes.
    pub frame_axes: [[f64; 3]; 3],
    /// Description of the position of the frame.
    pub frame: String,
    /// True if the frame follows the mean motion of the body.
    #[serde(skip)]
    pub in_mean_axes: bool,
}

impl MassProperties {
    /// Returns the largest radius of gyration. Coordinates that are rounding relative to it are shown as
    /// zero.
    pub(crate) fn size(&self) -> f64 {
        self.radii_of_gyration.iter().copied().fold(0.0, f64::max)
    }

    pub(crate) fn of(body: &FlexBody) -> Self {
        let (invariants, frame) = (body.invariants(), body.frame());
        let inertia = inertia_about_com(invariants);
        let moments = principal_moments(&inertia);
        let com = centre_of_mass(invariants);
        Self {
            mass: invariants.mass(),
            centre_of_mass: frame.to_model(com.into()),
            principal_inertia: moments,
            inertia_model: rows(&(frame.axes * inertia * frame.axes.transpose())),
            radii_of_gyration: moments.map(|i| (i / invariants.mass()).sqrt()),
            frame_origin: frame.origin.into(),
            frame_axes: rows(&frame.axes),
            frame: describe(body, &inertia),
            in_mean_axes: body.conditions().is_mean(),
        }
    }
}

/// Returns the rows of a matrix.
fn rows(a: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|k| std::array::from_fn(|l| a[(k, l)]))
}

fn describe(body: &FlexBody, inertia: &Matrix3<f64>) -> String {
    let (invariants, frame) = (body.invariants(), body.frame());
    let centred = centre_of_mass(invariants).norm() <= CENTRED * gyration_radius(invariants);
    let at_model = frame.origin == Vector3::zeros();
    let conditions = match body.conditions() {
        ReferenceConditions::MeanAxes => String::new(),
        other => format!("{other}: "),
    };
    let origin = match (centred, at_model) {
        (true, _) => "origin at the centre of mass",
        (false, true) => "origin of the model",
        (false, false) => "origin off the centre of mass",
    };
    let axes = match (frame.axes == Matrix3::identity(), largest_product(inertia) <= PRINCIPAL) {
        (true, true) => "axes of the model, which are principal",
        (true, false) => "axes of the model",
        (false, true) => "principal axes",
        (false, false) => "axes neither principal nor of the model",
    };
    let turned = turned_degrees(&frame.axes);
    if body.source().n_dofs == 0 || turned < 1e-9 {
        return format!("{conditions}{origin}, {axes}");
    }
    format!(
        "{conditions}{origin}, {axes}, turned by {} degrees from those of the model",
        significant(turned, 4)
    )
}

/// Returns the angle between the body axes and the model axes in degrees.
fn turned_degrees(axes: &Matrix3<f64>) -> f64 {
    let skew =
        Vector3::new(axes[(2, 1)] - axes[(1, 2)], axes[(0, 2)] - axes[(2, 0)], axes[(1, 0)] - axes[(0, 1)]);
    atan2(skew.norm(), axes.trace() - 1.0).to_degrees()
}

/// Returns the centre of mass c / m in the body frame. Unit: length.
pub(super) fn centre_of_mass(body: &Invariants) -> Vector3<f64> {
    body.first_moment() / body.mass()
}

/// Returns I0 about the centre of mass in body axes. Unit: mass length^2.
pub(super) fn inertia_about_com(body: &Invariants) -> Matrix3<f64> {
    let com = centre_of_mass(body);
    let j = body.second_moment() - com * com.transpose() * body.mass();
    // Sums two diagonal entries; the trace minus the third would cancel for slender bodies.
    Matrix3::from_fn(|k, l| {
        if k == l { j[((k + 1) % 3, (k + 1) % 3)] + j[((k + 2) % 3, (k + 2) % 3)] } else { -j[(k, l)] }
    })
}

/// Returns the radius of gyration sqrt(tr J_com / m). Unit: length.
pub(super) fn gyration_radius(body: &Invariants) -> f64 {
    (0.5 * inertia_about_com(body).trace() / body.mass()).max(0.0).sqrt()
}

/// Returns the largest |I_kl| / sqrt(I_kk I_ll), k != l; NaN if a moment is not positive.
fn largest_product(inertia: &Matrix3<f64>) -> f64 {
    let scaled = |(k, l): (usize, usize)| {
        let product = inertia[(k, l)].abs();
        if product == 0.0 { 0.0 } else { product / (inertia[(k, k)] * inertia[(l, l)]).sqrt() }
    };
    let products = [(0, 1), (0, 2), (1, 2)].map(scaled);
    if products.iter().any(|p| p.is_nan()) { f64::NAN } else { products.into_iter().fold(0.0, f64::max) }
}

/// Returns the principal moments of inertia, ascending. Unit: mass length^2.
pub(super) fn principal_moments(inertia: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = inertia.diagonal().into();
    // The eigenvalue iteration is skipped for entries that are not finite.
    let diagonal = largest_product(inertia) <= DIAGONAL;
    if !diagonal && inertia.iter().all(|v| v.is_finite()) {
        let scale = inertia.amax();
        moments = SymmetricEigen::try_new(inertia / scale, f64::EPSILON, 1000)
            .map_or([f64::NAN; 3], |e| (e.eigenvalues * scale).into());
    }
    moments.sort_by(f64::total_cmp);
    moments
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn moments_of_a_turned_body_are_its_principal_ones() {
        let turn = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let inertia =
            turn.matrix() * Matrix3::from_diagonal(&Vector3::new(3.0, 1.0, 2.0)) * turn.matrix().transpose();
        for (moment, expected) in principal_moments(&inertia).into_iter().zip([1.0, 2.0, 3.0]) {
            assert!((moment - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn needle_keeps_its_small_moment_and_numbers_that_overflow_end() {
        let mut needle = Matrix3::from_diagonal(&Vector3::new(1.0, 1e-14, 1.0));
        needle[(0, 1)] = 1e-21;
        needle[(1, 0)] = 1e-21;
        assert_eq!(principal_moments(&needle), [1e-14, 1.0, 1.0]);
        assert!(principal_moments(&Matrix3::from_element(f64::INFINITY)).iter().all(|m| !m.is_finite()));
        assert_eq!(principal_moments(&Matrix3::zeros()), [0.0; 3]);
    }
}

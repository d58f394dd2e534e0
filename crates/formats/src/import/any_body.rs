//! Requirements on every body, for any modes.

use flexbody_body::invariants::{BodyFrame, Expected, Numbered, Turning};
use nalgebra::Matrix3;

/// Expectations for identities that hold for any modes.
pub(crate) const ANY_BODY: Expected<'static> = Expected {
    mass_normalised: false,
    free_surface: false,
    frame: BodyFrame::Model,
    origin: nalgebra::Vector3::new(0.0, 0.0, 0.0),
    eigenvalues: None,
    eigenvalue_noise: 0.0,
    eigenvalue_rounding: 0.0,
    turning: Turning::None,
};

/// Rounding in files with 10 digits and more, relative to Cauchy-Schwarz bounds. Redundant numbers may differ
/// by this much.
pub(crate) const DIGITS: f64 = 1e-9;

/// Meaning of a principal moment of zero.
pub(crate) const NO_INERTIA: &str = "rotation about an axis through the centre of mass has no inertia: all masses lie on a line, or the inertia of the nodes is missing";

/// Returns the number of principal moments about the centre of mass that are zero up to rounding; NaN if they
/// cannot be computed.
pub(crate) fn axes_without_inertia(inertia: &Numbered) -> f64 {
    const ZERO_MOMENT: f64 = 1e-12;
    let centre = inertia.i2 / inertia.i1;
    let steiner = (Matrix3::identity() * centre.norm_squared() - centre * centre.transpose()) * inertia.i1;
    let about_centre = inertia.i7 - steiner;
    if about_centre.iter().any(|entry| !entry.is_finite()) {
        return f64::NAN;
    }
    // The scale of rounding is that of the moments about the origin.
    let size = inertia.i7.amax();
    let moments = (0.5 * (about_centre + about_centre.transpose())).symmetric_eigenvalues();
    moments.iter().filter(|moment| moment.abs() <= ZERO_MOMENT * size).count() as f64
}

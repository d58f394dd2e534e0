//! Relative differences, and the rounding error of a shift.

use flexbody_linalg::larger;

/// Returns |difference| / scale; 0 if the difference is zero, even if the scale is zero.
pub(super) fn relative(difference: f64, scale: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / scale }
}

/// Returns the largest difference of pairs of numbers, relative to the largest number; each pair has a factor.
pub(super) fn relative_difference(pairs: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for (factor, a, b) in pairs {
        difference = larger(difference, factor * (a - b).abs());
        size = larger(size, factor * larger(a.abs(), b.abs()));
    }
    relative(difference, size)
}

/// Returns the rounding error of a shift of J by `distance`, relative to the smallest diagonal entry of J.
/// About a distant origin J is dominated by m d^2, and the moments of the body itself are in its last digits.
pub(super) fn lost_by_shift(mass: f64, distance: f64, smallest: f64) -> f64 {
    8.0 * f64::EPSILON * relative(mass * distance * distance, smallest)
}

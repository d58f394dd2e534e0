//! Differences that the digits of a matrix explain.

/// Returns the relative difference that rounding of values with `digits` significant digits explains.
pub(crate) fn rounding(digits: u8, margin: i32) -> f64 {
    10f64.powi(margin - i32::from(digits)).clamp(1e-12, 1e-4)
}

/// Returns the relative deviation of a mass block from a multiple of the identity that rounding explains.
pub(crate) fn block_tolerance(digits: u8) -> f64 {
    rounding(digits, 3).max(1e-10)
}

//! How far values may differ that were written with few digits.

/// Relative size below which a difference is rounding of values with `digits` significant digits.
pub(super) fn rounding(digits: u8, margin: i32) -> f64 {
    10f64.powi(margin - i32::from(digits)).clamp(1e-12, 1e-4)
}

/// Relative deviation of a block of the mass from a multiple of the identity that rounding explains.
pub(super) fn block_tolerance(digits: u8) -> f64 {
    rounding(digits, 3).max(1e-10)
}

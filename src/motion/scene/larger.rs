//! Maxima that keep what is no number: an error that cannot be computed must not pass as none.

/// The larger of two; not a number where one of them is not.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Zero for what only rounding makes negative; what is no number stays so.
pub(crate) fn not_negative(value: f64) -> f64 {
    larger(value, 0.0)
}

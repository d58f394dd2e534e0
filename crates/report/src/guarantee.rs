//! Guarantees of the accuracy `certified` in quotable numbers.

use super::numbers::{counted, frequency, significant};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::DIGITS;
use serde::{Serialize, Serializer};

/// Guarantees of a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct GuaranteeFacts {
    /// Lower bound of each eigenvalue. Unit: 1/time^2.
    pub eigenvalue_lower: Vec<f64>,
    /// Upper bound of each eigenvalue. Unit: 1/time^2.
    pub eigenvalue_upper: Vec<f64>,
    /// Guaranteed digits of each eigenvalue: -log10 of the larger distance to a bound, relative to the
    /// eigenvalue.
    pub eigenvalue_digits: Vec<f64>,
    pub shape_error: Vec<f64>,
    #[serde(serialize_with = "as_map")]
    pub invariant_digits: Vec<(&'static str, f64)>,
    /// Shift between the rigid modes and the first flexible one. Unit: 1/time^2.
    pub shift_below: f64,
    pub shift_below_hz: f64,
    pub negative_pivots_below: usize,
}

fn as_map<S: Serializer>(pairs: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().copied())
}

impl GuaranteeFacts {
    pub(crate) fn of(body: &FlexBody) -> Option<Self> {
        let guarantee = body.certificate().guarantee.as_ref()?;
        let bounds = guarantee.eigenvalue_lower.iter().zip(&guarantee.eigenvalue_upper);
        let digits = |(value, (lower, upper)): (&f64, (&f64, &f64))| {
            let error = (value - lower).max(upper - value) / value;
            (-error.log10()).clamp(0.0, 16.0)
        };
        Some(Self {
            eigenvalue_digits: body.modes().eigenvalue.iter().zip(bounds).map(digits).collect(),
            eigenvalue_lower: guarantee.eigenvalue_lower.clone(),
            eigenvalue_upper: guarantee.eigenvalue_upper.clone(),
            shape_error: guarantee.shape_error.clone(),
            invariant_digits: DIGITS.into_iter().zip(guarantee.digits).collect(),
            shift_below: guarantee.shift_below,
            shift_below_hz: body.units().frequency_of(guarantee.shift_below.max(0.0)),
            negative_pivots_below: guarantee.pivots_below,
        })
    }

    /// Returns the guarantees of the eigenvalues and the inertia count below them in words.
    pub(crate) fn eigenvalues(&self) -> String {
        let (digits, mode) = least(self.eigenvalue_digits.iter().copied().zip(1..));
        let rigid = counted(self.negative_pivots_below, "rigid mode");
        format!(
            "every eigenvalue to {digits} digits or more (mode {mode} worst); only {rigid} below {} (inertia count {})",
            frequency(self.shift_below_hz, 5),
            self.negative_pivots_below
        )
    }

    /// Returns the guarantees of the invariants, and the distance of the modes from the exact modes, in
    /// words.
    pub(crate) fn invariants(&self) -> String {
        let (digits, name) = least(self.invariant_digits.iter().map(|&(name, digits)| (digits, name)));
        let shape = self.shape_error.iter().copied().fold(0.0, f64::max);
        format!(
            "invariants of the stored modes to {digits} digits or more ({name} worst); modes within {} of the exact modes",
            significant(shape, 2)
        )
    }
}

/// Returns a number of digits rounded down to one decimal, never more than is guaranteed.
pub(super) fn cut(digits: f64) -> String {
    significant((10.0 * digits).floor() / 10.0, 3)
}

/// Returns the smallest number of digits and its name.
fn least<T>(digits: impl Iterator<Item = (f64, T)>) -> (String, T) {
    let (digits, whose) =
        digits.min_by(|a, b| a.0.total_cmp(&b.0)).expect("bodies have modes and invariants");
    (cut(digits), whose)
}

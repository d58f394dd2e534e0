//! By how much an identity between arrays is missed, beside what the digits of the file allow.

use crate::import::AuditCheck;
use flexbody_base::diagnostic::Code;
use flexbody_linalg::larger;

/// What identities may be missed by, relative to the Cauchy-Schwarz bounds of their arrays, beside the digits
/// of the file: sums over the nodes of a large model in double precision.
const ROUNDING: f64 = 1e-10;

/// Roundings of the last digit that one identity may add up.
const TERMS: f64 = 10.0;

/// One identity: by how much it is missed, the size of its terms, and half units of their last digits.
pub(super) struct Missed {
    pub by: f64,
    pub scale: f64,
    pub rounding: f64,
}

impl Missed {
    pub(super) fn check(
        self,
        name: &'static str,
        formula: &'static str,
        code: Code,
        meaning: impl Into<String>,
    ) -> AuditCheck {
        let relative = |v: f64| if v == 0.0 { 0.0 } else { v / self.scale };
        let limit = ROUNDING + TERMS * relative(self.rounding);
        AuditCheck { name, formula, value: relative(self.by), limit, code, meaning: meaning.into() }
    }

    pub(super) fn passes(self) -> bool {
        self.check("", "", Code::AuditIdentity, "").passed()
    }
}

/// The largest magnitude of `entry` over all rows and columns. A NaN, from numbers beyond the range of double
/// precision, passes nothing.
pub(super) fn largest_entry(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> f64 {
    let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    places.map(|(i, j)| entry(i, j).abs()).fold(0.0, larger)
}

//! Violation of an identity between arrays, compared with the digits of the file.

use crate::import::AuditCheck;
use flexbody_base::diagnostic::Code;
use flexbody_linalg::larger;

/// Violation of identities allowed beyond the digits of the file, relative to the Cauchy-Schwarz bounds of
/// their arrays: the rounding of sums over the nodes of a large model in double precision.
const ROUNDING: f64 = 1e-10;

/// Number of last-digit roundings that one identity may accumulate. A smaller value reports rounding as
/// contradictions.
const TERMS: f64 = 10.0;

/// Violation of an identity, with the scale of its terms and half a unit of their last digits.
pub(super) struct Violation {
    pub by: f64,
    pub scale: f64,
    pub rounding: f64,
}

impl Violation {
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

/// Returns the largest magnitude of `entry` over all rows and columns. A NaN, from numbers beyond double
/// precision, is returned as NaN and fails every check.
pub(super) fn largest_entry(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> f64 {
    let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    places.map(|(i, j)| entry(i, j).abs()).fold(0.0, larger)
}

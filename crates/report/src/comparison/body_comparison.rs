//! Result of a comparison: rows of quantities, pairs of modes, notes.

use super::comparable::is_placed;
use super::mode_pair::{ModePair, Pairing};
use super::pair::Pair;
use flexbody_body::flex_body::FlexBody;
use serde::Serialize;

/// One compared quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonRow {
    /// Stable name of the quantity.
    pub quantity: &'static str,
    /// Reference value that the difference is divided by, in words.
    pub meaning: &'static str,
    /// Largest difference, dimensionless; 0 is equal.
    pub difference: f64,
    /// Largest difference that passes: the requested tolerance plus the rounding error of a shift to a
    /// distant origin.
    pub tolerance: f64,
    /// True if `difference <= tolerance`; a NaN never passes.
    pub passed: bool,
}

/// Result of [`compare`](crate::compare).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyComparison {
    pub(super) a: String,
    pub(super) b: String,
    pub(super) passed: bool,
    pub(super) same_nodes: bool,
    pub(super) paired: Pairing,
    pub(super) modes: Vec<ModePair>,
    pub(super) rows: Vec<ComparisonRow>,
    pub(super) notes: Vec<String>,
    pub(super) not_compared: Vec<String>,
}

impl BodyComparison {
    /// Returns true if every difference is within its tolerance.
    pub fn passed(&self) -> bool {
        self.passed
    }

    /// Returns the compared quantities.
    pub fn rows(&self) -> &[ComparisonRow] {
        &self.rows
    }

    /// Returns true if shapes and invariants were compared mode by mode, which requires the same node numbers
    /// in both bodies.
    pub fn same_nodes(&self) -> bool {
        self.same_nodes
    }

    /// Returns the pairs of modes with their frequencies, in the order of the modes of the first body.
    pub fn modes(&self) -> &[ModePair] {
        &self.modes
    }

    /// Returns the way in which the modes are paired.
    pub fn paired(&self) -> Pairing {
        self.paired
    }

    /// Returns the notes on the limits of the comparison.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns the entries of the flex-body file that were not compared, each with its paths: `lumped
    /// comparators (/lumped, /comparison)`.
    pub fn not_compared(&self) -> &[String] {
        &self.not_compared
    }

    /// Returns the notes, and a sentence for every entry that was not compared.
    pub(super) fn remarks(&self) -> Vec<String> {
        let left_out = self.not_compared.iter().map(|entry| format!("not compared: {entry}"));
        self.notes.iter().cloned().chain(left_out).collect()
    }

    /// Returns the comparison as JSON: `a`, `b`, `passed`, `same_nodes`, `paired`, `modes`, `rows`, `notes`,
    /// `not_compared`.
    pub fn json(&self) -> serde_json::Value {
        serde_json::to_value(self).expect("plain data with text keys")
    }

    /// Returns true if a quantity cannot be compared because a body imported from another program does not
    /// have it: the format may not hold the data that `has` looks for. If the other body has such data, `name
    /// (paths)` is added to the entries that were not compared.
    pub(super) fn leave_out(
        &mut self,
        pair: &Pair<'_>,
        name: &str,
        paths: &str,
        has: impl Fn(&FlexBody) -> bool,
    ) -> bool {
        let may_lack = |body: &FlexBody| !is_placed(body) && !has(body);
        let left_out = may_lack(pair.a) || may_lack(pair.b);
        if left_out && (has(pair.a) || has(pair.b)) {
            let entry = format!("{name}, which a body of another program does not have ({paths})");
            self.not_compared.push(entry);
        }
        left_out
    }

    pub(super) fn row(
        &mut self,
        quantity: &'static str,
        meaning: &'static str,
        difference: f64,
        tolerance: f64,
    ) {
        self.rows.push(ComparisonRow {
            quantity,
            meaning,
            difference,
            tolerance,
            passed: difference <= tolerance,
        });
    }
}

//! Settings of a trade study.

use super::Varied;
use crate::reference::ReferenceError;

/// Settings of a trade study.
#[derive(Debug, Clone, Copy)]
pub struct TradeSettings<'s> {
    /// Number of integrations per candidate, of which the median time counts. Fewer if an integration takes long.
    pub repeat: usize,
    /// Part of the tolerances that the truncation error of the reference takes, in each load case: candidates get the
    /// rest. Cases beyond its length count as zero.
    pub reserved: &'s [f64],
    /// Variations of the scene that the cheapest candidates are judged on; `None` to judge on the scene alone.
    pub varied: Option<&'s Varied>,
}

/// Returns the part of the tolerances that the reference takes in each load case, from its enrichment rounds. Zero if
/// the truncation error is too large for a reference, and for the motion of all nodes (`nodal`).
pub fn reserved(reference_errors: &[Vec<ReferenceError>], nodal: bool) -> Vec<f64> {
    let of = |rounds: &Vec<ReferenceError>| {
        rounds.last().filter(|own| !nodal && own.is_reference()).map_or(0.0, |own| own.worst)
    };
    reference_errors.iter().map(of).collect()
}

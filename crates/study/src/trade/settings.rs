//! Settings of a study.

use crate::reference::ReferenceError;

/// Settings of a study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TradeSettings<'s> {
    /// Integrations whose median time counts; of those that take long, fewer.
    pub repeat: usize,
    /// Part of the tolerances that the reference lacks of its model itself, in each load case: candidates get
    /// the rest. Nothing is known of cases that it does not reach.
    pub reserved: &'s [f64],
}

/// What the reference of a study lacks of its model in each load case, by the rounds in which it was
/// enriched; nothing where it is none. All nodes lack nothing.
pub fn reserved(lacks: &[Vec<ReferenceError>], nodal: bool) -> Vec<f64> {
    let of = |rounds: &Vec<ReferenceError>| {
        rounds.last().filter(|own| !nodal && own.is_reference()).map_or(0.0, |own| own.worst)
    };
    lacks.iter().map(of).collect()
}

//! Decisions about the groups of the kinetic energy of a body.

use super::TermGroup;

/// Decision about one group of the kinetic energy.
#[derive(Debug, Clone, PartialEq)]
pub struct TermDecision {
    /// Group of the decision.
    pub group: TermGroup,
    /// True if the body holds the group.
    pub kept: bool,
    /// Tier of the decision (theory section 7): 0 for bounds from I0 and frequencies, 1 for norms of the
    /// invariants, 2 for an integrated motion.
    pub tier: u8,
    /// Largest error caused by dropping the group, in the quantity that `reason` names.
    pub bound: f64,
    /// Largest allowed error in this quantity.
    pub limit: f64,
    /// Reason, as a sentence without a full stop.
    pub reason: String,
}

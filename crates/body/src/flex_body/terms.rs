//! Why a body holds the groups of the kinetic energy that it holds.

use super::TermGroup;

/// What was decided about one group of the kinetic energy.
#[derive(Debug, Clone, PartialEq)]
pub struct TermDecision {
    /// The group.
    pub group: TermGroup,
    /// Whether the body holds it.
    pub kept: bool,
    /// What decided (theory section 7): 0 bounds from I0 and frequencies, 1 norms of the invariants, 2 a
    /// motion that was integrated.
    pub tier: u8,
    /// Largest error that dropping the group makes, in the quantity that `reason` names.
    pub bound: f64,
    /// Largest error that is allowed in it.
    pub limit: f64,
    /// Why, as a sentence without a full stop.
    pub reason: String,
}

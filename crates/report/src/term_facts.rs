//! Groups of the kinetic energy that a body holds, and the reasons.

use super::numbers::significant;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TermFacts {
    /// `W1`, `W2`, `W3`.
    pub group: &'static str,
    pub kept: bool,
    /// Decision about the group; `None`: no selection was made.
    pub decision: Option<DecisionFacts>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DecisionFacts {
    pub tier: u8,
    /// Infinite where none is known.
    pub bound: f64,
    /// Infinite where there is none.
    pub limit: f64,
    pub reason: String,
}

impl TermFacts {
    /// The facts of every group.
    pub(crate) fn of(body: &FlexBody) -> Vec<Self> {
        let facts = |group: TermGroup| Self {
            group: group.name(),
            kept: body.groups().has(group),
            decision: body.terms().iter().find(|term| term.group == group).map(|term| DecisionFacts {
                tier: term.tier,
                bound: term.bound,
                limit: term.limit,
                reason: term.reason.clone(),
            }),
        };
        TermGroup::ALL.map(facts).to_vec()
    }

    /// `W1 dropped, error without it up to 0.0001 of 0.001 allowed: slow spin`.
    pub(crate) fn in_words(&self) -> String {
        let what = if self.kept { "kept" } else { "dropped" };
        let Some(decision) = &self.decision else { return format!("{} {what}", self.group) };
        let error = match (decision.bound.is_finite(), decision.limit.is_finite()) {
            (false, _) => String::new(),
            (true, false) => format!(", error without it up to {}", significant(decision.bound, 3)),
            (true, true) => format!(
                ", error without it up to {} of {} allowed",
                significant(decision.bound, 3),
                significant(decision.limit, 3)
            ),
        };
        format!("{} {what}{error}: {}", self.group, decision.reason)
    }
}

/// A note for every group that `body` lacks: nothing of it is checked.
pub fn dropped_text(body: &FlexBody) -> String {
    let note = |group: TermGroup| format!("note: {} was dropped: nothing of it is checked\n", group.name());
    body.groups().dropped().map(note).collect()
}

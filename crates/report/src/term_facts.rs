//! Groups of the kinetic energy in a body, with the reasons for keeping or dropping them.

use super::numbers::significant;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TermFacts {
    /// Name of the group: `W1`, `W2`, `W3`.
    pub group: &'static str,
    pub kept: bool,
    /// Decision about the group; `None` if no selection was made.
    pub decision: Option<DecisionFacts>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DecisionFacts {
    pub tier: u8,
    /// Bound of the error without the group; infinite if unknown.
    pub bound: f64,
    /// Limit of the error; infinite without a limit.
    pub limit: f64,
    pub reason: String,
}

impl TermFacts {
    /// Collects the facts of every group.
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

    /// Returns the group in words: `W1 dropped, error without it up to 0.0001 of 0.001 allowed: slow spin`.
    pub(crate) fn in_words(&self) -> String {
        let what = if self.kept { "kept" } else { "dropped" };
        let Some(decision) = &self.decision else { return format!("{} {what}", self.group) };
        let error = match (decision.bound.is_finite(), decision.limit.is_finite()) {
            (false, _) => String::new(),
            (true, false) => format!(", error without it up to {}", significant(decision.bound, 3)),
            (true, true) => format!(
                ", error without it up to {}, tolerance {}",
                significant(decision.bound, 3),
                significant(decision.limit, 3)
            ),
        };
        format!("{} {what}{error}: {}", self.group, decision.reason)
    }
}

/// Returns a note for every group that `body` dropped, since no check covers it.
pub fn dropped_text(body: &FlexBody) -> String {
    let note = |group: TermGroup| format!("note: {} was dropped and is not checked\n", group.name());
    body.groups().dropped().map(note).collect()
}

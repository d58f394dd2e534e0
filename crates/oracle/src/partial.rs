//! Bodies without some groups of the kinetic energy.

use flexbody_body::flex_body::{FlexBody, TermDecision, TermGroup, TermGroups};

/// Returns every combination of groups.
pub fn combinations() -> impl Iterator<Item = TermGroups> {
    (0..8).map(|bits| TermGroups { w1: bits & 1 != 0, w2: bits & 2 != 0, w3: bits & 4 != 0 })
}

/// Returns the decisions that lead to these groups.
pub fn decisions(groups: TermGroups) -> Vec<TermDecision> {
    let decision = |group: TermGroup| TermDecision {
        group,
        kept: groups.has(group),
        tier: 0,
        bound: 1e-4,
        limit: 1e-3,
        reason: "a test wants it so".to_owned(),
    };
    TermGroup::ALL.map(decision).to_vec()
}

/// Returns the body with only these groups.
pub fn with_groups(body: &FlexBody, groups: TermGroups) -> FlexBody {
    let all: Vec<usize> = (0..body.n_modes()).collect();
    body.reduced(&all, groups, decisions(groups)).expect("a body")
}

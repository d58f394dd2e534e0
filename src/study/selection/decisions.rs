//! Decisions in words and numbers, and the trials that they rest on.

use super::search::Choice;
use super::situation::Input;
use super::trial::Trial;
use crate::body::flex_body::{FlexBody, Group, Groups, TermDecision};
use crate::motion::scene::Scene;

/// The error that a decision about a group rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// The output whose error is largest beside its tolerance: attitude, deflection, stress or reaction.
    pub output: &'static str,
    /// Its error without the group: of the attitude in radians, else relative. A bound, or measured over a run (`tier` 2).
    pub error: f64,
    /// The tolerance of the scene.
    pub tolerance: f64,
    /// The part of the tolerance that may be spent on dropping groups.
    pub budget: f64,
    /// 0: bound from I0 and the frequencies; 1: bound with the norms of the invariants; 2: measured.
    pub tier: u8,
}

/// The decision about every group, and the error that it rests on where there is one.
pub(super) fn decisions(
    body: &FlexBody,
    scene: &Scene,
    rotation: &Input,
    choice: &Choice,
    trials: &[Trial],
    short_of: Option<(f64, f64)>,
) -> Vec<(TermDecision, Option<Ground>)> {
    let held = body.invariants().groups();
    let last_with = |kept: Groups| trials.iter().rfind(move |trial| trial.kept == kept);
    let first_passed = |kept: Groups| trials.iter().find(move |trial| trial.kept == kept && trial.passed());
    let decide = |group: Group| {
        let kept = choice.groups.has(group);
        let undecided = |kept: bool, reason: &str| TermDecision {
            group,
            kept,
            tier: 0,
            bound: 0.0,
            limit: 0.0,
            reason: reason.to_owned(),
        };
        if !held.has(group) {
            let earlier = body.terms().iter().find(|decision| decision.group == group).cloned();
            return (earlier.unwrap_or_else(|| undecided(false, "the body does not hold it")), None);
        }
        let basis = if kept {
            last_with(choice.groups.and(Groups::without(group)))
        } else {
            first_passed(choice.groups).or(choice.chosen.as_ref())
        };
        let (mut decided, ground) = match basis {
            Some(trial) => (decision(group, kept, trial, scene, rotation), ground(trial, scene)),
            None => (undecided(kept, "nothing shows that it may be dropped"), None),
        };
        if let Some((reached, allowed)) = short_of.filter(|_| kept) {
            decided.reason = format!(
                "{}; the run turns with {reached:.3e} only where the scene allows {allowed:.3e}, so nothing was measured",
                decided.reason
            );
        }
        (decided, ground)
    };
    Group::ALL.into_iter().map(decide).collect()
}

/// What is largest beside its tolerance in a trial; `None` where its errors are not known.
fn ground(trial: &Trial, scene: &Scene) -> Option<Ground> {
    let errors = trial.errors.as_ref().filter(|_| trial.worst.is_finite())?;
    let (output, error, tolerance) = errors.decisive(&scene.requirements.tolerance);
    Some(Ground { output, error, tolerance, budget: trial.budget, tier: trial.tier })
}

/// The decision that a trial without `group` leads to.
pub(super) fn decision(
    group: Group,
    kept: bool,
    trial: &Trial,
    scene: &Scene,
    rotation: &Input,
) -> TermDecision {
    let ground = ground(trial, scene);
    let how = match trial.tier {
        2 => "measured over the run",
        1 => "bound with the norms of the invariants",
        _ => "bound from I0 and the frequencies",
    };
    let reason = match (&ground, trial.remark.as_str()) {
        (Some(ground), _) => format!("error of {}, {how}; rotation from {}", ground.output, rotation.source),
        (None, "") => format!("no finite {how}"),
        (None, remark) => remark.to_owned(),
    };
    let (bound, limit) = ground.map_or((0.0, 0.0), |one| (one.error, one.tolerance * one.budget));
    TermDecision { group, kept, tier: trial.tier, bound, limit, reason }
}

/// The guideline of \[WP19\] section 8 that a set of groups is nearest to.
pub(super) fn guideline(groups: Groups) -> &'static str {
    match (groups.w1, groups.w2, groups.w3) {
        (false, false, false) => "I: inertia of the undeformed body",
        (true, false, false) => "II: constant centrifugal load, and W1 in the inertia with it",
        (_, true, false) | (true, false, true) => "III: inertia of the deformed body",
        (false, false, true) => "IV: Coriolis forces",
        (_, true, true) => "III and IV: inertia of the deformed body and Coriolis forces",
    }
}

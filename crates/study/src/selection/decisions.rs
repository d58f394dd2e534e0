//! Decisions about groups, with their reasons and the trials behind them.

use super::choice::Choice;
use super::demand::Demand;
use super::situation::Input;
use super::trial::Trial;
use flexbody_body::flex_body::{TermDecision, TermGroup, TermGroups};
use flexbody_linalg::ties::first_largest;

/// Beginning of the reason of a decision that no error can support.
pub const NOT_JUDGED: &str = "not judged";

/// Error that decides about a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecisiveError {
    /// Output whose error is largest relative to its tolerance: attitude, deflection, stress or reaction.
    pub output: &'static str,
    /// Error of that output without the group: of the attitude in radians, else relative. It is a bound, or measured
    /// over a run (`tier` 2).
    pub error: f64,
    /// Tolerance of the scene for that output.
    pub tolerance: f64,
    /// Part of the tolerance that dropped groups may take.
    pub budget: f64,
    /// Tier of the decision. 0: bound from I0 and the frequencies; 1: bound with the norms of the invariants; 2:
    /// measured.
    pub tier: u8,
    /// Index of the load case (from 0), if there are several.
    pub case: Option<usize>,
}

/// Input of the decisions: the demands of every load case, the choice, and all trials.
pub(super) struct DecisionInput<'d> {
    pub demands: &'d [Demand<'d>],
    pub choice: &'d Choice,
    pub trials: &'d [Trial],
}

impl DecisionInput<'_> {
    /// Returns the decision about every group, and the error behind it if there is one.
    pub(super) fn decisions(&self) -> Vec<(TermDecision, Option<DecisiveError>)> {
        TermGroup::ALL.into_iter().map(|group| self.decide(group)).collect()
    }

    fn decide(&self, group: TermGroup) -> (TermDecision, Option<DecisiveError>) {
        let body = self.demands[0].body;
        let kept = self.choice.groups.has(group);
        if !body.invariants().groups().has(group) {
            let earlier = body.terms().iter().find(|decision| decision.group == group).cloned();
            return (
                earlier.unwrap_or_else(|| undecided(group, false, "the body does not have this group")),
                None,
            );
        }
        // A kept group rests on the last trial without it, a dropped one on the first trial that passed.
        let basis = if kept { self.last_without(group) } else { self.first_that_passed(group) };
        let (mut decided, decisive_error) = match basis {
            Some(trial) => {
                let rotation = &demand_of(trial, self.demands).situation.spin;
                (decision(group, kept, trial, self.demands, rotation), decisive_error(trial, self.demands))
            }
            None => (undecided(group, kept, "no bound or run shows that it can be dropped"), None),
        };
        // The error of W2 alone decides nothing while the stress stiffness of the same order is missing.
        let unstressed =
            self.demands.iter().any(|demand| demand.stress_error.as_ref().is_some_and(|own| !own.is_small()));
        if group == TermGroup::W2 && unstressed {
            decided.reason = format!(
                "{NOT_JUDGED}: centrifugal softening and the missing stress stiffness of the spin are of one order, and only together right ({})",
                decided.reason
            );
            return (decided, None);
        }
        // A run slower than the allowed rotation cannot decide about a kept group.
        let short = self.demands.iter().find_map(|demand| Some((demand, demand.short_of?)));
        if let Some((demand, (reached, allowed))) = short.filter(|_| kept) {
            let of = demand.name.map_or_else(String::new, |name| format!(" of case `{name}`"));
            decided.reason = format!(
                "{}; the run{of} reaches an angular velocity of only {reached:.3e}, the scene allows {allowed:.3e}, so that no run could decide",
                decided.reason
            );
        }
        (decided, decisive_error)
    }

    /// Returns true if the trial covers all load cases; a bound covers one.
    fn is_of_all(&self, trial: &Trial) -> bool {
        self.demands.len() == 1 || !trial.by_case.is_empty()
    }

    /// Returns the last trial of the kept groups without `group`.
    fn last_without(&self, group: TermGroup) -> Option<&Trial> {
        let kept = self.choice.groups.and(TermGroups::without(group));
        let without = || self.trials.iter().filter(move |trial| trial.kept == kept);
        without().rfind(|trial| self.is_of_all(trial)).or(without().rfind(|trial| !trial.passed()))
    }

    /// Returns the first trial of the kept groups that passed. If bounds in each load case decided, returns the trial
    /// with the largest error among those without `group`.
    fn first_that_passed(&self, group: TermGroup) -> Option<&Trial> {
        let kept = self.choice.groups;
        let passed = || self.trials.iter().filter(|trial| trial.passed());
        let of_all = passed().find(|trial| trial.kept == kept && self.is_of_all(trial));
        let bounds = passed().filter(|trial| !trial.kept.has(group));
        of_all.or(self.choice.chosen.as_ref()).or_else(|| first_largest(bounds, |trial| trial.worst))
    }
}

fn undecided(group: TermGroup, kept: bool, reason: &str) -> TermDecision {
    TermDecision { group, kept, tier: 0, bound: 0.0, limit: 0.0, reason: reason.to_owned() }
}

/// Returns the demand of the load case of a trial.
fn demand_of<'d>(trial: &Trial, demands: &'d [Demand<'d>]) -> &'d Demand<'d> {
    &demands[trial.case.unwrap_or(0)]
}

/// Returns the error of a trial that is largest relative to its tolerance; `None` if the errors are unknown.
fn decisive_error(trial: &Trial, demands: &[Demand<'_>]) -> Option<DecisiveError> {
    let errors = trial.errors.as_ref().filter(|_| trial.worst.is_finite())?;
    let (output, error, tolerance) = errors.decisive(demand_of(trial, demands).tolerance());
    Some(DecisiveError { output, error, tolerance, budget: trial.budget, tier: trial.tier, case: trial.case })
}

/// Returns the decision that follows from `trial`. `rotation` is the rotation that the trial assumes.
pub(super) fn decision(
    group: TermGroup,
    kept: bool,
    trial: &Trial,
    demands: &[Demand<'_>],
    rotation: &Input,
) -> TermDecision {
    let decisive_error = decisive_error(trial, demands);
    let demand = demand_of(trial, demands);
    let how = match trial.tier {
        2 => "measured over the run",
        1 => "bound with the norms of the invariants",
        _ => "bound from I0 and the frequencies",
    };
    let reason = match (&decisive_error, trial.remark.as_str()) {
        (Some(decisive_error), _) => {
            format!("error of {}, {how}; rotation from {}", decisive_error.output, rotation.source)
        }
        (None, "") => format!("no finite {how}"),
        (None, remark) => remark.to_owned(),
    };
    let reason = match demand.name {
        Some(name) => format!("case `{name}`: {reason}"),
        None => reason,
    };
    let (bound, limit) = decisive_error.map_or((0.0, 0.0), |one| (one.error, one.tolerance * one.budget));
    TermDecision { group, kept, tier: trial.tier, bound, limit, reason }
}

//! Decides which terms and modes a body needs in a scene.

use super::by_case::{CaseSelection, by_case, worst_lacks};
use super::deciding::Deciding;
use super::decisions::{Deliberation, Ground, decision, guideline};
use super::demand::{Demand, OnStage};
use super::participation::{Participation, participations};
use super::significance::{Significance, largest_significances, significances};
use super::situation::Input;
use super::trial::{ModeShare, Trial, multiplications};
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermDecision, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::scene::{LoadCases, PerQuantity};

/// What was decided, and on what grounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body.
    pub body: String,
    /// Numbers that the decision follows from.
    pub inputs: Vec<Input>,
    /// Largest errors that are allowed, of several load cases the least in any.
    pub tolerance: PerQuantity<f64>,
    /// Sizes of all terms.
    pub significances: Vec<Significance>,
    /// Everything that was tried, in order.
    pub trials: Vec<Trial>,
    /// The decision about every group.
    pub terms: Vec<TermDecision>,
    /// The error that each of these decisions rests on.
    pub grounds: Vec<Option<Ground>>,
    /// Groups that are kept.
    pub groups: TermGroups,
    /// Modes that the body has.
    pub n_modes: usize,
    /// Frequency of each of them in hertz.
    pub frequencies_hz: Vec<f64>,
    /// Modes that are kept (from 0).
    pub modes: Vec<usize>,
    /// What every mode of the body does, where a motion was integrated.
    pub shares: Vec<ModeShare>,
    /// What the selected modes lack of the static responses to the loads.
    pub participations: Vec<Participation>,
    /// The reason for these modes.
    pub mode_reason: String,
    /// The selected model, measured against all that the body holds; none where nothing was integrated.
    pub chosen: Option<Trial>,
    /// Multiplications of an evaluation with everything that the body holds.
    pub multiplications: usize,
    /// Guideline of \[WP19\] section 8 that the kept groups are nearest to.
    pub guideline: &'static str,
    /// The cost that the scene allows, where that decides.
    pub most_multiplications: Option<usize>,
    /// What the body, and those before it that were enriched, lack of the model, the last one the body
    /// itself; empty where only a file is at hand, or nothing can be estimated. Of several load cases: in
    /// that where the body lacks most.
    pub lacks: Vec<ReferenceError>,
    /// What belongs to each load case; empty of a scene without.
    pub cases: Vec<CaseSelection>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl Selection {
    /// Whether what was asked for holds: the cost, or else the tolerances as far as they were measured,
    /// against a body that lacks no more than half of them itself.
    pub fn holds(&self) -> bool {
        let is_reference = self.lacks.last().is_none_or(ReferenceError::is_reference);
        self.chosen.as_ref().is_none_or(|chosen| match self.most_multiplications {
            Some(most) => chosen.multiplications <= most,
            None => chosen.passed() && is_reference,
        })
    }
}

/// What I0 and the eigenvalues alone rule out (tier 0): decisions about the groups that a body in these load
/// cases need not hold. `body` needs to hold none.
///
/// # Errors
/// FB212 where a scene does not fit the body; those of [`simulate`](flexbody_motion::scene::simulate).
pub fn rule_out(body: &FlexBody, cases: &LoadCases, context: &Context<'_>) -> Result<Vec<TermDecision>> {
    if cases.iter().any(|scene| scene.carried.is_some()) {
        return Ok(Vec::new());
    }
    let stages = stages(body, cases)?;
    let demands = demands(&stages, cases, context, false)?;
    let passed = |(at, demand): (usize, &Demand<'_>)| {
        let trial = demand.bounds.iter().find(|trial| trial.passed())?;
        Some(Trial { case: Some(at), ..trial.clone() })
    };
    let passed: Option<Vec<Trial>> = demands.iter().enumerate().map(passed).collect();
    let Some(trials) = passed else { return Ok(Vec::new()) };
    let kept = trials.iter().fold(TermGroups::NONE, |kept, trial| kept.or(trial.kept));
    let largest = trials.iter().max_by(|a, b| a.worst.total_cmp(&b.worst)).expect("one scene at least");
    let rotation = &demands[largest.case.unwrap_or(0)].cases[0].situation.spin;
    Ok(kept.dropped().map(|group| decision(group, false, largest, &demands, rotation)).collect())
}

/// The terms and modes of `body` with which every load case is within its own tolerances.
///
/// Terms are dropped by whole groups, cheapest set first: by bounds of tier 0 and 1 where these leave half of
/// the tolerances, else by the error of a motion that is integrated (tier 2), if the scene says how long it
/// lasts. A group that bounds rule out in some cases is measured in the others. Where a scene allows faster
/// rotation than its run has, everything holds for the run and for the run with the rotation scaled to that.
/// Modes are ranked by the most that they do beside the tolerances of any case, and the fewest are kept whose
/// motion, with the kept groups, is within the tolerances.
///
/// * `lacks`: for each load case the known errors of `body`, and of those before it, against the model: what is
///   left of the tolerances. Nothing is known of cases that it does not reach.
///
/// # Errors
/// FB212 where a scene does not fit the body; those of [`simulate`](flexbody_motion::scene::simulate).
pub fn select(
    body: &FlexBody,
    lacks: &[Vec<ReferenceError>],
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<Selection> {
    body.require_mean_axes("select")?;
    let stages = stages(body, cases)?;
    context.phase("bounds");
    let mut demands = demands(&stages, cases, context, true)?;
    for (demand, lacks) in demands.iter_mut().zip(lacks) {
        demand.lacks = lacks;
    }
    let mut deciding = Deciding::new(&demands);
    let mode_reason = match deciding.has_run() {
        false => deciding.choose_by_band(),
        true => deciding.choose_by_motion(context)?,
    };
    let Deciding { choice, trials, diagnostics, short_of, chosen_by_case, .. } = deciding;
    for (demand, short_of) in demands.iter_mut().zip(short_of) {
        demand.short_of = short_of;
    }
    let decided = Deliberation { demands: &demands, choice: &choice, trials: &trials }.decisions();
    let (terms, grounds): (Vec<_>, Vec<_>) = decided.into_iter().unzip();
    let first = &demands[0];
    Ok(Selection {
        scene: cases.name().to_owned(),
        body: first.body.source().name.clone(),
        inputs: inputs(&demands),
        tolerance: cases.least_tolerance().errors,
        significances: largest_significances(
            demands.iter().map(|one| significances(&one.situation, one.body)),
        ),
        multiplications: multiplications(first.body, first.body.invariants().groups()),
        guideline: guideline(choice.groups),
        groups: choice.groups,
        n_modes: first.body.n_modes(),
        frequencies_hz: first.body.frequencies_hz(),
        participations: static_responses(&demands, &choice.modes),
        cases: by_case(&demands, &choice, &trials, &grounds, chosen_by_case),
        terms,
        grounds,
        modes: choice.modes,
        shares: choice.shares,
        mode_reason,
        chosen: choice.chosen,
        most_multiplications: first.scene.requirements.multiplications,
        trials,
        lacks: worst_lacks(&demands),
        diagnostics: once(diagnostics),
    })
}

/// Body and load cases on their stages.
fn stages<'s>(body: &'s FlexBody, cases: &'s LoadCases) -> Result<Vec<OnStage<'s>>> {
    let staged = |(at, scene)| OnStage::new(body, scene).map_err(|error| cases.about(at, error));
    cases.iter().enumerate().map(staged).collect()
}

fn demands<'d>(
    stages: &'d [OnStage<'_>],
    cases: &'d LoadCases,
    context: &Context<'d>,
    tier_1: bool,
) -> Result<Vec<Demand<'d>>> {
    let demand = |(at, stage)| Demand::new(stage, cases.case_name(at), context, tier_1);
    stages.iter().enumerate().map(demand).collect()
}

/// Numbers that the decision follows from, with their load cases where there are several.
fn inputs(demands: &[Demand<'_>]) -> Vec<Input> {
    let of = |demand: &Demand<'_>| {
        let own = |input: &Input| match demand.name {
            Some(name) => Input { source: format!("case `{name}`: {}", input.source), ..input.clone() },
            None => input.clone(),
        };
        demand.situation.inputs().map(own)
    };
    demands.iter().flat_map(of).collect()
}

/// What the selected modes lack of static responses; loads that several load cases have stand there once.
fn static_responses(demands: &[Demand<'_>], modes: &[usize]) -> Vec<Participation> {
    let mut all: Vec<Participation> = Vec::new();
    for demand in demands {
        for one in participations(demand.body, demand.scene, &demand.loads, modes) {
            if !all.contains(&one) {
                all.push(one);
            }
        }
    }
    all
}

/// Each diagnostic once.
fn once(diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut kept: Vec<Diagnostic> = Vec::new();
    for diagnostic in diagnostics {
        if !kept.contains(&diagnostic) {
            kept.push(diagnostic);
        }
    }
    kept
}

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
use flexbody_linalg::progress::{Event, Watch};
use flexbody_motion::scene::{Scene, Tolerance};

/// What was decided, and on what grounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body.
    pub body: String,
    /// Numbers that the decision follows from.
    pub inputs: Vec<Input>,
    /// Largest errors that are allowed, of several load cases the least in any; in the order attitude,
    /// deflection, stress, reaction.
    pub tolerance: [f64; 4],
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
/// cases, one or more, need not hold. `body` needs to hold none.
///
/// # Errors
/// FB212 where a scene does not fit the body; those of [`simulate`](flexbody_motion::scene::simulate).
pub fn rule_out(body: &FlexBody, scenes: &[Scene], memory: Option<u64>) -> Result<Vec<TermDecision>> {
    if scenes.iter().any(|scene| scene.carried.is_some()) {
        return Ok(Vec::new());
    }
    let stages = scenes.iter().map(|scene| on_stage(body, scene, scenes)).collect::<Result<Vec<_>>>()?;
    let demands = demands(&stages, scenes, memory, false)?;
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

/// The terms and modes of `body` that `scene` needs.
///
/// Terms are dropped by whole groups, cheapest set first: by bounds of tier 0 and 1 where these leave half of
/// the tolerances, else by the error of a motion that is integrated (tier 2), if the scene says how long it
/// lasts. Where the scene allows faster rotation than its run has, everything holds for the run and for the
/// run with the rotation scaled to that. Modes are ranked by what they do in the motion, and the fewest are
/// kept whose motion, with the kept groups, is within the tolerances.
///
/// # Errors
/// FB212 where the scene does not fit the body; those of [`simulate`](flexbody_motion::scene::simulate).
pub fn select(body: &FlexBody, scene: &Scene, memory: Option<u64>, watch: Watch<'_>) -> Result<Selection> {
    select_from(body, &[], scene, memory, watch)
}

/// The same where it is known what `body`, and those before it, lack of the model in this scene: what is left
/// of the tolerances.
///
/// # Errors
/// As [`select`].
pub fn select_from(
    body: &FlexBody,
    lacks: &[ReferenceError],
    scene: &Scene,
    memory: Option<u64>,
    watch: Watch<'_>,
) -> Result<Selection> {
    select_for_cases(body, &[lacks.to_vec()], std::slice::from_ref(scene), memory, watch)
}

/// The same for the load cases `scenes`: the terms and modes with which every one of them is within its own
/// tolerances. A group that bounds rule out in some cases is measured in the others; modes are ranked by the
/// most that they do beside the tolerances of any case.
///
/// * `lacks`: for each case as in [`select_from`]; nothing is known of cases that it does not reach.
///
/// # Errors
/// As [`select`].
///
/// # Panics
/// When there is no case.
pub fn select_for_cases(
    body: &FlexBody,
    lacks: &[Vec<ReferenceError>],
    scenes: &[Scene],
    memory: Option<u64>,
    watch: Watch<'_>,
) -> Result<Selection> {
    assert!(!scenes.is_empty(), "a scene to select for");
    body.require_mean_axes("select")?;
    let stages = scenes.iter().map(|scene| on_stage(body, scene, scenes)).collect::<Result<Vec<_>>>()?;
    watch(Event::Phase("bounds"));
    let mut demands = demands(&stages, scenes, memory, true)?;
    for (demand, lacks) in demands.iter_mut().zip(lacks) {
        demand.lacks = lacks;
    }
    let mut deciding = Deciding::new(&demands);
    let mode_reason = match deciding.has_run() {
        false => deciding.choose_by_band(),
        true => deciding.choose_by_motion(watch)?,
    };
    let Deciding { choice, trials, diagnostics, short_of, chosen_by_case, .. } = deciding;
    for (demand, short_of) in demands.iter_mut().zip(short_of) {
        demand.short_of = short_of;
    }
    let decided = Deliberation { demands: &demands, choice: &choice, trials: &trials }.decisions();
    let (terms, grounds): (Vec<_>, Vec<_>) = decided.into_iter().unzip();
    let first = &demands[0];
    Ok(Selection {
        scene: scenes[0]
            .case
            .as_ref()
            .filter(|_| scenes.len() > 1)
            .map_or(&first.scene.name, |case| &case.scene)
            .clone(),
        body: first.body.source().name.clone(),
        inputs: inputs(&demands),
        tolerance: least_tolerances(&demands),
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

/// Body and scene on their stage; where there are several load cases, an error says which it belongs to.
fn on_stage<'s>(body: &'s FlexBody, scene: &'s Scene, scenes: &[Scene]) -> Result<OnStage<'s>> {
    OnStage::new(body, scene).map_err(|error| match scene.case_name().filter(|_| scenes.len() > 1) {
        Some(name) => error.about(format!("case `{name}`")),
        None => error,
    })
}

fn demands<'d>(
    stages: &'d [OnStage<'_>],
    scenes: &'d [Scene],
    memory: Option<u64>,
    tier_1: bool,
) -> Result<Vec<Demand<'d>>> {
    let mut demands =
        stages.iter().map(|stage| Demand::new(stage, memory, tier_1)).collect::<Result<Vec<_>>>()?;
    if scenes.len() > 1 {
        for (demand, scene) in demands.iter_mut().zip(scenes) {
            demand.name = Some(scene.case_name().unwrap_or(&scene.name));
        }
    }
    Ok(demands)
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

/// Largest errors that are allowed in all load cases.
fn least_tolerances(demands: &[Demand<'_>]) -> [f64; 4] {
    let of = |tolerance: &Tolerance| {
        [tolerance.attitude, tolerance.deflection, tolerance.stress, tolerance.reaction]
    };
    let all = demands.iter().map(|demand| of(demand.tolerance()));
    all.reduce(|a, b| std::array::from_fn(|i| a[i].min(b[i]))).expect("a scene")
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

//! Selection of the terms and modes that a body needs in a scene.

use super::choice::Choice;
use super::decisions::{DecisionInput, DecisiveError, decision};
use super::demand::{Demand, FramedTests, Participation, participations};
use super::mode_reasons::ModeReasons;
use super::search::SelectionState;
use super::shapes::{FixedInterfaceChoice, Pool};
use super::significance::{Significance, largest_significances, significances};
use super::situation::Input;
use super::trial::{ModeShare, Trial, multiplications};
use super::variations::{VariedRuns, VariedSelection, framed_variations};
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Subset, TermDecision, TermGroup, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::{LoadCases, PerQuantity, StressError, Tolerance};

/// Result of a selection, with the reasons.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body.
    pub body: String,
    /// Input numbers of the decision.
    pub inputs: Vec<Input>,
    /// Tolerances; for several load cases, the smallest of each quantity.
    pub tolerance: PerQuantity<f64>,
    /// Significance of all terms.
    pub significances: Vec<Significance>,
    /// All trials, in order.
    pub trials: Vec<Trial>,
    /// Decision about every group.
    pub terms: Vec<TermDecision>,
    /// Error behind each decision; `None` if no error decided.
    pub decisive_errors: Vec<Option<DecisiveError>>,
    /// Groups that are kept.
    pub groups: TermGroups,
    /// Fixed-interface modes that a Craig-Bampton body keeps beside all motions of its interfaces; `None` if the selection picks
    /// modes.
    pub fixed_interface: Option<FixedInterfaceChoice>,
    /// Number of modes of the body or, with `fixed_interface`, of the body with these fixed-interface modes.
    pub n_modes: usize,
    /// Frequency of each of these modes, in hertz.
    pub frequencies_hz: Vec<f64>,
    /// Indices of the kept modes (from 0).
    pub modes: Vec<usize>,
    /// Contribution of every mode of the body or, with `fixed_interface`, of every fixed-interface mode; empty if no motion was
    /// integrated.
    pub shares: Vec<ModeShare>,
    /// Parts of the static responses to the loads that the selected modes miss.
    pub participations: Vec<Participation>,
    /// Reason for the choice of modes.
    pub mode_reason: String,
    /// Excitations of the modes and the worth of those at the edge; `None` unless the fewest modes were looked for.
    pub mode_reasons: Option<ModeReasons>,
    /// Selected model, measured against the whole body; `None` if no motion was integrated.
    pub chosen: Option<Trial>,
    /// Multiplications of an evaluation of the equations with everything that the body holds.
    pub multiplications: usize,
    /// Guideline of \[WP19\] section 8 that is closest to the kept groups.
    pub guideline: &'static str,
    /// Number of multiplications that the scene allows; `None` if tolerances decide.
    pub most_multiplications: Option<usize>,
    /// Truncation errors of the body and of its versions before enrichment; the last belongs to the body itself. Empty
    /// if no model is at hand or nothing can be estimated. For several load cases, those of the case with the largest
    /// last error.
    pub reference_errors: Vec<ReferenceError>,
    /// Largest error of any load case by the stress stiffness of the spin that the body does not have; `None` if nothing is
    /// missing, or if the error is a small part of the tolerances.
    pub stress_error: Option<StressError>,
    /// Results for each load case; empty for a single scene.
    pub cases: Vec<CaseSelection>,
    /// Errors of the selected model in variations of the scene, whose motions did not choose it.
    pub varied: Vec<VariedSelection>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl Selection {
    /// Returns the modes and groups that are selected of the body.
    pub fn subset(&self) -> Subset {
        Subset {
            fixed_interface_modes: self.fixed_interface.as_ref().map(|choice| choice.kept.clone()),
            modes: Some(self.modes.clone()),
            groups: self.groups,
        }
    }

    /// Returns the selected body of `whole`, with the reasons for its groups.
    ///
    /// # Errors
    /// The errors of [`FlexBody::with_fixed_interface_modes`] and [`FlexBody::reduced`].
    pub fn body(&self, whole: &FlexBody) -> Result<FlexBody> {
        let fewer =
            self.fixed_interface.as_ref().map(|choice| whole.with_fixed_interface_modes(&choice.kept));
        let fewer = fewer.transpose()?;
        fewer.as_ref().unwrap_or(whole).reduced(&self.modes, self.groups, self.terms.clone())
    }

    /// Returns true if the requirement holds: the cost, or else the measured errors, relative to a body whose truncation error
    /// and missing stress stiffness take at most half of the tolerances each, also in every stated variation. True if nothing
    /// was measured.
    pub fn holds(&self) -> bool {
        let in_variations = self.varied.iter().all(|variation| variation.holds() || !variation.is_required);
        let is_reference = self.reference_errors.last().is_none_or(ReferenceError::is_reference)
            && self.stress_error.as_ref().is_none_or(StressError::is_small);
        self.chosen.as_ref().is_none_or(|chosen| match self.most_multiplications {
            Some(most) => chosen.multiplications <= most,
            None => chosen.passed() && is_reference && in_variations,
        })
    }
}

/// Result of a selection for one of several load cases.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSelection {
    /// Name of the load case.
    pub name: String,
    /// Tolerances of the load case.
    pub tolerance: Tolerance,
    /// Selected model, measured against the whole body; `None` if no motion was integrated.
    pub chosen: Option<Trial>,
    /// Groups whose decision rests on this load case.
    pub binds_groups: Vec<TermGroup>,
    /// True if one mode fewer would exceed the tolerances most in this load case.
    pub binds_modes: bool,
    /// Truncation errors in this case, of the body and of its versions before enrichment.
    pub reference_errors: Vec<ReferenceError>,
}

/// Returns decisions about the groups that I0 and the eigenvalues alone rule out (tier 0) in these load cases. `body`
/// may hold no groups. Empty if no group is ruled out.
///
/// # Errors
/// FB212 if a scene does not match the body; the errors of [`simulate`](flexbody_motion::scene::simulate).
pub fn rule_out(body: &FlexBody, cases: &LoadCases, context: &Context<'_>) -> Result<Vec<TermDecision>> {
    let framed_cases = framed_cases(body, cases)?;
    let demands = demands(&framed_cases, cases, context, false)?;
    let passed = |(at, demand): (usize, &Demand<'_>)| {
        let trial = demand.bounds.iter().find(|trial| trial.passed())?;
        Some(Trial { case: Some(at), ..trial.clone() })
    };
    let passed: Option<Vec<Trial>> = demands.iter().enumerate().map(passed).collect();
    let Some(trials) = passed else { return Ok(Vec::new()) };
    let kept = trials.iter().fold(TermGroups::NONE, |kept, trial| kept.or(trial.kept));
    let largest = first_largest(&trials, |trial| trial.worst).expect("one scene at least");
    let rotation = &demands[largest.case.unwrap_or(0)].cases[0].situation.spin;
    Ok(kept.dropped().map(|group| decision(group, false, largest, &demands, rotation)).collect())
}

/// Selects the terms and modes of `body` with which every load case is within its own tolerances.
///
/// Terms are dropped by whole groups, cheapest set first: by bounds of tier 0 and 1 if these take at most half of the
/// tolerances, else by the error of an integrated motion (tier 2), if the scene states its duration. A group that
/// bounds rule out in some cases is measured in the others. If a scene allows faster rotation than its run has, the
/// selection must hold for the run and for the run with its rotation scaled to the allowed one. Modes are ranked by
/// their largest contribution relative to the tolerances of any case. The fewest modes are kept whose motion, with the
/// kept groups, is within the tolerances.
///
/// * `reference_errors`: for each load case, the known truncation errors of `body` and of its versions before enrichment; they
///   reduce the tolerances. Cases beyond its length have unknown errors, which count as zero.
///
/// # Errors
/// FB212 if a scene does not match the body; the errors of [`simulate`](flexbody_motion::scene::simulate).
pub fn select(
    body: &FlexBody,
    reference_errors: &[Vec<ReferenceError>],
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<Selection> {
    select_judged(body, reference_errors, &[], cases, context)
}

/// Does the work of [`select`] for a body whose truncation errors `varied_reference_errors` in the variations of the load cases are
/// known: they reduce the tolerances there. Unknown errors count as zero.
///
/// # Errors
/// The errors of [`select`].
pub fn select_judged(
    body: &FlexBody,
    reference_errors: &[Vec<ReferenceError>],
    varied_reference_errors: &[Vec<ReferenceError>],
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<Selection> {
    body.require_mean_axes("select")?;
    // Bounds of each load case, in its own frame.
    let framed_cases = framed_cases(body, cases)?;
    context.phase("bounds");
    let mut demands = demands(&framed_cases, cases, context, true)?;
    for (demand, reference_errors) in demands.iter_mut().zip(reference_errors) {
        demand.reference_errors = reference_errors;
    }
    // By simulation if every case has a duration, else by the frequency band.
    let mut selection_state = SelectionState::new(&demands);
    let mode_reason = if !selection_state.has_run() {
        selection_state.choose_by_band()
    } else {
        choose_by_motion(&mut selection_state, body, varied_reference_errors, cases, context)?
    };
    // State the reasons of the decision.
    let SelectionState {
        mut choice,
        trials,
        diagnostics,
        short_of,
        stress_errors,
        chosen_by_case,
        varied,
        groups_of_variations,
        ..
    } = selection_state;
    for (demand, (short_of, stress_error)) in demands.iter_mut().zip(short_of.into_iter().zip(stress_errors))
    {
        (demand.short_of, demand.stress_error) = (short_of, stress_error);
    }
    // Decide for the model that the scene alone needs, then for what variations add to it.
    let groups = choice.groups;
    choice.groups = groups.and(groups_of_variations.complement());
    let decided = DecisionInput { demands: &demands, choice: &choice, trials: &trials }.decisions();
    choice.groups = groups;
    let decided = with_variations(decided, groups_of_variations, &varied, cases);
    let (terms, decisive_errors): (Vec<_>, Vec<_>) = decided.into_iter().unzip();
    let first = &demands[0];
    let parts = SelectedModes::new(&choice, body, first)?;
    Ok(Selection {
        mode_reasons: ModeReasons::of(&demands, &choice, &trials),
        scene: cases.name().to_owned(),
        body: first.body.description().name.clone(),
        inputs: inputs(&demands),
        tolerance: cases.least_tolerance().errors,
        significances: largest_significances(
            demands.iter().map(|demand| significances(&demand.situation, demand.body)),
        ),
        multiplications: multiplications(first.body, first.body.invariants().groups()),
        guideline: guideline(choice.groups),
        groups: choice.groups,
        n_modes: parts.frequencies_hz.len(),
        frequencies_hz: parts.frequencies_hz,
        participations: if parts.fixed_interface.is_none() {
            static_responses(&demands, &choice.modes)
        } else {
            Vec::new()
        },
        cases: by_case(&demands, &choice, &trials, &decisive_errors, chosen_by_case),
        varied,
        terms,
        decisive_errors,
        fixed_interface: parts.fixed_interface,
        modes: parts.modes,
        shares: choice.shares,
        mode_reason,
        chosen: choice.chosen,
        most_multiplications: first.scene.requirements.multiplications,
        trials,
        reference_errors: worst_reference_errors(&demands),
        stress_error: worst_stress_error(&demands),
        diagnostics: once(diagnostics),
    })
}

/// Modes of a selection, by the pool that they were picked from.
struct SelectedModes {
    fixed_interface: Option<FixedInterfaceChoice>,
    modes: Vec<usize>,
    frequencies_hz: Vec<f64>,
}

impl SelectedModes {
    /// Returns the modes of `choice` of `body`, of which `demand` has the one in the frame of its scene.
    fn new(choice: &Choice, body: &FlexBody, demand: &Demand<'_>) -> Result<Self> {
        if choice.pool == Pool::Modes {
            let (modes, frequencies_hz) = (choice.modes.clone(), demand.body.frequencies_hz());
            return Ok(Self { fixed_interface: None, modes, frequencies_hz });
        }
        let fewer = body.with_fixed_interface_modes(&choice.modes)?;
        Ok(Self {
            fixed_interface: Some(FixedInterfaceChoice {
                kept: choice.modes.clone(),
                of: choice.ranked.len(),
            }),
            modes: (0..fewer.n_modes()).collect(),
            frequencies_hz: fewer.frequencies_hz(),
        })
    }
}

/// Chooses terms and modes by integrated motion, beside the variations of the load cases. Returns the reason for the modes.
fn choose_by_motion(
    state: &mut SelectionState<'_>,
    body: &FlexBody,
    varied_reference_errors: &[Vec<ReferenceError>],
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<String> {
    let variations = cases.variations(body.dimension());
    let framed = framed_variations(body, &variations)?;
    context.phase("reference motion of the variations");
    context.runs(variations.len());
    let varied = VariedRuns::new(&variations, cases, &framed, varied_reference_errors, context)?;
    state.diagnostics.extend(varied.diagnostics.iter().cloned());
    let varied = Some(&varied).filter(|varied| !varied.is_empty());
    state.choose_by_motion(cases, varied, context)
}

/// Brings the body and each load case into one frame.
fn framed_cases<'s>(body: &'s FlexBody, cases: &'s LoadCases) -> Result<Vec<FramedTests<'s>>> {
    let framed = |(at, scene)| FramedTests::new(body, scene).map_err(|error| cases.about(at, error));
    cases.iter().enumerate().map(framed).collect()
}

fn demands<'d>(
    framed_cases: &'d [FramedTests<'_>],
    cases: &'d LoadCases,
    context: &Context<'d>,
    tier_1: bool,
) -> Result<Vec<Demand<'d>>> {
    let demand = |(at, framed)| Demand::new(framed, cases.case_name(at), context, tier_1);
    framed_cases.iter().enumerate().map(demand).collect()
}

/// Returns the results for each of several load cases; empty for a single scene.
pub(super) fn by_case(
    demands: &[Demand<'_>],
    choice: &Choice,
    trials: &[Trial],
    decisive_errors: &[Option<DecisiveError>],
    chosen: Vec<Trial>,
) -> Vec<CaseSelection> {
    if demands.len() == 1 {
        return Vec::new();
    }
    // Failed trial with one mode fewer than the choice: its worst load case binds the number of modes.
    let number = choice.chosen.as_ref().map(|chosen| chosen.modes);
    let is_one_fewer = |trial: &&Trial| trial.pool == choice.pool && Some(trial.modes + 1) == number;
    let one_fewer =
        trials.iter().rfind(|trial| !trial.by_case.is_empty() && !trial.passed() && is_one_fewer(trial));
    let of_case = |(at, demand): (usize, &Demand<'_>)| {
        let is_bound_here = |group: &TermGroup, decisive_error: &Option<DecisiveError>| {
            choice.groups.has(*group)
                && decisive_error.is_some_and(|decisive_error| decisive_error.case == Some(at))
        };
        let decisive_errors = TermGroup::ALL.into_iter().zip(decisive_errors);
        CaseSelection {
            name: demand.name.unwrap_or_default().to_owned(),
            tolerance: *demand.tolerance(),
            chosen: chosen.get(at).cloned(),
            binds_groups: decisive_errors
                .filter(|(group, decisive_error)| is_bound_here(group, decisive_error))
                .map(|(group, _)| group)
                .collect(),
            binds_modes: one_fewer.is_some_and(|trial| trial.case == Some(at)),
            reference_errors: demand.reference_errors.to_vec(),
        }
    };
    demands.iter().enumerate().map(of_case).collect()
}

/// Returns the truncation errors in the load case whose last error is largest.
pub(super) fn worst_reference_errors(demands: &[Demand<'_>]) -> Vec<ReferenceError> {
    let last = |demand: &&Demand<'_>| demand.reference_errors.last().map_or(-1.0, |own| own.worst);
    let worst = first_largest(demands, |demand| last(demand));
    worst.map_or_else(Vec::new, |demand| demand.reference_errors.to_vec())
}

/// Returns the largest error of any load case by the missing stress stiffness of the spin.
fn worst_stress_error(demands: &[Demand<'_>]) -> Option<StressError> {
    first_largest(demands.iter().filter_map(|demand| demand.stress_error.clone()), |one| one.worst)
}

/// Returns the decisions with those about the groups that variations need in place of those by the scene alone.
fn with_variations(
    mut decided: Vec<(TermDecision, Option<DecisiveError>)>,
    groups_of_variations: TermGroups,
    varied: &[VariedSelection],
    cases: &LoadCases,
) -> Vec<(TermDecision, Option<DecisiveError>)> {
    for (term, error) in decided.iter_mut().filter(|(term, _)| groups_of_variations.has(term.group)) {
        (*term, *error) = needed_by_variations(term.group, varied, cases);
    }
    decided
}

/// Returns the decision about a group that the scene alone would drop, and the error that it then has in the worst
/// variation.
fn needed_by_variations(
    group: TermGroup,
    varied: &[VariedSelection],
    cases: &LoadCases,
) -> (TermDecision, Option<DecisiveError>) {
    let without = |variation: &VariedSelection| {
        Some((variation.name.clone(), variation.case.clone(), variation.with_all_modes.clone()?))
    };
    let worst = first_largest(varied.iter().filter_map(without), |one| one.2.worst);
    let error = worst.as_ref().and_then(|(_, case, trial)| {
        let at = (0..cases.len()).find(|at| cases.case_name(*at) == case.as_deref());
        let tolerance = &cases[at.unwrap_or(0)].requirements.tolerance;
        let (output, error, tolerance) = trial.errors?.decisive(tolerance);
        let case = at.filter(|_| case.is_some());
        Some(DecisiveError { output, error, tolerance, budget: trial.budget, tier: 2, case })
    });
    let reason = match &worst {
        Some((name, ..)) => {
            format!("variation `{name}`: error of the groups that the scene alone needs, with all modes")
        }
        None => "needed by a variation of the scene".to_owned(),
    };
    let (bound, limit) = error.map_or((0.0, 0.0), |one| (one.error, one.tolerance * one.budget));
    (TermDecision { group, kept: true, tier: 2, bound, limit, reason }, error)
}

/// Returns the input numbers of the decision, marked with their load cases if there are several.
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

/// Returns the missing parts of static responses; loads that several load cases share are listed once.
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

/// Removes repeated diagnostics.
fn once(diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let mut kept: Vec<Diagnostic> = Vec::new();
    for diagnostic in diagnostics {
        if !kept.contains(&diagnostic) {
            kept.push(diagnostic);
        }
    }
    kept
}

/// Returns the guideline of \[WP19\] section 8 that is closest to a set of groups.
fn guideline(groups: TermGroups) -> &'static str {
    match (groups.w1, groups.w2, groups.w3) {
        (false, false, false) => "I: inertia of the undeformed body",
        (true, false, false) => "II: constant centrifugal load, and W1 in the inertia with it",
        (_, true, false) | (true, false, true) => "III: inertia of the deformed body",
        (false, false, true) => "IV: Coriolis forces",
        (_, true, true) => "III and IV: inertia of the deformed body and Coriolis forces",
    }
}

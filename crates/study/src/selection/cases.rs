//! Scenes in which a selection must hold: load cases, with trials by bounds in all of them and the selection listed by
//! case, and variations, on which a selection is judged whose terms and modes their motions did not choose.

use super::bounds::Variation;
use super::demand::{Demand, FramedTests};
use super::norms::Norms;
use super::search::Choice;
use super::select::DecisiveError;
use super::situation::Situation;
use super::trial::{Trial, TrialRuns};
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::dynamics::BodyPoint;
use flexbody_motion::scene::{
    LoadCases, Measure, OutputErrors, Range, Scene, SceneVariation, Tolerance, Trace, ends_a_run, points_of,
};
use nalgebra::Vector3;

/// Part of the tolerances that dropped terms may take according to bounds. The rest is left for measured trials.
pub(super) const PART_OF_BOUNDS: f64 = 0.5;

/// Largest ratio of the allowed rotation to that of the run at which measurements of the run count.
pub(super) const SLACK_OF_RANGE: f64 = 1.01;

/// Returns the sets of groups that a body may keep, cheapest first. A carried body keeps all: the dropped groups would
/// be those of its own modes, but the motion of its interface needs them.
pub(super) fn sets_in(carried: bool) -> impl Iterator<Item = TermGroups> {
    sets().filter(move |set| !carried || *set == TermGroups::ALL)
}

/// Returns every set of groups, cheapest first. W1 costs a multiple of nf, W2 six products with matrices of the size of
/// K_ff, W3 two times three.
fn sets() -> impl Iterator<Item = TermGroups> {
    (0..8).map(|bits| TermGroups { w1: bits & 1 != 0, w2: bits & 2 != 0, w3: bits & 4 != 0 })
}

/// Returns the scene and, if its run turns less than the scene allows, the scene with its rotation scaled to the
/// largest allowed.
pub(super) fn scenes(body: &FlexBody, scene: &Scene) -> Result<Vec<Scene>> {
    let (loads, _) = points_of(body, scene)?;
    let allowed = Situation::new(body, scene, &loads);
    let mut own = scene.clone();
    own.requirements.motion = Default::default();
    let (spin, acceleration) = match (scene.rotation(), &scene.carried) {
        (Some(velocity), _) => {
            let rate = Variation::of_vector(velocity, allowed.duration.value);
            (rate.largest, rate.rate)
        }
        (None, Some(_)) => (0.0, 0.0),
        // The accelerations of a free body grow with the square of its angular velocity.
        (None, None) => (scene.initial.angular_velocity.norm(), f64::INFINITY),
    };
    // Factor that brings velocity and acceleration to the largest allowed.
    let velocity = allowed.spin.value / spin;
    let acceleration = match scene.requirements.motion.angular_acceleration {
        Some(_) => allowed.acceleration.value / acceleration,
        None => 0.0,
    };
    let factor = velocity.max(acceleration);
    if scene.requirements.motion == own.requirements.motion || scene.run.duration.is_none() {
        return Ok(vec![scene.clone()]);
    }
    if factor.is_nan() || factor <= SLACK_OF_RANGE {
        return Ok(vec![own]);
    }
    let mut scaled = own.turning_faster(factor);
    match (scene.prescribes(), &scene.requirements.motion.angular_velocity) {
        (true, _) if factor.is_infinite() => return Ok(vec![scene.clone()]),
        // A free body without initial rotation gets the allowed rotation.
        (false, Some(range)) if factor.is_infinite() => {
            scaled.initial.angular_velocity = match range {
                Range::Axes(components) => *components,
                Range::Any(length) if body.dimension() == 2 => Vector3::z() * *length,
                Range::Any(length) => Vector3::repeat(length / 3f64.sqrt()),
            };
        }
        _ => scaled.initial.angular_velocity *= factor,
    }
    Ok(vec![own, scaled])
}

/// Scene in which models are tested.
pub(super) struct Case<'c> {
    body: &'c FlexBody,
    scene: &'c Scene,
    pub situation: Situation,
    loads: Vec<BodyPoint>,
    watched: Vec<BodyPoint>,
    context: Context<'c>,
}

impl<'c> Case<'c> {
    pub(super) fn new(body: &'c FlexBody, scene: &'c Scene, context: &Context<'c>) -> Result<Self> {
        let (loads, watched) = points_of(body, scene)?;
        let situation = Situation::new(body, scene, &loads);
        Ok(Self { body, scene, situation, loads, watched, context: *context })
    }

    /// Returns norms of the terms at tier 0 and, if `tier_1` is set and the body holds all groups, at tier 1. Empty if
    /// there are no bounds for the scene.
    fn norms(&self, tier_1: bool) -> Vec<Norms> {
        let Ok(driven) = &self.situation.driven else { return Vec::new() };
        let (invariants, eigenvalues) = (self.body.invariants(), &self.body.modes().eigenvalue);
        let axis = driven.rotation.axis.as_ref();
        let rigid = Norms::of_rigid(&invariants.inertia(), eigenvalues, axis);
        let own = tier_1.then(|| Norms::of_invariants(invariants, eigenvalues, axis)).flatten();
        [Some(rigid), own].into_iter().flatten().collect()
    }

    pub(super) fn runs(&self) -> TrialRuns<'_> {
        let Self { body, scene, situation, loads, watched, context } = self;
        TrialRuns { body, scene, situation, loads, watched, context: *context }
    }
}

/// Returns trials by bounds, up to the first set of groups that passes. If the rotation comes from a run, only models
/// that cost a multiple of nf are simulated; others cost as much as a measurement.
pub(super) fn bounded(cases: &[Case<'_>], tier_1: bool) -> Result<Vec<Trial>> {
    // The norms of the actual terms are eigenproblems of the size of the basis: compute them once for each case.
    let norms: Vec<Vec<Norms>> = cases.iter().map(|case| case.norms(tier_1)).collect();
    let mut trials = Vec::new();
    let only_w1 = TermGroups::NONE.with(TermGroup::W1);
    for kept in sets().filter(|set| *set != TermGroups::ALL) {
        // Bounds of this set of groups in every case, at every tier.
        let by_tier = cases.iter().zip(&norms).map(|(case, norms)| -> Result<Vec<Trial>> {
            let runs = case.runs();
            let TrialRuns { body, scene, situation, .. } = runs;
            let Ok(driven) = &situation.driven else { return Ok(Vec::new()) };
            let is_of_run = driven.rotation.of_run;
            let follows_run = scene.spin.is_some() && scene.run.duration.is_some() && is_of_run;
            let held = body.invariants().groups();
            let is_cheap = kept == TermGroups::NONE || kept == only_w1 && held.w1;
            if follows_run && !is_cheap {
                return Ok(Vec::new());
            }
            let run = if follows_run { runs.fine_motion(kept)? } else { None };
            let tiers = norms.iter();
            Ok(tiers.map(|norms| runs.bounded(norms, run.as_ref(), kept, PART_OF_BOUNDS)).collect())
        });
        let by_case: Vec<Vec<Trial>> = by_tier.collect::<Result<_>>()?;
        // A tier counts if all cases have it; the worst case decides.
        let tiers = by_case.iter().map(Vec::len).min().unwrap_or(0);
        for tier in 0..tiers {
            let trial = worst(by_case.iter().map(|trials| trials[tier].clone()));
            let passed = trial.passed();
            trials.push(trial);
            if passed {
                return Ok(trials);
            }
        }
    }
    Ok(trials)
}

/// Returns the trial with the largest error over its tolerance. Its errors become the largest of all trials that have
/// errors. `trials` must not be empty.
pub(super) fn worst(trials: impl Iterator<Item = Trial>) -> Trial {
    let trials: Vec<Trial> = trials.collect();
    let errors = trials.iter().filter_map(|trial| trial.errors).reduce(OutputErrors::larger_of);
    let worst = first_largest(trials, |trial| trial.worst).expect("a scene to try it in");
    Trial { errors: worst.errors.and(errors), ..worst }
}

/// Returns the trial of a model in all load cases: that of the case in which the errors take the largest part of the
/// remaining tolerances. The trial of a single scene is returned unchanged.
pub(super) fn together(trials: Vec<Trial>) -> Trial {
    let has_failed = trials.iter().any(|trial| !trial.passed());
    let by_case: Vec<f64> = trials.iter().map(|trial| trial.worst).collect();
    let several = trials.len() > 1;
    let decisive = trials.into_iter().enumerate().filter(|(_, trial)| trial.passed() != has_failed);
    let largest = first_largest(decisive, |(_, trial)| trial.worst / trial.budget);
    let (at, mut trial) = largest.expect("a load case to try it in");
    if several {
        (trial.case, trial.by_case) = (Some(at), by_case);
    }
    trial
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
    let one_fewer = trials
        .iter()
        .rfind(|trial| !trial.by_case.is_empty() && !trial.passed() && trial.modes + 1 == choice.modes.len());
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

/// Factor by which the number of modes grows from trial to trial. A smaller value finds fewer modes and takes more
/// simulations.
const GROWTH: f64 = 1.25;

/// Errors of a selected model in a variation of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct VariedSelection {
    /// Name of the variation.
    pub name: String,
    /// Name of the load case that it varies; `None` for a single scene.
    pub case: Option<String>,
    /// True if the scene file states the variation, so that the model must hold in it; false for a standard one.
    pub is_stated: bool,
    /// The selected model in the variation, measured against the whole body.
    pub chosen: Trial,
    /// The model that the scene alone would select; `None` if it is the selected one.
    pub of_scene: Option<Trial>,
    /// The groups that the scene alone would select, with all modes; `None` unless these groups fail in a variation.
    pub with_all_modes: Option<Trial>,
    /// Truncation errors of the whole body in the variation; empty if no model is at hand.
    pub reference_errors: Vec<ReferenceError>,
}

impl VariedSelection {
    /// Returns true if the selected model is within the tolerances in the variation, and the whole body is a reference
    /// there.
    pub fn holds(&self) -> bool {
        self.chosen.passed() && self.reference_errors.last().is_none_or(ReferenceError::is_reference)
    }

    /// Returns the warning about a model that does not hold; `None` if it does, or if the variation is a standard one.
    pub(super) fn warning(&self) -> Option<Diagnostic> {
        if self.holds() || !self.is_stated {
            return None;
        }
        let message = match self.reference_errors.last().filter(|own| !own.is_reference()) {
            Some(own) => format!(
                "the selection cannot be judged in this variation: the body with all its modes differs from the FE model by about {} of the tolerances (estimated)",
                own.part_of_tolerances()
            ),
            None => format!(
                "the selected modes and terms are off by {:.3} times the tolerances in this variation",
                self.chosen.worst
            ),
        };
        Some(Diagnostic::new(Code::VariationFails, message).about(format!("variation `{}`", self.name)))
    }
}

/// Variations in which a selection is judged, each with the motion of the whole body.
pub(super) struct VariedRuns<'v> {
    variations: Vec<&'v SceneVariation>,
    cases: Vec<Case<'v>>,
    references: Vec<Trace>,
    /// Truncation errors of the whole body in each variation; empty lists if none are known.
    reference_errors: Vec<&'v [ReferenceError]>,
    /// Notes about variations that cannot be simulated.
    pub diagnostics: Vec<Diagnostic>,
}

/// Returns a note that a variation judges nothing, if `error` says that its simulation stopped.
pub(crate) fn stops(error: &Error, variation: &SceneVariation) -> Option<Diagnostic> {
    let first = error.diagnostics().first()?;
    error.diagnostics().iter().all(|one| ends_a_run(one.code())).then(|| {
        let message = format!("variation `{}` judges nothing: {}", variation.name, first.message());
        Diagnostic::new(Code::VariationStops, message)
    })
}

/// Returns the body and every variation in one frame.
pub(super) fn framed_variations<'s>(
    body: &'s FlexBody,
    variations: &'s [SceneVariation],
) -> Result<Vec<FramedTests<'s>>> {
    let in_frame = |one: &'s SceneVariation| {
        FramedTests::new(body, &one.scene).map_err(|error| error.about(format!("variation `{}`", one.name)))
    };
    variations.iter().map(in_frame).collect()
}

impl<'v> VariedRuns<'v> {
    /// Simulates the whole body in every variation. `reference_errors` are its truncation errors there. Unless the scene
    /// file states the variations, one whose simulation stops is left out.
    ///
    /// # Errors
    /// The errors of [`trace`](flexbody_motion::scene::trace).
    pub(super) fn new(
        all: &'v [SceneVariation],
        cases: &LoadCases,
        framed: &'v [FramedTests<'_>],
        reference_errors: &'v [Vec<ReferenceError>],
        context: &Context<'v>,
    ) -> Result<Self> {
        let mut runs = Self {
            variations: Vec::new(),
            cases: Vec::new(),
            references: Vec::new(),
            reference_errors: Vec::new(),
            diagnostics: Vec::new(),
        };
        for (at, (tests, one)) in framed.iter().zip(all).enumerate() {
            let case = Case::new(&tests.body, &tests.scene, context)?;
            let motion = case.runs().motion(tests.body.groups());
            match motion {
                Ok((motion, _)) => runs.references.push(motion),
                Err(error) => match stops(&error, one).filter(|_| !cases.states_variations()) {
                    Some(note) => {
                        runs.diagnostics.push(note);
                        continue;
                    }
                    None => return Err(error.about(format!("variation `{}`", one.name))),
                },
            }
            runs.cases.push(case);
            runs.variations.push(one);
            runs.reference_errors.push(reference_errors.get(at).map_or(&[], Vec::as_slice));
        }
        Ok(runs)
    }

    /// Returns true if there is no variation.
    pub(super) fn is_empty(&self) -> bool {
        self.variations.is_empty()
    }

    /// Measures a model in every variation; `measures` belong to the references.
    fn measured(&self, measures: &[Measure<'_>], choice: &Choice) -> Result<Vec<Trial>> {
        let trial = |(at, (case, measure)): (usize, (&Case<'v>, &Measure<'_>))| {
            let budget = ReferenceError::left(self.reference_errors[at]);
            Ok(case.runs().measured(measure, &choice.modes, choice.groups, budget)?.0)
        };
        self.cases.iter().zip(measures).enumerate().map(trial).collect()
    }

    /// Judges `choice`. Unless the scene limits the cost, modes in the order `ranked` are added until the model is within
    /// the tolerances of every variation; before, all groups of `held` if those of `choice` are not enough even with all
    /// modes. Returns the errors in each variation.
    pub(super) fn judge(
        &self,
        choice: &mut Choice,
        ranked: &[usize],
        held: TermGroups,
        is_limited: bool,
        cases: &LoadCases,
    ) -> Result<Vec<VariedSelection>> {
        // The measures look at all nodes and instants of the references: made once for all models.
        let both = self.cases.iter().zip(&self.references);
        let measures: Vec<Measure<'_>> =
            both.map(|(case, reference)| Measure::new(case.body, case.scene, reference)).collect();
        let of_scene = self.measured(&measures, choice)?;
        let mut chosen = of_scene.clone();
        let passed = |trials: &[Trial]| trials.iter().all(Trial::passed);
        let mut count = choice.modes.len();
        let mut with_all_modes = None;
        if !is_limited && !passed(&chosen) && choice.groups != held {
            // Groups are at fault only if they fail with all modes.
            let modes = choice.modes.clone();
            choice.keep_most(ranked, ranked.len());
            let whole = self.measured(&measures, choice)?;
            choice.keep(modes);
            if !passed(&whole) {
                choice.groups = held;
                chosen = self.measured(&measures, choice)?;
                with_all_modes = Some(whole);
            }
        }
        while !is_limited && !passed(&chosen) && count < ranked.len() {
            count = ((count as f64 * GROWTH).ceil() as usize).min(ranked.len());
            choice.keep_most(ranked, count);
            chosen = self.measured(&measures, choice)?;
        }
        let is_changed = chosen != of_scene;
        let row = |(at, (chosen, before)): (usize, (Trial, Trial))| VariedSelection {
            name: self.variations[at].name.clone(),
            case: cases.case_name(self.variations[at].case).map(str::to_owned),
            is_stated: cases.states_variations(),
            chosen,
            of_scene: is_changed.then_some(before),
            with_all_modes: with_all_modes.as_ref().map(|all: &Vec<Trial>| all[at].clone()),
            reference_errors: self.reference_errors[at].to_vec(),
        };
        Ok(chosen.into_iter().zip(of_scene).enumerate().map(row).collect())
    }
}

//! Scenes in which models are tested: those of a load case, with trials by bounds in all of them.

use super::bounds::Variation;
use super::norms::Norms;
use super::shapes::FixedInterfaceModes;
use super::situation::Situation;
use super::trial::{Trial, TrialRuns};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::dynamics::BodyPoint;
use flexbody_motion::scene::{OutputErrors, Range, Scene, points_of};
use nalgebra::Vector3;

/// Part of the tolerances that dropped terms may take according to bounds. The rest is left for measured trials.
const PART_OF_BOUNDS: f64 = 0.5;

/// Largest ratio of the allowed rotation to that of the run at which measurements of the run count.
pub(super) const SLACK_OF_RANGE: f64 = 1.01;

/// Returns the sets of groups that a body may keep, cheapest first. A carried body has W2 and W3 only beside W1.
pub(crate) fn sets_in(carried: bool) -> impl Iterator<Item = TermGroups> {
    sets().filter(move |set| !carried || set.in_carried_modes() == *set)
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
pub(crate) struct Case<'c> {
    pub body: &'c FlexBody,
    pub scene: &'c Scene,
    pub situation: Situation,
    loads: Vec<BodyPoint>,
    watched: Vec<BodyPoint>,
    fixed: Option<&'c FixedInterfaceModes<'c>>,
    context: Context<'c>,
}

impl<'c> Case<'c> {
    pub(crate) fn new(body: &'c FlexBody, scene: &'c Scene, context: &Context<'c>) -> Result<Self> {
        let (loads, watched) = points_of(body, scene)?;
        let situation = Situation::new(body, scene, &loads);
        Ok(Self { body, scene, situation, loads, watched, fixed: None, context: *context })
    }

    /// Returns the case of a Craig-Bampton body whose fixed-interface modes may be left out.
    pub(super) fn with_fixed(self, fixed: Option<&'c FixedInterfaceModes<'c>>) -> Self {
        Self { fixed, ..self }
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

    pub(crate) fn runs(&self) -> TrialRuns<'_> {
        let Self { body, scene, situation, loads, watched, fixed, context } = self;
        TrialRuns { body, scene, situation, loads, watched, fixed: *fixed, context: *context }
    }
}

/// Returns trials by bounds, up to the first set of groups that passes. If the rotation comes from a run, only models
/// that cost a multiple of nf are simulated; others cost as much as a measurement.
pub(super) fn bounded(cases: &[Case<'_>], tier_1: bool) -> Result<Vec<Trial>> {
    // The norms of the actual terms are eigenproblems of the size of the basis: compute them once for each case.
    let norms: Vec<Vec<Norms>> = cases.iter().map(|case| case.norms(tier_1)).collect();
    let mut trials = Vec::new();
    // A carrier that does not rotate rules out every group by one bound.
    let at_rest = cases.iter().map(|case| case.runs().beside_resting_carrier(PART_OF_BOUNDS));
    if let Some(at_rest) = at_rest.collect::<Result<Option<Vec<Trial>>>>()? {
        trials.push(worst(at_rest.into_iter()));
        if trials[0].passed() {
            return Ok(trials);
        }
    }
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

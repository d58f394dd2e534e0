//! Enrichment of a body for a scene, until its truncation error is small compared with the tolerances.

use super::estimate::{Estimate, PART_OF_FINE, PART_OF_REFERENCE, ReferenceError};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::side_by_side;
use flexbody_model::FeModel;
use flexbody_motion::scene::{LoadCases, Scene, SceneVariation, ends_a_run};

/// Largest ratio of the truncation error to that of the previous round at which another round is made, after the first
/// responses: they may leave most of the error from inertia to the next round. A smaller value gives up earlier.
const MAX_FIRST_ERROR_RATIO: f64 = 0.9;

/// Largest such ratio after later responses. A larger value adds responses that hardly pay, whose choice rounding
/// decides: the motion of a long run magnifies it a thousandfold in every round.
const MAX_LATER_ERROR_RATIO: f64 = 0.75;

/// Largest number of enrichment rounds for an ordinary reference.
const MOST_ROUNDS: usize = 4;
/// Largest number of enrichment rounds for a reference that stands for the motion of all nodes.
const MOST_ROUNDS_OF_FINE: usize = 12;

/// Settings of an enrichment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enrichment {
    /// True if the body may be enriched. The truncation error is estimated in any case.
    pub grows: bool,
    /// True if the truncation error must be within [`PART_OF_FINE`] of the tolerances, instead of
    /// [`PART_OF_REFERENCE`].
    pub is_fine: bool,
}

impl Enrichment {
    /// Returns the part of the tolerances that the truncation error may take.
    pub fn enough(&self) -> f64 {
        if self.is_fine { PART_OF_FINE } else { PART_OF_REFERENCE }
    }

    fn most_rounds(&self) -> usize {
        match (self.grows, self.is_fine) {
            (false, _) => 0,
            (true, false) => MOST_ROUNDS,
            (true, true) => MOST_ROUNDS_OF_FINE,
        }
    }
}

/// Result of [`enrich`]: a body that is enriched for the load cases of a scene.
#[derive(Debug, Clone)]
pub struct Enriched<B> {
    /// Last result of the closure `make`.
    pub made: B,
    /// Estimated errors of the body in every round, for each load case. The last entry belongs to `made`. A list is
    /// empty if nothing can be estimated.
    pub rounds: Vec<Vec<ReferenceError>>,
}

/// Makes a body of `model` and enriches it for the load cases.
///
/// `make` receives nodal forces (N x k) and returns a body whose basis contains their static responses beside its
/// modes; the first call receives no forces. In every round the truncation error is estimated along the body's own
/// motion. If the error in a load case exceeds [`Enrichment::enough`] of the tolerances, the forces that this motion
/// leaves unbalanced are added. A load case whose error no longer decreases adds no more forces. The process ends if no
/// case asks for more or if the last round improved no case. `body` returns the body of a result of `make`.
///
/// # Errors
/// The errors of `make` and of [`trace`](flexbody_motion::scene::trace); FB225 if both scene and model state a
/// damping.
pub fn enrich<B>(
    model: &FeModel,
    cases: &LoadCases,
    enrichment: Enrichment,
    context: &Context<'_>,
    make: impl FnMut(&Mat<f64>) -> Result<B>,
    body: impl Fn(&B) -> &FlexBody,
) -> Result<Enriched<B>> {
    let refuse = |scene: &Scene| scene.requirements.refuse_damping_beside(model, &scene.name);
    cases.iter().try_for_each(refuse)?;
    enrich_from(Mat::zeros(model.rows().len(), 0), model, cases, enrichment, context, make, body)
}

/// Does the work of [`enrich`], starting from a body with the static responses to `loads` (N x k).
///
/// # Errors
/// The errors of `make` and of [`trace`](flexbody_motion::scene::trace).
pub fn enrich_from<B>(
    mut loads: Mat<f64>,
    model: &FeModel,
    cases: &LoadCases,
    enrichment: Enrichment,
    context: &Context<'_>,
    mut make: impl FnMut(&Mat<f64>) -> Result<B>,
    body: impl Fn(&B) -> &FlexBody,
) -> Result<Enriched<B>> {
    let mut made = make(&loads)?;
    let mut enrichments = vec![CaseEnrichment::default(); cases.len()];
    let mut poorer = None;
    let (enough, most_rounds) = (enrichment.enough(), enrichment.most_rounds());
    for round in 0..=most_rounds {
        context.phase("error of the reference");
        let estimate = |scene: &Scene| Estimate::new(model, body(&made), scene, enough, context);
        let estimates = cases.iter().map(estimate).collect::<Result<Vec<_>>>()?;
        if estimates.iter().all(Option::is_none) {
            break;
        }
        let paid = enrichments.iter().zip(&estimates).any(|(case, own)| case.has_reduced_error(own.as_ref()));
        if let (Some(earlier), false) = (poorer.take(), paid) {
            // A shock excites modes of every frequency: no number of responses suffices.
            made = earlier;
            break;
        }
        // Collect the forces that each case asks for.
        let mut wanted = vec![loads];
        for (case, estimate) in enrichments.iter_mut().zip(estimates) {
            wanted.extend(estimate.and_then(|estimate| case.update(estimate, enough)));
        }
        let is_done = wanted.len() == 1;
        loads = side_by_side(&wanted.iter().map(Mat::as_ref).collect::<Vec<_>>());
        if is_done || round == most_rounds {
            break;
        }
        poorer = Some(std::mem::replace(&mut made, make(&loads)?));
    }
    Ok(Enriched { made, rounds: enrichments.into_iter().map(|case| case.rounds).collect() })
}

/// Returns the result, or `otherwise` if a simulation stopped.
fn unless_stopped<T>(found: Result<T>, otherwise: T) -> Result<T> {
    match found {
        Err(error) if error.diagnostics().iter().all(|diagnostic| ends_a_run(diagnostic.code())) => {
            Ok(otherwise)
        }
        found => found,
    }
}

/// Returns the estimated truncation errors of `body`, made of `model`, in each variation of the load cases. A list is
/// empty if nothing can be estimated, or if the simulation of a standard variation stops.
///
/// # Errors
/// The errors of [`trace`](flexbody_motion::scene::trace).
pub fn varied_errors(
    model: &FeModel,
    body: &FlexBody,
    cases: &LoadCases,
    context: &Context<'_>,
) -> Result<Vec<Vec<ReferenceError>>> {
    let variations = cases.variations(model.dimension());
    if variations.iter().any(|variation| variation.scene.run.duration.is_none()) {
        return Ok(Vec::new());
    }
    let error = |one: &SceneVariation| {
        let estimate = Estimate::new(model, body, &one.scene, PART_OF_REFERENCE, context);
        let estimate = if cases.requires_variations() { estimate } else { unless_stopped(estimate, None) };
        let estimate = estimate.map_err(|error| error.about(format!("variation `{}`", one.name)))?;
        Ok(estimate.map(|own| own.error).into_iter().collect())
    };
    variations.iter().map(error).collect()
}

/// State of a load case during enrichment.
#[derive(Debug, Clone, Default)]
struct CaseEnrichment {
    rounds: Vec<ReferenceError>,
    /// True if responses to the motion of this case were added to the last body.
    asked: bool,
    /// True if added responses did not reduce the error of this case enough.
    gave_up: bool,
}

impl CaseEnrichment {
    /// Returns true if the last body contains forces of this case and its error decreased by enough.
    fn has_reduced_error(&self, now: Option<&Estimate>) -> bool {
        match (self.rounds.last(), now) {
            (Some(before), Some(now)) if self.asked => !self.is_without_progress(before, &now.error),
            _ => false,
        }
    }

    fn is_without_progress(&self, before: &ReferenceError, now: &ReferenceError) -> bool {
        let most = if self.rounds.len() == 1 { MAX_FIRST_ERROR_RATIO } else { MAX_LATER_ERROR_RATIO };
        now.worst > most * before.worst
    }

    /// Records the estimated error. Returns the forces that this case asks for, if its error exceeds `enough` and
    /// enrichment still helps.
    fn update(&mut self, estimate: Estimate, enough: f64) -> Option<Mat<f64>> {
        let Estimate { error, missing } = estimate;
        self.gave_up |=
            self.asked && self.rounds.last().is_some_and(|before| self.is_without_progress(before, &error));
        self.asked = error.worst > enough && missing.ncols() > 0 && !self.gave_up;
        self.rounds.push(error);
        self.asked.then_some(missing)
    }
}

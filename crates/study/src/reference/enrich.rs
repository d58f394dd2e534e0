//! A body that is enriched for a scene until what it lacks of its model no longer counts.

use super::estimate::{Estimate, PART_OF_FINE, PART_OF_REFERENCE, ReferenceError};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::side_by_side;
use flexbody_model::FeModel;
use flexbody_motion::scene::{LoadCases, Scene};

/// What a body still lacks, relative to the one before it, for its modes to be worth their cost: the first
/// responses may leave most of what has inertia to those of the next round.
const WORTH: f64 = 0.9;

/// How often a body is enriched at the most, and one that has to come close to the model.
const MOST_ROUNDS: usize = 4;
const MOST_ROUNDS_OF_FINE: usize = 12;

/// How far a body is enriched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enrichment {
    /// Whether it can be enriched at all: what it lacks is estimated in any case.
    pub grows: bool,
    /// Whether it has to come within [`PART_OF_FINE`] of the tolerances instead of [`PART_OF_REFERENCE`].
    pub is_fine: bool,
}

impl Enrichment {
    /// Part of the tolerances that the body may lack of its model.
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

/// A body that is enriched for the load cases of a scene.
#[derive(Debug, Clone)]
pub struct Enriched<B> {
    /// What the body was last made as.
    pub made: B,
    /// For each load case the estimated errors of every body on the way, the last one that of `made`; empty where
    /// nothing can be estimated.
    pub rounds: Vec<Vec<ReferenceError>>,
}

/// Makes a body of `model` with `make`, which gets nodal forces (N x k) whose static responses the body shall
/// have beside its modes, none at first. As long as the body lacks more than [`Enrichment::enough`] of the
/// tolerances of a load case in its own motion, the forces that its motion leaves unbalanced at the nodes join
/// these, while that pays in one of them. A case in which it no longer pays asks for nothing more.
///
/// # Errors
/// Those of `make` and of [`trace`](flexbody_motion::scene::trace).
pub fn enrich<B>(
    model: &FeModel,
    cases: &LoadCases,
    enrichment: Enrichment,
    context: &Context<'_>,
    mut make: impl FnMut(&Mat<f64>) -> Result<B>,
    body: impl Fn(&B) -> &FlexBody,
) -> Result<Enriched<B>> {
    let refuse = |scene: &Scene| scene.requirements.refuse_damping_beside(model, &scene.name);
    cases.iter().try_for_each(refuse)?;
    let mut loads = Mat::zeros(model.rows().len(), 0);
    let mut made = make(&loads)?;
    let mut asking = vec![Asking::default(); cases.len()];
    let mut poorer = None;
    let (enough, most_rounds) = (enrichment.enough(), enrichment.most_rounds());
    for round in 0..=most_rounds {
        context.phase("what the body lacks of the model");
        let estimate = |scene: &Scene| Estimate::new(model, body(&made), scene, enough, context);
        let estimates = cases.iter().map(estimate).collect::<Result<Vec<_>>>()?;
        if estimates.iter().all(Option::is_none) {
            break;
        }
        let paid = asking.iter().zip(&estimates).any(|(case, own)| case.was_paid(own.as_ref()));
        if let (Some(earlier), false) = (poorer.take(), paid) {
            // A shock excites modes without end: no number of responses follows it.
            made = earlier;
            break;
        }
        let mut wanted = vec![loads];
        for (case, estimate) in asking.iter_mut().zip(estimates) {
            wanted.extend(estimate.and_then(|estimate| case.hear(estimate, enough)));
        }
        let is_done = wanted.len() == 1;
        loads = side_by_side(&wanted.iter().map(Mat::as_ref).collect::<Vec<_>>());
        if is_done || round == most_rounds {
            break;
        }
        poorer = Some(std::mem::replace(&mut made, make(&loads)?));
    }
    Ok(Enriched { made, rounds: asking.into_iter().map(|case| case.rounds).collect() })
}

/// What a load case has asked for so far.
#[derive(Debug, Clone, Default)]
struct Asking {
    rounds: Vec<ReferenceError>,
    /// Whether responses to its motion joined the last body.
    asked: bool,
    /// Whether responses to its motion did not pay.
    gave_up: bool,
}

impl Asking {
    /// Whether the last body, which has what this case asked for, lacks less than the one before it by as
    /// much as pays.
    fn was_paid(&self, now: Option<&Estimate>) -> bool {
        match (self.rounds.last(), now) {
            (Some(before), Some(now)) if self.asked => !Self::in_vain(before, &now.error),
            _ => false,
        }
    }

    fn in_vain(before: &ReferenceError, now: &ReferenceError) -> bool {
        now.worst > WORTH * before.worst
    }

    /// Notes what the body lacks, and answers the forces whose responses this case asks for where that is more
    /// than `enough`.
    fn hear(&mut self, estimate: Estimate, enough: f64) -> Option<Mat<f64>> {
        let Estimate { error, missing } = estimate;
        self.gave_up |= self.asked && self.rounds.last().is_some_and(|before| Self::in_vain(before, &error));
        self.asked = error.worst > enough && missing.ncols() > 0 && !self.gave_up;
        self.rounds.push(error);
        self.asked.then_some(missing)
    }
}

//! What one scene, or one load case of several, demands of a body.

use super::cases::{Case, PART_OF_BOUNDS, bounded, scenes};
use super::situation::Situation;
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::BodyPoint;
use flexbody_motion::scene::{PerQuantity, Scene, Stage, Tolerance, damped_once, points_of};
use std::borrow::Cow;

/// A body and a scene on their stage, and the scenes that a model is tried in: this one, and where it allows
/// faster rotation than its run has, the one that turns as fast.
pub(super) struct OnStage<'s> {
    pub body: Cow<'s, FlexBody>,
    pub scene: Cow<'s, Scene>,
    found: Vec<Diagnostic>,
    scenes: Vec<Scene>,
}

impl<'s> OnStage<'s> {
    pub(super) fn new(body: &'s FlexBody, scene: &'s Scene) -> Result<Self> {
        let Stage { body, scene, found } = Stage::new(body, scene)?;
        let (body, scene) = damped_once(body, scene)?;
        let scenes = scenes(&body, &scene)?;
        Ok(Self { body, scene, found, scenes })
    }
}

/// What a scene demands: the motion that it means, the groups that bounds leave, and what is left of its
/// tolerances.
pub(super) struct Demand<'c> {
    /// Name of the load case; `None` of a scene alone.
    pub name: Option<&'c str>,
    pub body: &'c FlexBody,
    pub scene: &'c Scene,
    pub situation: Situation,
    pub loads: Vec<BodyPoint>,
    /// What a model is tried in.
    pub cases: Vec<Case<'c>>,
    /// Warnings and notes about scene and body.
    pub found: &'c [Diagnostic],
    /// Trials by bounds.
    pub bounds: Vec<Trial>,
    /// The groups that bounds leave, where these rule out some.
    pub by_bounds: Option<TermGroups>,
    /// What the body, and those before it that were enriched, lack of the model.
    pub lacks: &'c [ReferenceError],
    /// The largest rotation of the runs and that which the scene allows, where the runs stay behind it.
    pub short_of: Option<(f64, f64)>,
}

impl<'c> Demand<'c> {
    /// Of the load case `name`; `tier_1` says whether bounds may use norms of the invariants.
    pub(super) fn new(
        stage: &'c OnStage<'_>,
        name: Option<&'c str>,
        context: &Context<'c>,
        tier_1: bool,
    ) -> Result<Self> {
        let (body, scene) = (&*stage.body, &*stage.scene);
        let (loads, _) = points_of(body, scene)?;
        let cases =
            stage.scenes.iter().map(|one| Case::new(body, one, context)).collect::<Result<Vec<_>>>()?;
        let bounds = bounded(&cases, tier_1)?;
        Ok(Self {
            name,
            body,
            scene,
            situation: Situation::new(body, scene, &loads),
            loads,
            cases,
            found: &stage.found,
            by_bounds: bounds.iter().find(|trial| trial.passed()).map(|trial| trial.kept),
            bounds,
            lacks: &[],
            short_of: None,
        })
    }

    /// The groups that the body holds and bounds leave.
    pub(super) fn groups(&self) -> TermGroups {
        let held = self.body.invariants().groups();
        self.by_bounds.map_or(held, |kept| kept.and(held))
    }

    pub(super) fn tolerance(&self) -> &'c Tolerance {
        &self.scene.requirements.tolerance
    }

    /// What the body itself and bounds leave of the tolerances.
    pub(super) fn budget(&self) -> f64 {
        let lacking = self.lacks.last().filter(|own| own.is_reference());
        let left = (1.0 - lacking.map_or(0.0, |own| own.worst)).max(0.0);
        if self.by_bounds.is_none() {
            return left;
        }
        // What is measured is relative to a motion that may be larger than that of the whole body by as much
        // as bounds allow.
        let PerQuantity { deflection, stress, reaction, .. } = self.tolerance().errors;
        (left - PART_OF_BOUNDS).max(0.0) / (1.0 + PART_OF_BOUNDS * deflection.max(stress).max(reaction))
    }

    /// What is said about this load case, where there are several.
    pub(super) fn about(&self, said: Diagnostic) -> Diagnostic {
        match self.name {
            Some(name) => said.about(format!("case `{name}`")),
            None => said,
        }
    }
}

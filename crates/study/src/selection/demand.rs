//! Demands of a scene, or of one of several load cases, on a body.

use super::cases::{Case, PART_OF_BOUNDS, bounded, scenes};
use super::situation::Situation;
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::BodyPoint;
use flexbody_motion::scene::{FramedScene, PerQuantity, Scene, Tolerance, damped_once, points_of};
use std::borrow::Cow;

/// Body and scene in one frame, with the scenes in which models are tested: this scene and, if it allows faster
/// rotation than its run has, the scene with its rotation scaled to that.
pub(super) struct FramedTests<'s> {
    pub body: Cow<'s, FlexBody>,
    pub scene: Cow<'s, Scene>,
    found: Vec<Diagnostic>,
    scenes: Vec<Scene>,
}

impl<'s> FramedTests<'s> {
    pub(super) fn new(body: &'s FlexBody, scene: &'s Scene) -> Result<Self> {
        let FramedScene { body, scene, found } = FramedScene::new(body, scene)?;
        let (body, scene) = damped_once(body, scene)?;
        let scenes = scenes(&body, &scene)?;
        Ok(Self { body, scene, found, scenes })
    }
}

/// Demand of a scene: the motion that it implies, the groups that bounds leave open, and the remaining tolerances.
pub(super) struct Demand<'c> {
    /// Name of the load case; `None` for a single scene.
    pub name: Option<&'c str>,
    pub body: &'c FlexBody,
    pub scene: &'c Scene,
    pub situation: Situation,
    pub loads: Vec<BodyPoint>,
    /// Scenes in which models are tested.
    pub cases: Vec<Case<'c>>,
    /// Warnings and notes about scene and body.
    pub found: &'c [Diagnostic],
    /// Trials by bounds.
    pub bounds: Vec<Trial>,
    /// Groups that bounds do not rule out; `None` if bounds rule out no group.
    pub by_bounds: Option<TermGroups>,
    /// Truncation errors of the body and of its versions before enrichment.
    pub reference_errors: &'c [ReferenceError],
    /// Largest angular velocity of the runs and the allowed one; `None` if the runs reach the allowed one.
    pub short_of: Option<(f64, f64)>,
}

impl<'c> Demand<'c> {
    /// Creates the demand of the load case `name`. Bounds use norms of the invariants if `tier_1` is set.
    pub(super) fn new(
        framed: &'c FramedTests<'_>,
        name: Option<&'c str>,
        context: &Context<'c>,
        tier_1: bool,
    ) -> Result<Self> {
        let (body, scene) = (&*framed.body, &*framed.scene);
        let (loads, _) = points_of(body, scene)?;
        let cases =
            framed.scenes.iter().map(|one| Case::new(body, one, context)).collect::<Result<Vec<_>>>()?;
        let bounds = bounded(&cases, tier_1)?;
        Ok(Self {
            name,
            body,
            scene,
            situation: Situation::new(body, scene, &loads),
            loads,
            cases,
            found: &framed.found,
            by_bounds: bounds.iter().find(|trial| trial.passed()).map(|trial| trial.kept),
            bounds,
            reference_errors: &[],
            short_of: None,
        })
    }

    /// Returns the groups that the body holds and that bounds do not rule out.
    pub(super) fn groups(&self) -> TermGroups {
        let held = self.body.invariants().groups();
        self.by_bounds.map_or(held, |kept| kept.and(held))
    }

    pub(super) fn tolerance(&self) -> &'c Tolerance {
        &self.scene.requirements.tolerance
    }

    /// Returns the part of the tolerances left after the truncation error of the body and the bounds.
    pub(super) fn budget(&self) -> f64 {
        let left = ReferenceError::left(self.reference_errors);
        if self.by_bounds.is_none() {
            return left;
        }
        // Measured errors are relative to a motion with groups dropped by bounds, which may be larger than that of the
        // whole body by as much as the bounds allow.
        let PerQuantity { deflection, stress, reaction, .. } = self.tolerance().errors;
        (left - PART_OF_BOUNDS).max(0.0) / (1.0 + PART_OF_BOUNDS * deflection.max(stress).max(reaction))
    }

    /// Returns the diagnostic with the name of the load case, if there are several.
    pub(super) fn about(&self, said: Diagnostic) -> Diagnostic {
        match self.name {
            Some(name) => said.about(format!("case `{name}`")),
            None => said,
        }
    }
}

//! The motion of all nodes as the reference of a study.

use super::effort::{Effort, ORDER, Way, fastest_mode};
use super::seen::Seen;
use super::staged::{Staged, refused};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, LoadKind};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{ErrorHistory, Scene, Scheme, Trace, liveliest_rate, nodal_point};

/// Tolerance of the explicit integration unless the scene has one: errors of reduced models that are smaller
/// are not told.
const TOLERANCE: f64 = 1e-8;

/// Part of the tolerances of the scene that steps which are halved may be worth before they are halved again.
const PART_OF_STEPS: f64 = 0.01;

/// Part that is a reference for others no longer without a word.
const WORTH_A_WORD: f64 = 0.1;

/// How the equations of all nodes were integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodalIntegration {
    /// Rows of the model.
    pub rows: usize,
    /// With the tolerance, or the step that was taken.
    pub scheme: Scheme,
    /// Steps taken.
    pub steps: u64,
    /// What steps of twice the length make of the motion, over the tolerances of the scene: an upper estimate
    /// of the error of the integration. `None` where the scene gives the step, as of all candidates, or the
    /// tolerance.
    pub error: Option<f64>,
}

/// The motion of all nodes of a model, in the places where those of bodies of it are to be looked at.
#[derive(Debug, Clone)]
pub struct NodalReference<'m> {
    model: &'m FeModel,
    seen: Seen,
    largest_deflection: f64,
    error: Option<f64>,
}

impl<'m> NodalReference<'m> {
    /// Refuses, before any work, what the nodal equations do not have, and more work than is allowed for the
    /// motion of `body`.
    ///
    /// # Errors
    /// FB801 for geometric stiffness; FB212 for places that the model does not have; FB604.
    pub fn refuse(model: &FeModel, body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<()> {
        let stiffened =
            body.geometric_stiffness().iter().any(|one| !matches!(one.load.kind, LoadKind::Named(_)));
        if stiffened && scene.run.terms.geometric_stiffness && scene.carried.is_none() {
            let what = "the equations of all nodes have no geometric stiffness, which the model has";
            return Err(refused(what));
        }
        for place in scene.loads.iter().map(|load| &load.at).chain(&scene.watched) {
            nodal_point(model, place)?;
        }
        let effort = Effort::new(model, scene, body.n_modes());
        // At the least the first mode counts.
        let first = body.modes().eigenvalue[0].sqrt();
        let liveliest = match scene.run.scheme {
            Scheme::Adaptive { .. } => first,
            Scheme::Conserving { .. } => fastest_mode(body),
        };
        let (_, seconds) = effort.plan(scene, scene.run.scheme, liveliest);
        effort.refuse_long(seconds, context.longest)
    }

    /// Integrates the unreduced equations of `model` in `scene` from where `motion`, that of a body of the
    /// model, starts.
    ///
    /// A scene with a method of implicit steps gets these steps. One with error control gets them from the
    /// explicit method, or where that takes long in implicit steps that are halved until they no longer
    /// change what is measured.
    ///
    /// # Errors
    /// Those of [`NodalReference::refuse`], FB801 for models without nodal equations, FB601; FB540 when the
    /// integration cannot go on.
    pub fn new(
        model: &'m FeModel,
        body: &FlexBody,
        scene: &Scene,
        motion: &Trace,
        context: &Context<'_>,
    ) -> Result<Self> {
        let effort = Effort::new(model, scene, body.n_modes());
        // Modes that count less need no steps of their own to begin with.
        let liveliest = liveliest_rate(body, scene, motion, 1.0).max(body.modes().eigenvalue[0].sqrt());
        let (way, seconds) = effort.plan(scene, motion.scheme, liveliest);
        effort.refuse_long(seconds, context.longest)?;
        let instants = match way {
            Way::Explicit => motion.time.len() as f64,
            Way::Implicit { step, .. } => effort.instants(step),
        };
        effort.refuse_large(instants, way, context.memory)?;
        let staged = Staged::new(model, body, scene, motion)?;
        let end = motion.time.last().copied().unwrap_or(0.0);
        let whole = |seen: Seen, error: Option<f64>| {
            let largest_deflection = seen.largest_deflection(model);
            Ok(Self { model, seen, largest_deflection, error })
        };
        match (way, motion.scheme) {
            (Way::Explicit, scheme) => {
                let tolerance = match scheme {
                    Scheme::Adaptive { tolerance } => tolerance.max(TOLERANCE),
                    Scheme::Conserving { .. } => TOLERANCE,
                };
                whole(staged.explicit(tolerance, &motion.time, context)?, None)
            }
            (Way::Implicit { order, step, given: true }, _) => {
                let is_allowed = |parts| effort.is_allowed(order, step, parts, context.longest);
                let in_parts = |parts| staged.implicit(order, step, parts, end, context);
                whole(divided(in_parts, is_allowed)?.0, None)
            }
            (Way::Implicit { step, .. }, _) => {
                let halving = Halving { model, staged: &staged, effort, longest: context.longest, end };
                let (seen, error) = halving.run(step, context)?;
                whole(seen, Some(error))
            }
        }
    }

    /// Where the motion is looked at.
    pub fn time(&self) -> &[f64] {
        &self.seen.trace.time
    }

    /// How it was integrated.
    pub fn integration(&self) -> NodalIntegration {
        let Trace { scheme, work, .. } = &self.seen.trace;
        NodalIntegration {
            rows: self.model.rows().len(),
            scheme: *scheme,
            steps: work.steps,
            error: self.error,
        }
    }

    /// The warning about steps that still count when no more of them were allowed.
    pub fn warning(&self) -> Option<Diagnostic> {
        let error = self.error.filter(|error| error.is_nan() || *error > WORTH_A_WORD)?;
        let message = format!(
            "steps of twice the length change the motion of all nodes by {:.0} % of the tolerances",
            100.0 * error
        );
        let help = "say --allow-long, so that the steps may be halved again, or start loads from zero";
        Some(Diagnostic::new(Code::ReferenceLacks, message).with_help(help))
    }

    /// Errors of the motion of `body`, which was looked at where this one was; `None` when it is no body of
    /// the model.
    ///
    /// # Panics
    /// When it was looked at elsewhere.
    pub fn errors(&self, body: &FlexBody, candidate: &Trace) -> Option<ErrorHistory> {
        let vectors = body.vectors_of(self.model)?;
        let own = |first: usize, count: usize| Seen::of_modes(vectors.as_ref(), candidate, first, count);
        Some(self.seen.errors(self.model, candidate, self.largest_deflection, own))
    }
}

/// Implicit steps that are halved until they no longer count.
struct Halving<'h, 'm> {
    model: &'m FeModel,
    staged: &'h Staged<'m>,
    effort: Effort,
    longest: Option<f64>,
    end: f64,
}

impl Halving<'_, '_> {
    /// The motion with the shortest steps, looked at where the first ones of length `step` end, and what
    /// twice their length changes of it over the tolerances of the scene.
    fn run(&self, step: f64, context: &Context<'_>) -> Result<(Seen, f64)> {
        let tolerance = &self.staged.scene.requirements.tolerance;
        let is_allowed = |parts| self.effort.is_allowed(ORDER, step, parts, self.longest);
        let in_parts = |parts| self.staged.implicit(ORDER, step, parts, self.end, context);
        let (mut coarse, parts) = divided(in_parts, is_allowed)?;
        let mut refinement = 2 * parts;
        loop {
            let mut fine = self.staged.implicit(ORDER, step, refinement, self.end, context)?;
            // Ends of the same steps, whose times differ by rounding.
            fine.trace.time.clone_from(&coarse.trace.time);
            let scale = fine.largest_deflection(self.model);
            let own = |first: usize, count: usize| coarse.displacements().subcols(first, count).to_owned();
            let error = fine.errors(self.model, &coarse.trace, scale, own).largest().worst(tolerance);
            if error <= PART_OF_STEPS || !is_allowed(2 * refinement) {
                return Ok((fine, error));
            }
            coarse = fine;
            refinement *= 2;
        }
    }
}

/// The motion `in_parts` of a step, as few as can be solved for and do not take longer than is allowed, and
/// how many these are.
fn divided(
    mut in_parts: impl FnMut(u32) -> Result<Seen>,
    is_allowed: impl Fn(u32) -> bool,
) -> Result<(Seen, u32)> {
    let mut parts = 1;
    loop {
        match in_parts(parts) {
            Err(error) if error.has(Code::SimulationStopped) && is_allowed(2 * parts) => parts *= 2,
            motion => return motion.map(|motion| (motion, parts)),
        }
    }
}

//! Motion of all nodes as the reference of a study.

use super::effort::{Effort, ORDER, Way, fastest_mode};
use super::nodal_trace::NodalTrace;
use super::setup::{NodalSetup, refused};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, LoadKind};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{ErrorHistory, Scene, Scheme, Trace, highest_excited_rate, nodal_point};

/// Tolerance of the explicit integration unless the scene states a larger one. Smaller errors of reduced models are not
/// reported.
const TOLERANCE: f64 = 1e-8;

/// Part of the tolerances of the scene below which the effect of halving the steps is accepted.
const MAX_STEP_ERROR: f64 = 0.01;

/// Part of the tolerances above which the integration error of the reference causes a warning.
const MAX_SILENT_STEP_ERROR: f64 = 0.1;

/// Integration of the equations of all nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodalIntegration {
    /// Number of rows of the model.
    pub rows: usize,
    /// Scheme, with the tolerance or the step that was used.
    pub scheme: Scheme,
    /// Number of steps.
    pub steps: u64,
    /// Change of the motion by steps of twice the length, over the tolerances of the scene: an upper estimate of the
    /// integration error. `None` if the scene states the step or the tolerance.
    pub error: Option<f64>,
}

/// Motion of all nodes of a model, evaluated like the motions of its bodies.
#[derive(Debug, Clone)]
pub struct NodalReference<'m> {
    model: &'m FeModel,
    seen: NodalTrace,
    largest_deflection: f64,
    error: Option<f64>,
}

impl<'m> NodalReference<'m> {
    /// Refuses, before any work, a scene that the nodal equations do not support, or whose motion of `body` needs more
    /// work than allowed.
    ///
    /// # Errors
    /// FB801 for geometric stiffness; FB212 for points that the model does not have; FB604 for too much work.
    pub fn refuse(model: &FeModel, body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<()> {
        let stiffened =
            body.geometric_stiffness().iter().any(|one| !matches!(one.load.kind, LoadKind::Named(_)));
        if stiffened && scene.run.terms.geometric_stiffness && scene.carried.is_none() {
            let what = "the model has geometric stiffness, which the equations of all nodes do not support";
            return Err(refused(what));
        }
        for place in scene.loads.iter().map(|load| &load.at).chain(&scene.watched) {
            nodal_point(model, place)?;
        }
        let effort = Effort::new(model, scene, body.n_modes());
        // The first mode counts at least.
        let first = body.modes().eigenvalue[0].sqrt();
        let highest_rate = match scene.run.scheme {
            Scheme::Adaptive { .. } => first,
            Scheme::Conserving { .. } => fastest_mode(body),
        };
        let (_, seconds) = effort.plan(scene, scene.run.scheme, highest_rate);
        effort.refuse_long(seconds, context.longest)
    }

    /// Integrates the unreduced equations of `model` in `scene`, from the initial state of `motion`, the motion of a
    /// body of the model.
    ///
    /// A scene with implicit steps is integrated with these steps. A scene with error control is integrated with the
    /// explicit method or, if this takes long, with implicit steps that are halved until the measured change is small.
    ///
    /// # Errors
    /// The errors of [`NodalReference::refuse`], FB801 for models without nodal equations, FB601 for too little memory;
    /// FB540 if the integration fails.
    pub fn new(
        model: &'m FeModel,
        body: &FlexBody,
        scene: &Scene,
        motion: &Trace,
        context: &Context<'_>,
    ) -> Result<Self> {
        let effort = Effort::new(model, scene, body.n_modes());
        // Modes of small amplitude do not need steps of their own at first.
        let highest_rate =
            highest_excited_rate(body, scene, motion, 1.0).max(body.modes().eigenvalue[0].sqrt());
        let (way, seconds) = effort.plan(scene, motion.scheme, highest_rate);
        effort.refuse_long(seconds, context.longest)?;
        let instants = match way {
            Way::Explicit => motion.time.len() as f64,
            Way::Implicit { step, .. } => effort.instants(step),
        };
        effort.refuse_large(instants, way, context.memory)?;
        let setup = NodalSetup::new(model, body, scene, motion)?;
        let end = motion.time.last().copied().unwrap_or(0.0);
        let whole = |seen: NodalTrace, error: Option<f64>| {
            let largest_deflection = seen.largest_deflection(model);
            Ok(Self { model, seen, largest_deflection, error })
        };
        match (way, motion.scheme) {
            (Way::Explicit, scheme) => {
                let tolerance = match scheme {
                    Scheme::Adaptive { tolerance } => tolerance.max(TOLERANCE),
                    Scheme::Conserving { .. } => TOLERANCE,
                };
                whole(setup.explicit(tolerance, &motion.time, context)?, None)
            }
            (Way::Implicit { order, step, given: true }, _) => {
                let is_allowed = |parts| effort.is_allowed(order, step, parts, context.longest);
                let in_parts = |parts| setup.implicit(order, step, parts, end, context);
                whole(divided(in_parts, is_allowed)?.0, None)
            }
            (Way::Implicit { step, .. }, _) => {
                let halving = Halving { model, setup: &setup, effort, longest: context.longest, end };
                let (seen, error) = halving.run(step, context)?;
                whole(seen, Some(error))
            }
        }
    }

    /// Returns the instants of the motion.
    pub fn time(&self) -> &[f64] {
        &self.seen.trace.time
    }

    /// Returns the scheme, the steps and the error of the integration.
    pub fn integration(&self) -> NodalIntegration {
        let Trace { scheme, work, .. } = &self.seen.trace;
        NodalIntegration {
            rows: self.model.rows().len(),
            scheme: *scheme,
            steps: work.steps,
            error: self.error,
        }
    }

    /// Returns a warning if the step error was still large when no further halving was allowed.
    pub fn warning(&self) -> Option<Diagnostic> {
        let error = self.error.filter(|error| error.is_nan() || *error > MAX_SILENT_STEP_ERROR)?;
        let message = format!(
            "doubling the step changes the motion of all nodes by {:.0} % of the tolerances",
            100.0 * error
        );
        let help = "add --allow-long, so that the step may be halved again, or start loads from zero";
        Some(Diagnostic::new(Code::ReferenceIncomplete, message).with_help(help))
    }

    /// Returns the errors of the motion of `body`, evaluated at the instants of this motion; `None` if the body has
    /// other rows than the model.
    ///
    /// # Panics
    /// If the motion was evaluated at other instants.
    pub fn errors(&self, body: &FlexBody, candidate: &Trace) -> Option<ErrorHistory> {
        let vectors = body.vectors_of(self.model)?;
        let own =
            |first: usize, count: usize| NodalTrace::of_modes(vectors.as_ref(), candidate, first, count);
        Some(self.seen.errors(self.model, candidate, self.largest_deflection, own))
    }
}

/// Implicit integration with steps that are halved until the change is small.
struct Halving<'h, 'm> {
    model: &'m FeModel,
    setup: &'h NodalSetup<'m>,
    effort: Effort,
    longest: Option<f64>,
    end: f64,
}

impl Halving<'_, '_> {
    /// Returns the motion with the shortest steps, at the ends of the first steps of length `step`, and its change
    /// against steps of twice the length, over the tolerances of the scene.
    fn run(&self, step: f64, context: &Context<'_>) -> Result<(NodalTrace, f64)> {
        let tolerance = &self.setup.scene.requirements.tolerance;
        let is_allowed = |parts| self.effort.is_allowed(ORDER, step, parts, self.longest);
        let in_parts = |parts| self.setup.implicit(ORDER, step, parts, self.end, context);
        let (mut coarse, parts) = divided(in_parts, is_allowed)?;
        let mut refinement = 2 * parts;
        loop {
            let mut fine = self.setup.implicit(ORDER, step, refinement, self.end, context)?;
            // The instants are equal except for rounding.
            fine.trace.time.clone_from(&coarse.trace.time);
            // Error of the coarser steps, relative to the finer ones.
            let scale = fine.largest_deflection(self.model);
            let own = |first: usize, count: usize| coarse.displacements().subcols(first, count).to_owned();
            let error = fine.errors(self.model, &coarse.trace, scale, own).largest().worst(tolerance);
            if error <= MAX_STEP_ERROR || !is_allowed(2 * refinement) {
                return Ok((fine, error));
            }
            coarse = fine;
            refinement *= 2;
        }
    }
}

/// Returns the motion with the fewest parts per step for which the implicit equations can be solved within the time
/// limit, and this number of parts. `in_parts` receives the number of parts and integrates.
fn divided(
    mut in_parts: impl FnMut(u32) -> Result<NodalTrace>,
    is_allowed: impl Fn(u32) -> bool,
) -> Result<(NodalTrace, u32)> {
    let mut parts = 1;
    loop {
        match in_parts(parts) {
            Err(error) if error.has(Code::SimulationStopped) && is_allowed(2 * parts) => parts *= 2,
            motion => return motion.map(|motion| (motion, parts)),
        }
    }
}

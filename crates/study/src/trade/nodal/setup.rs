//! Equations of all nodes of a model in a scene, prepared for integration.

use super::nodal_trace::NodalTrace;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{
    LoadAxes, NodalEquations, NodalEvaluation, NodalModes, NodalMotion, NodalPoint, ReferenceConditions,
};
use flexbody_motion::integration::{Explicit, Failure, Gauss, Method, ObserverEvent, integrate_closely};
use flexbody_motion::scene::{Axes, Driving, Load, Scene, Scheme, Trace, damped, nodal_point};

/// Residual of the implicit stages, relative to the scales of the motion: far below the errors that are reported, far
/// above rounding.
const SOLVED: f64 = 1e-11;

/// Equations of all nodes in a scene, with the modal damping of a body.
pub(super) struct NodalSetup<'a> {
    pub equations: NodalEquations<'a>,
    pub scene: &'a Scene,
    loads: Vec<(NodalPoint, &'a Load)>,
    pub watched: Vec<NodalPoint>,
    driving: Driving<'a>,
    /// Initial state.
    start: Vec<f64>,
    /// Motion of the body.
    motion: &'a Trace,
}

/// Returns the error for a scene that the nodal equations do not support.
pub(super) fn refused(what: impl std::fmt::Display) -> Error {
    let diagnostic = Diagnostic::new(Code::Usage, format!("--reference nodal: {what}"));
    diagnostic.with_help("use --reference full").into()
}

/// Returns the error for an integration of `scene` that failed.
fn stopped(scene: &Scene, failure: Failure) -> Error {
    let message = format!("the nodal reference of `{}` stopped: {failure}", scene.name);
    Diagnostic::new(Code::SimulationStopped, message).into()
}

impl<'a> NodalSetup<'a> {
    /// Prepares `model` in `scene`, both in the frame of `body`, a body of the model. The initial state is that of
    /// `motion`.
    pub(super) fn new(
        model: &'a FeModel,
        body: &FlexBody,
        scene: &'a Scene,
        motion: &'a Trace,
    ) -> Result<Self> {
        // The frame of a carried body is fixed to its carrier; that of a free body has mean axes.
        let conditions = match &scene.carried {
            Some(carried) => ReferenceConditions::AtRest(nodal_point(model, &carried.by)?),
            None => ReferenceConditions::MeanAxes,
        };
        let body = &*damped(body, scene)?;
        let equations = match &scene.requirements.damping {
            Some(_) => NodalEquations::of_damped_body(model, body, &conditions),
            None => NodalEquations::of_body(model, body, &conditions),
        };
        let equations = equations.map_err(refused)?;
        let loads = scene.loads.iter().map(|load| Ok((nodal_point(model, &load.at)?, load)));
        let watched = scene.watched.iter().map(|point| nodal_point(model, point));
        let mut setup = Self {
            loads: loads.collect::<Result<Vec<_>>>()?,
            watched: watched.collect::<Result<Vec<_>>>()?,
            driving: Driving::new(body.frame(), scene),
            start: Vec::new(),
            equations,
            scene,
            motion,
        };
        // Initial state: that of the modal motion, or the static deformation of the model.
        let modes = NodalModes::new(&setup.equations, body)
            .ok_or_else(|| refused("the matrix rows of the body and the model differ"))?;
        let mut start = modes.lift(&motion.start);
        if scene.initial.settled {
            let softest = body.modes().eigenvalue[0];
            start =
                setup.system().settled(0.0, &start, softest).map_err(|failure| stopped(scene, failure))?;
        }
        setup.start = setup.equations.state(&start).map_err(refused)?;
        Ok(setup)
    }

    /// Returns the system of equations that is integrated.
    pub(super) fn system<'s>(&'s self) -> NodalMotion<'s, impl FnMut(f64, &mut NodalEvaluation<'s>) + 's> {
        let motion = NodalMotion::new(&self.equations, |time, evaluation: &mut NodalEvaluation<'s>| {
            self.act(time, evaluation);
        });
        if self.scene.prescribes() { motion.driven(|time, axes| self.driving.at(time, axes)) } else { motion }
    }

    fn act(&self, time: f64, evaluation: &mut NodalEvaluation<'_>) {
        if let Some(gravity) = &self.scene.gravity {
            evaluation.add_gravity(gravity);
        }
        for (point, load) in &self.loads {
            let (force, torque) = load.at_time(time);
            let axes = match load.axes {
                Axes::World => LoadAxes::World,
                // The frame of the body is that of the scene.
                Axes::Model | Axes::Body => LoadAxes::Body,
            };
            evaluation.add_force_at(point, &force, axes);
            if !load.torque.is_nothing() {
                evaluation.add_torque_at(point, &torque, axes);
            }
        }
    }

    /// Integrates with the explicit method, and records the motion at `instants`.
    pub(super) fn explicit(
        &self,
        tolerance: f64,
        instants: &[f64],
        context: &Context<'_>,
    ) -> Result<NodalTrace> {
        let end = instants.last().copied().unwrap_or(0.0);
        let method = Method::Explicit(Explicit::new(self.start.len(), tolerance, end));
        let scheme = Scheme::Adaptive { tolerance };
        self.integrate(method, scheme, instants, context, |event| event == ObserverEvent::Instant)
    }

    /// Integrates to `end` by collocation of the given order, in steps of at most `step`, each divided into
    /// `refinement` parts. Records the motion at the ends of the undivided steps and at both sides of every break.
    pub(super) fn implicit(
        &self,
        order: usize,
        step: f64,
        refinement: u32,
        end: f64,
        context: &Context<'_>,
    ) -> Result<NodalTrace> {
        let method = Gauss::new(self.start.len(), order).solved_to(SOLVED).refined(refinement);
        let scheme = Scheme::Conserving { order, step: Some(step / f64::from(refinement)) };
        let mut taken = 0;
        self.integrate(Method::Gauss { method, step }, scheme, &[0.0, end], context, |event| match event {
            ObserverEvent::Start => {
                taken = 0;
                true
            }
            ObserverEvent::End => {
                taken += 1;
                taken % refinement == 0
            }
            ObserverEvent::Instant | ObserverEvent::Within => false,
        })
    }

    fn integrate(
        &self,
        mut method: Method,
        scheme: Scheme,
        instants: &[f64],
        context: &Context<'_>,
        mut counts: impl FnMut(ObserverEvent) -> bool,
    ) -> Result<NodalTrace> {
        let end = instants.last().copied().unwrap_or(0.0);
        let (mut motion, mut state, mut seen) =
            (self.system(), self.start.clone(), NodalTrace::new(self.equations.n_rows(), self.motion));
        let (mut observer, mut workspace) = (self.system(), vec![0.0; self.equations.n_rows()]);
        let look = |event: ObserverEvent, time: f64, state: &[f64]| {
            if counts(event) {
                seen.see(time, state, &mut observer, &self.watched, &mut workspace)?;
            }
            context.fraction(time / end);
            Ok::<(), Failure>(())
        };
        integrate_closely(&mut method, &mut motion, &mut state, instants, &self.scene.breaks(), 1, look)
            .map_err(|failure| stopped(self.scene, failure))?;
        seen.finish(scheme, method.work());
        Ok(seen)
    }
}

//! Motion of all nodes in the form in which errors are measured against it, and the equations of all nodes of a model in
//! a scene, prepared for its integration.

use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::{combine, larger, multiply, not_negative};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{
    LoadAxes, NodalEquations, NodalEvaluation, NodalModes, NodalMotion, NodalPoint, ReferenceConditions,
};
use flexbody_motion::integration::{
    Explicit, Failure, Gauss, Method, ObserverEvent, Work, integrate_closely,
};
use flexbody_motion::scene::{
    Axes, DeformationDifference, Driving, ErrorHistory, Extremes, Load, Peak, Scene, Scheme, Trace, damped,
    nodal_point,
};

/// Number of instants whose errors are computed together.
const BLOCK: usize = 256;

/// Displacements of all rows, with the data of a [`Trace`].
#[derive(Debug, Clone)]
pub(super) struct NodalTrace {
    /// Displacements (N x instants), in rows and axes of the model.
    displacements: Vec<f64>,
    rows: usize,
    /// Trace without modal coordinates.
    pub trace: Trace,
    spin: Peak,
    internal: Peak,
    /// Largest energy, with that of translation.
    total: f64,
}

impl NodalTrace {
    /// Creates an empty motion of `rows` rows with the layout of `motion`, the trace of a body.
    pub(super) fn new(rows: usize, motion: &Trace) -> Self {
        let trace = Trace {
            scheme: motion.scheme,
            time: Vec::new(),
            attitude: Vec::new(),
            q: Vec::new(),
            elastic: Vec::new(),
            reactions: motion.reactions.as_ref().map(|_| Vec::new()),
            deflections: vec![Vec::new(); motion.deflections.len()],
            recovered: None,
            start: motion.start.clone(),
            extremes: Extremes::default(),
            work: Work::default(),
            size: motion.size,
            resolution: motion.resolution,
        };
        Self {
            displacements: Vec::new(),
            rows,
            trace,
            spin: Peak::default(),
            internal: Peak::default(),
            total: 0.0,
        }
    }

    /// Records the state at a time, and the displacements of the `watched` points. `workspace` is scratch space of N
    /// entries.
    pub(super) fn see<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)>(
        &mut self,
        time: f64,
        state: &[f64],
        motion: &mut NodalMotion<'e, L>,
        watched: &[NodalPoint],
        workspace: &mut [f64],
    ) -> std::result::Result<(), Failure> {
        let trace = &mut self.trace;
        // Only reactions need the accelerations.
        match &mut trace.reactions {
            Some(reactions) => {
                motion.accelerations(time, state, workspace)?;
                reactions.push(motion.evaluation().driving_force());
            }
            None => drop(motion.evaluate(time, state)?),
        }
        let u = motion.loaded_displacements();
        self.displacements.extend_from_slice(u);
        let u = &self.displacements[self.displacements.len() - self.rows..];
        let evaluation = motion.evaluation();
        let to_frame = evaluation.equations().frame().axes.transpose();
        for (path, point) in trace.deflections.iter_mut().zip(watched) {
            path.push(to_frame * point.displacement(u));
        }
        let now = evaluation.configuration();
        // Internal energy: total energy without that of the centre of mass, P^2 / (2m).
        let flight = 0.5 * evaluation.momenta().0.norm_squared() / trace.size.0;
        let energy = evaluation.equations().elastic_energy(u);
        self.spin.see(time, now.omega.norm());
        let total = evaluation.kinetic_energy() + energy;
        self.internal.see(time, (total - flight).max(0.0).sqrt());
        self.total = self.total.max(total);
        trace.time.push(time);
        trace.attitude.push(now.attitude);
        trace.elastic.push(energy);
        Ok(())
    }

    /// Completes the motion with its scheme, work and extremes.
    pub(super) fn finish(&mut self, scheme: Scheme, work: Work) {
        let internal = self.internal.value.powi(2);
        let extremes = Extremes { spin: self.spin.value, internal, total: self.total, ..Extremes::default() };
        self.trace = Trace { scheme, work, extremes, ..self.trace.clone() };
    }

    /// Returns the displacements (N x instants).
    pub(super) fn displacements(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.displacements, self.rows, self.trace.time.len())
    }

    /// Returns the largest displacement of any node at any instant.
    pub(super) fn largest_deflection(&self, model: &FeModel) -> f64 {
        let lengths = self.displacements.chunks_exact(self.rows).map(|u| longest(model, u));
        Peak::of(&self.trace.time, lengths).value
    }

    /// Returns the errors of `candidate` relative to this motion. `of` receives the first instant and a count, and
    /// returns the displacements of the candidate there (N x count); `recovery` has the errors of recoveries, if any has a
    /// limit.
    pub(super) fn errors(
        &self,
        model: &FeModel,
        candidate: &Trace,
        largest_deflection: f64,
        recovery: Option<Vec<f64>>,
        of: impl Fn(usize, usize) -> Mat<f64>,
    ) -> ErrorHistory {
        let (mut energy, mut deflection) = (Vec::new(), Vec::new());
        let instants = self.trace.time.len();
        for first in (0..instants).step_by(BLOCK) {
            let count = BLOCK.min(instants - first);
            // Elastic energy and largest displacement of the difference.
            let difference = of(first, count) - self.displacements().subcols(first, count);
            let mut forces = Mat::zeros(difference.nrows(), count);
            multiply(model.stiffness(), 1, difference.as_ref(), forces.as_mut());
            let product = |i: usize| {
                let pairs = difference.col_as_slice(i).iter().zip(forces.col_as_slice(i));
                0.5 * pairs.map(|(u, f)| u * f).sum::<f64>()
            };
            energy.extend((0..count).map(|i| not_negative(product(i))));
            deflection.extend((0..count).map(|i| longest(model, difference.col_as_slice(i))));
        }
        ErrorHistory::new(
            &self.trace,
            candidate,
            DeformationDifference { energy, deflection, largest_deflection, recovery },
        )
    }

    /// Returns the displacements of a body with the shapes `vectors` (N x nf), at `count` instants of a motion from
    /// `first` on.
    pub(super) fn of_modes(vectors: MatRef<'_, f64>, motion: &Trace, first: usize, count: usize) -> Mat<f64> {
        let q = Mat::from_fn(vectors.ncols(), count, |j, i| motion.q[first + i][j]);
        combine(vectors, q.as_ref())
    }
}

/// Returns the largest displacement of a node.
fn longest(model: &FeModel, u: &[f64]) -> f64 {
    let d = model.dimension();
    let squares = u[..d * model.nodes().len()].chunks_exact(d).map(|u| u.iter().map(|u| u * u).sum::<f64>());
    squares.fold(0.0, larger).sqrt()
}

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
            ObserverEvent::Instant | ObserverEvent::Within | ObserverEvent::Between => false,
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

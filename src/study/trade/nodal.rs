//! The motion of all nodes as the reference.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::base::memory::refuse_beyond;
use crate::base::progress::{Event, Watch};
use crate::body::flex_body::FlexBody;
use crate::model::FeModel;
use crate::motion::dynamics::{
    EulerParameters, NodalEquations, NodalError, NodalEvaluation, NodalModes, NodalMotion,
    ReferenceConditions,
};
use crate::motion::scene::{Apart, Axes, ErrorHistory, Extremes, Load, Peak, Point, Scene, Scheme, Trace};
use crate::numerics::integration::{Explicit, Failure, Method, Work, integrate};
use crate::numerics::linalg::{combine, multiply, not_negative};
use faer::Mat;
use nalgebra::Vector3;

/// Tolerance of the integration unless the scene has one: errors of reduced models that are smaller are not told.
const TOLERANCE: f64 = 1e-8;

/// Multiplications with K that are affordable: some minutes.
const AFFORDABLE: f64 = 3e11;

/// Instants whose errors are computed together.
const BLOCK: usize = 256;

/// Evaluations per shortest period that an explicit method of order 8 takes at the least.
const EVALUATIONS: f64 = 15.0;

/// The motion of all nodes of a model, in the places where that of a body of it was looked at.
#[derive(Debug, Clone)]
pub struct NodalReference<'m> {
    model: &'m FeModel,
    trace: Trace,
    /// Displacements (N x instants), rows and axes of the model.
    displacements: Mat<f64>,
    largest_deflection: f64,
}

impl<'m> NodalReference<'m> {
    /// Refuses, before any work, what the nodal equations do not have, and more work than is affordable; loads with the nodes that they act
    /// at.
    ///
    /// # Errors
    /// FB801.
    pub fn refuse<'s>(model: &FeModel, scene: &'s Scene) -> Result<Vec<(usize, &'s Load)>> {
        if scene.spin.is_some() {
            return Err(refused("the nodal equations know no prescribed spin"));
        }
        if scene.carried.is_some() {
            return Err(refused("the nodal equations carry no interface"));
        }
        if scene.requirements.damping.is_some() && model.damping().is_none() {
            return Err(refused(NodalError::DampingOfModes));
        }
        let mut loads = Vec::new();
        for load in &scene.loads {
            let Point::Node(number) = &load.at else {
                return Err(refused(format!("loads act at nodes, not at {}", load.at)));
            };
            let node = model.nodes().ids.iter().position(|id| id == number);
            loads.push((node.ok_or_else(|| refused(format!("the model has no {}", load.at)))?, load));
        }
        let periods = scene.run.duration.unwrap_or(0.0) * fastest(model) / std::f64::consts::TAU;
        let work = EVALUATIONS * periods * entries_of(model);
        if work.is_nan() || work > AFFORDABLE {
            return Err(refused(format!(
                "some {work:.0e} multiplications with K to follow the fastest motion of {} rows, {AFFORDABLE:.0e} are affordable",
                model.rows().len()
            )));
        }
        Ok(loads)
    }

    /// Integrates the unreduced equations of `model` in `scene` from where `motion`, that of a body of the model, starts.
    ///
    /// # Errors
    /// Those of [`NodalReference::refuse`], and FB801 for models without nodal equations; FB540 when the integration cannot go on.
    pub fn new(
        model: &'m FeModel,
        body: &FlexBody,
        scene: &Scene,
        motion: &Trace,
        memory: Option<u64>,
        watch: Watch<'_>,
    ) -> Result<Self> {
        let loads = Self::refuse(model, scene)?;
        refuse_too_much(model, motion, memory)?;
        let equations =
            NodalEquations::new(model, body.frame(), &ReferenceConditions::MeanAxes).map_err(refused)?;
        let modes = NodalModes::new(&equations, body).ok_or_else(|| refused("the body has other rows"))?;
        let start = equations.state(&modes.lift(&motion.start)).map_err(refused)?;
        let tolerance = match scene.run.scheme {
            Scheme::Adaptive { tolerance } => tolerance.max(TOLERANCE),
            Scheme::Conserving { .. } => TOLERANCE,
        };
        let mut observed = Observed::new(&equations, motion);
        let acting = Acting { scene, loads };
        let work = integrated(&equations, start, &acting, tolerance, &mut observed, watch)?;
        let Observed { displacements, attitude, elastic, spin, internal, .. } = observed;
        let own = Shapes::new(model, body, &displacements);
        let trace = Trace {
            scheme: Scheme::Adaptive { tolerance },
            attitude,
            elastic,
            q: Vec::new(),
            reactions: None,
            deflections: scene.watched.iter().map(|point| own.path(body, point)).collect(),
            work,
            extremes: Extremes { spin: spin.value, internal: internal.value.powi(2), ..Extremes::default() },
            ..motion.clone()
        };
        let lengths =
            (0..displacements.ncols()).map(|i| model.longest_displacement(displacements.col_as_slice(i)));
        let largest_deflection = Peak::of(&trace.time, lengths).value;
        Ok(Self { model, trace, displacements, largest_deflection })
    }

    /// Errors of the motion of `body`; `None` when it is no body of the model.
    pub fn errors(&self, body: &FlexBody, candidate: &Trace) -> Option<ErrorHistory> {
        let vectors = body.vectors_of(self.model)?;
        let (mut energy, mut deflection) = (Vec::new(), Vec::new());
        for first in (0..candidate.q.len()).step_by(BLOCK) {
            let count = BLOCK.min(candidate.q.len() - first);
            let q = Mat::from_fn(body.n_modes(), count, |j, i| candidate.q[first + i][j]);
            let own = combine(vectors.as_ref(), q.as_ref());
            let difference = own - self.displacements.as_ref().subcols(first, count);
            let mut forces = Mat::zeros(difference.nrows(), count);
            multiply(self.model.stiffness(), 1, difference.as_ref(), forces.as_mut());
            let product = |i: usize| {
                let pairs = difference.col_as_slice(i).iter().zip(forces.col_as_slice(i));
                0.5 * pairs.map(|(u, f)| u * f).sum::<f64>()
            };
            energy.extend((0..count).map(|i| not_negative(product(i))));
            deflection
                .extend((0..count).map(|i| self.model.longest_displacement(difference.col_as_slice(i))));
        }
        let apart = Apart { energy, deflection, largest_deflection: self.largest_deflection };
        Some(ErrorHistory::new(&self.trace, candidate, &apart))
    }
}

/// Gravity and loads of a scene on the nodes.
struct Acting<'s> {
    scene: &'s Scene,
    /// Loads with the nodes that they act at.
    loads: Vec<(usize, &'s Load)>,
}

impl Acting<'_> {
    fn add(&self, time: f64, evaluation: &mut NodalEvaluation<'_>) {
        if let Some(gravity) = &self.scene.gravity {
            evaluation.add_gravity(gravity);
        }
        for (node, load) in &self.loads {
            let in_world = |v: Vector3<f64>| match load.axes {
                Axes::World => v,
                Axes::Model | Axes::Body => evaluation.axes() * v,
            };
            let (force, torque) = load.at_time(time);
            let (force, torque) = (in_world(force), in_world(torque));
            evaluation.add_force(*node, &force);
            if !load.torque.is_nothing() {
                evaluation.add_torque(*node, &torque);
            }
        }
    }
}

/// Displacements, attitude and energies of the motion, at the instants of another one.
struct Observed<'e> {
    evaluation: NodalEvaluation<'e>,
    motion: &'e Trace,
    displacements: Mat<f64>,
    attitude: Vec<EulerParameters>,
    elastic: Vec<f64>,
    spin: Peak,
    internal: Peak,
}

impl<'e> Observed<'e> {
    fn new(equations: &'e NodalEquations<'e>, motion: &'e Trace) -> Self {
        Self {
            evaluation: NodalEvaluation::new(equations),
            motion,
            displacements: Mat::zeros(equations.n_rows(), motion.time.len()),
            attitude: Vec::new(),
            elastic: Vec::new(),
            spin: Peak::default(),
            internal: Peak::default(),
        }
    }

    fn see(&mut self, time: f64, state: &[f64]) -> std::result::Result<(), Failure> {
        let evaluation = &mut self.evaluation;
        evaluation.set(state)?;
        let column = self.displacements.col_as_slice_mut(self.attitude.len());
        column.copy_from_slice(evaluation.displacements());
        let now = evaluation.configuration();
        let flight = 0.5 * evaluation.momenta().0.norm_squared() / self.motion.size.0;
        let energy = evaluation.elastic_energy();
        self.spin.see(time, now.omega.norm());
        self.internal.see(time, (evaluation.kinetic_energy() - flight + energy).max(0.0).sqrt());
        self.attitude.push(now.attitude);
        self.elastic.push(energy);
        Ok(())
    }
}

/// Integrates from `state` through the instants that are observed.
fn integrated(
    equations: &NodalEquations<'_>,
    mut state: Vec<f64>,
    acting: &Acting<'_>,
    tolerance: f64,
    observed: &mut Observed<'_>,
    watch: Watch<'_>,
) -> Result<Work> {
    let instants = &observed.motion.time;
    let end = instants.last().copied().unwrap_or(0.0);
    let act = |time: f64, evaluation: &mut NodalEvaluation<'_>| acting.add(time, evaluation);
    let mut method = Method::Explicit(Explicit::new(state.len(), tolerance, end));
    let mut system = NodalMotion::new(equations, act);
    let breaks = acting.scene.breaks();
    let observe = |time: f64, state: &[f64]| {
        observed.see(time, state)?;
        watch(Event::Fraction(time / end));
        Ok::<(), Failure>(())
    };
    integrate(&mut method, &mut system, &mut state, instants, &breaks, observe).map_err(|failure| {
        let message = format!("the nodal reference of `{}` stopped: {failure}", acting.scene.name);
        Error::from(Diagnostic::new(Code::SimulationStopped, message))
    })?;
    Ok(method.work())
}

/// The displacements of all rows are kept wherever the motion is looked at.
fn refuse_too_much(model: &FeModel, motion: &Trace, memory: Option<u64>) -> Result<()> {
    const DOUBLE: f64 = 8.0;
    let needed = DOUBLE * motion.time.len() as f64 * (model.rows().len() + 3 * model.nodes().len()) as f64;
    let help = "take --reference full, or simulate a shorter `duration`";
    refuse_beyond(memory, needed, "the motion of all nodes", help)
}

/// The error for what the nodal equations do not have.
fn refused(what: impl std::fmt::Display) -> Error {
    let diagnostic = Diagnostic::new(Code::Usage, format!("--reference nodal: {what}"));
    diagnostic.with_help("take --reference full").into()
}

/// An estimate of the largest circular frequency: sqrt(3 max K_ii / M_ii), an element of three dimensions with consistent mass.
fn fastest(model: &FeModel) -> f64 {
    let mass = model.pencil().mass_diagonal();
    let ratios = model.stiffness().diagonal().into_iter().zip(mass).filter(|(_, m)| *m > 0.0);
    (3.0 * ratios.map(|(k, m)| k / m).fold(0.0, f64::max)).sqrt()
}

/// Number of entries of K.
fn entries_of(model: &FeModel) -> f64 {
    (0..model.rows().len()).map(|row| model.stiffness().row(row).0.len()).sum::<usize>() as f64
}

/// Displacements and rotations of the nodes in body axes, as modes have them: a column for every instant.
struct Shapes {
    shape: Mat<f64>,
    rotation: Option<Mat<f64>>,
}

impl Shapes {
    fn new(model: &FeModel, body: &FlexBody, u: &Mat<f64>) -> Self {
        let (rows, d, n) = (model.rows(), model.dimension(), model.nodes().len());
        let axes = &body.frame().axes;
        let mut shape = Mat::zeros(3 * n, u.ncols());
        let mut rotation = Mat::zeros(3 * n, u.ncols());
        let add = |to: &mut Mat<f64>, node: usize, axis: usize, row: usize| {
            for i in 0..u.ncols() {
                (0..3).for_each(|k| to[(3 * node + k, i)] += axes[(axis, k)] * u[(row, i)]);
            }
        };
        for row in 0..d * n {
            add(&mut shape, row / d, row % d, row);
        }
        for (at, &(node, axis)) in rows.rotations().iter().enumerate() {
            add(&mut rotation, node as usize, axis.into(), rows.displacements() + at);
        }
        Self { shape, rotation: (!rows.rotations().is_empty()).then_some(rotation) }
    }

    /// Deflections of a watched point.
    fn path(&self, body: &FlexBody, point: &Point) -> Vec<Vector3<f64>> {
        let at = |a: &Mat<f64>, first: usize, i: usize| Vector3::from_fn(|k, _| a[(first + k, i)]);
        let path = |a: &Mat<f64>, first: usize| (0..a.ncols()).map(|i| at(a, first, i)).collect();
        match point {
            Point::Node(number) => {
                let node = body.nodes().ids.iter().position(|id| id == number);
                node.map_or_else(Vec::new, |node| path(&self.shape, 3 * node))
            }
            Point::Interface(name) => {
                let interface = body.interfaces().iter().find(|interface| interface.name == *name);
                let rotation = self.rotation.as_ref().map(Mat::as_ref);
                let rows = interface
                    .and_then(|own| own.rows(body.nodes(), self.shape.as_ref(), rotation, body.dimension()));
                rows.map_or_else(Vec::new, |rows| path(&rows.translation, 0))
            }
        }
    }
}

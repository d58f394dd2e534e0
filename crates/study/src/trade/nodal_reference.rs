//! Motion of all nodes as the reference of a study, and the estimate of its time and memory before it is computed.

use super::nodal_trace::{NodalSetup, NodalTrace, refused};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::memory::refuse_beyond;
use flexbody_body::convert::recovered_rows;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::Analysis;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, ModelRecovery, RecoveryOperator};
use flexbody_motion::scene::{
    ErrorHistory, RecoveryMeasure, Scene, Scheme, Trace, fastest_history, highest_excited_rate, nodal_point,
};
use std::f64::consts::TAU;

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
    recoveries: Option<NodalRecoveries<'m>>,
    error: Option<f64>,
}

/// Recoveries with a limit, from the displacements of all nodes.
#[derive(Debug, Clone)]
struct NodalRecoveries<'m> {
    model: &'m FeModel,
    measure: RecoveryMeasure,
    /// Recoveries of the model and their values of the undeformed body.
    asked: Vec<(&'m ModelRecovery, Vec<f64>)>,
}

/// Number of instants whose rows are computed together.
const BLOCK: usize = 64;

impl<'m> NodalRecoveries<'m> {
    /// Creates the recoveries that have limits in `scene`, for a reference `motion` of `body`; `None` without limits.
    ///
    /// # Errors
    /// FB801 for a recovery that is known for some shapes only.
    fn new(model: &'m FeModel, body: &FlexBody, scene: &Scene, motion: &Trace) -> Result<Option<Self>> {
        let Some(measure) = RecoveryMeasure::new(body, scene, motion.recovered.as_ref()) else {
            return Ok(None);
        };
        let one = |name: &str| {
            let known = model.recoveries().iter().find(|recovery| recovery.name == name);
            let of_shapes =
                |recovery: &&ModelRecovery| !matches!(recovery.operator, RecoveryOperator::Shapes { .. });
            let asked = known.filter(of_shapes).ok_or_else(|| {
                refused(format!("recovery `{name}` is not known for the displacements of all nodes"))
            })?;
            let offset = body
                .recoveries()
                .iter()
                .find(|recovery| recovery.name == name)
                .map(|recovery| recovery.offset.clone());
            Ok((asked, offset.unwrap_or_default()))
        };
        let asked = measure.names().map(one).collect::<Result<Vec<_>>>()?;
        Ok(Some(Self { model, measure, asked }))
    }

    /// Returns the errors of `candidate` relative to the limits, at the instants of the `displacements` of all nodes.
    fn errors(&self, displacements: MatRef<'_, f64>, candidate: &Trace) -> Vec<f64> {
        let instants = displacements.ncols();
        let Some(traced) = &candidate.recovered else { return vec![f64::INFINITY; instants] };
        let mut errors = Vec::with_capacity(instants);
        for first in (0..instants).step_by(BLOCK) {
            let block = first..instants.min(first + BLOCK);
            let u = displacements.subcols(first, block.len()).to_owned();
            let difference = |(at, (asked, offset)): (usize, &(&ModelRecovery, Vec<f64>))| {
                let whole = recovered_rows(self.model, asked, &u).expect("rows of all nodes");
                let own = self.measure.rows_of(at, traced, block.clone());
                Mat::from_fn(own.nrows(), own.ncols(), |i, j| own[(i, j)] - offset[i] - whole[(i, j)])
            };
            let rows: Vec<Mat<f64>> = self.asked.iter().enumerate().map(difference).collect();
            errors.extend(self.measure.of_rows(&rows));
        }
        errors
    }

    /// Returns the errors relative to the limits between two motions of all nodes.
    fn between(&self, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Vec<f64> {
        let mut errors = Vec::with_capacity(a.ncols());
        for first in (0..a.ncols()).step_by(BLOCK) {
            let count = BLOCK.min(a.ncols() - first);
            let difference = a.subcols(first, count) - b.subcols(first, count);
            let rows = |(asked, _): &(&ModelRecovery, Vec<f64>)| {
                recovered_rows(self.model, asked, &difference).expect("rows of all nodes")
            };
            errors.extend(self.measure.of_rows(&self.asked.iter().map(rows).collect::<Vec<_>>()));
        }
        errors
    }
}

impl<'m> NodalReference<'m> {
    /// Refuses, before any work, a scene that the nodal equations do not support, or whose motion of `body` needs more
    /// work than allowed.
    ///
    /// # Errors
    /// FB801 for geometric stiffness; FB212 for points that the model does not have; FB604 for too much work.
    pub fn refuse(model: &FeModel, body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<()> {
        let is_stiffened = match &scene.carried {
            Some(carried) => !body.carried(&carried.carrier())?.geometric_stiffness().is_empty(),
            None => !body.geometric_stiffness().is_empty(),
        };
        if is_stiffened && scene.run.terms.geometric_stiffness {
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
        let recoveries = NodalRecoveries::new(model, body, scene, motion)?;
        let end = motion.time.last().copied().unwrap_or(0.0);
        let whole = |seen: NodalTrace, error: Option<f64>| {
            let largest_deflection = seen.largest_deflection(model);
            Ok(Self { model, seen, largest_deflection, recoveries: recoveries.clone(), error })
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
                let (longest, recoveries) = (context.longest, recoveries.as_ref());
                let halving = Halving { model, setup: &setup, effort, longest, end, recoveries };
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
        let recovery = self.recoveries.as_ref().map(|all| all.errors(self.seen.displacements(), candidate));
        Some(self.seen.errors(self.model, candidate, self.largest_deflection, recovery, own))
    }
}

/// Implicit integration with steps that are halved until the change is small.
struct Halving<'h, 'm> {
    model: &'m FeModel,
    setup: &'h NodalSetup<'m>,
    effort: Effort,
    longest: Option<f64>,
    end: f64,
    recoveries: Option<&'h NodalRecoveries<'m>>,
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
            let recovery =
                self.recoveries.map(|all| all.between(coarse.displacements(), fine.displacements()));
            let errors = fine.errors(self.model, &coarse.trace, scale, recovery, own);
            let error = errors.largest().worst(tolerance);
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

/// Seconds per multiplication with an entry of a sparse matrix or factor.
const PER_ENTRY: f64 = 1.5e-9;
/// Seconds per floating-point operation of a factorisation.
const PER_FLOP: f64 = 1.0e-9;

/// Number of passes over the rows in an evaluation, besides the products.
const PASSES: f64 = 60.0;

/// Number of solves with the factor of M in an evaluation if rotations carry mass: 7 to 14 where nodes turn by 0.03, 8
/// to 22 where they turn by 0.1 (frames of beams, a folded shell, a rigid region).
const TURNED_SOLVES: f64 = 15.0;

/// Smallest number of evaluations per shortest period of an explicit method of order 8.
const EVALUATIONS: f64 = 15.0;

/// Number of iterations of an implicit step.
const ITERATIONS: f64 = 5.0;

/// Duration of a complex solve, relative to a real one.
const COMPLEX: f64 = 3.0;

/// Duration of an explicit integration, in seconds, up to which it is preferred even if an implicit one is cheaper,
/// since its step error is controlled.
const MAX_EXPLICIT_SECONDS: f64 = 30.0;

/// Angle (rad) of the fastest relevant motion per step in the first implicit integration.
const FIRST_ANGLE: f64 = 1.5;

/// Order of implicit steps that the scene does not prescribe.
const ORDER: usize = 6;

/// Largest number of parts that a step is divided into.
const MAX_PARTS: u32 = 1024;

/// Number of steps of the implicit integrations relative to the first one, at least: the first plus one with half the
/// step, 1 + 2.
const MIN_STEP_RUNS: f64 = 3.0;

/// Properties of a model that determine the work.
#[derive(Debug, Clone, Copy)]
struct Effort {
    rows: f64,
    /// Seconds of an evaluation, of a solve with a real factor of the size of K, and of its factorisation.
    evaluation: f64,
    solve: f64,
    factorisation: f64,
    /// Number of entries of that factor.
    entries: f64,
    /// Estimated largest circular frequency.
    fastest: f64,
    duration: f64,
    /// Number of stretches between breaks.
    pieces: f64,
}

/// Method of integration.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Explicit method of order 8 with error control.
    Explicit,
    /// Implicit steps, `given` by the scene or halved until the change is small.
    Implicit { order: usize, step: f64, given: bool },
}

impl Effort {
    /// Estimates the work of `model` in `scene`, with `modes` damped modes.
    fn new(model: &FeModel, scene: &Scene, modes: usize) -> Self {
        let (pencil, rows) = (model.pencil(), model.rows().len() as f64);
        let analysis = Analysis::new(&pencil);
        let (entries, flops) = analysis.map_or((f64::INFINITY, f64::INFINITY), |analysis| {
            (analysis.factor_len() as f64, analysis.flops())
        });
        let block = pencil.block() as f64;
        let stiffness = pencil.stiffness().as_csc().nnz() as f64;
        // Multiplications with K, both triangles of a factor of M (of which one component is stored), and passes over
        // the rows.
        let (solves, of_directors) = match model.director_mass() {
            None => (1.0, 0.0),
            Some(mass) => (TURNED_SOLVES, PASSES * mass.rows() as f64),
        };
        let evaluation = stiffness
            + (2.0 * entries / block + of_directors) * solves
            + (PASSES + 2.0 * modes as f64) * rows;
        Self {
            rows,
            evaluation: PER_ENTRY * evaluation,
            solve: PER_ENTRY * 2.0 * entries,
            factorisation: PER_FLOP * flops,
            entries,
            fastest: fastest(model),
            duration: scene.run.duration.unwrap_or(0.0),
            pieces: 1.0 + scene.breaks().len() as f64,
        }
    }

    /// Returns the seconds of the explicit method.
    fn explicit(&self) -> f64 {
        EVALUATIONS * self.duration * self.fastest / TAU * self.evaluation
    }

    /// Returns the seconds of implicit integration with steps of length `step`, multiplied by `runs`.
    fn implicit(&self, order: usize, step: f64, runs: f64) -> f64 {
        let (stages, solves) = match order {
            2 => (1.0, 1.0),
            4 => (2.0, COMPLEX),
            _ => (3.0, 1.0 + COMPLEX),
        };
        let steps = (self.duration / step).max(1.0) * runs;
        let one = ITERATIONS * (stages * self.evaluation + solves * self.solve);
        steps * one + self.pieces * (1.0 + COMPLEX) * self.factorisation
    }

    /// Returns true if implicit steps may be divided into `parts` parts within the time limit.
    fn is_allowed(&self, order: usize, step: f64, parts: u32, longest: Option<f64>) -> bool {
        let seconds = self.implicit(order, step, f64::from(parts));
        parts <= MAX_PARTS && longest.is_none_or(|longest| seconds <= longest)
    }

    /// Chooses the method of integration for a scene with `scheme`. `highest_rate` is the largest circular frequency that
    /// counts. Also returns the estimated seconds.
    fn plan(&self, scene: &Scene, scheme: Scheme, highest_rate: f64) -> (Way, f64) {
        match scheme {
            // Implicit steps solve for the stiff part of a body in mean axes only.
            _ if scene.carried.is_some() => (Way::Explicit, self.explicit()),
            Scheme::Conserving { order, step } => {
                let step = step.unwrap_or(TAU / (20.0 * highest_rate)).min(self.duration);
                (Way::Implicit { order, step, given: true }, self.implicit(order, step, 1.0))
            }
            Scheme::Adaptive { .. } => {
                let for_loads = 1.0 / (20.0 * fastest_history(scene, self.duration));
                let step = (FIRST_ANGLE / highest_rate).min(for_loads).min(self.duration);
                let (explicit, implicit) = (self.explicit(), self.implicit(ORDER, step, MIN_STEP_RUNS));
                if explicit <= MAX_EXPLICIT_SECONDS.max(implicit) {
                    (Way::Explicit, explicit)
                } else {
                    (Way::Implicit { order: ORDER, step, given: false }, implicit)
                }
            }
        }
    }

    /// Refuses work that takes longer than `longest` seconds.
    ///
    /// # Errors
    /// FB604 if the estimate exceeds the limit.
    fn refuse_long(&self, seconds: f64, longest: Option<f64>) -> Result<()> {
        let Some(longest) = longest.filter(|longest| seconds.is_nan() || seconds > *longest) else {
            return Ok(());
        };
        let message = format!(
            "--reference nodal: the motion of {} rows over a time of {:.3e} needs at least about {seconds:.1e} s ({:.1e} entries in a factor), {longest:.0} s are allowed",
            self.rows, self.duration, self.entries
        );
        let help = "use --reference fine, a shorter `duration` or method = \"conserving\" with a longer `step`, or add --allow-long";
        Err(Diagnostic::new(Code::WorkLong, message).with_help(help).into())
    }

    /// Refuses work that does not fit into `memory`: the displacements of all rows at the `instants` of the motions,
    /// and the factors of implicit steps.
    ///
    /// # Errors
    /// FB601 if the estimate exceeds the memory.
    fn refuse_large(&self, instants: f64, way: Way, memory: Option<u64>) -> Result<()> {
        const DOUBLE: f64 = 8.0;
        /// Bytes per entry of a real and a complex factor with their indices.
        const FACTORS: f64 = 12.0 + 20.0;
        let (runs, factors) = match way {
            Way::Explicit => (1.0, 0.0),
            Way::Implicit { given: true, .. } => (1.0, FACTORS * self.entries),
            Way::Implicit { .. } => (2.0, FACTORS * self.entries),
        };
        let needed = DOUBLE * runs * instants * self.rows + factors;
        let help = "use --reference fine, or simulate a shorter `duration`";
        refuse_beyond(memory, needed, "the motion of all nodes", help)
    }

    /// Returns the number of instants at which implicit steps are evaluated.
    fn instants(&self, step: f64) -> f64 {
        self.duration / step + 2.0 * self.pieces
    }
}

/// Returns the largest circular frequency of the modes of `body`.
fn fastest_mode(body: &FlexBody) -> f64 {
    body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt()
}

/// Returns an estimate of the largest circular frequency: sqrt(3 max K_ii / M_ii), as for a solid element with
/// consistent mass.
fn fastest(model: &FeModel) -> f64 {
    let mass = model.pencil().mass_diagonal();
    let ratios = model.stiffness().diagonal().into_iter().zip(mass).filter(|(_, m)| *m > 0.0);
    (3.0 * ratios.map(|(k, m)| k / m).fold(0.0, f64::max)).sqrt()
}

//! Trials of models with fewer terms or modes: by bounds, and by integration.

use super::bounds::{Driven, ErrorBound, Variation};
use super::dropped_terms::{DroppedTerms, torques_of_w3};
use super::norms::Norms;
use super::shapes::{FixedInterfaceModes, Pool, PoolShapes};
use super::situation::{PointRows, Situation};
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Subset, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::largest;
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Terms};
use flexbody_motion::scene::{
    ErrorHistory, LEAST_REACTION, Load, Measure, OtherModes, OutputErrors, Recording, RecoveryMeasure,
    Resolution, Scene, Spin, StressError, Trace, ends_a_run, reaction_errors, simulate, trace, trace_at,
};
use nalgebra::{DMatrix, Vector3};
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Number of instants per shortest period at which bounds evaluate a motion.
const INSTANTS_PER_PERIOD: f64 = 20.0;

/// Largest number of instants at which bounds evaluate a motion.
const MAX_INSTANTS: f64 = 6e4;

/// Part of the stress tolerance above which a mode takes part in a motion.
const MIN_MODE_SHARE: f64 = 0.01;

/// Smallest number of instants at which bounds evaluate a motion, and number of samples for the largest rate of a spin.
const LEAST_INSTANTS: usize = 500;

/// Returns the mass of a body, and its radius of gyration about the centre of mass.
fn size_of(body: &FlexBody) -> (f64, f64) {
    let invariants = body.invariants();
    let mass = invariants.mass();
    let about_origin = 0.5 * invariants.inertia().trace() / mass;
    let about_centre = about_origin - (invariants.first_moment() / mass).norm_squared();
    (mass, if about_centre > 0.0 { about_centre } else { about_origin }.sqrt())
}

/// Model with fewer terms or modes, and its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Groups of the model.
    pub kept: TermGroups,
    /// Pool from which its modes were picked.
    pub pool: Pool,
    /// Number of modes of the model.
    pub modes: usize,
    /// Multiplications of an evaluation of its equations.
    pub multiplications: usize,
    /// Tier. 0 and 1: guaranteed bounds; 2: a measured motion.
    pub tier: u8,
    /// Errors or their bounds; `None` if there is no bound or the integration failed.
    pub errors: Option<OutputErrors>,
    /// Part of the tolerances that the model may use: 1, or the rest after other decisions.
    pub budget: f64,
    /// Largest error over its tolerance.
    pub worst: f64,
    /// Reason why there are no errors; empty if there are errors.
    pub remark: String,
    /// Index (from 0) of the load case of the errors, where they take the largest part of the remaining tolerances;
    /// `None` for a single scene.
    pub case: Option<usize>,
    /// Largest error over its tolerance in each load case; empty if only one was tested.
    pub by_case: Vec<f64>,
}

impl Trial {
    /// Returns true if the errors are within the allowed part of the tolerances.
    pub fn passed(&self) -> bool {
        self.worst <= self.budget
    }
}

/// Body and scene of the trials, both on their [`FramedScene`](flexbody_motion::scene::FramedScene).
pub struct TrialRuns<'a> {
    /// Body, with the damping of the scene.
    pub body: &'a FlexBody,
    /// Scene.
    pub scene: &'a Scene,
    /// Sizes of motion that the scene implies for the body.
    pub situation: &'a Situation,
    /// Points of the loads.
    pub loads: &'a [BodyPoint],
    /// Watched points.
    pub watched: &'a [BodyPoint],
    /// Fixed-interface modes of a Craig-Bampton body that may be left out; `None` for another body.
    pub fixed: Option<&'a FixedInterfaceModes<'a>>,
    /// Limits of time and memory for recordings.
    pub context: Context<'a>,
}

impl TrialRuns<'_> {
    /// Simulates the motion of the body with the groups `kept`, as a continuous trace.
    ///
    /// # Errors
    /// The errors of [`trace`].
    pub fn motion(&self, kept: TermGroups) -> Result<(Trace, Vec<Diagnostic>)> {
        let mut scene = self.scene.clone();
        scene.run.terms = self.terms(kept);
        trace(self.body, &scene, &self.context)
    }

    /// Measures the error of the missing stress stiffness of the spin in `own`, the motion with the groups `kept`.
    ///
    /// # Errors
    /// The errors of [`StressError::of_trace`].
    pub fn stress_error(&self, kept: TermGroups, own: &Trace) -> Result<Option<StressError>> {
        let mut scene = self.scene.clone();
        scene.run.terms = self.terms(kept);
        StressError::of_trace(self.body, &scene, own, &self.context)
    }

    /// Returns the terms of a model with the groups `kept`: with geometric stiffness unless the scene switches it off.
    fn terms(&self, kept: TermGroups) -> Terms {
        Terms { geometric_stiffness: self.scene.run.terms.geometric_stiffness, ..Terms::ALL }.held(kept)
    }

    /// Simulates the body with the groups `kept` at evenly spaced instants. The spacing follows the fastest mode, the
    /// loads and the spin; if this needs too many instants, only the modes that take part are followed. Returns `None`
    /// if even these need too many.
    ///
    /// # Errors
    /// The errors of [`simulate`].
    pub fn fine_motion(&self, kept: TermGroups) -> Result<Option<Recording>> {
        let mut scene = self.scene.clone();
        let duration = self.situation.duration.value;
        let wanted = |rate: f64| (duration * rate / TAU * INSTANTS_PER_PERIOD).ceil();
        let followed = wanted(self.fastest(f64::INFINITY)).min(MAX_INSTANTS);
        // Loads and spin must be followed whether or not modes take part.
        if followed.is_nan() || wanted(self.fastest(0.0)) > MAX_INSTANTS {
            return Ok(None);
        }
        scene.run.outputs = (followed as usize).max(LEAST_INSTANTS);
        scene.run.terms = self.terms(kept);
        let (motion, _) = simulate(self.body, &scene, &self.context)?;
        let is_followed = wanted(self.highest_excited_rate(&motion)) <= followed.max(LEAST_INSTANTS as f64);
        Ok(is_followed.then_some(motion))
    }

    /// Returns the largest circular frequency of the modes that take part in a motion. A mode takes part if its root of
    /// the elastic energy, relative to the largest, exceeds a part of the stress tolerance.
    fn highest_excited_rate(&self, motion: &Recording) -> f64 {
        let roots: Vec<f64> = self.body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
        let energies = || roots.iter().zip(&motion.extremes.amplitudes).map(|(root, q)| root * q.abs());
        let least = MIN_MODE_SHARE
            * self.scene.requirements.tolerance.of_deformation()
            * energies().fold(0.0, f64::max);
        let excited = roots.iter().zip(energies()).filter(|(_, energy)| *energy > least);
        excited.map(|(root, _)| *root).fold(0.0, f64::max)
    }

    /// Returns the largest circular frequency in the motion of the body, with its modes up to `highest`. The time
    /// between two breaks of a spin counts as half a period.
    fn fastest(&self, highest: f64) -> f64 {
        let duration = self.situation.duration.value;
        let roots = self.body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt());
        let modes = roots.filter(|root| *root <= highest).fold(0.0, f64::max);
        let histories = self.scene.acting().chain(self.scene.driving());
        // Frequencies of loads and driving motion.
        let tones = histories.map(|history| TAU * history.frequency_until(duration));
        // A smooth history may have half an oscillation between two rows.
        let rows = self.scene.driving().filter_map(|history| Some(0.5 * TAU / history.spacing()?));
        // Half a period between two breaks of the spin.
        let mut breaks = self.scene.rotation().map_or(Vec::new(), |velocity| velocity.breaks());
        breaks.retain(|&time| 0.0 < time && time < duration);
        let ends = [0.0].into_iter().chain(breaks).chain([duration]);
        let ends: Vec<f64> = ends.collect();
        let pieces = ends.windows(2).map(|ends| 0.5 * TAU / (ends[1] - ends[0]));
        tones.chain(rows).chain(pieces).fold(modes, f64::max) + self.situation.spin.value
    }

    /// Measures a model with the modes `modes` and the groups `kept` against the reference motion of `measure`. Returns
    /// the trial and the history of its errors.
    ///
    /// # Errors
    /// The errors of [`simulate`] except those that end a run (such as FB540 and FB550), which become the remark of the
    /// trial.
    pub fn measured(
        &self,
        measure: &Measure<'_>,
        modes: &[usize],
        kept: TermGroups,
        budget: f64,
    ) -> Result<(Trial, Option<ErrorHistory>)> {
        self.measured_of(Pool::Modes, measure, modes, kept, budget)
    }

    /// Does the work of [`TrialRuns::measured`] for the `shapes` of a pool.
    ///
    /// # Errors
    /// The errors of [`TrialRuns::measured`].
    pub(super) fn measured_of(
        &self,
        pool: Pool,
        measure: &Measure<'_>,
        shapes: &[usize],
        kept: TermGroups,
        budget: f64,
    ) -> Result<(Trial, Option<ErrorHistory>)> {
        // The static columns of recoveries hold what dropped groups leave out, so that they belong to the groups too.
        let held = measure.body().invariants().groups();
        let groups = if measure.recoveries().is_some() { held.and(kept) } else { held };
        let (body, shared) = self.body_of(pool, measure.body(), shapes, groups)?;
        let is_some_of_modes = shared.is_none() && shapes.len() < self.number_of(pool);
        let mut scene = if is_some_of_modes { self.scene.of_modes(shapes) } else { self.scene.clone() };
        scene.run.terms = self.terms(kept);
        // Use the steps of the reference, so that the errors come from the model alone.
        scene.run.scheme = measure.trace().scheme;
        let history = match trace_at(&body, &scene, &measure.trace().time, &self.context) {
            Ok(trace) => match &shared {
                None if is_some_of_modes => Ok(measure.of_subset(&trace, shapes)),
                None => Ok(measure.of_subset(&trace, &(0..body.n_modes()).collect::<Vec<_>>())),
                Some(shared) => match OtherModes::new(&body, measure.body(), shared.as_ref()) {
                    Some(others) => Ok(measure.of_other(&trace, &others)),
                    None => Err("the modes cannot be compared with those of the whole body".to_owned()),
                },
            },
            Err(error) if error.diagnostics().iter().all(|d| ends_a_run(d.code())) => {
                Err(error.first_error().message().to_owned())
            }
            Err(error) => return Err(error),
        };
        let errors = history.as_ref().ok().map(ErrorHistory::largest);
        let trial = Trial {
            kept,
            pool,
            modes: body.n_modes(),
            multiplications: multiplications(&body, kept),
            tier: 2,
            errors,
            budget,
            worst: errors.map_or(f64::INFINITY, |errors| errors.worst(&self.scene.requirements.tolerance)),
            remark: history.as_ref().err().cloned().unwrap_or_default(),
            case: None,
            by_case: Vec::new(),
        };
        Ok((trial, history.ok()))
    }

    /// Returns the shapes of a pool.
    pub(super) fn shapes(&self, pool: Pool) -> PoolShapes<'_> {
        PoolShapes::new(pool, self.body, self.fixed)
    }

    /// Returns the number of shapes of a pool.
    pub(super) fn number_of(&self, pool: Pool) -> usize {
        self.shapes(pool).eigenvalues().len()
    }

    /// Returns the body with `shapes` of a pool and the `groups`, of the `whole` body in the frame of the scene, and the stiffness
    /// that couples its modes to those of the whole body; `None` for some of its modes.
    fn body_of<'w>(
        &self,
        pool: Pool,
        whole: &'w FlexBody,
        shapes: &[usize],
        groups: TermGroups,
    ) -> Result<(Cow<'w, FlexBody>, Option<Mat<f64>>)> {
        let is_all = shapes.len() == self.number_of(pool);
        if is_all && groups == whole.invariants().groups() {
            return Ok((Cow::Borrowed(whole), None));
        }
        let all_modes = Subset { groups, ..Subset::default() };
        match (pool, self.fixed) {
            (Pool::FixedInterface, Some(fixed)) if !is_all => {
                let (body, shared) = fixed.body(shapes)?;
                Ok((Cow::Owned(body.subset(&all_modes)?), Some(shared)))
            }
            (Pool::Modes, _) if !is_all => {
                let subset = Subset { modes: Some(shapes.to_vec()), ..all_modes };
                Ok((Cow::Owned(whole.clone().subset(&subset)?), None))
            }
            _ => Ok((Cow::Owned(whole.clone().subset(&all_modes)?), None)),
        }
    }

    /// Returns the trial by bounds of a model with the groups `kept`. With its motion `run`, the dropped terms are
    /// evaluated along this motion; without, at the largest motion that loads and rotation allow.
    pub fn bounded(&self, norms: &Norms, run: Option<&Recording>, kept: TermGroups, budget: f64) -> Trial {
        let mut trial = self.without_errors(kept, norms.tier, budget);
        match self.bounds(norms, run, kept) {
            Ok(errors) => {
                trial.worst = errors.worst(&self.scene.requirements.tolerance);
                trial.errors = Some(errors);
            }
            Err(reason) => trial.remark = reason,
        }
        trial
    }

    /// Returns the trial without any group, by bounds, of a body whose carrier does not rotate. `None` in another scene, in one
    /// with limits of recoveries, for a mass that does not commute with rotations, and if the motion needs too many instants.
    ///
    /// Without rotation W1 and W2 act on nothing. W3 changes the torque of the reaction alone, so that the motion of the modes
    /// is that of the whole body (theory section 7).
    ///
    /// # Errors
    /// The errors of [`simulate`].
    pub(super) fn beside_resting_carrier(&self, budget: f64) -> Result<Option<Trial>> {
        let Self { body, scene, situation, .. } = *self;
        let rests = situation.spin.value == 0.0 && situation.acceleration.value == 0.0;
        let is_solid = body.invariants().general().is_none();
        if scene.carried.is_none() || !rests || !is_solid || !scene.requirements.recoveries.is_empty() {
            return Ok(None);
        }
        let Some(run) = self.fine_motion(TermGroups::NONE)? else { return Ok(None) };
        let Some(own) = &run.reactions else { return Ok(None) };
        let torques = torques_of_w3(body, scene, &run);
        let with = |((force, torque), more): (&(Vector3<f64>, Vector3<f64>), f64)| {
            (*force, torque + Vector3::x() * more)
        };
        let whole: Vec<_> = own.iter().zip(torques).map(with).collect();
        let errors = reaction_errors(&run.time, [own, &whole], size_of(body), &run.extremes);
        // The torque of the whole body is at least that of the run without the bound.
        let largest = errors.map_or(0.0, largest);
        let reaction = if largest < 1.0 { largest / (1.0 - largest) } else { f64::INFINITY };
        let errors =
            OutputErrors { reaction: Some(reaction), recovery: None, ..OutputErrors::all(Some(0.0)) };
        let worst = errors.worst(&scene.requirements.tolerance);
        Ok(Some(Trial { errors: Some(errors), worst, ..self.without_errors(TermGroups::NONE, 0, budget) }))
    }

    /// Returns a trial of the whole body with the groups `kept`, without errors.
    fn without_errors(&self, kept: TermGroups, tier: u8, budget: f64) -> Trial {
        Trial {
            kept,
            pool: Pool::Modes,
            modes: self.body.n_modes(),
            multiplications: multiplications(self.body, kept),
            tier,
            errors: None,
            budget,
            worst: f64::INFINITY,
            remark: String::new(),
            case: None,
            by_case: Vec::new(),
        }
    }

    fn bounds(
        &self,
        norms: &Norms,
        run: Option<&Recording>,
        kept: TermGroups,
    ) -> std::result::Result<OutputErrors, String> {
        let driven = self.situation.driven.as_ref().map_err(String::clone)?;
        let dropped = kept.complement();
        let softened = || "the spin may make the stiffness of some motion zero or negative".to_owned();
        let mut first_order = None;
        // Load of the dropped terms on the error, along the run or at the largest possible motion.
        let (own, residual, defect) = match run {
            Some(run) => {
                let terms = DroppedTerms::new(self.body, self.scene, run, kept, norms);
                first_order = terms.first_order;
                (terms.amplitude, vec![terms.load], terms.defect)
            }
            None => {
                let own = driven.amplitude(kept, norms).ok_or_else(softened)?;
                let residual = driven.residual(dropped, norms, &own);
                (own, residual, driven.torque_defect(dropped, norms, &own))
            }
        };
        // Bound of the error; the first-order response, where known, is often closer.
        let mut error = driven.error(norms, &residual).ok_or_else(softened)?;
        if let Some(mut first) = first_order {
            first.leave_torques(&driven.turned, driven.rotation.duration);
            let closer = first.with(&driven.error(norms, &[first.rest]).ok_or_else(softened)?);
            if closer.energy < error.energy {
                error = closer;
            }
        }
        let levers = self.lever_torques(driven) * error.energy;
        let torque = driven.torque_error(norms, &own, &error, &defect) + levers;
        Ok(self.relative_errors(driven, run, &error, torque))
    }

    /// Returns the torques of the loads for |Lambda^(1/2) e| = 1, from the deformation of their lever arms.
    fn lever_torques(&self, driven: &Driven) -> f64 {
        let lever = |(load, point): (&Load, &BodyPoint)| {
            let largest = Variation::of_vector(&load.force, driven.rotation.duration).largest;
            largest * self.reach_of(&PointRows::of_lever(point))
        };
        self.scene.loads.iter().zip(self.loads).map(lever).sum::<f64>()
    }

    /// Returns errors relative to the certain part of the whole motion, or to the resolution. `torque` is the bound of
    /// the torque error.
    fn relative_errors(
        &self,
        driven: &Driven,
        run: Option<&Recording>,
        error: &ErrorBound,
        torque: f64,
    ) -> OutputErrors {
        let least = Resolution::new(self.body, self.scene.requirements.tolerance.least_deflection);
        let relative = |error: f64, size: &dyn Fn(&Recording) -> f64, least: f64| {
            error / (run.map_or(0.0, size) - error).max(least)
        };
        let paths = |run: &Recording| run.extremes.watched.iter().map(|peak| peak.value).fold(0.0, f64::max);
        let energies = |run: &Recording| run.extremes.elastic.sqrt();
        let torques = |run: &Recording| {
            run.reactions.iter().flatten().map(|(_, torque)| torque.norm()).fold(0.0, f64::max)
        };
        let least_torque = self.least_torque(driven.rotation.duration);
        OutputErrors {
            attitude: Some(0.0),
            deflection: Some(relative(self.reach() * error.energy, &paths, least.deflection)),
            stress: Some(relative(error.energy / 2f64.sqrt(), &energies, least.root_energy)),
            reaction: self.scene.spin.is_some().then(|| relative(torque, &torques, least_torque)),
            recovery: RecoveryMeasure::of_recording(
                self.body,
                self.scene,
                run.and_then(|run| run.recovered.as_ref()),
            )
            .map(|measure| measure.bound(error.energy)),
        }
    }

    /// Returns the smallest torque of a prescribed spin that counts.
    fn least_torque(&self, duration: f64) -> f64 {
        // Use the inertia with the radius of gyration of recordings: for a plane body, about its normal.
        let inertia = self.body.invariants().inertia();
        let inertia = 0.5 * if self.body.dimension() == 2 { inertia[(2, 2)] } else { inertia.trace() };
        let rate = |spin: &Spin| {
            let even = (0..=LEAST_INSTANTS).map(|i| duration * (i as f64 / LEAST_INSTANTS as f64));
            even.map(|time| spin.velocity.at(time).0.norm()).fold(0.0, f64::max)
        };
        LEAST_REACTION * inertia * self.scene.spin.as_ref().map_or(0.0, rate).powi(2)
    }

    /// Returns the largest deflection of a watched point, or of any node if none is watched, for |Lambda^(1/2) q| = 1.
    fn reach(&self) -> f64 {
        let mut reach = 0.0f64;
        self.each_watched(|rows| reach = reach.max(self.reach_of(&rows)));
        reach
    }

    fn reach_of(&self, rows: &DMatrix<f64>) -> f64 {
        let eigenvalues = &self.body.modes().eigenvalue;
        PointRows::norm(&PointRows::weighted(rows, |j| 1.0 / eigenvalues[j].sqrt()))
    }

    /// Calls `hear` with Psi of every watched point, or of every node if none is watched.
    fn each_watched(&self, mut hear: impl FnMut(DMatrix<f64>)) {
        let rows = PointRows::new(self.body);
        match self.watched {
            [] => (0..self.body.n_nodes()).for_each(|node| hear(rows.of_node(node))),
            points => points.iter().for_each(|point| hear(rows.of(point))),
        }
    }

    /// Returns the contribution of every shape of a pool to a motion of the body.
    pub(super) fn shares(&self, pool: Pool, trace: &Trace) -> Vec<ModeShare> {
        let shapes = self.shapes(pool);
        let (eigenvalues, amplitudes) = (shapes.eigenvalues(), shapes.largest_amplitudes(trace));
        // Largest displacement of each shape, then its shares of deflection and stress.
        let mut longest = vec![0.0f64; eigenvalues.len()];
        self.each_watched(|rows| {
            for (longest, column) in longest.iter_mut().zip(shapes.rows(rows).column_iter()) {
                *longest = longest.max(column.norm());
            }
        });
        let extremes = &trace.extremes;
        let energy = extremes.elastic.sqrt();
        let deflection = if extremes.watched.is_empty() {
            extremes.deflection.value * self.body.extent()
        } else {
            extremes.watched.iter().map(|peak| peak.value).fold(0.0, f64::max)
        };
        // Fixed-interface modes are ranked without the recoveries, whose contributions are those of modes.
        let recovery = RecoveryMeasure::new(self.body, self.scene, trace.recovered.as_ref());
        let recovery = recovery.filter(|_| pool == Pool::Modes).zip(trace.recovered.as_ref());
        let recovery = recovery.map(|(measure, recovered)| {
            measure.contributions(&extremes.amplitudes, &recovered.dynamic_amplitudes(self.body))
        });
        let share = |j: usize| {
            let amplitude = amplitudes[j];
            let moved = longest[j] * amplitude;
            let root_energy = (0.5 * eigenvalues[j]).sqrt() * amplitude;
            ModeShare {
                amplitude,
                deflection: moved / deflection.max(trace.resolution.deflection),
                stress: root_energy / energy.max(trace.resolution.root_energy),
                recovery: recovery.as_ref().map(|all| all[j]),
                kept: true,
            }
        };
        (0..eigenvalues.len()).map(share).collect()
    }
}

/// Contribution of a mode to the motion of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShare {
    /// Largest |q|.
    pub amplitude: f64,
    /// Largest deflection of a watched point (or of any node if none is watched) by this mode alone, relative to the
    /// largest of all modes together.
    pub deflection: f64,
    /// Root of its largest elastic energy, relative to the largest of all modes together.
    pub stress: f64,
    /// Largest contribution to a recovery over its limit, without the part that static columns hold; `None` if no
    /// recovery has a limit.
    pub recovery: Option<f64>,
    /// True if the mode is kept.
    pub kept: bool,
}

/// Returns the multiplications of an evaluation of the equations of `body` with `groups`.
pub(super) fn multiplications(body: &FlexBody, groups: TermGroups) -> usize {
    EquationsOfMotion::new(body, Terms::ALL.held(groups)).multiplications()
}

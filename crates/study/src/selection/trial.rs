//! Models with fewer terms or modes, tried: by bounds, and by integration.

use super::bounds::{Driven, ErrorBound};
use super::dropped_terms::DroppedTerms;
use super::norms::Norms;
use super::rows::PointRows;
use super::situation::Situation;
use super::variation::Variation;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Terms};
use flexbody_motion::scene::{
    ErrorHistory, LEAST_REACTION, Load, Measure, OutputErrors, Recording, Resolution, Scene, Spin, Trace,
    ends_a_run, simulate, trace, trace_at,
};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Instants per shortest period at which bounds look at a motion.
const INSTANTS_PER_PERIOD: f64 = 20.0;

/// Instants at which they look at it at the most.
const MOST_INSTANTS: f64 = 6e4;

/// Part of the tolerance of the stress from which a mode takes part in a motion.
const TAKES_PART: f64 = 0.01;

/// Instants that bounds look at a motion where nothing in it is fast, and places where the largest rate of a
/// spin is looked for.
const LEAST_INSTANTS: usize = 500;

/// A model with fewer terms or modes and the error that it makes.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Groups that it has.
    pub kept: TermGroups,
    /// Number of modes that it has.
    pub modes: usize,
    /// Multiplications of an evaluation of its equations.
    pub multiplications: usize,
    /// 0 and 1: guaranteed bounds; 2: a measured motion.
    pub tier: u8,
    /// Its errors, or bounds of them; none where there is no bound or the integration failed.
    pub errors: Option<OutputErrors>,
    /// What remains of the tolerances for it: 1, or what other decisions leave.
    pub budget: f64,
    /// Largest error over its tolerance.
    pub worst: f64,
    /// Why there are no errors; empty where there are.
    pub remark: String,
    /// Of several load cases the one (from 0) that the errors are of: where they take the largest part of
    /// what is left of the tolerances.
    pub case: Option<usize>,
    /// Largest error over its tolerance in each load case, where it was tried in several.
    pub by_case: Vec<f64>,
}

impl Trial {
    /// Whether the errors are within what the tolerances leave.
    pub fn passed(&self) -> bool {
        self.worst <= self.budget
    }
}

/// A body and a scene that trials are made with, both on their [`Stage`](flexbody_motion::scene::Stage).
pub struct TrialRuns<'a> {
    /// The body, with the damping of the scene.
    pub body: &'a FlexBody,
    /// The scene.
    pub scene: &'a Scene,
    /// The sizes of motion that the scene means for the body.
    pub situation: &'a Situation,
    /// Where its loads act.
    pub loads: &'a [BodyPoint],
    /// Watched points.
    pub watched: &'a [BodyPoint],
    /// The limits of recordings.
    pub context: Context<'a>,
}

impl TrialRuns<'_> {
    /// The continuous motion of the body with the groups `kept`.
    ///
    /// # Errors
    /// As [`trace`].
    pub fn motion(&self, kept: TermGroups) -> Result<(Trace, Vec<Diagnostic>)> {
        let mut scene = self.scene.clone();
        scene.run.terms = Terms::ALL.held(kept);
        trace(self.body, &scene, &self.context)
    }

    /// The motion of the body with the groups `kept`, at even instants that follow its fastest mode, the
    /// loads and the spin; or, where these would be too many, the fastest mode that takes part. `None` where
    /// that are too many still.
    ///
    /// # Errors
    /// As [`simulate`].
    pub fn fine_motion(&self, kept: TermGroups) -> Result<Option<Recording>> {
        let mut scene = self.scene.clone();
        let duration = self.situation.duration.value;
        let wanted = |rate: f64| (duration * rate / TAU * INSTANTS_PER_PERIOD).ceil();
        let followed = wanted(self.fastest(f64::INFINITY)).min(MOST_INSTANTS);
        // What no mode has a part in has to be followed in any case.
        if followed.is_nan() || wanted(self.fastest(0.0)) > MOST_INSTANTS {
            return Ok(None);
        }
        scene.run.outputs = (followed as usize).max(LEAST_INSTANTS);
        scene.run.terms = Terms::ALL.held(kept);
        let (motion, _) = simulate(self.body, &scene, &self.context)?;
        let is_followed = wanted(self.liveliest(&motion)) <= followed.max(LEAST_INSTANTS as f64);
        Ok(is_followed.then_some(motion))
    }

    /// The largest circular frequency of the modes that take part in a motion: whose root of the elastic
    /// energy, relative to the largest, is above a part of the tolerance.
    fn liveliest(&self, motion: &Recording) -> f64 {
        let roots: Vec<f64> = self.body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
        let energies = || roots.iter().zip(&motion.extremes.amplitudes).map(|(root, q)| root * q.abs());
        let least =
            TAKES_PART * self.scene.requirements.tolerance.errors.stress * energies().fold(0.0, f64::max);
        let lively = roots.iter().zip(energies()).filter(|(_, energy)| *energy > least);
        lively.map(|(root, _)| *root).fold(0.0, f64::max)
    }

    /// Largest circular frequency of anything in the motion of the body, of its modes up to `highest`. What a
    /// spin does between two of its breaks is one half of a period.
    fn fastest(&self, highest: f64) -> f64 {
        let duration = self.situation.duration.value;
        let roots = self.body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt());
        let modes = roots.filter(|root| *root <= highest).fold(0.0, f64::max);
        let histories = self.scene.acting().chain(self.scene.driving());
        let tones = histories.map(|history| TAU * history.frequency_until(duration));
        // Between two rows of a smooth history there may be half an oscillation.
        let rows = self.scene.driving().filter_map(|history| Some(0.5 * TAU / history.spacing()?));
        let mut breaks = self.scene.rotation().map_or(Vec::new(), |velocity| velocity.breaks());
        breaks.retain(|&time| 0.0 < time && time < duration);
        let ends = [0.0].into_iter().chain(breaks).chain([duration]);
        let ends: Vec<f64> = ends.collect();
        let pieces = ends.windows(2).map(|ends| 0.5 * TAU / (ends[1] - ends[0]));
        tones.chain(rows).chain(pieces).fold(modes, f64::max) + self.situation.spin.value
    }

    /// The trial of a model with the modes `modes` and the groups `kept` against the motion that `measure`
    /// holds; and how its errors grow.
    ///
    /// # Errors
    /// Those of [`simulate`] other than FB540 and FB550, which the trial notes.
    pub fn measured(
        &self,
        measure: &Measure<'_>,
        modes: &[usize],
        kept: TermGroups,
        budget: f64,
    ) -> Result<(Trial, Option<ErrorHistory>)> {
        let whole = measure.body();
        let own;
        let body = if modes.len() == whole.n_modes() {
            whole
        } else {
            own = whole.reduced(modes, whole.invariants().groups(), Vec::new())?;
            &own
        };
        let mut scene =
            if modes.len() == whole.n_modes() { self.scene.clone() } else { self.scene.of_modes(modes) };
        scene.run.terms = Terms::ALL.held(kept);
        // The same steps: errors are those of the model.
        scene.run.scheme = measure.trace().scheme;
        let history = match trace_at(body, &scene, &measure.trace().time, &self.context) {
            Ok(trace) => Ok(measure.of_subset(&trace, modes)),
            Err(error) if error.diagnostics().iter().all(|d| ends_a_run(d.code())) => {
                Err(error.first_error().message().to_owned())
            }
            Err(error) => return Err(error),
        };
        let errors = history.as_ref().ok().map(ErrorHistory::largest);
        let trial = Trial {
            kept,
            modes: modes.len(),
            multiplications: multiplications(body, kept),
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

    /// The trial by bounds of a model with the groups `kept`. With its motion `run`, the load that the
    /// dropped terms are to its error is taken along that, at its instants; without, at the largest motion
    /// that loads and rotation allow.
    pub fn bounded(&self, norms: &Norms, run: Option<&Recording>, kept: TermGroups, budget: f64) -> Trial {
        let mut trial = Trial {
            kept,
            modes: self.body.n_modes(),
            multiplications: multiplications(self.body, kept),
            tier: norms.tier,
            errors: None,
            budget,
            worst: f64::INFINITY,
            remark: String::new(),
            case: None,
            by_case: Vec::new(),
        };
        match self.bounds(norms, run, kept) {
            Ok(errors) => {
                trial.worst = errors.worst(&self.scene.requirements.tolerance);
                trial.errors = Some(errors);
            }
            Err(reason) => trial.remark = reason,
        }
        trial
    }

    fn bounds(
        &self,
        norms: &Norms,
        run: Option<&Recording>,
        kept: TermGroups,
    ) -> std::result::Result<OutputErrors, String> {
        let driven = self.situation.driven.as_ref().map_err(String::clone)?;
        let dropped = kept.complement();
        let softened = || "the spin may take the stiffness of some motion".to_owned();
        let mut first_order = None;
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

    /// Torques of the loads for |Lambda^(1/2) e| = 1, since their levers deform with the body.
    fn lever_torques(&self, driven: &Driven) -> f64 {
        let rows = PointRows::new(self.body);
        let lever = |(load, point): (&Load, &BodyPoint)| {
            let largest = Variation::of_vector(&load.force, driven.rotation.duration).largest;
            largest * self.reach_of(&rows.of(point))
        };
        self.scene.loads.iter().zip(self.loads).map(lever).sum::<f64>()
    }

    /// Errors relative to what is certain of the whole motion, or to the least that counts; `torque` is the
    /// bound of the error of that.
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
        }
    }

    /// The least torque of a prescribed spin that counts.
    fn least_torque(&self, duration: f64) -> f64 {
        // The inertia whose radius of gyration a recording has: of a plane body that about its normal alone.
        let inertia = self.body.invariants().inertia();
        let inertia = 0.5 * if self.body.dimension() == 2 { inertia[(2, 2)] } else { inertia.trace() };
        let rate = |spin: &Spin| {
            let even = (0..=LEAST_INSTANTS).map(|i| duration * (i as f64 / LEAST_INSTANTS as f64));
            even.map(|time| spin.velocity.at(time).0.norm()).fold(0.0, f64::max)
        };
        LEAST_REACTION * inertia * self.scene.spin.as_ref().map_or(0.0, rate).powi(2)
    }

    /// Largest deflection of a watched point, or without any of a node, for |Lambda^(1/2) q| = 1.
    fn reach(&self) -> f64 {
        let mut reach = 0.0f64;
        self.each_watched(|rows| reach = reach.max(self.reach_of(rows)));
        reach
    }

    fn reach_of(&self, rows: &DMatrix<f64>) -> f64 {
        let eigenvalues = &self.body.modes().eigenvalue;
        PointRows::norm(&PointRows::weighted(rows, |j| 1.0 / eigenvalues[j].sqrt()))
    }

    /// Hands over Psi of every watched point; of every node where there are none.
    fn each_watched(&self, mut hear: impl FnMut(&DMatrix<f64>)) {
        let rows = PointRows::new(self.body);
        match self.watched {
            [] => (0..self.body.n_nodes()).for_each(|node| hear(&rows.of_node(node))),
            points => points.iter().for_each(|point| hear(&rows.of(point))),
        }
    }

    /// What every mode does in a motion of the body.
    pub fn shares(&self, trace: &Trace) -> Vec<ModeShare> {
        let mut longest = vec![0.0f64; self.body.n_modes()];
        self.each_watched(|rows| {
            for (longest, column) in longest.iter_mut().zip(rows.column_iter()) {
                *longest = longest.max(column.norm());
            }
        });
        let extremes = &trace.extremes;
        let energy = extremes.elastic.sqrt();
        let deflection = match extremes.watched.is_empty() {
            true => extremes.deflection.value * self.body.extent(),
            false => extremes.watched.iter().map(|peak| peak.value).fold(0.0, f64::max),
        };
        let share = |j: usize| {
            let amplitude = extremes.amplitudes[j];
            let moved = longest[j] * amplitude;
            let root_energy = (0.5 * self.body.modes().eigenvalue[j]).sqrt() * amplitude;
            ModeShare {
                amplitude,
                deflection: moved / deflection.max(trace.resolution.deflection),
                stress: root_energy / energy.max(trace.resolution.root_energy),
                kept: true,
            }
        };
        (0..self.body.n_modes()).map(share).collect()
    }
}

/// The part of a mode in the motion of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShare {
    /// Largest |q|.
    pub amplitude: f64,
    /// Largest deflection of a watched point (without any: of a node) by this mode alone, relative to the
    /// largest of all together.
    pub deflection: f64,
    /// Root of its largest elastic energy, relative to the largest of all together.
    pub stress: f64,
    /// Whether the mode is kept.
    pub kept: bool,
}

/// Multiplications of an evaluation of the equations of `body` with `groups`.
pub(super) fn multiplications(body: &FlexBody, groups: TermGroups) -> usize {
    EquationsOfMotion::new(body, Terms::ALL.held(groups)).multiplications()
}

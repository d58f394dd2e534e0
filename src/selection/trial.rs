//! Models with fewer terms or modes, tried: by bounds, and by integration.

use super::norms::Norms;
use super::rows::PointRows;
use super::situation::Situation;
use crate::diagnostic::{Code, Diagnostic};
use crate::dynamics::{BodyPoint, EquationsOfMotion, Terms};
use crate::error::Result;
use crate::flex_body::{FlexBody, Groups};
use crate::model::extents;
use crate::scene::{ErrorHistory, Measure, OutputErrors, Recording, Resolution, Scene, simulate};
use nalgebra::DMatrix;

/// A model with fewer terms or modes and the error that it makes.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Groups that it has.
    pub kept: Groups,
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
}

impl Trial {
    /// Whether the errors are within what the tolerances leave.
    pub fn passed(&self) -> bool {
        self.worst <= self.budget
    }
}

/// A body and a scene that trials are made with.
pub struct Bench<'a> {
    /// The body, with the damping of the scene.
    pub body: &'a FlexBody,
    /// The scene.
    pub scene: &'a Scene,
    /// What it means for the body.
    pub situation: &'a Situation,
    /// Where its loads act.
    pub loads: &'a [BodyPoint],
    /// Watched points.
    pub watched: &'a [BodyPoint],
    /// Memory for recordings.
    pub memory: Option<u64>,
}

impl Bench<'_> {
    /// Multiplications of the equations of a body with `groups`.
    pub fn multiplications(&self, body: &FlexBody, groups: Groups) -> usize {
        EquationsOfMotion::new(body, terms(groups)).multiplications()
    }

    /// The motion of `body` with the groups `kept`.
    ///
    /// # Errors
    /// As [`simulate`].
    pub fn motion(&self, body: &FlexBody, kept: Groups) -> Result<(Recording, Vec<Diagnostic>)> {
        let mut scene = self.scene.clone();
        scene.run.terms = terms(kept);
        simulate(body, &scene, self.memory, |_| ())
    }

    /// The trial of a model with the modes `modes` and the groups `kept` against the motion that `measure` holds; and how its errors grow.
    ///
    /// # Errors
    /// Those of [`simulate`] other than FB540, which the trial notes.
    pub fn measured(
        &self,
        measure: &Measure<'_>,
        modes: &[usize],
        kept: Groups,
        budget: f64,
    ) -> Result<(Trial, Option<ErrorHistory>)> {
        let whole = measure.body();
        let own;
        let body = if modes.len() == whole.n_modes() {
            whole
        } else {
            own = whole.reduced(modes, whole.invariants().groups, Vec::new())?;
            &own
        };
        let started;
        let bench = if modes.len() == whole.n_modes() {
            self
        } else {
            started = self.scene.of_modes(modes);
            &Bench { scene: &started, ..*self }
        };
        let history = match bench.motion(body, kept) {
            Ok((recording, _)) => Ok(measure.of_subset(&recording, modes)),
            Err(error) if error.diagnostics().iter().all(|d| d.code() == Code::SimulationStopped) => {
                Err(error.diagnostics()[0].message().to_owned())
            }
            Err(error) => return Err(error),
        };
        let errors = history.as_ref().ok().map(ErrorHistory::largest);
        let trial = Trial {
            kept,
            modes: modes.len(),
            multiplications: self.multiplications(body, kept),
            tier: 2,
            errors,
            budget,
            worst: errors.map_or(f64::INFINITY, |errors| errors.worst(&self.scene.requirements.tolerance)),
            remark: history.as_ref().err().cloned().unwrap_or_default(),
        };
        Ok((trial, history.ok()))
    }

    /// The trial by bounds of a model with the groups `kept`. Errors are relative to the largest of the motion: that is no less than the
    /// largest of `simplest`, the motion of the model without any group, less the bound of how far that is from the whole.
    pub fn bounded(&self, norms: &Norms, simplest: Option<&Recording>, kept: Groups, budget: f64) -> Trial {
        let mut trial = Trial {
            kept,
            modes: self.body.n_modes(),
            multiplications: self.multiplications(self.body, kept),
            tier: norms.tier,
            errors: None,
            budget,
            worst: f64::INFINITY,
            remark: String::new(),
        };
        let driven = match &self.situation.driven {
            Ok(driven) => driven,
            Err(reason) => {
                trial.remark.clone_from(reason);
                return trial;
            }
        };
        let dropped = kept.complement();
        let all = driven.error(Groups::ALL, norms);
        let (Some(error), Some(torque)) = (driven.error(dropped, norms), driven.torque_error(dropped, norms))
        else {
            trial.remark = "the spin may take the stiffness of some motion".to_owned();
            return trial;
        };
        let least = Resolution::new(self.body, self.scene.requirements.tolerance.least_deflection);
        let reach = self.reach();
        // What is certain of the whole motion.
        let surely = |of_simplest: &dyn Fn(&Recording) -> f64, error: &dyn Fn(f64) -> f64, least: f64| {
            let far = all.map_or(f64::INFINITY, |all| error(all.energy));
            (simplest.map_or(0.0, of_simplest) - far).max(least)
        };
        let deflection = |energy: f64| reach * energy;
        let largest_path = |recording: &Recording| {
            let all = recording.paths.iter().flat_map(|path| &path.deflection);
            all.map(|d| d.norm()).fold(0.0, f64::max)
        };
        let root_energy = |energy: f64| energy / 2f64.sqrt();
        let largest_energy = |recording: &Recording| {
            recording.balances.iter().map(|balance| balance.elastic).fold(0.0, f64::max).sqrt()
        };
        // The levers of the loads deform with the body.
        let levers: f64 = driven.loads.len() as f64
            * self.scene.loads.iter().map(|load| load.force.norm()).fold(0.0, f64::max)
            * self.reach_of_nodes()
            * error.energy;
        let reaction = self.scene.spin.is_some().then(|| {
            let inertia = 0.5 * self.body.invariants().inertia().trace();
            let largest = simplest
                .and_then(|recording| recording.reactions.as_ref())
                .map_or(0.0, |all| all.iter().map(|(_, torque)| torque.norm()).fold(0.0, f64::max));
            let whole = driven.torque_error(Groups::ALL, norms).unwrap_or(f64::INFINITY) + levers;
            let least = 1e-3 * inertia * driven.rotation.largest.powi(2);
            (torque + levers) / (largest - whole).max(least)
        });
        let errors = OutputErrors {
            attitude: 0.0,
            deflection: Some(deflection(error.energy) / surely(&largest_path, &deflection, least.deflection)),
            stress: Some(
                root_energy(error.energy) / surely(&largest_energy, &root_energy, least.root_energy),
            ),
            reaction,
        };
        trial.worst = errors.worst(&self.scene.requirements.tolerance);
        trial.errors = Some(errors);
        trial
    }

    /// Largest deflection of a watched point, or without any of a node, for |Lambda^(1/2) q| = 1.
    fn reach(&self) -> f64 {
        self.watched_rows().iter().map(|rows| self.reach_of(rows)).fold(0.0, f64::max)
    }

    fn reach_of_nodes(&self) -> f64 {
        let rows = PointRows::new(self.body);
        (0..self.body.n_nodes()).map(|node| self.reach_of(&rows.of_node(node))).fold(0.0, f64::max)
    }

    fn reach_of(&self, rows: &DMatrix<f64>) -> f64 {
        let eigenvalues = &self.body.modes().eigenvalue;
        PointRows::norm(&PointRows::weighted(rows, |j| 1.0 / eigenvalues[j].sqrt()))
    }

    /// Psi of the watched points; of all nodes where there are none.
    fn watched_rows(&self) -> Vec<DMatrix<f64>> {
        let rows = PointRows::new(self.body);
        match self.watched {
            [] => (0..self.body.n_nodes()).map(|node| rows.of_node(node)).collect(),
            points => points.iter().map(|point| rows.of(point)).collect(),
        }
    }

    /// What every mode does in a motion of the body.
    pub fn shares(&self, recording: &Recording) -> Vec<ModeShare> {
        let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let rows = self.watched_rows();
        let energy = most(&mut recording.balances.iter().map(|balance| balance.elastic)).sqrt();
        let paths = recording.paths.iter().flat_map(|path| &path.deflection);
        let deflection = match recording.paths.is_empty() {
            true => recording.deflection * self.extent(),
            false => most(&mut paths.map(|d| d.norm())),
        };
        let share = |j: usize| {
            let amplitude = most(&mut recording.states.iter().map(|state| state.q[j].abs()));
            let moved = most(&mut rows.iter().map(|rows| rows.column(j).norm())) * amplitude;
            let root_energy = (0.5 * self.body.modes().eigenvalue[j]).sqrt() * amplitude;
            ModeShare {
                amplitude,
                deflection: moved / deflection.max(recording.resolution.deflection),
                stress: root_energy / energy.max(recording.resolution.root_energy),
                kept: true,
            }
        };
        (0..self.body.n_modes()).map(share).collect()
    }

    fn extent(&self) -> f64 {
        extents(&self.body.nodes().positions).into_iter().fold(0.0, f64::max)
    }
}

/// What a mode does in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShare {
    /// Largest |q|.
    pub amplitude: f64,
    /// Largest deflection of a watched point (without any: of a node) by this mode alone, relative to the largest of all together.
    pub deflection: f64,
    /// Root of its largest elastic energy, relative to the largest of all together.
    pub stress: f64,
    /// Whether the mode is kept.
    pub kept: bool,
}

/// Terms of equations with `groups`.
pub fn terms(groups: Groups) -> Terms {
    Terms { w1: groups.w1, w2: groups.w2, w3: groups.w3, geometric_stiffness: true }
}

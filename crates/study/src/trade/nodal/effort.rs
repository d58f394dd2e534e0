//! Estimate of time and memory for the motion of all nodes, before it is computed.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::memory::refuse_beyond;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::Analysis;
use flexbody_model::FeModel;
use flexbody_motion::scene::{Scene, Scheme, fastest_history};
use std::f64::consts::TAU;

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
pub(super) const ORDER: usize = 6;

/// Largest number of parts that a step is divided into.
const MAX_PARTS: u32 = 1024;

/// Number of steps of the implicit integrations relative to the first one, at least: the first plus one with half the
/// step, 1 + 2.
const MIN_STEP_RUNS: f64 = 3.0;

/// Properties of a model that determine the work.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
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
pub(super) enum Way {
    /// Explicit method of order 8 with error control.
    Explicit,
    /// Implicit steps, `given` by the scene or halved until the change is small.
    Implicit { order: usize, step: f64, given: bool },
}

impl Effort {
    /// Estimates the work of `model` in `scene`, with `modes` damped modes.
    pub(super) fn new(model: &FeModel, scene: &Scene, modes: usize) -> Self {
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
    pub(super) fn implicit(&self, order: usize, step: f64, runs: f64) -> f64 {
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
    pub(super) fn is_allowed(&self, order: usize, step: f64, parts: u32, longest: Option<f64>) -> bool {
        let seconds = self.implicit(order, step, f64::from(parts));
        parts <= MAX_PARTS && longest.is_none_or(|longest| seconds <= longest)
    }

    /// Chooses the method of integration for a scene with `scheme`. `highest_rate` is the largest circular frequency that
    /// counts. Also returns the estimated seconds.
    pub(super) fn plan(&self, scene: &Scene, scheme: Scheme, highest_rate: f64) -> (Way, f64) {
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
    pub(super) fn refuse_long(&self, seconds: f64, longest: Option<f64>) -> Result<()> {
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
    pub(super) fn refuse_large(&self, instants: f64, way: Way, memory: Option<u64>) -> Result<()> {
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
    pub(super) fn instants(&self, step: f64) -> f64 {
        self.duration / step + 2.0 * self.pieces
    }
}

/// Returns the largest circular frequency of the modes of `body`.
pub(super) fn fastest_mode(body: &FlexBody) -> f64 {
    body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt()
}

/// Returns an estimate of the largest circular frequency: sqrt(3 max K_ii / M_ii), as for a solid element with
/// consistent mass.
fn fastest(model: &FeModel) -> f64 {
    let mass = model.pencil().mass_diagonal();
    let ratios = model.stiffness().diagonal().into_iter().zip(mass).filter(|(_, m)| *m > 0.0);
    (3.0 * ratios.map(|(k, m)| k / m).fold(0.0, f64::max)).sqrt()
}

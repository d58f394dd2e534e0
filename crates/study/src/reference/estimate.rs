//! Estimate of the truncation error of a body along its motion in a scene.

use super::grid::Grid;
use super::residual::{NodalView, SceneLoad};
use super::resonances::ResonanceCriteria;
use super::truncated_motion::{TruncatedMotion, TruncationErrors, energy_scale};
use super::truncated_responses::TruncatedResponses;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::about_percent;
use flexbody_body::basis::CoupledModel;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::not_negative;
use flexbody_model::FeModel;
use flexbody_motion::scene::{
    FramedScene, Instant, Load, OutputErrors, Point, Scene, Trace, damped_once, instants, nodal_point, trace,
};

/// Part of the tolerances that the truncation error of a study's reference may take without a warning.
pub const PART_OF_REFERENCE: f64 = 0.1;

/// Part of the tolerances that the truncation error may take for a reference that stands for the motion of all nodes.
pub const PART_OF_FINE: f64 = 0.01;

/// Part of the tolerances that the truncation error of a reference may take at most. The candidates get the rest.
pub const MAX_REFERENCE_ERROR: f64 = 0.5;

/// Part of the allowed error. The dominant responses leave an elastic energy whose square root is at most this part. A
/// smaller value adds more responses in each round.
const PART_OF_RESPONSES: f64 = 0.1;

/// Reason given if following the motion would take too many instants.
const TOO_MANY_INSTANTS: &str = "its motion has too many periods or breakpoints to follow";

/// Part of the tolerances, as a root of the elastic energy, below which a resonance of a truncated mode is ignored.
const PART_OF_RESONANCE: f64 = 0.05;

/// Estimated truncation error of a body in a scene, relative to the model that it was made of.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceError {
    /// Number of modes of the body.
    pub modes: usize,
    /// Estimated errors against the motion of all nodes. The estimate contains the static responses (with inertia) to
    /// the forces that the equations of all nodes leave unbalanced, the motion of the modes that these cause, the
    /// rotation of a free body, and the reaction of a prescribed motion. Infinite if unknown.
    pub errors: OutputErrors,
    /// Largest error over its tolerance.
    pub worst: f64,
    /// First time at which the root of the estimated elastic energy reaches 0.8 of its largest value.
    pub time: f64,
    /// Reason why the errors are unknown; `None` if they are known.
    pub unknown: Option<&'static str>,
    /// Effect of the rigid interfaces of the body; the errors are estimated with these interfaces rigid in the model
    /// too. `None` for a body without rigid interfaces.
    pub coupling: Option<CouplingEffect>,
}

/// Effect of rigid interfaces in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct CouplingEffect {
    /// Names of the interfaces that no mode of the body deforms.
    pub interfaces: Vec<String>,
    /// Estimated errors of the body against the model with deformable interfaces: effect of the coupling and truncation
    /// error together.
    pub errors: OutputErrors,
    /// Largest error over its tolerance.
    pub worst: f64,
}

impl CouplingEffect {
    /// Returns the remark about the effect of the coupling.
    fn remark(&self) -> Diagnostic {
        let names: Vec<String> = self.interfaces.iter().map(|name| format!("`{name}`")).collect();
        let percent = |error: f64| format!("{:.2} %", 100.0 * error);
        let parts = [
            ("deflection", self.errors.deflection),
            ("stress", self.errors.stress),
            ("reaction", self.errors.reaction),
            ("recovery", self.errors.recovery),
        ];
        let parts: Vec<String> = parts
            .into_iter()
            .filter_map(|(name, error)| Some(format!("{name} {}", percent(error?))))
            .collect();
        let message = format!(
            "the body is compared with the model under the same coupling: {} rigid. Compared with the model whose interfaces deform, its errors are {}",
            match names.as_slice() {
                [one] => format!("interface {one} is"),
                all => format!("interfaces {} are", all.join(", ")),
            },
            parts.join(", ")
        );
        let remark = Diagnostic::new(Code::CouplingEffect, message);
        if self.worst <= 1.0 {
            return remark;
        }
        // Beyond the tolerances the coupling decides about the result, most of all near a resonance that it shifts.
        remark.with_help(
            "decide what is mounted there: a stiff part keeps the interface rigid, and the body fits; otherwise convert with coupling = \"averaging\". \
             A scene near a resonance shows large errors, since a rigid interface raises the frequency",
        )
    }
}

impl ReferenceError {
    /// Returns unknown (infinite) errors of a body with `modes` modes.
    fn unknown(modes: usize, reason: &'static str) -> Self {
        let all = f64::INFINITY;
        let errors = OutputErrors { reaction: None, recovery: None, ..OutputErrors::all(Some(all)) };
        Self { modes, errors, worst: all, time: 0.0, unknown: Some(reason), coupling: None }
    }

    /// Returns true if other bodies may be measured against this body, within the rest of the tolerances.
    pub fn is_reference(&self) -> bool {
        self.worst <= MAX_REFERENCE_ERROR
    }

    /// Returns the error as a part of the tolerances in words, with the one digit that an estimate has: beside the motion
    /// of all nodes it is 0.5 to 3 times the true error, and after a shock rounding alone changes the second digit.
    pub fn part_of_tolerances(&self) -> String {
        about_percent(self.worst)
    }

    /// Returns the part of the tolerances that the last error of `rounds` leaves to others: all of it if no error is
    /// known, or if the body is no reference.
    pub(crate) fn left(rounds: &[Self]) -> f64 {
        let error = rounds.last().filter(|own| own.is_reference());
        (1.0 - error.map_or(0.0, |own| own.worst)).max(0.0)
    }

    /// Returns remarks about what the errors do not contain: the effect of rigid interfaces that the body and the compared
    /// model have in common, and recoveries with a limit that are known for some shapes only.
    pub fn remarks(&self, scene: &Scene) -> Vec<Diagnostic> {
        let limited = scene.requirements.recoveries.first();
        let unjudged = limited.filter(|_| self.unknown.is_none() && self.errors.recovery.is_none()).map(|one| {
            let message = format!(
                "the error of recovery `{}` relative to the FE model is not known, only that relative to the body with all its modes: an FE program has computed its rows for the shapes of the body alone",
                one.recovery
            );
            Diagnostic::new(Code::RecoveryUnjudged, message)
        });
        self.coupling.as_ref().map(CouplingEffect::remark).into_iter().chain(unjudged).collect()
    }

    /// Returns a warning if the truncation error exceeds `enough` of the tolerances, or is unknown.
    pub fn warning(&self, scene: &Scene, enough: f64) -> Option<Diagnostic> {
        if self.worst <= enough {
            return None;
        }
        if let Some(reason) = self.unknown {
            let message = format!(
                "the error of the reference body of {} modes relative to the model is not known: {reason}",
                self.modes
            );
            return Some(
                Diagnostic::new(Code::ReferenceIncomplete, message)
                    .with_help("simulate a shorter `duration`"),
            );
        }
        let message = format!(
            "the error of the reference body of {} modes relative to the model is itself about {} of the tolerances, first large at about t = {:.0e}",
            self.modes,
            self.part_of_tolerances(),
            self.time
        );
        let warning = Diagnostic::new(Code::ReferenceIncomplete, message);
        let begins_with_shock = scene.acting().any(|history| history.at(0.0).0.norm() != 0.0);
        Some(if begins_with_shock && !scene.initial.settled {
            warning.with_help(
                "start with deformation = \"static\" in [initial], or with loads that begin at zero: loads that act at time 0 begin with a shock",
            )
        } else {
            warning
        })
    }
}

/// Estimate of the truncation error, with the forces that would improve the body.
pub(super) struct Estimate {
    pub error: ReferenceError,
    /// Nodal forces (N x k) whose static responses the body needs most. Their number is the smallest that leaves an
    /// error within the allowed part.
    pub missing: Mat<f64>,
}

impl Estimate {
    /// Estimates the truncation error of `body`, made of `model`, in `scene`. `allowed` is the part of the tolerances
    /// that the error may take. Returns `None` if no estimate is possible: the scene has no duration, the body has
    /// other rows than the model, or its nodal view cannot be built. A motion with too many periods or breaks gives an
    /// unknown (infinite) error.
    ///
    /// # Errors
    /// The errors of [`trace`] and of the static responses.
    pub(super) fn new(
        model: &FeModel,
        body: &FlexBody,
        scene: &Scene,
        allowed: f64,
        context: &Context<'_>,
    ) -> Result<Option<Self>> {
        // Bring body, scene and model into one frame, and check that they match.
        let Some(duration) = scene.run.duration else { return Ok(None) };
        let framed = FramedScene::new(body, scene)?;
        let given = scene.requirements.damping.is_some();
        let (body, scene) = damped_once(framed.body, framed.scene)?;
        let (body, scene) = (&*body, &*scene);
        let Some(vectors) = body.vectors_of(model) else { return Ok(None) };
        let coupled = body.coupled_model(model, vectors.as_ref());
        let interfaces = coupled.rigid_interfaces();
        let at = |point: &Point| Ok(nodal_point(model, point)?.unit_loads(model));
        let load_at = |load: &Load| Ok(SceneLoad::new(model, &nodal_point(model, &load.at)?));
        let loads = scene.loads.iter().map(load_at).collect::<Result<Vec<_>>>()?;
        let watched = scene.watched.iter().map(at).collect::<Result<Vec<_>>>()?;
        let carrier = scene.carried.as_ref().map(|carried| nodal_point(model, &carried.by)).transpose()?;
        let of_model = model.damping().filter(|_| !given);
        let view = |coupled| NodalView::new(coupled, body, loads.clone(), carrier.as_ref(), of_model);
        let Some(own) = view(coupled) else { return Ok(None) };
        // Simulate the motion and choose the instants at which the residual forces are evaluated.
        let (motion, _) = trace(body, scene, context)?;
        let Some(grid) = Grid::new(body, scene, &motion, duration) else {
            let error = ReferenceError::unknown(body.n_modes(), TOO_MANY_INSTANTS);
            return Ok(Some(Self { error, missing: Mat::zeros(model.rows().len(), 0) }));
        };
        let mut same_steps = scene.clone();
        same_steps.run.scheme = motion.scheme;
        let sampled = instants(body, &same_steps, &grid.times)?;
        let beside = ModelComparison {
            body,
            scene,
            motion: &motion,
            grid: &grid,
            sampled: &sampled,
            watched: &watched,
        };
        // Estimate the error under the body's coupling, then against deformable interfaces.
        let mut estimate = beside.estimate(&own, allowed)?;
        let deforms = || view(CoupledModel::uncoupled(model));
        if let Some(view) = (!interfaces.is_empty()).then(deforms).flatten() {
            let ReferenceError { errors, worst, .. } = beside.estimate(&view, allowed)?.error;
            estimate.error.coupling = Some(CouplingEffect { interfaces, errors, worst });
        }
        Ok(Some(estimate))
    }
}

/// Motion of a body, compared with that of its model.
struct ModelComparison<'a> {
    body: &'a FlexBody,
    scene: &'a Scene,
    motion: &'a Trace,
    grid: &'a Grid,
    /// The motion at the instants of the grid.
    sampled: &'a [Instant],
    /// Nodal weights of the points whose deflections count.
    watched: &'a [Mat<f64>],
}

impl ModelComparison<'_> {
    /// Estimates the truncation error of the body against the model of `view`.
    fn estimate(&self, view: &NodalView<'_>, allowed: f64) -> Result<Estimate> {
        let &Self { body, scene, motion, grid, sampled, watched } = self;
        let tolerance = &scene.requirements.tolerance;
        let least = tolerance.of_deformation();
        // A resonance counts above a small part of the tolerances; a free body has no missing mode below the
        // certificate.
        let criteria = ResonanceCriteria {
            settled: scene.initial.settled,
            negligible: PART_OF_RESONANCE * least * energy_scale(motion),
            complete_below: if view.held.is_some() { 0.0 } else { complete_below(body) },
        };
        let missed = TruncatedResponses::new(view, body, sampled, grid, &criteria)?;
        let truncated_motion =
            TruncatedMotion::new(view, body, &missed, sampled, grid, scene.initial.settled);
        let TruncationErrors { errors, time } = truncated_motion.errors(body, scene, motion, watched);
        let worst = errors.worst(tolerance);
        let modes = body.n_modes();
        let error = ReferenceError { modes, worst, time, errors, unknown: None, coupling: None };
        let enough = PART_OF_RESPONSES * allowed * least;
        let missing = missed.dominant(&truncated_motion.of_responses(), enough * energy_scale(motion));
        Ok(Estimate { error, missing })
    }
}

/// Circular frequency below which the body has all modes by certificate; zero without a certificate.
fn complete_below(body: &FlexBody) -> f64 {
    let certificate = body.certificate();
    if certificate.proved_modes.is_some() { not_negative(certificate.shift).sqrt() } else { 0.0 }
}

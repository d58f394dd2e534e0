//! Error of a run of another program.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::{about_percent, significant};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::{
    FramedScene, Measure, MotionHistory, OtherModes, OutputErrors, Scene, StressError, Tolerance, Trace,
    trace, trace_at,
};

/// Errors of a run of another program relative to a reference motion.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRun {
    /// Name of the scene.
    pub scene: String,
    /// Number of modes of the body that was run.
    pub modes: usize,
    /// Number of modes of the reference.
    pub reference_modes: usize,
    /// Number of instants that were compared.
    pub instants: usize,
    /// Largest errors; `None` for quantities that the run does not have.
    pub errors: OutputErrors,
    /// Tolerances of the scene.
    pub tolerance: Tolerance,
    /// Largest ratio of error to tolerance.
    pub worst: f64,
    /// Growth of the errors over the run, see [`ErrorHistory::growth`](flexbody_motion::scene::ErrorHistory::growth).
    pub growth: Option<f64>,
    /// Error of the stress stiffness of the spin that the reference does not have; `None` if nothing is missing, or if the
    /// error is a small part of the tolerances.
    pub stress_error: Option<StressError>,
}

impl MeasuredRun {
    /// Returns true if every error is within the part of its tolerance that the missing stress stiffness leaves.
    pub fn holds(&self) -> bool {
        let is_stressed = self.stress_error.as_ref().is_none_or(StressError::is_small);
        is_stressed && self.worst <= StressError::left(self.stress_error.as_ref())
    }
}

/// Measures the errors of `history`, which another program computed with `body` in `scene`. The reference is the motion
/// of `reference`, a body with more modes of the model, or of `body` itself, with the accuracy of the scene. Errors
/// between the instants of the history are those of parabolas through them.
///
/// # Errors
/// The errors of [`trace`] for the reference; those of [`MotionHistory::covering`] and [`Trace::of_history`] for the
/// history, FB217 also for instants too far apart; FB707 for bodies of different models.
pub fn measured_run(
    body: &FlexBody,
    history: MotionHistory,
    scene: &Scene,
    reference: Option<(&FlexBody, &FeModel)>,
    context: &Context<'_>,
) -> Result<(MeasuredRun, Vec<Diagnostic>)> {
    let duration = scene.run.duration.ok_or_else(|| {
        Diagnostic::new(Code::SceneContradicts, "the scene has no `duration`: nothing is simulated")
            .with_help("give `duration` in [run]")
    })?;
    let history = history.covering(duration)?;
    if history.q.iter().any(|q| q.len() != body.n_modes()) {
        let message = format!("the history does not have {} modal coordinates at every time", body.n_modes());
        let help = "give the history of a run with this body";
        return Err(Diagnostic::new(Code::BodyIncomparable, message).with_help(help).into());
    }
    let shared = reference.map(|(whole, model)| beside(body, whole, model)).transpose()?;
    let whole = reference.map_or(body, |(whole, _)| whole);
    // The extremes belong to the continuous motion, the comparison to the instants of the history.
    let (continuous, mut diagnostics) = trace(whole, scene, context)?;
    let sampled = trace_at(whole, scene, &history.time, context)?;
    let motion = Trace { extremes: continuous.extremes.clone(), ..sampled };
    let own = Trace::of_history(body, scene, &history, &motion)?;
    let framed_whole = FramedScene::new(whole, scene)?;
    let framed_body = FramedScene::new(body, scene)?.body;
    let stress_error = StressError::of_trace(&framed_whole.body, &framed_whole.scene, &continuous, context)?;
    diagnostics.extend(stress_error.as_ref().and_then(|own| own.warning(whole)));
    let measure = Measure::new(&framed_whole.body, &framed_whole.scene, &motion);
    let errors = match &shared {
        Some(shared) => {
            let modes =
                OtherModes::new(&framed_body, &framed_whole.body, shared.as_ref()).ok_or_else(unrelated)?;
            measure.of_other(&own, &modes)
        }
        None => measure.of_subset(&own, &(0..body.n_modes()).collect::<Vec<_>>()),
    };
    let tolerance = scene.requirements.tolerance;
    let mut largest = errors.largest();
    largest.attitude = largest.attitude.filter(|_| history.attitude.is_some());
    let run = MeasuredRun {
        scene: scene.name.clone(),
        modes: body.n_modes(),
        reference_modes: whole.n_modes(),
        instants: history.time.len(),
        errors: largest,
        worst: largest.worst(&tolerance),
        tolerance,
        growth: errors.growth(&motion, &tolerance),
        stress_error,
    };
    if run.worst <= 1.0 {
        let unseen = between_instants(whole, scene, &framed_whole, (&continuous, &motion))?;
        refuse_sparse(&history, unseen, &tolerance)?;
    }
    Ok((run, diagnostics))
}

/// Returns the errors of parabolas through the instants of the reference, `sampled` as the history is, relative to its
/// continuous motion.
fn between_instants(
    whole: &FlexBody,
    scene: &Scene,
    framed: &FramedScene<'_>,
    (continuous, sampled): (&Trace, &Trace),
) -> Result<OutputErrors> {
    let parabolas = sampled.through_parabolas(&continuous.time);
    let told = Trace::of_history(whole, scene, &parabolas, continuous)?;
    let measure = Measure::new(&framed.body, &framed.scene, continuous);
    Ok(measure.of_subset(&told, &(0..whole.n_modes()).collect::<Vec<_>>()).largest())
}

/// Refuses a history whose instants are too far apart to tell whether the run is within the tolerances: the reference
/// itself, known at these instants alone, would not be.
fn refuse_sparse(history: &MotionHistory, mut unseen: OutputErrors, tolerance: &Tolerance) -> Result<()> {
    unseen.attitude = unseen.attitude.filter(|_| history.attitude.is_some());
    if unseen.worst(tolerance) <= 1.0 {
        return Ok(());
    }
    let (name, error, allowed) = unseen.decisive(tolerance);
    let size = |value: f64| match name {
        "attitude" => format!("{} rad", significant(value, 2)),
        _ => about_percent(value),
    };
    let message = format!(
        "the {} instants are too far apart to judge the run: parabolas through those of the reference miss its {name} between them by {}, and {} is allowed",
        history.time.len(),
        size(error),
        size(allowed)
    );
    let help = "write at least twelve instants for each period of a vibration that matters, more for tolerances below 1 %";
    Err(Diagnostic::new(Code::SeriesRange, message).in_file(&history.path).with_help(help).into())
}

/// Returns Psi'K Psi_r of the modes of `body` and of those of `whole`.
fn beside(body: &FlexBody, whole: &FlexBody, model: &FeModel) -> Result<Mat<f64>> {
    body.stiffness_beside(whole, model).ok_or_else(unrelated)
}

fn unrelated() -> Error {
    let message = "the body, the reference and the model do not belong together";
    let help = "give two bodies that were converted from this model, with the same frame";
    Diagnostic::new(Code::BodyIncomparable, message).with_help(help).into()
}

//! The simulation of a scene.

use super::conditions::MeanAxes;
use super::extremes::Survey;
use super::prepared::{PARTS, Prepared, damped};
use super::scene_rows::SceneRows;
use super::{Extremes, FramedScene, Path, Recording, Scene, Setting};
use crate::dynamics::{BodyPoint, Evaluation, Motion};
use crate::integration::{Failure, ObserverEvent, Work};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::memory::refuse_beyond;
use flexbody_body::flex_body::{FlexBody, SOFTENING, axis_in_words};
use flexbody_linalg::context::Context;
use flexbody_model::LoadKind;
use nalgebra::Vector3;

/// Deflection, relative to the extent of the body, up to which linear elasticity holds.
const LINEAR_RANGE: f64 = 0.1;

/// Bytes per recorded number: the number, and its text in a table.
const BYTES: f64 = 8.0 + 25.0;

/// Number of values per output time besides modes and watched points.
const NUMBERS: usize = 47;

/// Number of values per output time and watched point: position, deflection, velocity and acceleration.
const WATCHED: usize = 12;

/// Simulates `body` in `scene` and returns the motion at the output times, with warnings and notes about
/// it.
///
/// * `context`: its memory limits the recording and its tables; its listener gets the finished fraction of
///   the duration.
///
/// # Errors
/// FB212 if the scene does not fit the body; FB550, before any work, if the run needs more steps than
/// allowed, and FB601 if the recording does not fit the memory; FB540 if the integration cannot go on.
pub fn simulate(
    body: &FlexBody,
    scene: &Scene,
    context: &Context<'_>,
) -> Result<(Recording, Vec<Diagnostic>)> {
    simulate_recording(body, scene, false, context)
}

/// Does the work of [`simulate`], and finds the largest stresses of every point of the recoveries as well.
///
/// # Errors
/// The errors of [`simulate`].
pub fn simulate_with_envelope(
    body: &FlexBody,
    scene: &Scene,
    context: &Context<'_>,
) -> Result<(Recording, Vec<Diagnostic>)> {
    simulate_recording(body, scene, true, context)
}

fn simulate_recording(
    body: &FlexBody,
    scene: &Scene,
    envelope: bool,
    context: &Context<'_>,
) -> Result<(Recording, Vec<Diagnostic>)> {
    // Body and scene in one frame, with the damping of the scene, ready to integrate.
    let framed = FramedScene::new(body, scene)?;
    let left_out = left_out(body, &framed.body);
    let body = &*damped(&framed.body, &framed.scene)?;
    let scene = &*framed.scene;
    let run = Prepared::new(body, scene)?;
    refuse_too_much(body, scene, context)?;
    // Record at the output times; survey extremes at every step and at points within the steps.
    let outputs = scene.run.outputs;
    let time: Vec<f64> = (0..=outputs).map(|i| run.duration * (i as f64 / outputs as f64)).collect();
    let mut recorder = Recorder::new(body, scene, &run, time.len());
    let mut survey = Survey::new(body, &run.watched);
    let (mut rows, unseen) = SceneRows::new(body, scene, envelope).unzip();
    let record = |event: ObserverEvent, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if event != ObserverEvent::Instant {
            context.fraction(time / run.duration);
            run.survey(&mut survey, event, time, state, motion)?;
        } else {
            recorder.record(time, state, motion)?;
        }
        if let Some(rows) = &mut rows {
            let now = motion.evaluate(time, state)?;
            match event {
                ObserverEvent::Instant => rows.record(time, &now, &run.forces),
                _ => rows.see(time, &now, &run.forces),
            }
        }
        Ok::<(), Failure>(())
    };
    let finished = run.integrate(&time, PARTS, record)?;
    // Add the work and the extremes, and warn of motions beyond the range of the model.
    let mut recording = recorder.recording;
    recording.work = finished.work;
    recording.extremes = survey.extremes(finished.size, finished.least_energy);
    recording.recovered = rows.map(SceneRows::finish);
    let found =
        [framed.found, left_out, unseen.unwrap_or_default(), remarks(body, scene, &recording.extremes)]
            .concat();
    Ok((recording, found))
}

/// Returns notes about recoveries of `body` that it does not have in the frame of the scene.
fn left_out(body: &FlexBody, framed: &FlexBody) -> Vec<Diagnostic> {
    let kept = |name: &str| framed.recoveries().iter().any(|one| one.name == name);
    let lost = body.recoveries().iter().filter(|one| !kept(&one.name));
    lost.map(|one| {
        let message =
            format!("recovery `{}` has displacements relative to the frame of the file, and the motion is in mean axes: it is left out", one.name);
        Diagnostic::new(Code::RecoveryLeftOut, message)
    })
    .collect()
}

/// Recording under construction.
struct Recorder<'r> {
    recording: Recording,
    watched: &'r [BodyPoint],
    conditions: Option<MeanAxes>,
    /// Positions of the watched points in the undeformed body.
    rest: Vec<Vector3<f64>>,
}

impl<'r> Recorder<'r> {
    fn new(body: &FlexBody, scene: &Scene, run: &'r Prepared<'_>, instants: usize) -> Self {
        let undeformed = Evaluation::new(&run.equations);
        let conditions = if scene.carried.is_some() { None } else { MeanAxes::new(body) };
        Self {
            recording: Recording {
                scene: scene.name.clone(),
                body: body.source().name.clone(),
                scheme: run.scheme,
                time: Vec::with_capacity(instants),
                states: Vec::with_capacity(instants),
                balances: Vec::with_capacity(instants),
                reactions: scene.prescribes().then(Vec::new),
                conditions: conditions.is_some().then(Vec::new),
                setting: Setting::new(body, scene),
                paths: scene.watched.iter().map(|point| Path::new(point.to_string())).collect(),
                work: Work::default(),
                extremes: Extremes::default(),
                recovered: None,
            },
            watched: &run.watched,
            conditions,
            rest: run.watched.iter().map(|point| point.place(&undeformed)).collect(),
        }
    }

    fn record(
        &mut self,
        time: f64,
        state: &[f64],
        motion: &mut Motion<'_>,
    ) -> std::result::Result<(), Failure> {
        // State, energies and momenta, with the reaction of a prescribed motion.
        let accelerations = motion.accelerations(time, state)?.to_vec();
        let now = motion.evaluate(time, state)?;
        self.recording.time.push(time);
        self.recording.states.push(now.configuration());
        self.recording.balances.push(now.balance());
        if let Some(reactions) = &mut self.recording.reactions {
            reactions.push(now.reaction());
        }
        // Torque that the mean-axis conditions carry.
        if let (Some(torques), Some(conditions)) = (&mut self.recording.conditions, &self.conditions) {
            let evaluation = now.evaluation();
            torques.push(conditions.torque(evaluation.modal_coordinates(), evaluation.modal_velocity()));
        }
        // Watched points: positions and their rates along world axes, deflections along the axes of the frame.
        for ((path, point), rest) in self.recording.paths.iter_mut().zip(self.watched).zip(&self.rest) {
            let (place, evaluation) = (now.place(), now.evaluation());
            let at = point.place(evaluation);
            path.place.push(place.origin + place.axes * at);
            path.deflection.push(at - rest);
            path.velocity.push(place.axes * point.velocity(evaluation));
            path.acceleration.push(place.axes * point.acceleration(evaluation, &accelerations));
        }
        Ok(())
    }
}

/// # Errors
/// FB601 if the recording does not fit the memory.
fn refuse_too_much(body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<()> {
    let numbers = NUMBERS + 2 * body.n_modes() + WATCHED * scene.watched.len();
    let instants = scene.run.outputs + 1;
    let needed = instants as f64 * numbers as f64 * BYTES;
    refuse_beyond(context.memory, needed, &format!("recording {instants} instants"), "record fewer `outputs`")
}

/// Returns warnings about a motion with these extremes that leaves the range of validity of the model.
pub(super) fn remarks(body: &FlexBody, scene: &Scene, extremes: &Extremes) -> Vec<Diagnostic> {
    let (mut found, unit) = (Vec::new(), body.units().time.name());
    let deflection = extremes.deflection;
    if deflection.value > LINEAR_RANGE {
        let message = format!(
            "a node is deflected by {:.0} % of the largest extent of the body at t = {} {unit}, but the modes hold for small deformations",
            100.0 * deflection.value,
            rounded(deflection.time)
        );
        found.push(Diagnostic::new(Code::LinearRangeLeft, message));
    }
    let stiffened = scene.run.terms.geometric_stiffness
        && body.geometric_stiffness().iter().any(|one| one.load.kind == LoadKind::Spin);
    if scene.run.terms.w2 && !stiffened {
        found.extend(softening(body, extremes));
    }
    found
}

/// Returns a warning if spin takes more than one hundredth of the stiffness of some motion.
fn softening(body: &FlexBody, extremes: &Extremes) -> Option<Diagnostic> {
    if extremes.spins.is_empty() {
        return None;
    }
    // A bound for any axis decides most cases without a search.
    let (_, worst) = body.worst_spin()?;
    if worst * extremes.spin.powi(2) <= SOFTENING {
        return None;
    }
    // The exact softening about each of the axes that occurred.
    let part = |omega: &Vector3<f64>| Some((body.softening(omega)?, *omega));
    let (part, omega) = extremes.spins.iter().filter_map(part).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (part > SOFTENING).then(|| {
        let message = format!(
            "the spin about {} reaches {} rad/{}: without geometric stiffness it removes {:.2} % of the stiffness of some motion",
            axis_in_words(&omega),
            rounded(omega.norm()),
            body.units().time.name(),
            100.0 * part
        );
        Diagnostic::new(Code::SpinSoftens, message)
    })
}

/// Returns the value rounded to four digits, for messages.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

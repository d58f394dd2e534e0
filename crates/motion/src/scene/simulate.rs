//! The simulation of a scene, and its results.

use super::extremes::Survey;
use super::framed_scene::{UNCOUPLED, is_uncoupled};
use super::pace::Pace;
use super::prepared::{PARTS, Prepared, damped};
use super::recovered::SceneRows;
use super::{Drift, Extremes, FramedScene, RecoveredMotion, Scene, Scheme, stresses_at_rigid_interfaces};
use crate::dynamics::{Balance, BodyPoint, Configuration, Evaluation, Motion, Orientation, RotationVector};
use crate::integration::{Failure, ObserverEvent, Work};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::memory::refuse_beyond;
use flexbody_body::flex_body::{FlexBody, MotionLoad, Recovery};
use flexbody_linalg::context::Context;
use flexbody_model::LoadKind;
use nalgebra::{DMatrix, DVector, Vector3};

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
///   the duration and, if the run takes long, advice.
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
    let is_in_mean_axes = scene.carried.is_none() && !body.conditions().is_mean();
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
    let mut pace = Pace::new(&run, context);
    let record = |event: ObserverEvent, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if event != ObserverEvent::Instant {
            pace.see(time);
            run.survey(&mut survey, event, time, state, motion)?;
        } else {
            recorder.record(time, state, motion)?;
        }
        if let Some(rows) = &mut rows {
            let z = rows.sampler.state(time, state, motion, &run.forces)?;
            match event {
                ObserverEvent::Instant => rows.record(time, &z),
                _ => rows.see(time, &z),
            }
        }
        Ok::<(), Failure>(())
    };
    let finished = run.integrate(&time, PARTS, record)?;
    // Add the work and the extremes, and warn of motions beyond the range of the model.
    let mut recording = recorder.recording;
    recording.work = finished.work;
    recording.setting.is_in_mean_axes = is_in_mean_axes;
    recording.extremes = survey.extremes(finished.size, finished.least_energy);
    recording.recovered = rows.map(SceneRows::finish);
    let at_interfaces = recording
        .recovered
        .as_ref()
        .map_or_else(Vec::new, |motion| stresses_at_rigid_interfaces(body, motion));
    let found = [
        framed.diagnostics,
        left_out,
        unseen.unwrap_or_default(),
        remarks(body, &recording.extremes),
        at_interfaces,
    ]
    .concat();
    Ok((recording, found))
}

/// Returns notes about recoveries of `body` that it does not have in the frame of the scene.
fn left_out(body: &FlexBody, framed: &FlexBody) -> Vec<Diagnostic> {
    let kept = |name: &str| framed.recoveries().iter().any(|recovery| recovery.name == name);
    let lost = body.recoveries().iter().filter(|recovery| !kept(&recovery.name));
    lost.map(|one| {
        let message =
            format!("recovery `{}` has displacements relative to the frame of the file, and the motion is in mean axes: it is left out", one.name);
        Diagnostic::new(Code::RecoveryLeftOut, message)
    })
    .collect()
}

/// Returns true if rows of a recovery depend on accelerations.
fn has_inertia(recovery: &Recovery) -> bool {
    recovery.motion.iter().any(|one| one.load != MotionLoad::Damping)
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
                body: body.description().name.clone(),
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
                accelerations: body.recoveries().iter().any(has_inertia).then(Vec::new),
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
        if let Some(all) = &mut self.recording.accelerations {
            let (_, angular, modal) = now.evaluation().equations().split(&accelerations);
            all.push((angular, modal.to_vec()));
        }
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
pub(super) fn remarks(body: &FlexBody, extremes: &Extremes) -> Vec<Diagnostic> {
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
    found
}

/// Returns the value rounded to four digits, for messages.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Motion of a body at the output times of its scene. Numbers are in the units of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the scene.
    pub scene: String,
    /// Name of the model of the body.
    pub body: String,
    /// Integration scheme, with the actual step length.
    pub scheme: Scheme,
    /// Output times.
    pub time: Vec<f64>,
    /// State at every output time.
    pub states: Vec<Configuration>,
    /// Energies, momenta, work and impulses at every output time.
    pub balances: Vec<Balance>,
    /// Frame of the numbers, and the conditions that the body is exposed to.
    pub setting: Setting,
    /// Force and torque of the prescribed motion about the origin of the frame, axes of the model; `None`
    /// without prescribed motion.
    pub reactions: Option<Vec<(Vector3<f64>, Vector3<f64>)>>,
    /// Torque of the reference conditions about the origin of the frame, axes of the model; their force is
    /// zero. `None` if the frame is no mean-axis frame: `reactions` then contain everything.
    pub conditions: Option<Vec<Vector3<f64>>>,
    /// Paths of the watched points.
    pub paths: Vec<Path>,
    /// Steps and evaluations of the integration.
    pub work: Work,
    /// Extremes of the motion, including times between the output times.
    pub extremes: Extremes,
    /// Recoveries of the body; `None` for a body without.
    pub recovered: Option<RecoveredMotion>,
    /// Angular acceleration of the frame (axes of the model) and second time derivatives of the modal coordinates at every
    /// output time; `None` if no recovery depends on them.
    pub accelerations: Option<Vec<(Vector3<f64>, Vec<f64>)>>,
}

/// Frame of a recording, and the conditions that the body is exposed to.
///
/// The frame of a recording is that of the scene ([`FramedScene`](super::FramedScene)). Its axes are those of the model
/// and turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name of the interface or node that carries the body.
    pub carrier: Option<String>,
    /// Origin of the frame in model coordinates: the centre of mass of the undeformed body, or the
    /// reference point of the carrier.
    pub origin: Vector3<f64>,
    /// Gravity at the start, axes of the model.
    pub gravity_model: Option<Vector3<f64>>,
    /// Eigenvalues of the carried body; empty without a carrier. Unit: 1/time^2.
    pub eigenvalues: Vec<f64>,
    /// Loads and motions for which the body has geometric stiffness in the frame, without their axes; each once.
    pub stiffening: Vec<String>,
    /// True if the scene leaves the geometric stiffness of the body out.
    pub stiffening_is_off: bool,
    /// True if the modal coordinates are those of the body in mean axes, and the body's file has another frame.
    pub is_in_mean_axes: bool,
}

impl Setting {
    /// Creates the setting of a body in its framed scene.
    pub(super) fn new(body: &FlexBody, scene: &Scene) -> Self {
        let start = RotationVector(scene.initial.rotation).axes();
        let carrier = scene.carried.as_ref().map(|carried| carried.by.to_string());
        let eigenvalues = carrier.as_ref().and_then(|_| body.eigenvalues_in_frame());
        Self {
            carrier,
            origin: body.frame().origin,
            gravity_model: scene.gravity.map(|gravity| start.tr_mul(&gravity)),
            eigenvalues: eigenvalues.unwrap_or_default(),
            stiffening: stiffening_loads(body),
            is_in_mean_axes: false,
            stiffening_is_off: !scene.run.terms.geometric_stiffness,
        }
    }

    /// Returns a description of the origin of the frame.
    pub fn origin_in_words(&self) -> String {
        match &self.carrier {
            Some(carrier) => format!("reference point of {carrier}"),
            None => "centre of mass of the undeformed body".to_owned(),
        }
    }
}

/// Returns the loads and motions for which `body` has geometric stiffness, without their axes, each once.
fn stiffening_loads(body: &FlexBody) -> Vec<String> {
    let mut loads = Vec::new();
    for stiffness in body.geometric_stiffness() {
        let kind = stiffness.load.kind.name().replace('_', " ");
        let words = match &stiffness.load.kind {
            LoadKind::Named(name) => format!("{kind} `{name}`"),
            LoadKind::Force(at) | LoadKind::Moment(at) => format!("{kind} at `{at}`"),
            _ => kind,
        };
        if !loads.contains(&words) {
            loads.push(words);
        }
    }
    loads
}

/// Smallest deformation that is compared: errors are relative to the largest deformation of the motion, but
/// at least to this one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Smallest deflection. Unit: length.
    pub deflection: f64,
    /// Root of the smallest elastic energy: the energy of the mode that needs least of it to deflect some
    /// node by `deflection`.
    pub root_energy: f64,
}

impl Resolution {
    /// Default of the smallest deflection, relative to the largest extent of the body: 10 micrometres per
    /// metre.
    const SMALLEST_DEFLECTION: f64 = 1e-5;

    /// Part of the default below which a stress is rounding. A larger part hides stresses of stiff bodies, a smaller one compares
    /// the rounding of motions that strain nothing.
    const ROUNDING: f64 = 1e-6;

    /// Creates the resolution for `body`; `least` is the smallest deflection, if given.
    pub fn new(body: &FlexBody, least: Option<f64>) -> Self {
        let deflection = least.unwrap_or(Self::SMALLEST_DEFLECTION * body.extent());
        Self { deflection, root_energy: root_energy_at(body, deflection) }
    }

    /// Returns the root of the elastic energy below which the stresses of a recovery with a limit are rounding.
    pub fn root_energy_of_rounding(body: &FlexBody) -> f64 {
        root_energy_at(body, Self::ROUNDING * Self::SMALLEST_DEFLECTION * body.extent())
    }
}

/// Returns the root of the elastic energy of the mode that needs least of it to deflect some node by `deflection`.
fn root_energy_at(body: &FlexBody, deflection: f64) -> f64 {
    let root_energy =
        |(j, lambda): (usize, &f64)| (0.5 * lambda).sqrt() * deflection / body.largest_displacement(j);
    body.modes().eigenvalue.iter().enumerate().map(root_energy).fold(f64::INFINITY, f64::min)
}

/// Path of a point of the body. The axes of the model turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Name of the point in the scene.
    pub name: String,
    /// Position at every output time, world axes.
    pub place: Vec<Vector3<f64>>,
    /// Deflection from the undeformed body at every output time, axes of the model (turning with the body).
    pub deflection: Vec<Vector3<f64>>,
    /// Velocity of the position at every output time, world axes.
    pub velocity: Vec<Vector3<f64>>,
    /// Acceleration of the position at every output time, world axes; where a load or motion jumps, the
    /// value after the jump.
    pub acceleration: Vec<Vector3<f64>>,
}

impl Recording {
    /// Returns the drift of energy and momenta.
    pub fn drift(&self) -> Drift {
        self.extremes.drift
    }
}

impl Path {
    /// Creates a path without positions.
    pub(super) fn new(name: String) -> Self {
        let none = Vec::new;
        Self { name, place: none(), deflection: none(), velocity: none(), acceleration: none() }
    }
}

// Reactions of the reference conditions of a body: the forces that keep its frame in the position that the
// conditions define.

/// Reaction of mean axes (Tisserand), the reference conditions of free-surface modes.
///
/// Displacements u of the nodes refer to a frame that conditions C u = 0 tie to the body, with multipliers
/// lambda in the equations of all nodes (theory 6.10). C'lambda has no resultant force and the torque about
/// the origin of the frame
///
/// ```text
/// sum_i u_i x (K u + D u')_i = Q'W3 m_ff^-1 (K_ff q + D_ff qd)
/// ```
///
/// (theory 6.12): the moment of linear elastic and damping forces about the deformed body. It does no work
/// and acts on no mode. It measures the difference, of second order in q, between elasticity that is linear
/// in a floating frame and elasticity that turns with the material. The right side equals the left one if
/// the modes are eigenvectors (K Psi = M Psi Lambda); for other shapes it contains the part of the elastic
/// forces in the span of the modes.
#[derive(Debug, Clone)]
struct MeanAxes {
    /// Blocks of W3 for the axes about which the body turns.
    w3: Vec<(usize, DMatrix<f64>)>,
    /// m_ff^-1 K_ff and m_ff^-1 D_ff.
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
}

impl MeanAxes {
    /// Creates the reaction for `body`. Returns `None` if its frame is no mean-axis frame (C1 and C2 do not
    /// vanish, as for a carried body), if it does not hold W3, or if its mass matrix is general: couples on
    /// nodes that turn are no sums over the invariants.
    pub(super) fn new(body: &FlexBody) -> Option<Self> {
        let (invariants, nf) = (body.invariants(), body.n_modes());
        let w3 = invariants.w3()?;
        if invariants.general().is_some() || !is_uncoupled(body) || !turns_no_mode(body) {
            return None;
        }
        let m = invariants.modal_mass();
        let mass = DMatrix::from_fn(nf, nf, |i, j| m[(i, j)]).cholesky()?;
        let (k, d) = (invariants.modal_stiffness(), body.damping());
        let axes = if body.dimension() == 2 { 2..3 } else { 0..3 };
        Some(Self {
            w3: axes.map(|a| (a, DMatrix::from_fn(nf, nf, |i, j| w3[(a * nf + i, j)]))).collect(),
            stiffness: mass.solve(&DMatrix::from_fn(nf, nf, |i, j| k[(i, j)])),
            damping: mass.solve(&DMatrix::from_fn(nf, nf, |i, j| d[(i, j)])),
        })
    }

    /// Returns the torque about the origin of the frame, axes of the frame.
    pub(super) fn torque(&self, q: &[f64], qd: &[f64]) -> Vector3<f64> {
        let (q, qd) = (DVector::from_column_slice(q), DVector::from_column_slice(qd));
        let internal = &self.stiffness * &q + &self.damping * qd;
        let mut torque = Vector3::zeros();
        self.w3.iter().for_each(|(a, w3)| torque[*a] = q.dot(&(w3 * &internal)));
        torque
    }
}

/// Returns true if angular accelerations of the frame excite no mode.
fn turns_no_mode(body: &FlexBody) -> bool {
    let invariants = body.invariants();
    let (c2, inertia, modal) = (invariants.c2(), invariants.inertia(), invariants.modal_mass());
    let largest = inertia.trace();
    (0..body.n_modes())
        .all(|j| (0..3).all(|k| c2[(k, j)].abs() <= UNCOUPLED * (largest * modal[(j, j)]).sqrt()))
}

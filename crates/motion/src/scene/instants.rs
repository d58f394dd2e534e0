//! Complete state of a motion at given times, for evaluations of the equations of all nodes.

use super::prepared::{Prepared, damped};
use super::recovery_errors::TracedRecoveries;
use super::row_states::RowSampler;
use super::{FramedScene, Recording, Scene, Scheme, Trace, simulate};
use crate::dynamics::Motion;
use crate::integration::{Failure, ObserverEvent};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// State, accelerations and loads of a body at one time. Vectors are along the axes of the frame of the
/// [`FramedScene`], about its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Time of the state.
    pub time: f64,
    /// Velocity V of the origin of the frame.
    pub velocity: Vector3<f64>,
    /// Rates of the components of V.
    pub velocity_rate: Vector3<f64>,
    /// Angular velocity omega of the frame.
    pub omega: Vector3<f64>,
    /// Rates of the components of omega.
    pub omega_rate: Vector3<f64>,
    /// Modal coordinates (nf).
    pub q: Vec<f64>,
    /// Rates of the modal coordinates (nf).
    pub qd: Vec<f64>,
    /// Accelerations of the modal coordinates (nf).
    pub qdd: Vec<f64>,
    /// Acceleration of gravity.
    pub gravity: Vector3<f64>,
    /// Force and torque of every load of the scene; the torque as generalised force on the rotation vector
    /// of its point.
    pub loads: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// State that the rows of recoveries with a limit are linear in ([`RowLayout`](super::RowLayout)); empty without.
    pub row_state: Vec<f64>,
}

/// Computes the motion of `body` in `scene` at `times`, ascending from 0 to the end of the scene.
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn instants(body: &FlexBody, scene: &Scene, times: &[f64]) -> Result<Vec<Instant>> {
    let framed = FramedScene::new(body, scene)?;
    let body = &*damped(&framed.body, &framed.scene)?;
    let run = Prepared::new(body, &framed.scene)?;
    let sampler = TracedRecoveries::new(body, &framed.scene)?.map(|(_, sampler)| sampler);
    let mut seen = Vec::with_capacity(times.len());
    let look = |event: ObserverEvent, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if event == ObserverEvent::Instant {
            seen.push(see(&run, sampler.as_ref(), time, state, motion)?);
        }
        Ok::<(), Failure>(())
    };
    run.integrate(times, 1, look)?;
    Ok(seen)
}

fn see(
    run: &Prepared<'_>,
    sampler: Option<&RowSampler>,
    time: f64,
    state: &[f64],
    motion: &mut Motion<'_>,
) -> std::result::Result<Instant, Failure> {
    let rates = motion.accelerations(time, state)?;
    let (linear, angular, modal) = run.equations.split(rates);
    let qdd = modal.to_vec();
    let now = motion.evaluate(time, state)?;
    let (place, evaluation) = (now.place(), now.evaluation());
    let (velocity, omega) = evaluation.rigid_velocity();
    let configuration = now.configuration();
    let worked = run.forces.acting(time, place).map(|(point, force, torque)| {
        let turned =
            if torque == Vector3::zeros() { torque } else { point.turned_torque(evaluation, &torque) };
        (force, turned)
    });
    let (gravity, loads) = (run.forces.gravity(place), worked.collect());
    let row_state = match sampler {
        Some(sampler) => sampler.state(time, state, motion, &run.forces)?,
        None => Vec::new(),
    };
    Ok(Instant {
        time,
        velocity,
        velocity_rate: linear,
        omega,
        omega_rate: angular,
        gravity,
        loads,
        row_state,
        q: configuration.q,
        qd: configuration.qd,
        qdd,
    })
}

// Check of a rotation rate for changes with finer integration steps.

/// Largest relative error of a rate due to the error of the momentum, above which the run is repeated with
/// finer steps. The limit is 1e4 times the error of a needle of 1:1e5, so that few bodies are simulated
/// twice without need: with the default tolerance those beyond 1:1000.
const MAX_RATE_ERROR: f64 = 1e-3;

/// Error of the momentum per step of the conserving method, relative to the momentum: the method conserves
/// the whole momentum, but not its component about an axis of the body.
const CONSERVING_ERROR: f64 = 1e-9;

/// Change of a rate by finer steps, relative to the largest value of this rate, above which a warning
/// reports it.
const MAX_RATE_CHANGE: f64 = 1e-2;

/// Rate, relative to the largest rate about any axis, below which changes are not reported: a body that
/// turns about a perpendicular axis has a rate about this axis that is rounding.
const SMALL_RATE: f64 = 1e-3;

/// Tolerance of the finer run, relative to that of the scene.
const FINER_TOLERANCE: f64 = 1e-2;
/// Step length of the finer run, relative to that of the scene.
const FINER_STEP: f64 = 0.5;

/// Finest tolerance requested from the adaptive method.
const FINEST_TOLERANCE: f64 = 1e-13;

/// Returns a warning if the rate about the axis of least inertia changes by more than 1 % with finer steps.
///
/// A rate is a momentum over an inertia. The momentum about each axis has the error of the whole momentum,
/// and for the axis of a needle this error is divided by an inertia that may be ten decades smaller. The
/// run is repeated with finer steps only if the error of a step could be significant. The rates of both
/// runs are compared at the output times of `recording`.
///
/// * `recording`: the motion of `body` in `scene`.
/// * `context`: its memory limits the second recording; its listener hears of it.
///
/// # Errors
/// The errors of [`FramedScene::new`]. If the finer run would take too long, the result is `None`.
pub fn unsettled_rate(
    body: &FlexBody,
    scene: &Scene,
    recording: &Recording,
    context: &Context<'_>,
) -> Result<Option<Diagnostic>> {
    if scene.prescribes() {
        return Ok(None);
    }
    let framed = FramedScene::new(body, scene)?;
    let inertia = framed.body.invariants().inertia();
    let Some(finer) = finer(&inertia, scene, recording.scheme) else { return Ok(None) };
    context.phase("simulation with finer steps");
    let Ok((finer, _)) = simulate(body, &finer, context) else { return Ok(None) };
    Ok(change(&inertia, recording, &finer))
}

/// Returns the scene with finer steps, if the error of a step could be significant for the rate about the
/// axis of least inertia.
fn finer(inertia: &Matrix3<f64>, scene: &Scene, scheme: Scheme) -> Option<Scene> {
    let principal = inertia.symmetric_eigenvalues();
    let (least, most) = (principal.min(), principal.max());
    let (error, scheme) = match scheme {
        Scheme::Adaptive { tolerance } => {
            let finer = (FINER_TOLERANCE * tolerance).max(FINEST_TOLERANCE);
            (tolerance, (finer < tolerance).then_some(Scheme::Adaptive { tolerance: finer })?)
        }
        Scheme::Conserving { order, step } => {
            (CONSERVING_ERROR, Scheme::Conserving { order, step: Some(FINER_STEP * step?) })
        }
    };
    let is_suspect = least > 0.0 && error * most > MAX_RATE_ERROR * least;
    is_suspect.then(|| {
        let mut finer = scene.clone();
        finer.run.scheme = scheme;
        finer
    })
}

/// Returns a warning if finer steps change the rate about the axis of least inertia significantly.
fn change(inertia: &Matrix3<f64>, recording: &Recording, finer: &Recording) -> Option<Diagnostic> {
    let eigen = inertia.symmetric_eigen();
    let axis: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    let rates = |recording: &Recording| -> Vec<f64> {
        recording.states.iter().map(|state| axis.dot(&state.omega)).collect()
    };
    let (coarse, fine) = (rates(recording), rates(finer));
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |most, value| most.max(value.abs()));
    let of_axis = largest(&mut fine.iter().copied());
    let of_all = largest(&mut finer.states.iter().map(|state| state.omega.norm()));
    let differences: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
    let changed = largest(&mut differences.iter().copied());
    if changed <= MAX_RATE_CHANGE * of_axis || changed <= SMALL_RATE * of_all {
        return None;
    }
    let at = differences.iter().position(|d| d.abs() == changed)?;
    let [x, y, z] = axis.map(|c| if c.abs() < 5e-4 { 0.0 } else { c }).into();
    let ratio = eigen.eigenvalues.max() / eigen.eigenvalues.min();
    let message = format!(
        "the angular velocity about the axis of least inertia ({x:.3}, {y:.3}, {z:.3}) depends on the step: at time {:.4e} it is {:.4e}, with finer steps {:.4e}; the inertias differ by a factor of {ratio:.1e}",
        recording.time[at], coarse[at], fine[at]
    );
    Some(Diagnostic::new(Code::RateUnsettled, message))
}

// Frequency of the modes that contribute to a motion.

/// Ratio of neighbouring intervals above which differences are not taken: the samples are at a break.
const MAX_INTERVAL_RATIO: f64 = 8.0;

/// Returns the largest circular frequency of the modes that contribute to the motion: modes whose root of
/// the elastic energy is at least this `part` of the tolerances. For a carried body the frequencies are not
/// above those of the free body. A mode that merely follows slow forces does not oscillate at its natural frequency
/// omega; the criterion is therefore the amplitude q'' / omega^2 that its acceleration q'' would have there.
pub fn highest_excited_rate(body: &FlexBody, scene: &Scene, motion: &Trace, part: f64) -> f64 {
    ExcitedRates::new(body, scene, motion, part).between(f64::NEG_INFINITY, f64::INFINITY)
}

/// Criterion of [`highest_excited_rate`], also for a part of the run: a mode that decays, or that a pulse excites late, counts
/// while it moves.
pub struct ExcitedRates<'m> {
    motion: &'m Trace,
    rates: Vec<f64>,
    /// Smallest root of the elastic energy that counts.
    least: f64,
}

impl<'m> ExcitedRates<'m> {
    /// Creates the criterion for a motion of `body` in `scene`; see [`highest_excited_rate`] for `part`.
    pub fn new(body: &FlexBody, scene: &Scene, motion: &'m Trace, part: f64) -> Self {
        let rates: Vec<f64> = body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
        let roots =
            rates.iter().zip(&motion.extremes.amplitudes).map(|(rate, amplitude)| rate * amplitude.abs());
        let tolerance = &scene.requirements.tolerance;
        let least = part * tolerance.of_deformation() * roots.fold(0.0, f64::max);
        Self { motion, rates, least }
    }

    /// Returns the largest circular frequency of the modes that contribute to the motion between two times.
    pub fn between(&self, start: f64, end: f64) -> f64 {
        let time = &self.motion.time;
        let first = time.partition_point(|own| *own < start).saturating_sub(1);
        let last = (time.partition_point(|own| *own <= end) + 1).min(time.len());
        let largest = accelerations(self.motion, self.rates.len(), first..last.max(first));
        let counts = |j: &usize| largest[*j] > 0.0 && largest[*j] / self.rates[*j] >= self.least;
        (0..self.rates.len()).rev().find(counts).map_or(0.0, |last| self.rates[last])
    }
}

/// Returns the largest |q''| of every mode at the samples of a range, by differences between those with similar spacing.
fn accelerations(motion: &Trace, modes: usize, samples: Range<usize>) -> Vec<f64> {
    let mut largest = vec![0.0f64; modes];
    for (times, q) in motion.time[samples.clone()].windows(3).zip(motion.q[samples].windows(3)) {
        let (before, after) = (times[1] - times[0], times[2] - times[1]);
        if !(before > 0.0
            && after > 0.0
            && before < MAX_INTERVAL_RATIO * after
            && after < MAX_INTERVAL_RATIO * before)
        {
            continue;
        }
        for (j, largest) in largest.iter_mut().enumerate() {
            let slopes = [(q[1][j] - q[0][j]) / before, (q[2][j] - q[1][j]) / after];
            *largest = largest.max(2.0 * (slopes[1] - slopes[0]).abs() / (before + after));
        }
    }
    largest
}

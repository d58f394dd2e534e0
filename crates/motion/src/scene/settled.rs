//! Rotation whose result still changes with the steps of the integration.

use super::{Recording, Scene, Scheme, Stage, simulate};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use nalgebra::{Matrix3, Vector3};

/// Largest error that the momentum may make of a rate, relative to the largest rate, before the run is repeated with finer
/// steps. The bound is 1e4 times the error of a needle of 1:1e5, so that few bodies are simulated twice for nothing:
/// with the default tolerance those beyond 1:1000.
const SUSPECT: f64 = 1e-3;

/// Error of the momentum per step of the conserving method, relative to the momentum: it conserves the whole, not its part
/// about one axis of the body.
const CONSERVING_ERROR: f64 = 1e-9;

/// Change of a rate by finer steps that is told, relative to the largest of this rate.
const UNSETTLED: f64 = 1e-2;

/// Part of the largest rate about any axis below which a change is not told: a body that turns across its axis has a rate
/// about it that is rounding.
const SMALL_RATE: f64 = 1e-3;

/// Part of the tolerance, and of the step, that the finer run has.
const FINER_TOLERANCE: f64 = 1e-2;
const FINER_STEP: f64 = 0.5;

/// Finest tolerance that the adaptive method is asked for.
const FINEST_TOLERANCE: f64 = 1e-13;

/// A warning where the rate about the axis of least inertia changes by more than 1 % with finer steps.
///
/// A rate is a momentum over an inertia. The momentum about each axis has the error of the whole, and about the axis of a
/// needle this is divided by an inertia that is ten decades smaller. Only where the error of a step could matter so much
/// the run is repeated with finer steps, and the rates of both are compared at the instants of `recording`.
///
/// * `recording`: the motion of `body` in `scene`.
/// * `context`: its memory bounds another recording.
///
/// # Errors
/// Those of [`Stage::new`]. A finer run that takes too long is none: then nothing is told.
pub fn unsettled_rate(
    body: &FlexBody,
    scene: &Scene,
    recording: &Recording,
    context: &Context<'_>,
) -> Result<Option<Diagnostic>> {
    if scene.prescribes() {
        return Ok(None);
    }
    let stage = Stage::new(body, scene)?;
    let inertia = stage.body.invariants().inertia();
    let Some(finer) = finer(&inertia, scene, recording.scheme) else { return Ok(None) };
    let Ok((finer, _)) = simulate(body, &finer, &context.unheard()) else { return Ok(None) };
    Ok(change(&inertia, recording, &finer))
}

/// The scene with finer steps, if an error of a step could be told from the rate about the axis of least inertia.
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
    let is_suspect = least > 0.0 && error * most > SUSPECT * least;
    is_suspect.then(|| {
        let mut finer = scene.clone();
        finer.run.scheme = scheme;
        finer
    })
}

/// What finer steps change of the rate about the axis of least inertia, if it counts.
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
    if changed <= UNSETTLED * of_axis || changed <= SMALL_RATE * of_all {
        return None;
    }
    let at = differences.iter().position(|d| d.abs() == changed)?;
    let [x, y, z] = axis.map(|c| if c.abs() < 5e-4 { 0.0 } else { c }).into();
    let ratio = eigen.eigenvalues.max() / eigen.eigenvalues.min();
    let message = format!(
        "the angular velocity about the axis of least inertia ({x:.3}, {y:.3}, {z:.3}) is not settled: at time {:.4e} it is {:.4e}, with finer steps {:.4e}; inertias differ by a factor of {ratio:.1e}",
        recording.time[at], coarse[at], fine[at]
    );
    Some(Diagnostic::new(Code::RateUnsettled, message))
}

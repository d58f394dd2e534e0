//! Check of a rotation rate for changes with finer integration steps.

use super::{FramedScene, Recording, Scene, Scheme, simulate};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use nalgebra::{Matrix3, Vector3};

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
/// * `context`: its memory limits the second recording.
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
    let Ok((finer, _)) = simulate(body, &finer, &context.without_listener()) else { return Ok(None) };
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

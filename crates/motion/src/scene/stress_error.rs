//! Error of a motion whose body lacks the stress stiffness of its spin, measured by an estimate of that stiffness.
//!
//! The motion is computed again with the estimated stiffness, and the difference is the estimated error. It contains the
//! change of static deflections and the drift of phases over the run alike.

use super::prepared::{damped, ends_a_run};
use super::{Extremes, FramedScene, Measure, OutputErrors, Scene, Trace, trace, trace_at};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_body::flex_body::{FlexBody, axis_in_words};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use nalgebra::Vector3;

/// Factor for the uncertainty of the estimate: the estimated change of stiffness is at least 0.84 times the true one for 95 %
/// of solids, and 0.64 times for shells.
const UNCERTAINTY: f64 = 1.5;

/// Part of the tolerances that the error may take in a result that is said to hold. The rest is for other errors.
const MAX_PART: f64 = 0.5;

/// Part of the smallest tolerance that a change of stiffness with its drift must reach for the motion to be computed again.
/// A larger value saves runs and misses errors of this size.
const MIN_PART: f64 = 0.05;

/// Estimated error of a motion by the stress stiffness of spin that its body does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct StressError {
    /// Estimated errors of the motion; infinite if the motion with the estimated stiffness cannot be computed.
    pub errors: OutputErrors,
    /// Largest error over its tolerance, times 1.5 for the uncertainty of the estimate.
    pub worst: f64,
    /// Largest part of the stiffness of any motion that the missing stress changes.
    pub part: f64,
    /// Angular velocity of this part, axes of the body.
    pub omega: Vector3<f64>,
    /// True if the body has an estimate of its own; false if 2.5 (w / Omega_1)^2 stands in.
    pub is_of_body: bool,
    /// Name of the quantity with the largest error over its tolerance, its error, and its tolerance.
    pub decisive: (&'static str, f64, f64),
}

impl StressError {
    /// Measures the motion `own` of `body` in `scene` against the motion with the missing stress stiffness. Body, scene and
    /// motion are in one frame, with the damping of the scene. Returns `None` if the body lacks nothing that the spin of the
    /// motion needs, or if the effect is a small part of the tolerances.
    ///
    /// # Errors
    /// The errors of [`trace_at`], except those that end a run.
    pub fn of_trace(
        body: &FlexBody,
        scene: &Scene,
        own: &Trace,
        context: &Context<'_>,
    ) -> Result<Option<Self>> {
        let Some((part, omega)) = missing_part(body, scene, &own.extremes) else { return Ok(None) };
        let stressed = body.with_missing_stiffness(scene.run.terms.geometric_stiffness)?;
        let mut scene = scene.clone();
        scene.run.terms.geometric_stiffness = true;
        scene.run.terms.stress_without_w2 = true;
        scene.run.scheme = own.scheme;
        let all: Vec<usize> = (0..body.n_modes()).collect();
        let errors = match trace_at(&stressed, &scene, &own.time, &context.without_listener()) {
            Ok(other) => Measure::new(body, &scene, own).of_subset(&other, &all).largest(),
            Err(error) if error.diagnostics().iter().all(|diagnostic| ends_a_run(diagnostic.code())) => {
                OutputErrors::all(Some(f64::INFINITY))
            }
            Err(error) => return Err(error),
        };
        let tolerance = &scene.requirements.tolerance;
        Ok(Some(Self {
            worst: UNCERTAINTY * errors.worst(tolerance),
            decisive: errors.decisive(tolerance),
            errors,
            part,
            omega: body.frame().axes * omega,
            is_of_body: !body.estimated_stiffness().is_empty(),
        }))
    }

    /// Measures the motion of `body` in `scene`, whose `extremes` are known. Returns `None` in the cases of
    /// [`StressError::of_trace`].
    ///
    /// # Errors
    /// The errors of [`trace`], except those that end a run.
    pub fn of_run(
        body: &FlexBody,
        scene: &Scene,
        extremes: &Extremes,
        context: &Context<'_>,
    ) -> Result<Option<Self>> {
        let framed = FramedScene::new(body, scene)?;
        let body = &*damped(&framed.body, &framed.scene)?;
        if missing_part(body, &framed.scene, extremes).is_none() {
            return Ok(None);
        }
        let mut scene = framed.scene.into_owned();
        scene.requirements.damping = None;
        context.phase("stress of the spin");
        match trace(body, &scene, context) {
            Ok((own, _)) => Self::of_trace(body, &scene, &own, context),
            Err(error) if error.diagnostics().iter().all(|diagnostic| ends_a_run(diagnostic.code())) => {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Returns true if the error leaves at least half of the tolerances to others.
    pub fn is_small(&self) -> bool {
        self.worst <= MAX_PART
    }

    /// Returns the part of the tolerances that the errors leave to others: all of it if nothing is missing, or if the error
    /// is not small, so that nothing can hold.
    pub fn left(known: Option<&Self>) -> f64 {
        1.0 - known.filter(|own| own.is_small()).map_or(0.0, |own| own.worst)
    }

    /// Returns the error in words: `an error of about 48 % in stress (tolerance 2 %)`.
    pub fn in_words(&self) -> String {
        let (name, error, tolerance) = self.decisive;
        let size = |value: f64| match name {
            "attitude" => format!("{} rad", significant(value, 2)),
            _ => format!("{} %", significant(100.0 * value, 2)),
        };
        if error.is_infinite() {
            return "an error that no run can measure".to_owned();
        }
        format!("an error of about {} in {name} (tolerance {})", size(error), size(tolerance))
    }

    /// Returns the warning that the result may be wrong by this error; `None` if it is small.
    pub fn warning(&self, body: &FlexBody) -> Option<Diagnostic> {
        (!self.is_small()).then(|| {
            let source = if self.is_of_body { "" } else { " (bound 2.5 (w / Omega_1)^2, the body has no estimate)" };
            let message = format!(
                "the body has no geometric stiffness of spin: the spin of {} rad/{} about {} changes up to {} % of the stiffness by its stress{source}: {}",
                significant(self.omega.norm(), 4),
                body.units().time.name(),
                axis_in_words(&self.omega),
                significant(100.0 * self.part, 2),
                self.in_words(),
            );
            Diagnostic::new(Code::SpinSoftens, message)
        })
    }
}

/// Returns the largest part of the stiffness that the missing stress changes in a motion, and its angular velocity; `None`
/// if its effect over the run is a small part of the tolerances.
fn missing_part(body: &FlexBody, scene: &Scene, extremes: &Extremes) -> Option<(f64, Vector3<f64>)> {
    if extremes.spin == 0.0 {
        return None;
    }
    let uses_given = scene.run.terms.geometric_stiffness;
    let part = |omega: &Vector3<f64>| Some((body.missing_part(omega, uses_given)?, *omega));
    let (part, omega) = first_largest(extremes.spins.iter().filter_map(part), |pair| pair.0)?;
    // A change of stiffness drifts by half of it times Omega_1 T (theory section 7).
    let first = body.modes().eigenvalue.first()?.sqrt();
    let drift = 0.5 * first * scene.run.duration.unwrap_or(0.0);
    let tolerance = &scene.requirements.tolerance;
    let attitude = if scene.prescribes() { f64::INFINITY } else { tolerance.errors.attitude };
    let others = tolerance.errors.reaction.min(tolerance.errors.recovery).min(tolerance.of_deformation());
    let smallest = attitude.min(others);
    (part * (1.0 + drift) > MIN_PART * smallest).then_some((part, omega))
}

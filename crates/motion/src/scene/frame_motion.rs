//! Motion of the frame of a body in a scene, the size of a stiffness that this motion causes, and the change of the motion
//! by a property that the body does not have.

use super::{FramedScene, LoadCases, Measure, OutputErrors, Scene, Trace, instants, trace, trace_at};
use crate::dynamics::Terms;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Recovery};
use flexbody_body::invariants::{InertiaShares, relative_norm};
use flexbody_linalg::context::Context;
use flexbody_model::{GeometricStiffness, LoadKind, RigidAcceleration, UnitLoad};

/// Number of instants at which the stiffness is evaluated exactly. Beyond it the bound over the directions counts; a
/// larger value costs an eigenvalue problem of the modes for each.
const MAX_EVALUATIONS: usize = 200;

/// Motion of the frame of a body in a load case.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameMotion {
    /// Name of the load case.
    pub scene: String,
    /// Body in the frame of the load case, which a carrier may hold.
    pub body: FlexBody,
    /// Acceleration minus gravity, angular acceleration and spin at the output times, along the axes of that frame.
    pub motion: Vec<RigidAcceleration>,
    /// Run of the load case; `None` for a motion of the frame that no scene states.
    pub run: Option<CaseRun>,
}

/// Body, load case and motion of [`FrameMotion`].
#[derive(Debug, Clone, PartialEq)]
pub struct CaseRun {
    body: FlexBody,
    scene: Scene,
    trace: Trace,
}

/// Property of a body that another program may leave out.
#[derive(Debug, Clone, PartialEq)]
pub enum Omission {
    /// Damping of the modes.
    Damping,
    /// Geometric stiffness for these loads.
    GeometricStiffness(Vec<UnitLoad>),
    /// Change of the inertia with the deformation: W1, W2 and W3.
    DeformedInertia,
}

impl FrameMotion {
    /// Computes the motion of the frame of `body` in a load case.
    ///
    /// # Errors
    /// The errors of [`simulate`](super::simulate).
    pub fn of(body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<Self> {
        let framed = FramedScene::new(body, scene)?;
        let (trace, _) = trace(body, scene, context)?;
        let seen = instants(body, scene, &trace.time)?;
        let motion = seen.iter().map(|now| {
            let linear = now.velocity_rate + now.omega.cross(&now.velocity) - now.gravity;
            RigidAcceleration::new(linear, now.omega_rate, &now.omega)
        });
        let motion = motion.collect();
        let run = Some(CaseRun { body: body.clone(), scene: scene.clone(), trace });
        Ok(Self { scene: scene.name.clone(), body: framed.body.into_owned(), motion, run })
    }

    /// Returns the largest errors of the motion of the body without a property. `None` if no scene states the motion.
    /// Infinite if the motion without it cannot be computed.
    pub fn change_without(&self, omission: &Omission) -> Option<OutputErrors> {
        let run = self.run.as_ref()?;
        let unknown = OutputErrors::all(Some(f64::INFINITY));
        Some(run.change_without(omission).unwrap_or(unknown))
    }

    /// Computes the motion in each load case.
    ///
    /// # Errors
    /// The errors of [`FrameMotion::of`].
    pub fn in_cases(body: &FlexBody, cases: &LoadCases, context: &Context<'_>) -> Result<Vec<Self>> {
        cases.iter().map(|scene| Self::of(body, scene, context)).collect()
    }

    /// Returns the largest ratio during the motion of a stiffness to that of the body against any deformation.
    /// `stiffness` has the matrices of unit accelerations, angular accelerations and products of spin, in the frame of
    /// [`FrameMotion::body`]. Returns `None` if K_ff is not positive definite.
    pub fn largest_share(&self, stiffness: &[GeometricStiffness<Mat<f64>>]) -> Option<f64> {
        let own = self.body.invariants().modal_stiffness();
        let shares = InertiaShares::of(stiffness, own.as_ref())?;
        let bound = |motion: &RigidAcceleration| {
            motion.spin.trace() * shares.spin_squared
                + motion.angular.norm() * shares.angular_acceleration
                + motion.linear.norm() * shares.acceleration
        };
        // The instants with the largest bounds come first, until no bound exceeds the largest value.
        let mut bounds: Vec<(f64, &RigidAcceleration)> =
            self.motion.iter().map(|motion| (bound(motion), motion)).collect();
        bounds.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut largest = 0.0f64;
        for (count, (bound, motion)) in bounds.into_iter().enumerate() {
            if bound <= largest {
                break;
            }
            if count == MAX_EVALUATIONS {
                return Some(bound);
            }
            largest = largest.max(relative_norm(stiffness_of(stiffness, motion).as_ref(), own.as_ref())?);
        }
        Some(largest)
    }
}

impl CaseRun {
    fn change_without(&self, omission: &Omission) -> Result<OutputErrors> {
        let mut scene = self.scene.clone();
        scene.run.scheme = self.trace.scheme;
        let mut parts = self.body.clone().into_parts();
        match omission {
            Omission::Damping => {
                parts.modes.damping_ratio.fill(0.0);
                parts.modes.modal_damping = None;
                parts.recoveries.iter_mut().for_each(Recovery::remove_damping);
            }
            Omission::GeometricStiffness(loads) => {
                parts.geometric_stiffness.retain(|stiffness| !loads.contains(&stiffness.load));
                parts.rotated_stiffness.retain(|one| !loads.contains(&one.load));
            }
            Omission::DeformedInertia => {
                let geometric_stiffness = scene.run.terms.geometric_stiffness;
                scene.run.terms = Terms { geometric_stiffness, ..Terms::NONE };
            }
        }
        let without = trace_at(&FlexBody::new(parts)?, &scene, &self.trace.time, &Context::QUIET)?;
        let framed = FramedScene::new(&self.body, &self.scene)?;
        let all: Vec<usize> = (0..framed.body.n_modes()).collect();
        Ok(Measure::new(&framed.body, &framed.scene, &self.trace).of_subset(&without, &all).largest())
    }
}

/// Returns the stiffness of a motion from those of unit motions.
fn stiffness_of(stiffness: &[GeometricStiffness<Mat<f64>>], motion: &RigidAcceleration) -> Mat<f64> {
    let n = stiffness.first().map_or(0, |stiffness| stiffness.matrix.nrows());
    stiffness.iter().fold(Mat::zeros(n, n), |sum: Mat<f64>, one| {
        let factor = match one.load.kind {
            LoadKind::Acceleration => motion.linear[one.load.component],
            LoadKind::AngularAcceleration => motion.angular[one.load.component],
            LoadKind::Spin => motion.spin[LoadKind::SPIN[one.load.component]],
            LoadKind::Force(_) | LoadKind::Moment(_) | LoadKind::Named(_) => 0.0,
        };
        sum + &one.matrix * faer::Scale(factor)
    })
}

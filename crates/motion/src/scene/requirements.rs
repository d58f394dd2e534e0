//! What a scene demands of a body, and what it says about motion that nobody simulates. All of it is
//! optional.

use super::{Axes, PerQuantity};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_model::{Damping, DampingRatios, FeModel};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// What decides which terms and modes a body needs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Requirements {
    /// Motion beyond that of the run.
    pub motion: MotionRange,
    /// How the body is joined to others.
    pub attachment: Attachment,
    /// Largest deflections, stresses and modal amplitudes.
    pub limits: Limits,
    /// Highest frequency of interest, oscillations per time.
    pub band: Option<f64>,
    /// Damping ratios of the modes of the body in this scene; none: those of the body.
    pub damping: Option<DampingRatios>,
    /// True if `damping` takes the place of that of the body; else a body with damping of its own is refused.
    pub replaces_damping: bool,
    /// Largest errors.
    pub tolerance: Tolerance,
    /// Multiplications that an evaluation of the equations of motion may take: instead of tolerances.
    pub multiplications: Option<usize>,
}

impl Requirements {
    /// `body` with this damping, where there is one.
    ///
    /// * `by`: what states it.
    ///
    /// # Errors
    /// [`SceneDamping`](Code::SceneDamping) when the body has one of its own that this does not replace; those of
    /// [`FlexBody::new`].
    pub fn damped<'b>(&self, body: &'b FlexBody, by: &str) -> Result<Cow<'b, FlexBody>> {
        let Some(ratios) = &self.damping else { return Ok(Cow::Borrowed(body)) };
        if body.damping().norm_max() > 0.0 {
            self.refuse_second_damping("body", by)?;
        }
        Ok(Cow::Owned(body.with_damping_ratios(ratios)?))
    }

    /// Refuses damping beside that of a body or model, unless it takes the place of that.
    ///
    /// * `of`: what has the other damping. `by`: what states this one.
    ///
    /// # Errors
    /// [`SceneDamping`](Code::SceneDamping).
    fn refuse_second_damping(&self, of: &str, by: &str) -> Result<()> {
        match &self.damping {
            Some(ratios) if !self.replaces_damping => {
                let message =
                    format!("{by} states the damping ratio {ratios}, and the {of} has damping of its own");
                Err(Diagnostic::new(Code::SceneDamping, message).into())
            }
            _ => Ok(()),
        }
    }

    /// Refuses damping beside that of a model that bodies are made of, before that is done.
    ///
    /// # Errors
    /// [`SceneDamping`](Code::SceneDamping).
    pub fn refuse_damping_beside(&self, model: &FeModel, scene: &str) -> Result<()> {
        match model.damping() {
            None | Some(Damping::Ratio(0.0)) => Ok(()),
            Some(_) => self.refuse_second_damping("model", &format!("scene `{scene}`")),
        }
    }
}

/// Largest rotation of the body frame; `None`: what the run shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionRange {
    /// Angular velocity.
    pub angular_velocity: Option<Range>,
    /// Angular acceleration.
    pub angular_acceleration: Option<Range>,
    /// Axes of components, which turn with the body: not those of the world.
    pub axes: Axes,
}

/// Largest magnitude of a vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// In any direction.
    Any(f64),
    /// Of the components along axes that turn with the body.
    Axes(Vector3<f64>),
}

impl Range {
    /// Largest length of a vector within the range.
    pub fn length(&self) -> f64 {
        match self {
            Self::Any(length) => *length,
            Self::Axes(components) => components.norm(),
        }
    }
}

/// How a body is joined to others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Attachment {
    /// Kind.
    pub kind: AttachmentKind,
    /// Inertia that joints attach to the body; zero is the conservative default.
    pub inertia: Matrix3<f64>,
    /// Its axes, which turn with the body: not those of the world.
    pub axes: Axes,
    /// First frequency of the assembled machine, oscillations per time.
    pub first_frequency: Option<f64>,
}

/// Kinds of attachment, the most sensitive first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AttachmentKind {
    /// Nothing holds the body: its rotation is its own. The conservative default.
    #[default]
    Free,
    /// Compliant joints.
    Soft,
    /// Joints that prescribe its rotation.
    Stiff,
}

impl AttachmentKind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Soft => "soft",
            Self::Stiff => "stiff",
        }
    }
}

/// Largest deflections and stresses of a body; from them follow the largest modal amplitudes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Limits {
    /// Largest deflection of a node.
    pub deflection: Option<f64>,
    /// Largest stress, and that of every mode at unit amplitude.
    pub stress: Option<(f64, Vec<f64>)>,
    /// Largest amplitudes of modes (numbers from 0).
    pub modes: Vec<(usize, f64)>,
}

/// Largest errors of what a simulation is asked for.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// Largest error of each quantity, at any time.
    #[serde(flatten)]
    pub errors: PerQuantity<f64>,
    /// Least deflection that counts ([`Resolution`](super::Resolution)); `None`: 1e-5 of the extent of the
    /// body.
    pub least_deflection: Option<f64>,
}

impl Default for Tolerance {
    /// A thousandth of a radian and one per cent: below what material data and damping are known to.
    fn default() -> Self {
        Self { errors: PerQuantity { attitude: 1e-3, ..PerQuantity::all(0.01) }, least_deflection: None }
    }
}

//! Requirements of a scene for a body, and data about motion that is not simulated. All of them are
//! optional.

use super::Axes;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_model::{Damping, DampingRatios, FeModel};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// Requirements that decide which terms and modes a body needs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Requirements {
    /// Motion beyond that of the simulation.
    pub motion: MotionRange,
    /// Attachment of the body to others.
    pub attachment: Attachment,
    /// Largest deflections, stresses and modal amplitudes.
    pub limits: Limits,
    /// Highest frequency of interest, in oscillations per time.
    pub band: Option<f64>,
    /// Damping ratios of the modes in this scene; `None`: those of the body.
    pub damping: Option<DampingRatios>,
    /// True if `damping` replaces the damping of the body; otherwise a body with damping of its own is an
    /// error.
    pub replaces_damping: bool,
    /// Largest allowed errors.
    pub tolerance: Tolerance,
    /// Largest allowed errors of recoveries, by name.
    pub recoveries: Vec<RecoveryTolerance>,
    /// Largest number of multiplications per evaluation of the equations of motion, in place of tolerances.
    pub multiplications: Option<usize>,
}

impl Requirements {
    /// Returns `body` with the damping of the scene, if there is one.
    ///
    /// * `by`: source of the damping, for messages.
    ///
    /// # Errors
    /// [`SceneDamping`](Code::SceneDamping) if the body has damping of its own that the scene does not
    /// replace; the errors of [`FlexBody::new`].
    pub fn damped<'b>(&self, body: &'b FlexBody, by: &str) -> Result<Cow<'b, FlexBody>> {
        let Some(ratios) = &self.damping else { return Ok(Cow::Borrowed(body)) };
        if body.damping().norm_max() > 0.0 {
            self.refuse_second_damping("body", by)?;
        }
        Ok(Cow::Owned(body.with_damping_ratios(ratios)?))
    }

    /// Returns an error for damping in addition to that of a body or model, unless it replaces the latter.
    ///
    /// * `of`: owner of the other damping. `by`: source of this damping.
    ///
    /// # Errors
    /// [`SceneDamping`](Code::SceneDamping) for two kinds of damping.
    fn refuse_second_damping(&self, of: &str, by: &str) -> Result<()> {
        match &self.damping {
            Some(ratios) if !self.replaces_damping => {
                let message =
                    format!("{by} states the damping ratio {ratios}, but the {of} already has damping");
                Err(Diagnostic::new(Code::SceneDamping, message).into())
            }
            _ => Ok(()),
        }
    }

    /// Returns an error for damping in addition to that of a model, before bodies are made of it.
    ///
    /// # Errors
    /// [`SceneDamping`](Code::SceneDamping) for two kinds of damping.
    pub fn refuse_damping_beside(&self, model: &FeModel, scene: &str) -> Result<()> {
        match model.damping() {
            None | Some(Damping::Ratio(0.0)) => Ok(()),
            Some(_) => self.refuse_second_damping("model", &format!("scene `{scene}`")),
        }
    }
}

/// Largest rotation of the body frame; `None`: the largest of the simulation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionRange {
    /// Angular velocity.
    pub angular_velocity: Option<Range>,
    /// Angular acceleration.
    pub angular_acceleration: Option<Range>,
    /// Axes of the components, which turn with the body: not those of the world.
    pub axes: Axes,
}

/// Largest magnitude of a vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Magnitude in any direction.
    Any(f64),
    /// Magnitudes of the components along axes that turn with the body.
    Axes(Vector3<f64>),
}

impl Range {
    /// Returns the range multiplied by a factor.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Any(length) => Self::Any(factor * length),
            Self::Axes(components) => Self::Axes(factor * components),
        }
    }

    /// Returns the largest length of a vector within the range.
    pub fn length(&self) -> f64 {
        match self {
            Self::Any(length) => *length,
            Self::Axes(components) => components.norm(),
        }
    }
}

/// Attachment of a body to others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Attachment {
    /// Kind of attachment.
    pub kind: AttachmentKind,
    /// Inertia that joints attach to the body; zero is the conservative default.
    pub inertia: Matrix3<f64>,
    /// Axes of the inertia, which turn with the body: not those of the world.
    pub axes: Axes,
    /// First frequency of the assembled machine, in oscillations per time.
    pub first_frequency: Option<f64>,
}

/// Kinds of attachment, the most sensitive first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub enum AttachmentKind {
    /// No attachment: the rotation of the body is free. The conservative default.
    #[default]
    Free,
    /// Compliant joints.
    Soft,
    /// Joints that prescribe the rotation of the body.
    Stiff,
}

impl AttachmentKind {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Largest deflections and stresses of a body, which bound the modal amplitudes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Limits {
    /// Largest deflection of a node.
    pub deflection: Option<f64>,
    /// Largest stress, and the stress of every mode at unit amplitude.
    pub stress: Option<(f64, Vec<f64>)>,
    /// Largest amplitudes of modes (numbers from 0).
    pub modes: Vec<(usize, f64)>,
}

/// Largest allowed errors of the results of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// Largest error of each quantity, at any time.
    #[serde(flatten)]
    pub errors: PerQuantity<f64>,
    /// Smallest deflection that is compared ([`Resolution`](super::Resolution)); `None`: 1e-5 of the extent
    /// of the body.
    pub least_deflection: Option<f64>,
}

impl Default for Tolerance {
    /// Returns the default tolerance: one thousandth of a radian and one per cent, below the uncertainty of
    /// material data and damping. Recoveries have none.
    fn default() -> Self {
        let errors = PerQuantity { attitude: 1e-3, recovery: f64::INFINITY, ..PerQuantity::all(0.01) };
        Self { errors, least_deflection: None }
    }
}

impl Tolerance {
    /// Returns the tolerance of deformations, which decides how closely a motion is followed: the smaller one of
    /// deflection and stress.
    pub fn of_deformation(&self) -> f64 {
        self.errors.deflection.min(self.errors.stress)
    }
}

/// Largest allowed error of a recovery.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveryTolerance {
    /// Name of the recovery.
    pub recovery: String,
    /// Largest error at any time.
    pub limit: RecoveryLimit,
    /// True if the rows are those of modes and static columns; false for a program that superposes modes only.
    pub static_columns: bool,
}

/// Limit of the error of a recovery: of the equivalent stress of von Mises of the difference, for points with all six
/// stresses; of the value, for other rows.
#[derive(Debug, Clone, PartialEq)]
pub enum RecoveryLimit {
    /// Part of the largest von Mises stress of any point; for other rows of the largest value of any row of the same
    /// quantity and unit.
    Relative(f64),
    /// Value in the unit of the rows.
    Absolute {
        /// Largest error.
        value: f64,
        /// Unit, as the rows state it.
        unit: String,
    },
}

// Quantities of a motion that have tolerances in a scene.

/// One value for each quantity of a motion that has a tolerance in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
#[serde(bound = "T: serde::Serialize + Unstated")]
pub struct PerQuantity<T> {
    /// Attitude of the frame. The error is the angle between the frames. Unit: rad.
    pub attitude: T,
    /// Deflection of the watched points in body axes. The error is relative to the largest deflection of
    /// any of them, or to the smallest one that is compared ([`Resolution`](super::Resolution)). Without
    /// watched points, the nodes that move most in some mode along some axis are compared.
    pub deflection: T,
    /// Stress, estimated without stress recovery. The error is sqrt(V(u - u_ref) / max V(u_ref)), where V
    /// is the elastic energy of a deformation; the smallest energy that is compared replaces a smaller
    /// maximum.
    pub stress: T,
    /// Force F and torque T of the prescribed motion. The error is relative to the largest force or torque,
    /// or to one thousandth of w^2 m r or w^2 I, with the radius of gyration r and I = m r^2, or to one
    /// hundredth of the largest T / r or F r.
    pub reaction: T,
    /// Recoveries with a tolerance. The error is the largest ratio of the error of one of them to its own limit
    /// ([`RecoveryTolerance`]), so that the tolerance is 1; without such limits it is infinite.
    #[serde(skip_serializing_if = "Unstated::is_unstated")]
    pub recovery: T,
}

/// Value that is not written where a scene has no tolerance of recoveries.
pub trait Unstated {
    /// Returns true if the value is not written.
    fn is_unstated(&self) -> bool;
}

impl Unstated for f64 {
    fn is_unstated(&self) -> bool {
        self.is_infinite()
    }
}

impl Unstated for Option<f64> {
    fn is_unstated(&self) -> bool {
        self.is_none()
    }
}

impl<T> PerQuantity<T> {
    /// Returns the values changed by `change`, which is called once for each quantity.
    pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> PerQuantity<U> {
        PerQuantity {
            attitude: change(self.attitude),
            deflection: change(self.deflection),
            stress: change(self.stress),
            reaction: change(self.reaction),
            recovery: change(self.recovery),
        }
    }

    /// Returns the pairs of values of both.
    pub fn zip<U>(self, other: PerQuantity<U>) -> PerQuantity<(T, U)> {
        PerQuantity {
            attitude: (self.attitude, other.attitude),
            deflection: (self.deflection, other.deflection),
            stress: (self.stress, other.stress),
            reaction: (self.reaction, other.reaction),
            recovery: (self.recovery, other.recovery),
        }
    }

    /// Returns references to the values.
    pub fn as_ref(&self) -> PerQuantity<&T> {
        PerQuantity {
            attitude: &self.attitude,
            deflection: &self.deflection,
            stress: &self.stress,
            reaction: &self.reaction,
            recovery: &self.recovery,
        }
    }

    /// Returns the values with the names of their quantities.
    pub fn named(self) -> [(&'static str, T); 5] {
        [
            ("attitude", self.attitude),
            ("deflection", self.deflection),
            ("stress", self.stress),
            ("reaction", self.reaction),
            ("recovery", self.recovery),
        ]
    }
}

impl<T: Clone> PerQuantity<T> {
    /// Returns one value for all quantities.
    pub fn all(value: T) -> Self {
        Self {
            attitude: value.clone(),
            deflection: value.clone(),
            stress: value.clone(),
            reaction: value.clone(),
            recovery: value,
        }
    }
}

//! The motion of the frame that a scene prescribes.

use super::{Carried, Scene, Spin};
use crate::body::flex_body::Frame;
use crate::motion::dynamics::{Orientation, Prescribed, RotationVector};
use nalgebra::{Matrix3, Vector3};

/// What a scene prescribes of the motion of the frame of its body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Driving<'a> {
    spin: Option<&'a Spin>,
    carried: Option<CarriedMotion<'a>>,
}

/// The prescribed motion of the frame of a body that is carried.
#[derive(Debug, Clone, Copy)]
struct CarriedMotion<'a> {
    carried: &'a Carried,
    /// From the axis of rotation to the origin of the frame, its axes.
    arm: Vector3<f64>,
    /// Axes of the frame at time zero.
    start: Matrix3<f64>,
}

impl<'a> CarriedMotion<'a> {
    fn new(frame: &Frame, scene: &'a Scene) -> Option<Self> {
        let carried = scene.carried.as_ref()?;
        let through = carried.spin.as_ref().and_then(|spin| spin.through);
        let arm = through.map_or_else(Vector3::zeros, |through| frame.origin - through);
        Some(Self { carried, arm, start: RotationVector(scene.initial.rotation).axes() })
    }

    /// V = omega x arm + A'd', and V' = alpha x arm + A'd'' - omega x A'd', for the way d of the axis: along the axes of the frame.
    fn at(&self, time: f64) -> (Prescribed, Prescribed) {
        let zero = Vector3::zeros();
        let (omega, alpha, turned) = match &self.carried.spin {
            Some(spin) => {
                let (rate, slope) = spin.rate.at(time);
                let turned = RotationVector(spin.axis * spin.rate.integral(time)).axes();
                (spin.axis * rate, spin.axis * slope, turned)
            }
            None => (zero, zero, Matrix3::identity()),
        };
        let (velocity, acceleration) = match &self.carried.translation {
            Some(translation) => {
                let (velocity, acceleration) = translation.drive.at(time);
                let along = (self.start * turned).tr_mul(&translation.direction);
                (along * velocity, along * acceleration)
            }
            None => (zero, zero),
        };
        let linear = omega.cross(&self.arm) + velocity;
        let rate = alpha.cross(&self.arm) + acceleration - omega.cross(&velocity);
        (
            Prescribed { linear: Some(linear), angular: Some(omega) },
            Prescribed { linear: Some(rate), angular: Some(alpha) },
        )
    }
}

impl<'a> Driving<'a> {
    /// What `scene` prescribes of the motion of `frame`, that of a body in its [`Stage`](super::Stage).
    pub fn new(frame: &Frame, scene: &'a Scene) -> Self {
        Self { spin: scene.spin.as_ref(), carried: CarriedMotion::new(frame, scene) }
    }

    /// Velocities at a time and their rates, axes of the frame.
    pub fn at(&self, time: f64) -> (Prescribed, Prescribed) {
        if let Some(carried) = &self.carried {
            return carried.at(time);
        }
        let Some(spin) = self.spin else { return (Prescribed::NOTHING, Prescribed::NOTHING) };
        let (rate, slope) = spin.rate.at(time);
        let linear = spin.hold.then(Vector3::zeros);
        (
            Prescribed { linear, angular: Some(spin.axis * rate) },
            Prescribed { linear, angular: Some(spin.axis * slope) },
        )
    }
}

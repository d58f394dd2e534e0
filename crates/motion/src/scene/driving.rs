//! Motion of the frame prescribed by a scene.

use super::{Carried, Scene, Spin};
use crate::dynamics::{AlongFrame, Prescribed};
use flexbody_body::flex_body::Frame;
use nalgebra::{Matrix3, Vector3};

/// Prescribed motion of the frame of a body in a scene.
#[derive(Debug, Clone, Copy)]
pub struct Driving<'a> {
    spin: Option<&'a Spin>,
    carried: Option<CarriedMotion<'a>>,
}

/// Prescribed motion of the frame of a carried body.
#[derive(Debug, Clone, Copy)]
struct CarriedMotion<'a> {
    carried: &'a Carried,
    /// Vector from the axis of rotation to the origin of the frame, axes of the frame.
    arm: Vector3<f64>,
}

impl<'a> CarriedMotion<'a> {
    fn new(frame: &Frame, scene: &'a Scene) -> Option<Self> {
        let carried = scene.carried.as_ref()?;
        let through = carried.spin.as_ref().and_then(|spin| spin.through);
        let arm = through.map_or_else(Vector3::zeros, |through| frame.origin - through);
        Some(Self { carried, arm })
    }

    /// Computes V = omega x arm + A'd', and V' = alpha x arm + A'd'' - omega x A'd', for the displacement d
    /// of the axis, along the axes A of the frame.
    fn at(&self, time: f64, axes: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        let nothing = (Vector3::zeros(), Vector3::zeros());
        let (omega, alpha) = self.carried.spin.as_ref().map_or(nothing, |spin| spin.at(time, axes));
        let (velocity, acceleration) =
            self.carried.translation.as_ref().map_or(nothing, |drive| drive.at(time));
        let (velocity, acceleration) = (axes.tr_mul(&velocity), axes.tr_mul(&acceleration));
        let linear = omega.cross(&self.arm) + velocity;
        let rate = alpha.cross(&self.arm) + acceleration - omega.cross(&velocity);
        let both = |linear, angular| Prescribed {
            linear: Some(AlongFrame(linear)),
            angular: Some(AlongFrame(angular)),
        };
        (both(linear, omega), both(rate, alpha))
    }
}

impl<'a> Driving<'a> {
    /// Collects the prescribed motion of `frame` in `scene`; `frame` belongs to a body in its
    /// [`FramedScene`](super::FramedScene).
    pub fn new(frame: &Frame, scene: &'a Scene) -> Self {
        Self { spin: scene.spin.as_ref(), carried: CarriedMotion::new(frame, scene) }
    }

    /// Returns the velocities at a time and their rates, along the axes of the frame, whose `axes` in the
    /// world are given.
    pub fn at(&self, time: f64, axes: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        if let Some(carried) = &self.carried {
            return carried.at(time, axes);
        }
        let Some(spin) = self.spin else { return (Prescribed::NOTHING, Prescribed::NOTHING) };
        let (omega, alpha) = spin.at(time, axes);
        let linear = spin.hold.then(AlongFrame::default);
        let about = |angular| Prescribed { linear, angular: Some(AlongFrame(angular)) };
        (about(omega), about(alpha))
    }
}

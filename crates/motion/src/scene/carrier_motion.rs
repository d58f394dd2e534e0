//! Accelerations of a carried body by the motion that its scene prescribes.

use super::{Driving, Scene};
use crate::dynamics::{AlongFrame, Orientation, RotationVector};
use flexbody_body::flex_body::{Frame, RigidAccelerations};
use flexbody_linalg::rotation_by;
use nalgebra::Vector3;

/// Number of intervals at whose ends the motion is computed.
const INTERVALS: usize = 200;

/// Returns the accelerations of the frame of a carried body, less gravity, at equal distances over the run.
///
/// * `scene`: in the frame of the body. The orientation follows the angular velocity at each instant; gravity alone
///   depends on it.
pub fn carrier_accelerations(frame: &Frame, scene: &Scene) -> Vec<RigidAccelerations> {
    let driving = Driving::new(frame, scene);
    let step = scene.run.duration.map_or(0.0, |duration| duration / INTERVALS as f64);
    let count = if step > 0.0 { INTERVALS + 1 } else { 1 };
    let gravity = scene.gravity.unwrap_or_else(Vector3::zeros);
    let mut axes = RotationVector(scene.initial.rotation).axes();
    let mut all = Vec::with_capacity(count);
    for instant in 0..count {
        let (velocities, rates) = driving.at(instant as f64 * step, &axes);
        let vector = |value: Option<AlongFrame>| value.map_or_else(Vector3::zeros, |along| along.0);
        let (velocity, omega) = (vector(velocities.linear), vector(velocities.angular));
        let (rate, alpha) = (vector(rates.linear), vector(rates.angular));
        let origin = rate + omega.cross(&velocity) - axes.tr_mul(&gravity);
        all.push(RigidAccelerations::new(origin, &omega, &alpha));
        axes *= rotation_by(&(omega * step)).matrix();
    }
    all
}

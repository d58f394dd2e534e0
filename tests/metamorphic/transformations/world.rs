//! Transformations of the world.

use super::Pair;
use super::moved::Motion;
use crate::correspondence::Correspondence;
use crate::draws::{axis, between, direction};
use crate::subject::Subject;
use flexbody_base::error::Result;
use flexbody_motion::dynamics::{Orientation, RotationVector};
use flexbody_motion::scene::{Drive, History, VectorHistory};
use nalgebra::{Matrix3, Vector3};
use oracle::random::Random;

/// Returns a random rotation; for a plane model in its plane.
pub fn turning(subject: &Subject, random: &mut Random) -> Matrix3<f64> {
    let turn = axis(random, subject.dimension()) * between(random, 0.2, 3.0);
    RotationVector(turn).axes()
}

/// Rotates the world about its origin.
pub fn turn(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let world = turning(subject, random);
    let map = Correspondence { world, ..Correspondence::default() };
    Ok(Some(Pair::new(subject, Motion::of_world(world).applied(subject), map)))
}

/// Shifts the world.
pub fn shift(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let by = direction(random, subject.dimension()) * (3.0 * extent(subject));
    let mut changed = subject.clone();
    changed.scene.initial.origin += by;
    let shift = [by, Vector3::zeros(), Vector3::zeros()];
    Ok(Some(Pair::new(subject, changed, Correspondence { shift, ..Correspondence::default() })))
}

/// Observes the motion from a frame with constant velocity.
pub fn boost(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let Some(duration) = subject.scene.run.duration else { return Ok(None) };
    let by = direction(random, subject.dimension()) * (extent(subject) / duration);
    let mut original = subject.clone();
    original.scene.spin.iter_mut().for_each(|spin| spin.hold = false);
    // A velocity along one direction cannot be added to another prescribed motion.
    original.scene.carried.iter_mut().for_each(|carried| carried.translation = None);
    let mut changed = original.clone();
    match &mut changed.scene.carried {
        None => changed.scene.initial.velocity += by,
        Some(carried) => carried.translation = Some(Drive::Velocity(VectorHistory::constant(by))),
    }
    let shift = [Vector3::zeros(), by, Vector3::zeros()];
    Ok(Some(Pair::new(&original, changed, Correspondence { shift, ..Correspondence::default() })))
}

/// Observes the motion from a falling frame: uniform gravity and an acceleration of the carrier are
/// equivalent.
pub fn accelerate(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let Some(duration) = subject.scene.run.duration else { return Ok(None) };
    let size = 0.1 * extent(subject) / (duration * duration);
    let gravity = direction(random, subject.dimension()) * size;
    let mut original = subject.clone();
    original.scene.gravity = Some(gravity);
    original.scene.carried.iter_mut().for_each(|carried| carried.translation = None);
    original.scene.spin.iter_mut().for_each(|spin| spin.hold = false);
    let mut changed = original.clone();
    changed.scene.gravity = None;
    if let Some(carried) = &mut changed.scene.carried {
        let (direction, factor) = (-gravity, History::Constant(1.0));
        carried.translation = Some(Drive::Acceleration(VectorHistory::Along { direction, factor }));
    }
    let shift = [Vector3::zeros(), Vector3::zeros(), -gravity];
    Ok(Some(Pair::new(&original, changed, Correspondence { shift, ..Correspondence::default() })))
}

/// Mirrors the world and the model in separate planes.
pub fn mirror(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    let image = |random: &mut Random| {
        let normal = direction(random, subject.dimension());
        Matrix3::identity() - normal * normal.transpose() * 2.0
    };
    let (world, model) = (image(random), image(random));
    let motion = Motion { world, model, shift: Vector3::zeros() };
    let map = Correspondence { world, model, ..Correspondence::default() };
    Ok(Some(Pair::new(subject, motion.applied(subject), map)))
}

/// Returns the largest distance of two nodes along an axis of the model.
pub fn extent(subject: &Subject) -> f64 {
    let along = |k: usize| subject.raw.nodes.positions.iter().map(move |x| x[k]);
    let width = |k: usize| along(k).fold(f64::MIN, f64::max) - along(k).fold(f64::MAX, f64::min);
    (0..3).map(width).fold(0.0, f64::max)
}

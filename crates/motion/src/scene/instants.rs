//! Complete state of a motion at given times, for evaluations of the equations of all nodes.

use super::prepared::{Prepared, damped};
use super::{FramedScene, Scene};
use crate::dynamics::Motion;
use crate::integration::{Failure, ObserverEvent};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use nalgebra::Vector3;

/// State, accelerations and loads of a body at one time. Vectors are along the axes of the frame of the
/// [`FramedScene`], about its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Time of the state.
    pub time: f64,
    /// Velocity V of the origin of the frame.
    pub velocity: Vector3<f64>,
    /// Rates of the components of V.
    pub velocity_rate: Vector3<f64>,
    /// Angular velocity omega of the frame.
    pub omega: Vector3<f64>,
    /// Rates of the components of omega.
    pub omega_rate: Vector3<f64>,
    /// Modal coordinates (nf).
    pub q: Vec<f64>,
    /// Rates of the modal coordinates (nf).
    pub qd: Vec<f64>,
    /// Accelerations of the modal coordinates (nf).
    pub qdd: Vec<f64>,
    /// Acceleration of gravity.
    pub gravity: Vector3<f64>,
    /// Force and torque of every load of the scene; the torque as generalised force on the rotation vector
    /// of its point.
    pub loads: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// Computes the motion of `body` in `scene` at `times`, ascending from 0 to the end of the scene.
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn instants(body: &FlexBody, scene: &Scene, times: &[f64]) -> Result<Vec<Instant>> {
    let framed = FramedScene::new(body, scene)?;
    let body = &*damped(&framed.body, &framed.scene)?;
    let run = Prepared::new(body, &framed.scene)?;
    let mut seen = Vec::with_capacity(times.len());
    let look = |event: ObserverEvent, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if event == ObserverEvent::Instant {
            seen.push(see(&run, time, state, motion)?);
        }
        Ok::<(), Failure>(())
    };
    run.integrate(times, 1, look)?;
    Ok(seen)
}

fn see(
    run: &Prepared<'_>,
    time: f64,
    state: &[f64],
    motion: &mut Motion<'_>,
) -> std::result::Result<Instant, Failure> {
    let rates = motion.accelerations(time, state)?;
    let (linear, angular, modal) = run.equations.split(rates);
    let qdd = modal.to_vec();
    let now = motion.evaluate(time, state)?;
    let (place, evaluation) = (now.place(), now.evaluation());
    let (velocity, omega) = evaluation.rigid_velocity();
    let configuration = now.configuration();
    let worked = run.forces.acting(time, place).map(|(point, force, torque)| {
        let turned =
            if torque == Vector3::zeros() { torque } else { point.turned_torque(evaluation, &torque) };
        (force, turned)
    });
    Ok(Instant {
        time,
        velocity,
        velocity_rate: linear,
        omega,
        omega_rate: angular,
        gravity: run.forces.gravity(place),
        loads: worked.collect(),
        q: configuration.q,
        qd: configuration.qd,
        qdd,
    })
}

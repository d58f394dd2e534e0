//! Results of a simulation.

use super::{Drift, Extremes, RecoveredMotion, Scene, Scheme};
use crate::dynamics::{Balance, Configuration, Orientation, RotationVector};
use crate::integration::Work;
use flexbody_body::flex_body::FlexBody;
use nalgebra::Vector3;

/// Motion of a body at the output times of its scene. Numbers are in the units of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the scene.
    pub scene: String,
    /// Name of the model of the body.
    pub body: String,
    /// Integration scheme, with the actual step length.
    pub scheme: Scheme,
    /// Output times.
    pub time: Vec<f64>,
    /// State at every output time.
    pub states: Vec<Configuration>,
    /// Energies, momenta, work and impulses at every output time.
    pub balances: Vec<Balance>,
    /// Frame of the numbers, and the conditions that the body is exposed to.
    pub setting: Setting,
    /// Force and torque of the prescribed motion about the origin of the frame, axes of the model; `None`
    /// without prescribed motion.
    pub reactions: Option<Vec<(Vector3<f64>, Vector3<f64>)>>,
    /// Torque of the reference conditions about the origin of the frame, axes of the model; their force is
    /// zero. `None` if the frame is no mean-axis frame: `reactions` then contain everything.
    pub conditions: Option<Vec<Vector3<f64>>>,
    /// Paths of the watched points.
    pub paths: Vec<Path>,
    /// Steps and evaluations of the integration.
    pub work: Work,
    /// Extremes of the motion, including times between the output times.
    pub extremes: Extremes,
    /// Recoveries of the body; `None` for a body without.
    pub recovered: Option<RecoveredMotion>,
}

/// Frame of a recording, and the conditions that the body is exposed to.
///
/// The frame of a recording is that of the scene ([`FramedScene`](super::FramedScene)). Its axes are those of the model
/// and turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name of the interface or node that carries the body.
    pub carrier: Option<String>,
    /// Origin of the frame in model coordinates: the centre of mass of the undeformed body, or the
    /// reference point of the carrier.
    pub origin: Vector3<f64>,
    /// Gravity at the start, axes of the model.
    pub gravity_model: Option<Vector3<f64>>,
    /// Eigenvalues of the carried body; empty without a carrier. Unit: 1/time^2.
    pub eigenvalues: Vec<f64>,
}

impl Setting {
    /// Creates the setting of a body in its framed scene.
    pub(super) fn new(body: &FlexBody, scene: &Scene) -> Self {
        let start = RotationVector(scene.initial.rotation).axes();
        let carrier = scene.carried.as_ref().map(|carried| carried.by.to_string());
        let eigenvalues = carrier.as_ref().and_then(|_| body.eigenvalues_in_frame());
        Self {
            carrier,
            origin: body.frame().origin,
            gravity_model: scene.gravity.map(|gravity| start.tr_mul(&gravity)),
            eigenvalues: eigenvalues.unwrap_or_default(),
        }
    }

    /// Returns a description of the origin of the frame.
    pub fn origin_in_words(&self) -> String {
        match &self.carrier {
            Some(carrier) => format!("reference point of {carrier}"),
            None => "centre of mass of the undeformed body".to_owned(),
        }
    }
}

/// Smallest deformation that is compared: errors are relative to the largest deformation of the motion, but
/// at least to this one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Smallest deflection. Unit: length.
    pub deflection: f64,
    /// Root of the smallest elastic energy: the energy of the mode that needs least of it to deflect some
    /// node by `deflection`.
    pub root_energy: f64,
}

impl Resolution {
    /// Default of the smallest deflection, relative to the largest extent of the body: 10 micrometres per
    /// metre.
    const SMALLEST_DEFLECTION: f64 = 1e-5;

    /// Creates the resolution for `body`; `least` is the smallest deflection, if given.
    pub fn new(body: &FlexBody, least: Option<f64>) -> Self {
        let deflection = least.unwrap_or(Self::SMALLEST_DEFLECTION * body.extent());
        let modes = &body.modes().eigenvalue;
        let root_energy =
            |(j, lambda): (usize, &f64)| (0.5 * lambda).sqrt() * deflection / body.largest_displacement(j);
        let root_energy = modes.iter().enumerate().map(root_energy).fold(f64::INFINITY, f64::min);
        Self { deflection, root_energy }
    }
}

/// Path of a point of the body. The axes of the model turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Name of the point in the scene.
    pub name: String,
    /// Position at every output time, world axes.
    pub place: Vec<Vector3<f64>>,
    /// Deflection from the undeformed body at every output time, axes of the model (turning with the body).
    pub deflection: Vec<Vector3<f64>>,
    /// Velocity of the position at every output time, world axes.
    pub velocity: Vec<Vector3<f64>>,
    /// Acceleration of the position at every output time, world axes; where a load or motion jumps, the
    /// value after the jump.
    pub acceleration: Vec<Vector3<f64>>,
}

impl Recording {
    /// Returns the drift of energy and momenta.
    pub fn drift(&self) -> Drift {
        self.extremes.drift
    }
}

impl Path {
    /// Creates a path without positions.
    pub(super) fn new(name: String) -> Self {
        let none = Vec::new;
        Self { name, place: none(), deflection: none(), velocity: none(), acceleration: none() }
    }
}

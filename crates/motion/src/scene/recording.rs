//! What a simulation leaves.

use super::{Drift, Extremes, Scene, Scheme};
use crate::dynamics::{Balance, Configuration, Orientation, RotationVector};
use crate::integration::Work;
use flexbody_body::flex_body::FlexBody;
use nalgebra::Vector3;

/// The motion of a body at the instants that its scene writes. Numbers are in the units of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body's model.
    pub body: String,
    /// How it was integrated; with the step that was taken.
    pub scheme: Scheme,
    /// Instants.
    pub time: Vec<f64>,
    /// The state at every instant.
    pub states: Vec<Configuration>,
    /// Energies, momenta, work and impulses at every instant.
    pub balances: Vec<Balance>,
    /// The frame that the numbers refer to, and what the body is exposed to.
    pub setting: Setting,
    /// Force and torque about the origin of the frame, axes of the model, that the prescribed motion takes;
    /// none without.
    pub reactions: Option<Vec<(Vector3<f64>, Vector3<f64>)>>,
    /// Torque about the origin of the frame, axes of the model, that the reference conditions carry; their
    /// force is zero. None where the frame is not a mean one: `reactions` are then all that there are.
    pub conditions: Option<Vec<Vector3<f64>>>,
    /// Paths of the watched points.
    pub paths: Vec<Path>,
    /// Steps and evaluations of the integration.
    pub work: Work,
    /// The largest of everything, also between the instants.
    pub extremes: Extremes,
}

/// What a recording is about: its frame, and what the body is exposed to.
///
/// The frame of a recording is that of the scene ([`Stage`](super::Stage)). Its axes are those of the model
/// and turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name of the interface or node that carries the body.
    pub carrier: Option<String>,
    /// Origin of the frame in model coordinates: the centre of mass of the undeformed body, or the reference
    /// point of what carries it.
    pub origin: Vector3<f64>,
    /// Gravity at the start, axes of the model.
    pub gravity: Option<Vector3<f64>>,
    /// Eigenvalues of the body as it is carried; empty where nothing carries it. Unit: 1/time^2.
    pub eigenvalues: Vec<f64>,
}

impl Setting {
    /// The setting of a body that is on its stage.
    pub(super) fn new(body: &FlexBody, scene: &Scene) -> Self {
        let start = RotationVector(scene.initial.rotation).axes();
        let carrier = scene.carried.as_ref().map(|carried| carried.by.to_string());
        let eigenvalues = carrier.as_ref().and_then(|_| body.eigenvalues_in_frame());
        Self {
            carrier,
            origin: body.frame().origin,
            gravity: scene.gravity.map(|gravity| start.tr_mul(&gravity)),
            eigenvalues: eigenvalues.unwrap_or_default(),
        }
    }

    /// What the origin of the frame is, in words.
    pub fn origin_in_words(&self) -> String {
        match &self.carrier {
            Some(carrier) => format!("reference point of {carrier}"),
            None => "centre of mass of the undeformed body".to_owned(),
        }
    }
}

/// The least deformation that counts: errors are relative to the largest of the motion, or to this where that
/// is less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Deflection.
    pub deflection: f64,
    /// Root of the elastic energy: that of the mode which takes least of it for this deflection of some node.
    pub root_energy: f64,
}

impl Resolution {
    /// Part of the largest extent of a body that its least deflection is unless said: 10 micrometres per
    /// metre.
    const LEAST: f64 = 1e-5;

    /// For `body`; `least`: the deflection, where it is given.
    pub fn new(body: &FlexBody, least: Option<f64>) -> Self {
        let deflection = least.unwrap_or(Self::LEAST * body.extent());
        let modes = &body.modes().eigenvalue;
        let root_energy =
            |(j, lambda): (usize, &f64)| (0.5 * lambda).sqrt() * deflection / body.largest_displacement(j);
        let root_energy = modes.iter().enumerate().map(root_energy).fold(f64::INFINITY, f64::min);
        Self { deflection, root_energy }
    }
}

/// The path of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Name of the point in the scene.
    pub name: String,
    /// Place at every instant, world axes.
    pub place: Vec<Vector3<f64>>,
    /// Deflection from the undeformed body, axes of the model.
    pub deflection: Vec<Vector3<f64>>,
    /// Velocity at every instant, world axes: that of the place.
    pub velocity: Vec<Vector3<f64>>,
    /// Acceleration at every instant, world axes: that of the place. Where a load or motion jumps, that after
    /// it.
    pub acceleration: Vec<Vector3<f64>>,
}

impl Recording {
    /// The drift of energy and momenta.
    pub fn drift(&self) -> Drift {
        self.extremes.drift
    }
}

impl Path {
    /// A path without a place yet.
    pub(super) fn new(name: String) -> Self {
        let none = Vec::new;
        Self { name, place: none(), deflection: none(), velocity: none(), acceleration: none() }
    }
}

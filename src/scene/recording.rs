//! What a simulation leaves.

use super::{Drift, Extremes, Scheme};
use crate::dynamics::{Balance, Configuration};
use crate::flex_body::FlexBody;
use crate::integration::Work;
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
    /// Force and torque about the origin of the frame, body axes, that the prescribed motion takes; none without.
    pub reactions: Option<Vec<(Vector3<f64>, Vector3<f64>)>>,
    /// Paths of the watched points.
    pub paths: Vec<Path>,
    /// What the integration did.
    pub work: Work,
    /// The largest of everything, also between the instants.
    pub extremes: Extremes,
}

/// The least deformation that counts: errors are relative to the largest of the motion, or to this where that is less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Deflection.
    pub deflection: f64,
    /// Root of the elastic energy: that of the mode which takes least of it for this deflection of some node.
    pub root_energy: f64,
}

impl Resolution {
    /// Part of the largest extent of a body that its least deflection is unless said: 10 micrometres per metre.
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
    /// What the scene calls it.
    pub name: String,
    /// Place at every instant, world axes.
    pub place: Vec<Vector3<f64>>,
    /// Deflection from the undeformed body, body axes.
    pub deflection: Vec<Vector3<f64>>,
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
        Self { name, place: Vec::new(), deflection: Vec::new() }
    }
}

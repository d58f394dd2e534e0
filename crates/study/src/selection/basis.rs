//! What a scene asks of a basis before there is one.

use flexbody_motion::scene::{Load, LoadCases, Point, Scene};
use std::f64::consts::TAU;

/// The loads of a scene whose static responses belong into a basis, so that no more modes are needed than the
/// motion excites.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WantedResponses {
    /// Centrifugal loads: the body turns.
    pub centrifugal: bool,
    /// Forces and torques at interfaces.
    pub interfaces: bool,
}

impl WantedResponses {
    /// The responses that any of the load cases wants.
    pub fn of_any(cases: &LoadCases) -> Self {
        cases.iter().map(Self::of).fold(Self::default(), |all, own| Self {
            centrifugal: all.centrifugal || own.centrifugal,
            interfaces: all.interfaces || own.interfaces,
        })
    }

    /// The responses that `scene` wants.
    pub fn of(scene: &Scene) -> Self {
        let motion = scene.requirements.motion.angular_velocity.is_some_and(|range| range.length() > 0.0);
        let turns = scene.initial.angular_velocity.norm() > 0.0;
        let at_interface = |load: &Load| matches!(load.at, Point::Interface(_));
        Self {
            centrifugal: motion || turns || scene.rotation().is_some(),
            // The reaction is a load at the interface that carries the body.
            interfaces: scene.carried.is_some() || scene.loads.iter().any(at_interface),
        }
    }
}

/// Free modes are wanted up to so many times the highest frequency of interest; what is above answers
/// statically.
pub const BEYOND_BAND: f64 = 2.0;

/// lambda up to which free modes are wanted: by the highest band of the load cases, where one of them has a band.
pub fn largest_eigenvalue(cases: &LoadCases) -> Option<f64> {
    let bands = cases.iter().filter_map(|scene| scene.requirements.band);
    bands.reduce(f64::max).map(|band| (TAU * BEYOND_BAND * band).powi(2))
}

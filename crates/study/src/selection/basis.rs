//! Static responses that a scene requires of a basis.

use flexbody_motion::scene::{Load, LoadCases, Point, Scene};
use std::f64::consts::TAU;

/// Loads of a scene whose static responses the basis should contain, so that only modes that the motion excites are
/// needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WantedResponses {
    /// True if the body turns: static responses to centrifugal loads.
    pub centrifugal: bool,
    /// True if forces or torques act at interfaces: static responses to these.
    pub interfaces: bool,
}

impl WantedResponses {
    /// Returns the responses that at least one load case requires.
    pub fn of_any(cases: &LoadCases) -> Self {
        cases.iter().map(Self::of).fold(Self::default(), |all, own| Self {
            centrifugal: all.centrifugal || own.centrifugal,
            interfaces: all.interfaces || own.interfaces,
        })
    }

    /// Returns the responses that `scene` requires.
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

/// Ratio of the highest free mode to the highest frequency of interest. Loads excite modes above it statically. A
/// larger value gives more modes.
pub const BEYOND_BAND: f64 = 2.0;

/// Returns the largest eigenvalue of the wanted free modes, from the highest band of the load cases; `None` if no case
/// states a band.
pub fn largest_eigenvalue(cases: &LoadCases) -> Option<f64> {
    let bands = cases.iter().filter_map(|scene| scene.requirements.band);
    bands.reduce(f64::max).map(|band| (TAU * BEYOND_BAND * band).powi(2))
}

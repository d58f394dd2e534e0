//! A scene as data. Numbers are in the units of the body that it is for.

use super::{History, Requirements};
use crate::dynamics::Terms;
use crate::provenance::SourceFile;
use nalgebra::Vector3;

/// What a body is to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name.
    pub name: String,
    /// How it is simulated.
    pub run: Run,
    /// The state at time zero.
    pub initial: Initial,
    /// Uniform gravity, world axes.
    pub gravity: Option<Vector3<f64>>,
    /// Forces and torques.
    pub loads: Vec<Load>,
    /// Prescribed spin.
    pub spin: Option<Spin>,
    /// Places whose paths are recorded.
    pub watched: Vec<Point>,
    /// What is demanded of the body.
    pub requirements: Requirements,
    /// The file that it was read from.
    pub source: Option<SourceFile>,
}

impl Scene {
    /// The same for a body that has only `modes` (from 0, ascending) of the one that it was written for.
    pub fn of_modes(&self, modes: &[usize]) -> Self {
        let mut scene = self.clone();
        let kept =
            |start: &ModeStart| Some(ModeStart { mode: modes.binary_search(&start.mode).ok()?, ..*start });
        scene.initial.modes = self.initial.modes.iter().filter_map(kept).collect();
        scene
    }

    /// Times at which something is not smooth, ascending.
    pub fn breaks(&self) -> Vec<f64> {
        let loads = self.loads.iter().map(|load| &load.history);
        let histories = loads.chain(self.spin.iter().map(|spin| &spin.rate));
        let mut times: Vec<f64> = histories.flat_map(History::breaks).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

/// How a scene is simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// From time zero to this; `None` where nothing is to be simulated.
    pub duration: Option<f64>,
    /// Instants recorded after the first, evenly spaced.
    pub outputs: usize,
    /// Steps that the integration may take; a run that needs more is refused.
    pub most_steps: u64,
    /// Integration method.
    pub scheme: Scheme,
    /// Terms of the equations of motion.
    pub terms: Terms,
}

impl Run {
    /// Steps that an integration may take unless the scene says otherwise: some minutes to an hour, with the number of modes.
    pub const MOST_STEPS: u64 = 20_000_000;
}

/// Integration methods ([`crate::integration`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Explicit, of order 8, with error control.
    Adaptive {
        /// Largest error of a step, relative to the scales of the motion.
        tolerance: f64,
    },
    /// Gauss collocation with steps of one length.
    Conserving {
        /// 2, 4 or 6.
        order: usize,
        /// Longest step; `None`: a twentieth of the shortest period of the body.
        step: Option<f64>,
    },
}

/// The state at time zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Initial {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// Velocity of the origin, world axes.
    pub velocity: Vector3<f64>,
    /// Attitude: the frame is turned by the length of this vector (radians) about its direction.
    pub rotation: Vector3<f64>,
    /// Angular velocity, body axes.
    pub angular_velocity: Vector3<f64>,
    /// Modes that are not at rest and undeformed.
    pub modes: Vec<ModeStart>,
}

/// A mode at time zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeStart {
    /// Number of the mode, from 0.
    pub mode: usize,
    /// Modal coordinate.
    pub amplitude: f64,
    /// Its rate.
    pub rate: f64,
}

/// A place of the body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Point {
    /// A node by its number.
    Node(i64),
    /// An interface by its name.
    Interface(String),
}

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Node(number) => write!(f, "node {number}"),
            Self::Interface(name) => write!(f, "interface {name}"),
        }
    }
}

/// A force and a torque at a place, each times the history.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// Where it acts.
    pub at: Point,
    /// Force.
    pub force: Vector3<f64>,
    /// Torque.
    pub torque: Vector3<f64>,
    /// Axes of both.
    pub axes: Axes,
    /// Factor over time.
    pub history: History,
}

/// Axes that a vector is given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Fixed in space.
    World,
    /// Turning with the body frame.
    Body,
}

/// Prescribed angular velocity of the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Spin {
    /// Direction, of length one, body axes.
    pub axis: Vector3<f64>,
    /// Angular velocity about it.
    pub rate: History,
    /// Whether the origin of the frame is held where it is.
    pub hold: bool,
}

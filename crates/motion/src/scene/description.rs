//! A scene as data. Numbers are in the units of the body that the scene is for.

use super::{Axes, Requirements, VectorHistory};
use crate::dynamics::{RotationVector, Terms};
use flexbody_base::provenance::SourceFile;
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;

/// A scene: initial state, loads and prescribed motion of a body, and settings of its simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name.
    pub name: String,
    /// Duration, output times and method of the simulation.
    pub run: Run,
    /// State at time zero.
    pub initial: Initial,
    /// Uniform gravity, world axes.
    pub gravity: Option<Vector3<f64>>,
    /// Applied forces and torques.
    pub loads: Vec<Load>,
    /// Prescribed spin.
    pub spin: Option<Spin>,
    /// Interface or node that carries the body.
    pub carried: Option<Carried>,
    /// Points whose paths are recorded.
    pub watched: Vec<Point>,
    /// Requirements for a body that is made for the scene.
    pub requirements: Requirements,
    /// File that the scene was read from.
    pub source: Option<SourceFile>,
    /// Files that histories of the scene were read from.
    pub series: Vec<SeriesFile>,
    /// True if the vectors are along the axes of a body in its [`FramedScene`](super::FramedScene), and the initial
    /// state is that of the frame of this body.
    pub resolved: bool,
    /// Name of this load case, if the scene file has several.
    pub case: Option<CaseName>,
}

/// Name of a load case of a scene file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaseName {
    /// Name of the scene that all cases belong to.
    pub scene: String,
    /// Name of the case.
    pub name: String,
}

impl Scene {
    /// Creates a scene in which nothing happens to the body: no loads, no prescribed motion, no requirements.
    pub fn new(name: impl Into<String>, run: Run) -> Self {
        Self {
            name: name.into(),
            run,
            initial: Initial::default(),
            gravity: None,
            loads: Vec::new(),
            spin: None,
            carried: None,
            watched: Vec::new(),
            requirements: Requirements::default(),
            source: None,
            series: Vec::new(),
            resolved: false,
            case: None,
        }
    }

    /// Returns the name of the load case; `None` if the scene has no cases.
    pub fn case_name(&self) -> Option<&str> {
        Some(&self.case.as_ref()?.name)
    }

    /// Returns the name of the load case or, for a scene without cases, of the scene.
    pub fn short_name(&self) -> &str {
        self.case_name().unwrap_or(&self.name)
    }

    /// Returns the scene for a body that has only `modes` (from 0, ascending) of the body that the scene
    /// was written for.
    pub fn of_modes(&self, modes: &[usize]) -> Self {
        let mut scene = self.clone();
        let kept =
            |start: &ModeStart| Some(ModeStart { mode: modes.binary_search(&start.mode).ok()?, ..*start });
        scene.initial.modes = self.initial.modes.iter().filter_map(kept).collect();
        scene
    }

    /// Returns the times at which a history is not smooth, ascending.
    pub fn breaks(&self) -> Vec<f64> {
        let mut times: Vec<f64> =
            self.acting().chain(self.driving()).flat_map(VectorHistory::breaks).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

impl Scene {
    /// Returns the angular velocity of a prescribed rotation, of the frame or of the interface that carries
    /// the body.
    pub fn rotation(&self) -> Option<&VectorHistory> {
        let carried = self.carried.as_ref().and_then(|carried| carried.spin.as_ref());
        let spin = self.spin.as_ref().map(|spin| &spin.velocity);
        spin.or(carried.map(|spin| &spin.velocity))
    }

    /// Returns true if the motion of the frame, or of the interface that carries the body, is prescribed.
    pub fn prescribes(&self) -> bool {
        self.spin.is_some() || self.carried.is_some()
    }

    /// Returns the scene with the prescribed angular velocity multiplied by `factor`.
    pub fn turning_faster(&self, factor: f64) -> Self {
        let mut scene = self.clone();
        let carried = scene.carried.as_mut().and_then(|carried| carried.spin.as_mut());
        let velocities = scene.spin.iter_mut().map(|spin| &mut spin.velocity);
        for velocity in velocities.chain(carried.map(|spin| &mut spin.velocity)) {
            *velocity = velocity.scaled(factor);
        }
        scene
    }

    /// Returns the histories of the loads.
    pub fn acting(&self) -> impl Iterator<Item = &VectorHistory> {
        self.loads.iter().flat_map(|load| [&load.force, &load.torque])
    }

    /// Returns the histories of prescribed motion.
    pub fn driving(&self) -> impl Iterator<Item = &VectorHistory> {
        let translation = self.carried.as_ref().and_then(|carried| carried.translation.as_ref());
        self.rotation().into_iter().chain(translation.map(Drive::history))
    }
}

/// Duration, output times and method of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// End time of the simulation, which starts at zero; `None` if nothing is simulated.
    pub duration: Option<f64>,
    /// Number of evenly spaced output times after the first.
    pub outputs: usize,
    /// Largest number of integration steps; a run that needs more fails.
    pub most_steps: u64,
    /// Integration method.
    pub scheme: Scheme,
    /// Terms of the equations of motion that are used.
    pub terms: Terms,
}

impl Run {
    /// Default limit of the number of integration steps: some minutes to an hour, depending on the number
    /// of modes.
    pub const MOST_STEPS: u64 = 20_000_000;
}

/// Integration methods ([`crate::integration`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Explicit method of order 8 with error control.
    Adaptive {
        /// Largest error of a step, relative to the scales of the motion.
        tolerance: f64,
    },
    /// Gauss collocation with steps of constant length.
    Conserving {
        /// Order of the method: 2, 4 or 6.
        order: usize,
        /// Longest step; `None`: one twentieth of the shortest period of the body.
        step: Option<f64>,
    },
}

impl Scheme {
    /// Returns the name of the method in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Adaptive { .. } => "adaptive",
            Self::Conserving { .. } => "conserving",
        }
    }
}

/// State at time zero.
///
/// A point with the coordinates x in the model is at `origin` + A x in the world, where A is the rotation
/// by `rotation`. Without rotation the world axes are the axes of the model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Initial {
    /// Position of the origin of the model, world axes.
    pub origin: Vector3<f64>,
    /// Velocity of the centre of mass of the undeformed body, world axes.
    pub velocity: Vector3<f64>,
    /// Attitude: the model is turned by the length of this vector (radians) about its direction.
    pub rotation: Vector3<f64>,
    /// Angular velocity.
    pub angular_velocity: Vector3<f64>,
    /// Axes of the angular velocity.
    pub axes: Axes,
    /// Initial values of modes that do not start at rest and undeformed.
    pub modes: Vec<ModeStart>,
    /// True if the deformation starts at rest, in equilibrium with the loads and the motion at time zero,
    /// instead of undeformed.
    pub settled: bool,
}

/// Initial values of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeStart {
    /// Number of the mode, from 0.
    pub mode: usize,
    /// Modal coordinate.
    pub amplitude: f64,
    /// Rate of the modal coordinate.
    pub rate: f64,
}

/// Point of the body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Point {
    /// Node of this number.
    Node(i64),
    /// Interface of this name.
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

/// File that a history was read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeriesFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Name and fingerprint of the file.
    pub source: SourceFile,
}

/// Force and torque at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// Point of application.
    pub at: Point,
    /// Force.
    pub force: VectorHistory,
    /// Torque.
    pub torque: VectorHistory,
    /// Axes of force and torque.
    pub axes: Axes,
}

impl Load {
    /// Returns force and torque at a time, along the axes of the load.
    pub fn at_time(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        (self.force.at(time).0, self.torque.at(time).0)
    }
}

/// Prescribed angular velocity of the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Spin {
    /// Angular velocity.
    pub velocity: VectorHistory,
    /// Axes of the angular velocity. For a history of constant direction, world axes are the world axes at
    /// time zero, and the direction turns with the body frame. For a history given in columns they are axes
    /// fixed in space.
    pub axes: Axes,
    /// Attitude at time zero of the model, or of its frame if `axes` are body axes, in place of that of
    /// [`Initial`].
    pub start: Option<RotationVector>,
    /// True if the centre of mass of the undeformed body is held in place.
    pub hold: bool,
}

impl Spin {
    /// Returns angular velocity and acceleration at a time along axes of the model with the given
    /// `attitude`, for a scene on its [`FramedScene`](super::FramedScene).
    pub fn at(&self, time: f64, attitude: &Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        turning(&self.velocity, self.axes, time, attitude)
    }
}

/// Returns angular velocity and acceleration along axes of the model with the given `attitude`. The rate of
/// an angular velocity is equal in body axes and in world axes, since omega x omega = 0.
fn turning(
    velocity: &VectorHistory,
    axes: Axes,
    time: f64,
    attitude: &Matrix3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let (omega, alpha) = velocity.at(time);
    match axes {
        Axes::World => (attitude.tr_mul(&omega), attitude.tr_mul(&alpha)),
        Axes::Model | Axes::Body => (omega, alpha),
    }
}

/// Interface, or node with rotations, whose motion is prescribed and which carries the rest of the body.
/// Without a prescribed motion it is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    /// The interface or node that carries the body.
    pub by: Point,
    /// Prescribed rotation.
    pub spin: Option<CarriedSpin>,
    /// Prescribed translation, superposed on the rotation.
    pub translation: Option<Drive>,
}

/// Prescribed rotation of a carrier about a point fixed to it.
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedSpin {
    /// Angular velocity.
    pub velocity: VectorHistory,
    /// Axes of the angular velocity, with the conventions of [`Spin::axes`].
    pub axes: Axes,
    /// Attitude at time zero, with the conventions of [`Spin::start`].
    pub start: Option<RotationVector>,
    /// Point of the rotation axis in model coordinates; `None`: the reference point of the carrier.
    pub through: Option<Vector3<f64>>,
}

impl CarriedSpin {
    /// Returns angular velocity and acceleration as [`Spin::at`] does.
    pub fn at(&self, time: f64, attitude: &Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        turning(&self.velocity, self.axes, time, attitude)
    }
}

/// Translation of a carrier together with its axis of rotation, along world axes, given by one of its time
/// derivatives. The displacement starts at zero.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// Displacement with two continuous derivatives.
    Displacement(VectorHistory),
    /// Velocity.
    Velocity(VectorHistory),
    /// Acceleration of a motion that starts at rest.
    Acceleration(VectorHistory),
}

impl Drive {
    /// Returns the history that is given: displacement, velocity or acceleration.
    pub fn history(&self) -> &VectorHistory {
        match self {
            Self::Displacement(history) | Self::Velocity(history) | Self::Acceleration(history) => history,
        }
    }

    /// Returns velocity and acceleration at a time.
    pub fn at(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Displacement(way) => {
                let [_, velocity, acceleration] = way.derivatives(time);
                (velocity, acceleration)
            }
            Self::Velocity(velocity) => velocity.at(time),
            Self::Acceleration(acceleration) => (acceleration.integral(time), acceleration.at(time).0),
        }
    }
}

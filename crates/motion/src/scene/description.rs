//! A scene as data. Numbers are in the units of the body that it is for.

use super::{Axes, Requirements, VectorHistory};
use crate::dynamics::{RotationVector, Terms};
use flexbody_base::provenance::SourceFile;
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;

/// A scene: start, loads and prescribed motion of a body, and how that is simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name.
    pub name: String,
    /// Duration, instants and method of the simulation.
    pub run: Run,
    /// The state at time zero.
    pub initial: Initial,
    /// Uniform gravity, world axes.
    pub gravity: Option<Vector3<f64>>,
    /// Forces and torques.
    pub loads: Vec<Load>,
    /// Prescribed spin.
    pub spin: Option<Spin>,
    /// The interface that carries the body.
    pub carried: Option<Carried>,
    /// Places whose paths are recorded.
    pub watched: Vec<Point>,
    /// Demands on a body that is made for the scene.
    pub requirements: Requirements,
    /// The file that it was read from.
    pub source: Option<SourceFile>,
    /// The files that its histories were read from.
    pub series: Vec<SeriesFile>,
    /// Whether its vectors are along the axes of a body in its [`Stage`](super::Stage), and its start is that
    /// of this body's frame.
    pub resolved: bool,
    /// Which load case it is of a scene that has several.
    pub case: Option<CaseName>,
}

/// Name of a load case of a scene file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaseName {
    /// Name of what all cases belong to.
    pub scene: String,
    /// Name of the case.
    pub name: String,
}

impl Scene {
    /// Name of the load case that it is.
    pub fn case_name(&self) -> Option<&str> {
        Some(&self.case.as_ref()?.name)
    }

    /// Name of the load case, or of a scene that is none.
    pub fn short_name(&self) -> &str {
        self.case_name().unwrap_or(&self.name)
    }

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
        let mut times: Vec<f64> =
            self.acting().chain(self.driving()).flat_map(VectorHistory::breaks).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

impl Scene {
    /// Angular velocity of a prescribed rotation, of the frame or of the interface that carries the body.
    pub fn rotation(&self) -> Option<&VectorHistory> {
        let carried = self.carried.as_ref().and_then(|carried| carried.spin.as_ref());
        let spin = self.spin.as_ref().map(|spin| &spin.velocity);
        spin.or(carried.map(|spin| &spin.velocity))
    }

    /// Whether the motion of the frame, or of the interface that carries the body, is prescribed.
    pub fn prescribes(&self) -> bool {
        self.spin.is_some() || self.carried.is_some()
    }

    /// The same with the prescribed angular velocity times a factor.
    pub fn turning_faster(&self, factor: f64) -> Self {
        let mut scene = self.clone();
        let carried = scene.carried.as_mut().and_then(|carried| carried.spin.as_mut());
        let velocities = scene.spin.iter_mut().map(|spin| &mut spin.velocity);
        for velocity in velocities.chain(carried.map(|spin| &mut spin.velocity)) {
            *velocity = velocity.scaled(factor);
        }
        scene
    }

    /// Histories of loads.
    pub fn acting(&self) -> impl Iterator<Item = &VectorHistory> {
        self.loads.iter().flat_map(|load| [&load.force, &load.torque])
    }

    /// Histories of prescribed motion.
    pub fn driving(&self) -> impl Iterator<Item = &VectorHistory> {
        let translation = self.carried.as_ref().and_then(|carried| carried.translation.as_ref());
        self.rotation().into_iter().chain(translation.map(Drive::history))
    }
}

/// Duration, instants and method of a simulation.
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
    /// Steps that an integration may take unless the scene says otherwise: some minutes to an hour, with the
    /// number of modes.
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
///
/// A point that has the coordinates x in the model is at `origin` + A x in the world, A being the rotation by
/// `rotation`: world axes start along those of the model unless that turns them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Initial {
    /// Where the origin of the model is, world axes.
    pub origin: Vector3<f64>,
    /// Velocity of the centre of mass of the undeformed body, world axes.
    pub velocity: Vector3<f64>,
    /// Attitude: the model is turned by the length of this vector (radians) about its direction.
    pub rotation: Vector3<f64>,
    /// Angular velocity.
    pub angular_velocity: Vector3<f64>,
    /// Axes of the angular velocity.
    pub axes: Axes,
    /// Modes that are not at rest and undeformed.
    pub modes: Vec<ModeStart>,
    /// Whether the deformation starts at rest in equilibrium with what acts at time zero, instead of with a
    /// shock.
    pub settled: bool,
}

/// A mode at time zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeStart {
    /// Number of the mode, from 0.
    pub mode: usize,
    /// Modal coordinate.
    pub amplitude: f64,
    /// Rate of the modal coordinate.
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

/// A file that a history was read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeriesFile {
    /// Where it lies.
    pub path: PathBuf,
    /// Its name and fingerprint.
    pub source: SourceFile,
}

/// A force and a torque at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// Where it acts.
    pub at: Point,
    /// Force.
    pub force: VectorHistory,
    /// Torque.
    pub torque: VectorHistory,
    /// Axes of both.
    pub axes: Axes,
}

impl Load {
    /// Force and torque at a time, along the axes of the load.
    pub fn at_time(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        (self.force.at(time).0, self.torque.at(time).0)
    }
}

/// Prescribed angular velocity of the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Spin {
    /// Angular velocity.
    pub velocity: VectorHistory,
    /// Its axes. Those of the world are, of a direction that does not change, the axes of the world at time
    /// zero, with which it turns; of columns, axes that are fixed in space.
    pub axes: Axes,
    /// The attitude at time zero of the model, or where `axes` are those of the body of its frame, instead of
    /// that of [`Initial`].
    pub start: Option<RotationVector>,
    /// Whether the centre of mass of the undeformed body is held where it is.
    pub hold: bool,
}

impl Spin {
    /// Angular velocity and acceleration at a time along axes of the model that have the `attitude`, of a
    /// scene that is on its [`Stage`](super::Stage).
    pub fn at(&self, time: f64, attitude: &Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        turning(&self.velocity, self.axes, time, attitude)
    }
}

/// Angular velocity and acceleration along axes of the model that have the `attitude`. Turned with the body,
/// the rate of an angular velocity is the same vector as seen from the world: omega x omega = 0.
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

/// An interface, or a node with rotations, whose motion is prescribed; the rest of the body hangs from it.
/// Without motion it is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    /// The interface or node that carries the body.
    pub by: Point,
    /// Rotation.
    pub spin: Option<CarriedSpin>,
    /// Motion along with that.
    pub translation: Option<Drive>,
}

/// Rotation of what carries a body, about a point that is fixed to it.
#[derive(Debug, Clone, PartialEq)]
pub struct CarriedSpin {
    /// Angular velocity.
    pub velocity: VectorHistory,
    /// Its axes, as those of a [`Spin`].
    pub axes: Axes,
    /// The attitude at time zero, as that of a [`Spin`].
    pub start: Option<RotationVector>,
    /// A point of the axis in model coordinates; `None`: the reference point of what is carried.
    pub through: Option<Vector3<f64>>,
}

impl CarriedSpin {
    /// As [`Spin::at`].
    pub fn at(&self, time: f64, attitude: &Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        turning(&self.velocity, self.axes, time, attitude)
    }
}

/// Motion of what carries a body, axis of rotation and all, along axes of the world, given by one of its
/// derivatives. It starts at zero.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// The way, of two continuous derivatives.
    Displacement(VectorHistory),
    /// The velocity.
    Velocity(VectorHistory),
    /// The acceleration of a motion that starts at rest.
    Acceleration(VectorHistory),
}

impl Drive {
    /// The history of the way, the velocity or the acceleration, whichever is given.
    pub fn history(&self) -> &VectorHistory {
        match self {
            Self::Displacement(history) | Self::Velocity(history) | Self::Acceleration(history) => history,
        }
    }

    /// Velocity and acceleration at a time.
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

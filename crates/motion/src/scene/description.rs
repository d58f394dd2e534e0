//! A scene as data. Numbers are in the units of the body that the scene is for.

use super::{Axes, History, Requirements, VectorHistory};
use crate::dynamics::{RotationVector, Terms};
use flexbody_base::provenance::SourceFile;
use flexbody_linalg::rotation;
use flexbody_linalg::ties::first_largest;
use nalgebra::{Matrix3, Unit, Vector3};
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
#[derive(Debug, Clone, Copy, PartialEq, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
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
        self.into()
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
    /// Nodal forces of the named load of this name: the component x of a force at it is their amplitude.
    NamedLoad(String),
}

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Node(number) => write!(f, "node {number}"),
            Self::Interface(name) => write!(f, "interface {name}"),
            Self::NamedLoad(name) => write!(f, "named load {name}"),
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
    /// Creates a named load with an amplitude over time.
    pub fn named(name: impl Into<String>, amplitude: History) -> Self {
        Self {
            at: Point::NamedLoad(name.into()),
            force: VectorHistory::Along { direction: Vector3::x(), factor: amplitude },
            torque: VectorHistory::nothing(),
            axes: Axes::Model,
        }
    }

    /// Returns true for a named load, which has an amplitude and no direction.
    pub fn is_named(&self) -> bool {
        matches!(self.at, Point::NamedLoad(_))
    }

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

    fn history_mut(&mut self) -> &mut VectorHistory {
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

// Variations of a scene: motions that a body is judged on and was not made for.

/// Factor of loads and of angular velocities in standard variations: near the scene, as inputs of a simulation are known.
const STANDARD_FACTOR: f64 = 1.1;

/// Angle of the turns in standard variations. Unit: degree.
const STANDARD_TURN: f64 = 10.0;

/// Variation of a load case.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneVariation {
    /// Name of the variation.
    pub name: String,
    /// Index of the load case that it varies (from 0).
    pub case: usize,
    /// The varied scene.
    pub scene: Scene,
}

/// Variations that a scene file states for its load cases.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Variations {
    /// None, and the standard ones are not wanted either: a scene that was not read from a file.
    #[default]
    Without,
    /// None: the standard variations are used, and tell what other motions would need.
    Standard,
    /// None, with `robust = true`: a body has to hold in the standard variations.
    Robust,
    /// Variations of the file.
    Stated(Vec<SceneVariation>),
}

impl Variations {
    /// Returns the variations of one load case (from 0), which becomes the only one.
    pub(super) fn of_case(self, case: usize) -> Self {
        match self {
            Self::Stated(all) => {
                let of_case = all.into_iter().filter(|one| one.case == case);
                Self::Stated(of_case.map(|one| SceneVariation { case: 0, ..one }).collect())
            }
            other => other,
        }
    }
}

/// Change of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Forces and torques are turned, in the axes of each load.
    Turn {
        /// Direction of the axis.
        axis: Unit<Vector3<f64>>,
        /// Angle. Unit: rad.
        angle: f64,
        /// Index of the load (from 0); `None` for all.
        load: Option<usize>,
    },
    /// Forces and torques are multiplied by a factor.
    Scale {
        /// Factor.
        factor: f64,
        /// Index of the load (from 0); `None` for all.
        load: Option<usize>,
    },
    /// A load acts at another point.
    Move {
        /// Index of the load (from 0).
        load: usize,
        /// New point of application.
        to: Point,
    },
    /// All prescribed and initial angular velocities, and the limits of rotation that the scene states, are multiplied by
    /// a factor.
    Speed(f64),
}

impl Scene {
    /// Returns the scene after a change. Indices of loads must exist.
    pub fn changed(&self, change: &Change) -> Self {
        match change {
            Change::Turn { axis, angle, load } => {
                let turn = rotation(axis, *angle);
                self.with_directed_loads(*load, |history| history.turned(turn.matrix()))
            }
            Change::Scale { factor, load } => self.with_loads(*load, |history| history.scaled(*factor)),
            Change::Move { load, to } => {
                let mut scene = self.clone();
                scene.loads[*load].at = to.clone();
                scene
            }
            Change::Speed(factor) => {
                let mut scene = self.turning_faster(*factor);
                scene.initial.angular_velocity *= *factor;
                // A variation may leave the range that the scene states: it is a motion that nobody asked for.
                let motion = &mut scene.requirements.motion;
                for range in [&mut motion.angular_velocity, &mut motion.angular_acceleration] {
                    *range = range.map(|range| range.scaled(factor.abs()));
                }
                scene
            }
        }
    }

    /// Returns the scene of [`Scene::with_loads`], except that named loads stay: they have no direction.
    fn with_directed_loads(
        &self,
        load: Option<usize>,
        change: impl Fn(&VectorHistory) -> VectorHistory,
    ) -> Self {
        let mut scene = self.with_loads(load, change);
        let named = scene.loads.iter_mut().zip(&self.loads).filter(|(load, _)| load.is_named());
        named.for_each(|(load, unchanged)| load.clone_from(unchanged));
        scene
    }

    /// Returns the scene with the histories of one load, or of all, replaced by `change` of each.
    fn with_loads(&self, load: Option<usize>, change: impl Fn(&VectorHistory) -> VectorHistory) -> Self {
        let mut scene = self.clone();
        let wanted = |at: usize| load.is_none_or(|load| load == at);
        for (_, load) in scene.loads.iter_mut().enumerate().filter(|(at, _)| wanted(*at)) {
            for history in [&mut load.force, &mut load.torque] {
                if !history.is_nothing() {
                    *history = change(history);
                }
            }
        }
        scene
    }

    /// Returns the standard variations of the scene for a body of 2 or 3 dimensions, each with its name. They stay near the
    /// scene: the loads, or without loads the prescribed translation, turned by [`STANDARD_TURN`] and multiplied by
    /// [`STANDARD_FACTOR`], and angular velocities multiplied by it.
    ///
    /// In space the turns are about the two axes across the main direction of the loads, in the plane about its normal.
    pub(super) fn standard_variations(&self, dimension: usize) -> Vec<(String, Scene)> {
        let mut all = Vec::new();
        let percent = (100.0 * (STANDARD_FACTOR - 1.0)).round();
        for axis in self.axes_across(dimension) {
            let normal = Unit::new_unchecked(Vector3::ith(axis, 1.0));
            let turn = rotation(&normal, STANDARD_TURN.to_radians());
            let about =
                if dimension == 2 { String::new() } else { format!(" about {}", ["x", "y", "z"][axis]) };
            all.extend(
                self.varied_excitation(|history| history.turned(turn.matrix()))
                    .map(|(what, scene)| (format!("{what} turned by {STANDARD_TURN} degrees{about}"), scene)),
            );
        }
        let larger = self.varied_excitation(|history| history.scaled(STANDARD_FACTOR));
        all.extend(larger.map(|(what, scene)| (format!("{what} larger by {percent} %"), scene)));
        let is_driven = self.rotation().is_some_and(|history| !history.is_nothing());
        if is_driven || self.initial.angular_velocity != Vector3::zeros() {
            all.push((format!("{percent} % faster"), self.changed(&Change::Speed(STANDARD_FACTOR))));
        }
        all
    }

    /// Returns the axes of the standard turns: in the plane its normal, in space the two along which the excitation is
    /// smaller, by the sum of its main directions.
    fn axes_across(&self, dimension: usize) -> Vec<usize> {
        if dimension == 2 {
            return vec![2];
        }
        let forces = self.loads.iter().filter(|load| !load.is_named()).map(|load| &load.force);
        let carried = self.carried.as_ref().and_then(|carried| carried.translation.as_ref());
        let mut along = Vector3::<f64>::zeros();
        for history in forces.chain(carried.map(Drive::history)) {
            along += history.main_direction().unwrap_or_default().abs();
        }
        let main = first_largest(0..3, |&axis| along[axis]).unwrap_or(0);
        (0..3).filter(|axis| *axis != main).collect()
    }

    /// Returns the scene with its loads changed or, without loads, with its prescribed translation changed. Returns `None`
    /// if it has neither. A named load has no direction and stays.
    fn varied_excitation(
        &self,
        change: impl Fn(&VectorHistory) -> VectorHistory,
    ) -> Option<(&'static str, Scene)> {
        let stays = |load: &Load| load.is_named() || load.force.is_nothing() && load.torque.is_nothing();
        if !self.loads.iter().all(stays) {
            return Some(("loads", self.with_directed_loads(None, change)));
        }
        let mut scene = self.clone();
        let way = scene.carried.as_mut()?.translation.as_mut()?.history_mut();
        *way = change(way);
        Some(("translation", scene))
    }
}

//! Recoveries over time, from a motion that any program computed.

use super::row_extremes::RowSurvey;
use super::row_states::RowSampler;
use super::{
    EnvelopeSearch, ExtremeSearch, Point, PointEnvelope, RowExtremes, RowLayout, RowMap, RowStates, Scene,
};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::InputFile;
use flexbody_base::text::series::{ColumnKey, has_column, read_series};
use flexbody_body::flex_body::{Carrier, FlexBody, ModalMotion, MotionLoad, Recovery};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Names of the columns of force and torque after the name of their interface.
const LOAD_COLUMNS: [[&str; 3]; 2] =
    [["force_x", "force_y", "force_z"], ["torque_x", "torque_y", "torque_z"]];

/// Names of the columns of the angular velocity.
const SPIN_COLUMNS: [&str; 3] = ["angular_velocity_x", "angular_velocity_y", "angular_velocity_z"];

/// Names of the columns of the angular acceleration.
const SPIN_RATE_COLUMNS: [&str; 3] =
    ["angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"];

/// Beginning of the names of modal coordinates, their rates and accelerations in the table of `simulate`, where the frame
/// of the body's file is on an interface and the motion is in mean axes, in which the body has other modes.
pub const MEAN_AXES: &str = "mean_axes_";

/// Columns of a table of `simulate` that tell a body with a prescribed motion, and one in mean axes: that of their torque,
/// or [`IN_MEAN_AXES`] for a body whose torque of mean axes is not known.
const REACTION: &str = "reaction_force_x";
const CONDITIONS: &str = "conditions_torque_x";

/// Column of ones in the table of `simulate` of a body with a prescribed motion in mean axes, whose torque is not known:
/// one without W3, or with nodes whose rotations carry mass.
pub const IN_MEAN_AXES: &str = "mean_axes";

/// Motion and loads of a body, computed by any program, at its own instants. Vectors are along the axes of the model,
/// which turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedHistory {
    /// File of the history.
    pub path: PathBuf,
    /// Times, ascending.
    pub time: Vec<f64>,
    /// Modal coordinates at each time.
    pub q: Vec<Vec<f64>>,
    /// Angular velocity of the body frame at each time; `None` if the file does not have it.
    pub angular_velocity: Option<Vec<Vector3<f64>>>,
    /// Rates of the modal coordinates at each time; `None` if the file does not have them.
    pub rate: Option<Vec<Vec<f64>>>,
    /// Second time derivatives of the modal coordinates at each time; `None` if the file does not have them.
    pub acceleration: Option<Vec<Vec<f64>>>,
    /// Angular acceleration of the body frame at each time; `None` if the file does not have it.
    pub angular_acceleration: Option<Vec<Vector3<f64>>>,
    /// Loads of the interfaces that the file has columns of.
    pub loads: Vec<LoadHistory>,
    /// Amplitudes of the named loads that the file has columns of.
    pub named: Vec<AmplitudeHistory>,
    /// Interface or node that carries the body, whose motion the frame has; `None` for the frame of the body's file.
    pub carrier: Option<Carrier>,
    /// True for the table that `simulate` writes of a carried body.
    pub is_of_carried: bool,
    /// True if the modal coordinates are those of the body in mean axes, and the body's file has another frame.
    pub is_in_mean_axes: bool,
}

/// Amplitude of a named load over time.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeHistory {
    /// Name of the load.
    pub load: String,
    /// Amplitude at each time.
    pub values: Vec<f64>,
}

/// Force and torque at the reference point of an interface over time.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadHistory {
    /// Name of the interface.
    pub interface: String,
    /// Force and torque at each time.
    pub values: Vec<[Vector3<f64>; 2]>,
}

/// Recoveries of a body over a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredMotion {
    /// Rows of every recovery, as maps of the states.
    pub recoveries: Vec<RowMap>,
    /// States at the instants of the output.
    pub states: RowStates,
    /// Largest values of every recovery.
    pub extremes: Vec<RowExtremes>,
    /// Largest stresses of every point of every recovery, if they were asked for.
    pub envelopes: Option<Vec<Vec<PointEnvelope>>>,
}

impl RecoveredMotion {
    /// Adds the largest stresses of every point at the instants.
    pub fn with_envelope(mut self) -> Self {
        let mut search = EnvelopeSearch::new(&self.recoveries, false);
        search.see(&self.recoveries, &self.states);
        self.envelopes = Some(search.finish());
        self
    }
}

/// Returns true if a table has modal coordinates of a body in mean axes whose file has another frame, and the names of the
/// columns of all modes for a prefix (`q`, `qd`, `qdd`).
fn modal_columns(file: &InputFile, body: &FlexBody) -> (bool, impl Fn(&str) -> Vec<String> + use<>) {
    let is_in_mean_axes = !body.conditions().is_mean() && has_column(file, &format!("{MEAN_AXES}q_1"));
    let (modes, count) = (if is_in_mean_axes { MEAN_AXES } else { "" }, body.n_modes());
    (is_in_mean_axes, move |prefix| (1..=count).map(|j| format!("{modes}{prefix}_{j}")).collect())
}

/// Returns true for the table of a prescribed motion that does not name mean axes.
fn names_carrier(file: &InputFile) -> bool {
    has_column(file, REACTION) && ![CONDITIONS, IN_MEAN_AXES].iter().any(|column| has_column(file, column))
}

impl LoadedHistory {
    /// Reads the columns `time`, `q_1` to `q_n` (or, for a body whose frame is on an interface, `mean_axes_q_1` to
    /// `mean_axes_q_n`, so the rates and accelerations too), `angular_velocity_x` to `_z`; `qd_1` to `qd_n`, `qdd_1` to `qdd_n` and
    /// `angular_acceleration_x` to `_z` if recoveries of the body have columns of forces of motion; for every interface of the body with
    /// a reference point `NAME force_x` to `_z` and `NAME torque_x` to `_z`, and for every named load but preloads `NAME`.
    /// Columns of an interface without load, and of a named load that does not act, may be absent. Other columns are
    /// ignored.
    ///
    /// # Errors
    /// FB215 for missing columns, also if a vector has only some of its three; FB216 for rows that cannot be read and for
    /// times that do not ascend; the errors of [`InputFile::open`].
    pub fn read(path: &Path, body: &FlexBody) -> Result<Self> {
        let file = InputFile::open(path)?;
        let (is_in_mean_axes, modal) = modal_columns(&file, body);
        let mut wanted: Vec<String> = modal("q");
        // A vector is in the file if any of its columns is; then all must be. Returns the place of its first column.
        let mut all_of = |names: Vec<String>| {
            names.iter().any(|name| has_column(&file, name)).then(|| {
                let first = wanted.len();
                wanted.extend(names);
                first
            })
        };
        let spin = all_of(SPIN_COLUMNS.map(str::to_owned).to_vec());
        let has_motion = body.recoveries().iter().any(|recovery| !recovery.motion.is_empty());
        let [rate, acceleration] =
            ["qd", "qdd"].map(|prefix| if has_motion { all_of(modal(prefix)) } else { None });
        let turning = SPIN_RATE_COLUMNS.map(str::to_owned).to_vec();
        let spin_rate = if has_motion { all_of(turning) } else { None };
        let mut vector = |names: [String; 3]| all_of(names.to_vec());
        let mut loaded = Vec::new();
        for interface in body.interfaces().iter().filter(|interface| interface.reference.is_some()) {
            let parts =
                LOAD_COLUMNS.map(|names| vector(names.map(|name| format!("{} {name}", interface.name))));
            if parts.iter().any(Option::is_some) {
                loaded.push((interface.name.clone(), parts));
            }
        }
        let acting = body.named_loads().iter().filter(|load| !load.preload);
        let named: Vec<(&str, usize)> = acting
            .filter(|load| has_column(&file, &load.name))
            .map(|load| {
                wanted.push(load.name.clone());
                (load.name.as_str(), wanted.len() - 1)
            })
            .collect();
        let keys: Vec<ColumnKey> = wanted.into_iter().map(ColumnKey::Name).collect();
        let all = read_series(&file, &ColumnKey::Name("time".to_owned()), &keys).map_err(Error::new)?;
        let rows = 0..all.times.len();
        let at = |place: Option<usize>, i: usize| match place {
            Some(place) => Vector3::from_fn(|k, _| all.columns[place + k][i]),
            None => Vector3::zeros(),
        };
        let load = |(interface, parts): (String, [Option<usize>; 2])| LoadHistory {
            interface,
            values: rows.clone().map(|i| parts.map(|part| at(part, i))).collect(),
        };
        let loads = loaded.into_iter().map(load).collect();
        let amplitude = |(load, place): (&str, usize)| AmplitudeHistory {
            load: load.to_owned(),
            values: all.columns[place].clone(),
        };
        let named = named.into_iter().map(amplitude).collect();
        let vectors = |place: Option<usize>| place.map(|_| rows.clone().map(|i| at(place, i)).collect());
        let modal = |first: usize| -> Vec<Vec<f64>> {
            let columns = &all.columns[first..first + body.n_modes()];
            rows.clone().map(|i| columns.iter().map(|column| column[i]).collect()).collect()
        };
        Ok(Self {
            path: path.to_owned(),
            q: modal(0),
            angular_velocity: vectors(spin),
            rate: rate.map(modal),
            acceleration: acceleration.map(modal),
            angular_acceleration: vectors(spin_rate),
            loads,
            named,
            time: all.times,
            carrier: None,
            is_of_carried: !is_in_mean_axes && names_carrier(&file),
            is_in_mean_axes,
        })
    }

    /// Returns the names of the interfaces and of the named loads that `body` has columns of and this history has no loads
    /// of; they count as unloaded.
    pub fn unloaded<'b>(&self, body: &'b FlexBody) -> Vec<&'b str> {
        let known = |name: &str| self.loads.iter().any(|load| load.interface == name);
        let interfaces = body.interfaces().iter().filter(|interface| interface.reference.is_some());
        let acting = body.named_loads().iter().filter(|load| !load.preload).map(|load| load.name.as_str());
        let absent = acting.filter(|name| self.named.iter().all(|one| one.load != *name));
        interfaces
            .map(|interface| interface.name.as_str())
            .filter(|name| !known(name))
            .chain(absent)
            .collect()
    }

    /// Returns recoveries of `body` over this motion: all of them, or those with the given names. Their largest values
    /// are those at the instants.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown) if the body has no recovery, or none of a name; FB215 if the history
    /// has no angular velocity and rows depend on it; FB212 for a torque at an interface whose nodes lie on one line,
    /// for loads at an interface without static columns, and for the run of a carried body without its carrier, if rows
    /// depend on the frame; the errors of [`FlexBody::carried`].
    pub fn recover(&self, body: &FlexBody, names: &[String]) -> Result<RecoveredMotion> {
        let body = &*self.in_own_frame(body)?;
        let chosen = chosen(body, names)?;
        self.refuse_other_frame(body, &chosen)?;
        self.refuse_torque_without_rotation(body)?;
        let layout = RowLayout::new(body, chosen.iter().copied());
        let recoveries: Vec<RowMap> = chosen.iter().map(|one| RowMap::new(one, &layout)).collect();
        self.refuse_unknown_spin(&recoveries, &layout)?;
        let states = self.states(body, layout)?;
        let mut search = ExtremeSearch::new(recoveries.len(), false);
        search.see(&recoveries, &states);
        Ok(RecoveredMotion { recoveries, states, extremes: search.finish(), envelopes: None })
    }

    /// Returns the body in the frame that the modal coordinates belong to.
    fn in_own_frame<'b>(&self, body: &'b FlexBody) -> Result<Cow<'b, FlexBody>> {
        match &self.carrier {
            Some(carrier) => Ok(Cow::Owned(body.carried(carrier)?)),
            None if self.is_in_mean_axes => body.in_mean_axes(),
            None => Ok(Cow::Borrowed(body)),
        }
    }

    /// Returns the states that rows depend on, along the axes of the body.
    fn states(&self, body: &FlexBody, layout: RowLayout) -> Result<RowStates> {
        let to_body = body.frame().axes.transpose();
        let mut places = Vec::new();
        for load in &self.loads {
            let is_loaded = load.values.iter().flatten().any(|vector| *vector != Vector3::zeros());
            match layout.interface(&load.interface) {
                Some(place) => places.push((place, load)),
                None if is_loaded => {
                    let message = format!(
                        "the recoveries have no static columns for the loads at interface `{}`",
                        load.interface
                    );
                    let help = "convert the model with an interface that is not `coupling = \"free\"`";
                    return Err(Diagnostic::new(Code::SceneBody, message)
                        .in_file(&self.path)
                        .with_help(help)
                        .into());
                }
                None => {}
            }
        }
        let named: Vec<_> = body
            .named_loads()
            .iter()
            .map(|load| (load.preload, self.named.iter().find(|one| one.load == load.name)))
            .collect();
        let mut states = RowStates::new(layout);
        let delay = body.stiffness_damping();
        let is_carrier = |load: &LoadHistory| {
            self.carrier.as_ref().is_some_and(|by| *by == Carrier::Interface(load.interface.clone()))
        };
        for (i, &time) in self.time.iter().enumerate() {
            let (last, share) = self.before(i, delay);
            let motion = self.motion(i, &to_body);
            let mut z = states.layout.state(motion.q, &motion.angular_velocity);
            states.layout.set_motion(&mut z, &motion, |load| self.missing_for(load).is_empty());
            for (place, load) in &places {
                let share = if is_carrier(load) { 0.0 } else { share };
                let late = |k: usize| load.values[i][k] + share * (load.values[last][k] - load.values[i][k]);
                let [force, torque] = [0, 1].map(|k| to_body * late(k));
                states.layout.add_load(&mut z, *place, &force, &torque);
            }
            for (place, (is_preload, own)) in named.iter().enumerate() {
                let late =
                    |one: &AmplitudeHistory| one.values[i] + share * (one.values[last] - one.values[i]);
                let amplitude = if *is_preload { 1.0 } else { own.map_or(0.0, late) };
                states.layout.add_amplitude(&mut z, place, amplitude);
            }
            states.push(time, &z);
        }
        Ok(states)
    }

    /// Returns the instant before instant `i`, and its share in what loads were at a `delay` before: what the modes leave out
    /// follows loads late by beta of damping in proportion to the stiffness. The share is at most one: where instants are
    /// closer than the delay, loads hardly change within it.
    fn before(&self, i: usize, delay: f64) -> (usize, f64) {
        match i.checked_sub(1) {
            Some(last) => (last, (delay / (self.time[i] - self.time[last])).min(1.0)),
            None => (i, 0.0),
        }
    }

    /// Refuses the run of a carried body for a body in another frame, to which the forces of the deformed body that turns
    /// belong.
    fn refuse_other_frame(&self, body: &FlexBody, chosen: &[&Recovery]) -> Result<()> {
        let depends =
            |recovery: &&Recovery| recovery.motion.iter().any(|own| own.load != MotionLoad::Damping);
        if !self.is_of_carried || !body.conditions().is_mean() || !chosen.iter().any(depends) {
            return Ok(());
        }
        let message = "the run is that of a carried body, whose frame follows the interface that carries it: the inertia of the deformation depends on it";
        let help = "name the interface, or the number of the node, that carries the body in the scene: --carried-by NAME";
        Err(Diagnostic::new(Code::SceneBody, message).in_file(&self.path).with_help(help).into())
    }

    /// Returns the motion at the instant `i`, along the rows of `axes` (given in the axes of the model). Rates that the
    /// history does not have are zero.
    pub(super) fn motion(&self, i: usize, axes: &Matrix3<f64>) -> ModalMotion<'_> {
        let vector =
            |all: &Option<Vec<Vector3<f64>>>| all.as_ref().map_or_else(Vector3::zeros, |all| axes * all[i]);
        ModalMotion {
            q: &self.q[i],
            rate: self.rate.as_ref().map_or(&[], |rows| &rows[i]),
            acceleration: self.acceleration.as_ref().map_or(&[], |rows| &rows[i]),
            angular_velocity: vector(&self.angular_velocity),
            angular_acceleration: vector(&self.angular_acceleration),
        }
    }

    /// Returns the columns that forces of motion depend on and that the history does not have.
    pub(super) fn missing_for(&self, load: MotionLoad) -> Vec<&'static str> {
        let (rate, acceleration) =
            (("qd_1 to qd_n", self.rate.is_some()), ("qdd_1 to qdd_n", self.acceleration.is_some()));
        let turning = ("angular_acceleration_x to _z", self.angular_acceleration.is_some());
        let needed = match load {
            MotionLoad::Damping => vec![rate],
            MotionLoad::Acceleration => vec![acceleration],
            MotionLoad::Turning => vec![rate, turning],
            MotionLoad::Centrifugal => Vec::new(),
        };
        needed.into_iter().filter(|(_, is_there)| !is_there).map(|(name, _)| name).collect()
    }

    /// Returns a warning about the forces of motion that recoveries of `body` have columns of and that are left out, since
    /// the history lacks columns.
    pub fn left_out(&self, body: &FlexBody, names: &[String]) -> Option<Diagnostic> {
        let read =
            body.recoveries().iter().filter(|recovery| names.is_empty() || names.contains(&recovery.name));
        let layout = RowLayout::new(body, read);
        let lacking: Vec<&MotionLoad> =
            layout.motion().iter().filter(|load| !self.missing_for(**load).is_empty()).collect();
        let mut columns: Vec<&str> = lacking.iter().flat_map(|load| self.missing_for(**load)).collect();
        columns.sort_unstable();
        columns.dedup();
        let forces: Vec<&str> = lacking.iter().map(|load| load.in_words()).collect();
        let message = format!(
            "the rows leave out {}, since the history has no columns {}",
            forces.join(" and "),
            columns.join(", ")
        );
        (!lacking.is_empty()).then(|| {
            Diagnostic::new(Code::RecoveryMotionUnknown, message)
                .in_file(&self.path)
                .with_help("write these columns to the table of the run, as `simulate --csv` does")
        })
    }

    /// Refuses recoveries that depend on an angular velocity that the history does not have.
    fn refuse_unknown_spin(&self, recoveries: &[RowMap], layout: &RowLayout) -> Result<()> {
        let needs = recoveries
            .iter()
            .find(|recovery| self.angular_velocity.is_none() && recovery.depends_on_spin(layout));
        let Some(recovery) = needs else { return Ok(()) };
        let message = format!(
            "recovery `{}` depends on the angular velocity, whose columns are missing: {}",
            recovery.name,
            SPIN_COLUMNS.join(", ")
        );
        let help = "write the angular velocity of the body along the axes of the model, or zeros for a body that does not turn";
        Err(self.lacks_columns(message, help))
    }

    /// Returns an error about columns that the history lacks.
    pub(super) fn lacks_columns(&self, message: String, help: &str) -> Error {
        Diagnostic::new(Code::SeriesColumn, message).in_file(&self.path).with_help(help).into()
    }

    /// Refuses torques at interfaces whose nodes do not determine a rotation.
    pub(super) fn refuse_torque_without_rotation(&self, body: &FlexBody) -> Result<()> {
        let modes = body.modes();
        let rotation = modes.rotation.as_ref().map(faer::Mat::as_ref);
        for load in &self.loads {
            let turned = load.values.iter().any(|[_, torque]| *torque != Vector3::zeros());
            let interface = body.interfaces().iter().find(|interface| interface.name == load.interface);
            let rows = interface.and_then(|interface| {
                interface.rows(body.nodes(), modes.shape.as_ref(), rotation, body.dimension())
            });
            if turned && rows.is_none_or(|rows| rows.rotation.is_none()) {
                let message = format!(
                    "the history has a torque at interface `{}`, whose nodes lie on one line and take none",
                    load.interface
                );
                return Err(Diagnostic::new(Code::SceneBody, message).in_file(&self.path).into());
            }
        }
        Ok(())
    }
}

/// Returns the recoveries with the given names, all of them without names.
fn chosen<'b>(body: &'b FlexBody, names: &[String]) -> Result<Vec<&'b Recovery>> {
    let all = body.recoveries();
    if all.is_empty() {
        let message = "the body has no recovery";
        return Err(Diagnostic::new(Code::RecoveryUnknown, message).into());
    }
    if names.is_empty() {
        return Ok(all.iter().collect());
    }
    let find = |name: &String| {
        all.iter().find(|one| one.name == *name).ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
            let message = format!("the body has no recovery `{name}`; it has {}", known.join(", "));
            Error::from(Diagnostic::new(Code::RecoveryUnknown, message).with_help("name one of them"))
        })
    };
    names.iter().map(find).collect()
}

// Recoveries of a body during its simulation in a scene.

/// Recoveries of a body along its motion: states at the output times, extremes of the continuous motion.
pub(super) struct SceneRows {
    recoveries: Vec<RowMap>,
    pub(super) sampler: RowSampler,
    states: RowStates,
    survey: RowSurvey,
}

impl SceneRows {
    /// Creates the recoveries of a body in a scene in one frame, with warnings about loads that they do not see;
    /// `None` for a body without recoveries.
    ///
    /// * `envelope`: true to find the largest stresses of every point.
    pub(super) fn new(body: &FlexBody, scene: &Scene, envelope: bool) -> Option<(Self, Vec<Diagnostic>)> {
        let all = body.recoveries();
        if all.is_empty() {
            return None;
        }
        let layout = RowLayout::new(body, all);
        let recoveries: Vec<RowMap> = all.iter().map(|one| RowMap::new(one, &layout)).collect();
        let sampler = RowSampler::new(layout.clone(), body, scene);
        let unseen = sampler.unseen(scene);
        let rows = Self {
            states: RowStates::new(layout.clone()),
            survey: RowSurvey::new(&recoveries, layout, envelope),
            recoveries,
            sampler,
        };
        Some((rows, Vec::from_iter(unseen_loads(&unseen))))
    }

    /// Records the state z at an output time.
    pub(super) fn record(&mut self, time: f64, z: &[f64]) {
        self.states.push(time, z);
    }

    /// Takes the state z of the motion for the extremes.
    pub(super) fn see(&mut self, time: f64, z: &[f64]) {
        self.survey.see(&self.recoveries, time, z);
    }

    /// Returns the recoveries over the motion.
    pub(super) fn finish(self) -> RecoveredMotion {
        let (extremes, envelopes) = self.survey.finish(&self.recoveries);
        RecoveredMotion { recoveries: self.recoveries, states: self.states, extremes, envelopes }
    }
}

/// Returns a warning about the places of loads without static columns.
fn unseen_loads(places: &[&Point]) -> Option<Diagnostic> {
    let first = places.first()?;
    let more = if places.len() > 1 { format!(" and {} more", places.len() - 1) } else { String::new() };
    let message = format!(
        "recoveries have no static columns for the load at {first}{more}: stresses near it are those of the modes alone"
    );
    Some(Diagnostic::new(Code::RecoveryLoadUnseen, message))
}

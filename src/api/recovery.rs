//! Recoveries: stresses, strains and forces over a motion of any program.

use super::matrix::by_rows;
use super::report_format::ReportFormat;
use super::{FlexBody, Matrix, Motion};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::flex_body::Carrier;
use flexbody_input::read_steps;
use flexbody_model::RecoveryRow;
use flexbody_motion::scene::{
    self, AmplitudeHistory, Envelope, LoadHistory, RecoveredMotion, RecoveryRequest, RowMap, StressPoint,
};
use flexbody_report::{EnvelopeKind, RecoveredFacts, RunData, channels_csv, recovered_csv};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Motion and loads of a body that any program computed, at its own instants. Vectors are along the axes of the model,
/// which turn with the body.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedHistory(scene::LoadedHistory);

impl LoadedHistory {
    /// Reads the table of a run of `body`, see `docs/reference/recovery.md`.
    ///
    /// # Errors
    /// FB215 for missing columns, also if a vector has only some of its three; FB216 for rows that cannot be read and
    /// for times that do not ascend; FB101 if there is no such file.
    pub fn read(path: impl AsRef<Path>, body: &FlexBody) -> Result<Self> {
        scene::LoadedHistory::read(path.as_ref(), &body.0).map(Self)
    }

    /// Makes a history of ascending times and the modal coordinates at each time, without loads.
    ///
    /// # Errors
    /// FB804 if the lengths differ, for no time, and for numbers that are not finite or times that do not ascend.
    pub fn new(time: Vec<f64>, q: Vec<Vec<f64>>) -> Result<Self> {
        let count = time.len();
        if q.len() != count {
            return refused(format!("{} rows of modal coordinates for {count} times", q.len()));
        }
        if count == 0 || !time.windows(2).all(|pair| pair[0] < pair[1]) {
            return refused("a history needs one or more ascending times".to_owned());
        }
        if !time.iter().chain(q.iter().flatten()).all(|value| value.is_finite()) {
            return refused("a time or a modal coordinate is not a finite number".to_owned());
        }
        let path = PathBuf::from("history");
        Ok(Self(scene::LoadedHistory {
            path,
            time,
            q,
            angular_velocity: None,
            rate: None,
            acceleration: None,
            angular_acceleration: None,
            loads: Vec::new(),
            named: Vec::new(),
            carrier: None,
            is_of_carried: false,
            is_in_mean_axes: false,
        }))
    }

    /// States that the motion is that of the frame of the interface, or of the node with this number, that carries `body`
    /// in the simulation: its origin is the reference point of the carrier.
    pub fn carried_by(mut self, body: &FlexBody, carrier: &str) -> Self {
        self.0.carrier = Some(Carrier::named(&body.0, carrier));
        self
    }

    /// Sets the angular velocity of the body frame at each time.
    ///
    /// # Errors
    /// FB804 if the number of rows is not that of the times, and for numbers that are not finite.
    pub fn angular_velocity(mut self, rows: &[[f64; 3]]) -> Result<Self> {
        self.0.angular_velocity = Some(self.vectors("angular velocity", rows)?);
        Ok(self)
    }

    /// Sets the angular acceleration of the body frame at each time, on which the inertia of the deformation depends.
    ///
    /// # Errors
    /// FB804 if the number of rows is not that of the times, and for numbers that are not finite.
    pub fn angular_acceleration(mut self, rows: &[[f64; 3]]) -> Result<Self> {
        self.0.angular_acceleration = Some(self.vectors("angular acceleration", rows)?);
        Ok(self)
    }

    /// Sets the first and, if they are known, the second time derivatives of the modal coordinates at each time, on which
    /// damping forces and the inertia of the deformation depend.
    ///
    /// # Errors
    /// FB804 if the numbers of rows or of columns are not those of the modal coordinates, and for numbers that are not
    /// finite.
    pub fn modal_rates(mut self, first: Vec<Vec<f64>>, second: Option<Vec<Vec<f64>>>) -> Result<Self> {
        for rows in [Some(&first), second.as_ref()].into_iter().flatten() {
            let fits = |(row, q): (&Vec<f64>, &Vec<f64>)| row.len() == q.len();
            if rows.len() != self.0.q.len() || !rows.iter().zip(&self.0.q).all(fits) {
                return refused("rates of the modal coordinates have another size than these".to_owned());
            }
            if !rows.iter().flatten().all(|value| value.is_finite()) {
                return refused("a rate of a modal coordinate is not a finite number".to_owned());
            }
        }
        self.0.rate = Some(first);
        self.0.acceleration = second;
        Ok(self)
    }

    /// Adds the force and the torque at the reference point of an interface at each time. Interfaces without loads count
    /// as unloaded.
    ///
    /// # Errors
    /// FB804 if a number of rows is not that of the times, for numbers that are not finite, and for an interface that
    /// has loads already.
    pub fn load(
        mut self,
        interface: impl Into<String>,
        force: &[[f64; 3]],
        torque: &[[f64; 3]],
    ) -> Result<Self> {
        let interface = interface.into();
        if self.0.loads.iter().any(|load| load.interface == interface) {
            return refused(format!("interface `{interface}` has loads already"));
        }
        let force = self.vectors(&format!("force at `{interface}`"), force)?;
        let torque = self.vectors(&format!("torque at `{interface}`"), torque)?;
        let values = force.into_iter().zip(torque).map(|(force, torque)| [force, torque]).collect();
        self.0.loads.push(LoadHistory { interface, values });
        Ok(self)
    }

    /// Adds the amplitude of a named load at each time. Named loads without amplitudes count as zero; preloads act always
    /// and take none.
    ///
    /// # Errors
    /// FB804 if the number of values is not that of the times, for numbers that are not finite, and for a load that has
    /// amplitudes already.
    pub fn amplitude(mut self, load: impl Into<String>, values: &[f64]) -> Result<Self> {
        let load = load.into();
        if self.0.named.iter().any(|known| known.load == load) {
            return refused(format!("named load `{load}` has amplitudes already"));
        }
        let count = self.0.time.len();
        if values.len() != count {
            return refused(format!(
                "{} amplitudes of the named load `{load}` for {count} times",
                values.len()
            ));
        }
        if !values.iter().all(|value| value.is_finite()) {
            return refused(format!("an amplitude of the named load `{load}` is not finite"));
        }
        self.0.named.push(AmplitudeHistory { load, values: values.to_vec() });
        Ok(self)
    }

    /// Returns rows of three as vectors, one for each time.
    fn vectors(&self, what: &str, rows: &[[f64; 3]]) -> Result<Vec<Vector3<f64>>> {
        let count = self.0.time.len();
        if rows.len() != count {
            return refused(format!("{} rows of the {what} for {count} times", rows.len()));
        }
        if !rows.iter().flatten().all(|value| value.is_finite()) {
            return refused(format!("the {what} has a number that is not finite"));
        }
        Ok(rows.iter().map(|row| Vector3::from(*row)).collect())
    }

    /// Refuses a history that does not fit the body.
    fn refuse_foreign(&self, body: &FlexBody) -> Result<()> {
        let n_modes = body.n_modes();
        if let Some(row) = self.0.q.iter().find(|row| row.len() != n_modes) {
            return refused(format!("{} modal coordinates, but the body has {n_modes} modes", row.len()));
        }
        for own in &self.0.named {
            let known = body.0.named_loads().iter().find(|load| load.name == own.load);
            let problem = match known {
                None => format!("the body has no named load `{}`", own.load),
                Some(load) if load.preload => {
                    format!("`{}` is a preload, which acts always with amplitude 1", own.load)
                }
                Some(_) => continue,
            };
            return Err(Diagnostic::new(Code::SceneBody, problem).into());
        }
        for load in &self.0.loads {
            let mut known = body.0.interfaces().iter().filter(|interface| interface.reference.is_some());
            if !known.any(|interface| interface.name == load.interface) {
                let message =
                    format!("the body has no interface `{}` with a reference point", load.interface);
                return Err(Diagnostic::new(Code::SceneBody, message).into());
            }
        }
        Ok(())
    }
}

fn refused<T>(message: String) -> Result<T> {
    Err(Diagnostic::new(Code::Argument, message).into())
}

/// Recoveries of a body over a motion: of a run of any program, or of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovered {
    pub(super) motion: RecoveredMotion,
    pub(super) source: RowSource,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Motion that recoveries are made of.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum RowSource {
    /// Run of any program.
    History(Box<LoadedHistory>),
    /// Simulation of the scene with this name.
    Scene(String),
}

/// Rows of one recovery over time.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RecoveredRows {
    /// Name of the recovery.
    pub name: String,
    /// Label of every row.
    pub labels: Vec<RecoveryRow>,
    /// Values: a row for each instant and a column for each label, in its unit.
    pub values: Matrix,
    /// Names of the points with all six stresses among the rows.
    pub points: Vec<String>,
    /// Equivalent stress of von Mises: a row for each instant and a column for each point.
    pub von_mises: Matrix,
    /// Equivalent stress of von Mises with the sign of the principal stress of the largest magnitude, in the same shape.
    pub signed_von_mises: Matrix,
    /// Principal stresses, the largest first, each in the same shape.
    pub principal: [Matrix; 3],
}

impl Motion {
    /// Returns the recoveries of the body over this motion, at the instants of the output; `None` if the body has none.
    pub fn recovered(&self) -> Option<Recovered> {
        let source = RowSource::Scene(self.recording.scene.clone());
        self.recording.recovered.clone().map(|motion| Recovered { motion, source, diagnostics: Vec::new() })
    }
}

impl FlexBody {
    /// Computes recoveries of the body over a history, like `flexbody recover`: those with the given names, or all.
    ///
    /// # Errors
    /// FB221 if the body has no recovery, or none of a name; FB215 if the history has no angular velocity and rows
    /// depend on it; FB212 for loads at an interface that the body does not have, and for a torque at one whose nodes
    /// lie on one line; FB804 for another number of modal coordinates.
    pub fn recover(&self, history: &LoadedHistory, names: &[&str]) -> Result<Recovered> {
        history.refuse_foreign(self)?;
        let only = names.iter().map(|name| (*name).to_owned()).collect();
        let request = RecoveryRequest { only, ..RecoveryRequest::default() };
        let scene::Recovered { motion, diagnostics } = request.run(&self.0, &history.0)?;
        Ok(Recovered { motion, source: RowSource::History(Box::new(history.clone())), diagnostics })
    }

    /// Returns the factor of each FE step over a history, like `flexbody recover --channels`, for a program that
    /// superposes the results of the steps.
    ///
    /// * `steps`: archive (`.npz`) that `flexbody shapes` wrote with the steps.
    ///
    /// # Errors
    /// FB101 and FB106 if the archive cannot be read, FB103 if it is damaged; FB326 for another archive and for steps of
    /// another body; FB215 if the history has no angular velocity and there are steps of spin; FB212 for loads without
    /// steps; FB804 for another number of modal coordinates.
    pub fn channels(&self, history: &LoadedHistory, steps: impl AsRef<Path>) -> Result<Channels> {
        history.refuse_foreign(self)?;
        let path = steps.as_ref();
        let steps = read_steps(path)?;
        let channels = history.0.channels(&self.0, &steps).map_err(|error| error.in_file(path))?;
        Ok(Channels { channels, history: history.0.path.display().to_string() })
    }

    /// Returns the names of the named loads of the body, preloads included.
    pub fn named_loads(&self) -> Vec<&str> {
        self.0.named_loads().iter().map(|load| load.name.as_str()).collect()
    }

    /// Returns the names of the recoveries of the body.
    pub fn recoveries(&self) -> Vec<&str> {
        self.0.recoveries().iter().map(|recovery| recovery.name.as_str()).collect()
    }
}

/// Factors of the steps of an FE program over time; the last channel is `constant`, for the values at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Channels {
    channels: scene::Channels,
    history: String,
}

impl Channels {
    /// Returns the names of the channels: those of the steps, and `constant`.
    pub fn names(&self) -> &[String] {
        &self.channels.names
    }

    /// Returns the times.
    pub fn times(&self) -> &[f64] {
        &self.channels.times
    }

    /// Returns the factors (times x channels).
    pub fn values(&self) -> Matrix {
        by_rows(self.channels.names.len(), &self.channels.values)
    }

    /// Returns the table of `flexbody recover --channels FILE.csv`.
    pub fn csv(&self) -> String {
        channels_csv(&self.channels)
    }

    /// Writes the HDF5 file of `flexbody recover --channels FILE.h5`, which appears whole or not at all. `body` is the
    /// body of the channels.
    ///
    /// # Errors
    /// FB104, FB105, FB107 and FB602 if the file cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn write(&self, body: &FlexBody, path: impl AsRef<Path>) -> Result<()> {
        let slot = flexbody_file::prepare_output(path)?;
        flexbody_file::fill_channels(&body.0, &self.channels, &self.history, &slot)?;
        slot.commit()
    }
}

impl Recovered {
    /// Returns warnings and notes of a history: forces of motion that the rows leave out, since the history does not have what
    /// they depend on, and largest stresses at rigid interfaces. Those of a simulation are with its motion.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Returns the times of the motion.
    pub fn times(&self) -> &[f64] {
        &self.motion.states.times
    }

    /// Returns the rows of every recovery.
    pub fn rows(&self) -> Vec<RecoveredRows> {
        self.motion.recoveries.iter().map(|map| self.rows_of(map)).collect()
    }

    fn rows_of(&self, map: &RowMap) -> RecoveredRows {
        let values: Vec<Vec<f64>> = self.motion.states.iter().map(|z| map.values(z)).collect();
        let of_points = |measure: &dyn Fn(&StressPoint, &[f64]) -> f64| {
            let row = |row: &Vec<f64>| map.points.iter().map(|point| measure(point, row)).collect();
            by_rows(map.points.len(), &values.iter().map(row).collect::<Vec<Vec<f64>>>())
        };
        RecoveredRows {
            name: map.name.clone(),
            labels: map.rows.clone(),
            points: map.points.iter().map(|point| point.name.clone()).collect(),
            von_mises: of_points(&StressPoint::von_mises),
            signed_von_mises: of_points(&StressPoint::signed_von_mises),
            principal: [0, 1, 2].map(|k| of_points(&|point, row| point.principal(row)[k])),
            values: by_rows(map.rows.len(), &values),
        }
    }

    /// Returns the report of `flexbody recover` on the largest values; `None` for rows of a simulation, whose own report
    /// has them. `body` is the body of the rows, here and in the functions that write files.
    pub fn report(&self, body: &FlexBody, format: ReportFormat) -> Option<String> {
        let RowSource::History(history) = &self.source else { return None };
        let run = RunData::default();
        Some(RecoveredFacts::new(&body.0, &history.0, &self.motion, &run).render(format.inner()))
    }

    /// Returns the table of `flexbody recover -o FILE.csv` and `flexbody simulate --rows FILE.csv`: one line per instant.
    pub fn csv(&self) -> String {
        recovered_csv(&self.motion)
    }

    /// Writes the HDF5 file of `flexbody recover -o FILE.h5` and `flexbody simulate --rows FILE.h5`, which appears whole
    /// or not at all.
    ///
    /// # Errors
    /// FB104, FB105, FB107 and FB602 if the file cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn write(&self, body: &FlexBody, path: impl AsRef<Path>) -> Result<()> {
        let history = match &self.source {
            RowSource::History(history) => history.0.path.display().to_string(),
            RowSource::Scene(_) => String::new(),
        };
        let origin = match &self.source {
            RowSource::History(_) => ("history", history.as_str()),
            RowSource::Scene(name) => ("scene", name.as_str()),
        };
        let slot = flexbody_file::prepare_output(path)?;
        flexbody_file::fill_recovered(&body.0, &self.motion, origin, &slot)?;
        slot.commit()
    }

    /// Writes the largest stresses of every point over the motion, like `--envelope`: a table (`.csv`), or the body with
    /// them at its nodes (`.vtu`). Those of a simulation need [`FlexBody::simulate_with_envelope`].
    ///
    /// # Errors
    /// FB801 for another extension; FB804 for a simulation without envelope; FB221 if no recovery has all six stresses of
    /// a point, or for a mesh if none of its points is a node; FB104 and FB602 if the file cannot be written.
    pub fn write_envelope(&self, body: &FlexBody, path: impl AsRef<Path>) -> Result<()> {
        write_envelope(self.envelope(None)?, body, path.as_ref())
    }

    /// Writes the largest stresses of every point over several load cases of `body`, each with its name, like `--envelope`
    /// for a scene with several: the file names the load case of each extreme.
    ///
    /// # Errors
    /// The errors of [`Recovered::write_envelope`]; FB804 without load cases, for two of one name, and for load cases with
    /// different recoveries or points.
    pub fn write_envelope_of_cases(
        cases: &[(&str, &Self)],
        body: &FlexBody,
        path: impl AsRef<Path>,
    ) -> Result<()> {
        let mut of_all: Option<Envelope> = None;
        for (name, own) in cases {
            let own = own.envelope(Some(name))?;
            match &mut of_all {
                Some(known) if known.cases.iter().any(|case| case == name) => {
                    return refused(format!("two load cases have the name `{name}`"));
                }
                Some(known) if !points_of(known).eq(points_of(&own)) => {
                    let first = &known.cases[0];
                    return refused(format!(
                        "load case `{name}` has other recoveries or points than load case `{first}`"
                    ));
                }
                Some(known) => known.join(own),
                None => of_all = Some(own),
            }
        }
        match of_all {
            Some(of_all) => write_envelope(of_all, body, path.as_ref()),
            None => refused("no load cases are given".to_owned()),
        }
    }

    fn envelope(&self, case: Option<&str>) -> Result<Envelope> {
        let motion = match (&self.motion.envelopes, &self.source) {
            (Some(_), _) => Cow::Borrowed(&self.motion),
            (None, RowSource::History(_)) => Cow::Owned(self.motion.clone().with_envelope()),
            (None, RowSource::Scene(_)) => {
                return refused("the body was simulated without the largest stresses of points".to_owned());
            }
        };
        match Envelope::of(&motion, case) {
            Some(envelope) => Ok(envelope),
            None => refused("the motion has no largest stresses of points".to_owned()),
        }
    }
}

/// Returns recovery, name, node, element and unit of every point of an envelope.
fn points_of(envelope: &Envelope) -> impl Iterator<Item = (&str, &str, Option<i64>, Option<i64>, &str)> {
    envelope.recoveries.iter().flat_map(|recovery| {
        let name = recovery.name.as_str();
        let points = recovery.points.iter();
        points.map(move |point| (name, point.name.as_str(), point.node, point.element, point.unit.as_str()))
    })
}

fn write_envelope(envelope: Envelope, body: &FlexBody, path: &Path) -> Result<()> {
    let kind = EnvelopeKind::of(path)?;
    let slot = OutputSlot::prepare(path)?;
    slot.fill(&kind.bytes(&body.0, &envelope)?)?;
    slot.commit()
}

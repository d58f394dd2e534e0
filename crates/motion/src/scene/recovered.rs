//! Recoveries over time, from a motion that any program computed.

use super::StressPoint;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::InputFile;
use flexbody_base::text::series::{ColumnKey, has_column, read_series};
use flexbody_body::flex_body::{FlexBody, LOAD_COMPONENTS, Recovery, RecoveryState};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// Names of the columns of force and torque after the name of their interface.
const LOAD_COLUMNS: [[&str; 3]; 2] =
    [["force_x", "force_y", "force_z"], ["torque_x", "torque_y", "torque_z"]];

/// Names of the columns of the angular velocity.
const SPIN_COLUMNS: [&str; 3] = ["angular_velocity_x", "angular_velocity_y", "angular_velocity_z"];

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
    /// Loads of the interfaces that the file has columns of.
    pub loads: Vec<LoadHistory>,
}

/// Force and torque at the reference point of an interface over time.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadHistory {
    /// Name of the interface.
    pub interface: String,
    /// Force and torque at each time.
    pub values: Vec<[Vector3<f64>; 2]>,
}

/// Rows of a recovery over time.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredRows<'b> {
    /// Recovery of the body.
    pub recovery: &'b Recovery,
    /// Values of all rows at each time.
    pub values: Vec<Vec<f64>>,
    /// Points with all six stresses among the rows.
    pub points: Vec<StressPoint>,
}

impl LoadedHistory {
    /// Reads the columns `time`, `q_1` to `q_n`, `angular_velocity_x` to `_z` and, for every interface of the body with
    /// a reference point, `NAME force_x` to `_z` and `NAME torque_x` to `_z`. Columns of an interface without load may be
    /// absent. Other columns are ignored.
    ///
    /// # Errors
    /// FB215 for missing columns, also if a vector has only some of its three; FB216 for rows that cannot be read and for
    /// times that do not ascend; the errors of [`InputFile::open`].
    pub fn read(path: &Path, body: &FlexBody) -> Result<Self> {
        let file = InputFile::open(path)?;
        let mut wanted: Vec<String> = (1..=body.n_modes()).map(|j| format!("q_{j}")).collect();
        // A vector is in the file if any of its columns is; then all must be. Returns the place of its first column.
        let mut vector = |names: [String; 3]| {
            names.iter().any(|name| has_column(&file, name)).then(|| {
                wanted.extend(names);
                wanted.len() - 3
            })
        };
        let spin = vector(SPIN_COLUMNS.map(str::to_owned));
        let mut loaded = Vec::new();
        for interface in body.interfaces().iter().filter(|interface| interface.reference.is_some()) {
            let parts =
                LOAD_COLUMNS.map(|names| vector(names.map(|name| format!("{} {name}", interface.name))));
            if parts.iter().any(Option::is_some) {
                loaded.push((interface.name.clone(), parts));
            }
        }
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
        let angular_velocity = spin.map(|_| rows.clone().map(|i| at(spin, i)).collect());
        let modes = &all.columns[..body.n_modes()];
        let q = rows.map(|i| modes.iter().map(|column| column[i]).collect()).collect();
        Ok(Self { path: path.to_owned(), time: all.times, q, angular_velocity, loads })
    }

    /// Returns the names of the interfaces that `body` has columns of and this history has no loads of; they count as
    /// unloaded.
    pub fn unloaded<'b>(&self, body: &'b FlexBody) -> Vec<&'b str> {
        let known = |name: &str| self.loads.iter().any(|load| load.interface == name);
        let interfaces = body.interfaces().iter().filter(|interface| interface.reference.is_some());
        interfaces.map(|interface| interface.name.as_str()).filter(|name| !known(name)).collect()
    }

    /// Returns the rows of recoveries of `body` at each time: all of them, or those with the given names.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown) if the body has no recovery, or none of a name; FB215 if the history
    /// has no angular velocity and rows depend on it; FB212 for a torque at an interface whose nodes lie on one line.
    pub fn recover<'b>(&self, body: &'b FlexBody, names: &[String]) -> Result<Vec<RecoveredRows<'b>>> {
        let chosen = chosen(body, names)?;
        self.refuse_torque_without_rotation(body)?;
        chosen.into_iter().map(|recovery| self.rows(body, recovery)).collect()
    }

    fn rows<'b>(&self, body: &FlexBody, recovery: &'b Recovery) -> Result<RecoveredRows<'b>> {
        if self.angular_velocity.is_none() && recovery.spin.norm_max() > 0.0 {
            let message = format!(
                "recovery `{}` depends on the angular velocity, whose columns are missing: {}",
                recovery.name,
                SPIN_COLUMNS.join(", ")
            );
            let help = "write the angular velocity of the body along the axes of the model, or zeros for a body that does not turn";
            return Err(Diagnostic::new(Code::SeriesColumn, message)
                .in_file(&self.path)
                .with_help(help)
                .into());
        }
        let to_body = body.frame().axes.transpose();
        let value = |i: usize| {
            let load = |interface: &String| {
                let given = self.loads.iter().find(|load| load.interface == *interface);
                let mut load = [0.0; LOAD_COMPONENTS];
                for (part, vector) in given.into_iter().flat_map(|given| &given.values[i]).enumerate() {
                    let along_body = to_body * vector;
                    (0..3).for_each(|k| load[3 * part + k] = along_body[k]);
                }
                load
            };
            let loads: Vec<_> = recovery.loads.iter().map(|one| load(&one.interface)).collect();
            let angular_velocity =
                self.angular_velocity.as_ref().map_or_else(Vector3::zeros, |omega| to_body * omega[i]);
            recovery.values(&RecoveryState { q: &self.q[i], angular_velocity, loads: &loads })
        };
        let points = StressPoint::among(&recovery.rows);
        Ok(RecoveredRows { recovery, values: (0..self.time.len()).map(value).collect(), points })
    }

    /// Refuses torques at interfaces whose nodes do not determine a rotation.
    fn refuse_torque_without_rotation(&self, body: &FlexBody) -> Result<()> {
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

impl RecoveredRows<'_> {
    /// Returns the equivalent stress of von Mises of every point at the instant `at`.
    pub fn von_mises(&self, at: usize) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().map(move |point| point.von_mises(&self.values[at]))
    }

    /// Returns the point and the instant of the largest equivalent stress, by index, with its value; `None` without
    /// points.
    pub fn largest_von_mises(&self) -> Option<(usize, usize, f64)> {
        let all = (0..self.values.len())
            .flat_map(|at| self.von_mises(at).enumerate().map(move |(p, v)| (p, at, v)));
        all.reduce(|most, one| if one.2 > most.2 { one } else { most })
    }

    /// Returns the row and the instant of the largest magnitude among all values, by index, with the value; `None` if
    /// there are no values.
    pub fn largest(&self) -> Option<(usize, usize, f64)> {
        let all = self.values.iter().enumerate();
        let all = all.flat_map(|(t, rows)| rows.iter().enumerate().map(move |(row, &value)| (row, t, value)));
        all.reduce(|most, one| if one.2.abs() > most.2.abs() { one } else { most })
    }
}

//! The file of a simulation: a small HDF5 file with a separate format, described in `docs/reference/simulate.md`.

use super::names;
use super::recorded_motion::RecordedMotion;
use super::units::{ONE, Units, unit};
use super::write::system_error;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::hdf5_file;
use flexbody_base::hdf5_file::{
    Numbers, Stored, broken_seal, create, dataset, elements, finish, make, open_group,
    open_with_checked_texts, put_numbers, put_text,
};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::generator;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::Carrier;
use flexbody_motion::dynamics::Balance;
use flexbody_motion::scene::{Recording, Scheme};
use hdf5_metno as hdf5;
use nalgebra::Vector3;
use std::cell::RefCell;
use std::path::Path;

/// Value of the root attribute `format`.
const FORMAT: &str = "flexbody-simulation";
/// Version of the format.
const VERSION: i64 = 3;
/// Version of files without digests, which are read as well.
const WITHOUT_DIGESTS: i64 = 2;

/// Writes the motion of a body with numbers in `units` to the temporary file of `slot`, which appears under its name
/// when the slot is committed.
///
/// # Errors
/// FB104 if the file cannot be written, FB602 if the disk is full.
pub fn fill_simulation(recording: &Recording, units: &UnitSystem, slot: &OutputSlot) -> Result<()> {
    fill(recording, units, slot.temporary()).map_err(|e| slot.failure(&system_error(&e.to_string())))
}

/// A group of the file with the units of its numbers.
struct DescribedGroup<'a> {
    group: hdf5::Group,
    units: &'a UnitSystem,
    numbers: &'a RefCell<Numbers>,
}

impl DescribedGroup<'_> {
    /// Writes a dataset with one number for every instant.
    fn put(&self, name: &str, units: Units, description: &str, values: &[f64]) -> hdf5::Result<()> {
        self.put_shaped(name, units, description, &[values.len()], values)
    }

    /// Writes a matrix with `rows` rows, which keeps two dimensions if one of them is 1.
    fn put_rows(
        &self,
        name: &str,
        units: Units,
        description: &str,
        rows: usize,
        values: &[f64],
    ) -> hdf5::Result<()> {
        self.put_shaped(name, units, description, &[rows, values.len() / rows.max(1)], values)
    }

    fn put_shaped(
        &self,
        name: &str,
        units: Units,
        description: &str,
        shape: &[usize],
        values: &[f64],
    ) -> hdf5::Result<()> {
        let dataset = put_numbers(&self.group, name, shape, values, &mut self.numbers.borrow_mut())?;
        put_text(&dataset, "units", &units.concrete(self.units))?;
        put_text(&dataset, "description", description)
    }

    fn vectors<'v>(
        &self,
        name: &str,
        units: Units,
        description: &str,
        vectors: impl Iterator<Item = &'v Vector3<f64>>,
    ) -> hdf5::Result<()> {
        let values: Vec<f64> = vectors.flat_map(|v| [v.x, v.y, v.z]).collect();
        self.put_rows(name, units, description, values.len() / 3, &values)
    }
}

fn fill(recording: &Recording, units: &UnitSystem, path: &Path) -> hdf5::Result<()> {
    let writer = Writer { recording, units, file: create(path)?, numbers: RefCell::default() };
    writer.origin()?;
    writer.method()?;
    writer.summary()?;
    writer.described(writer.file.as_group()?).put("time", unit(0, 0, 1), "instants", &recording.time)?;
    writer.frame()?;
    writer.modes()?;
    writer.energy()?;
    writer.momentum()?;
    writer.reaction()?;
    writer.conditions()?;
    writer.points()?;
    finish(writer.file, path, &writer.numbers.into_inner())
}

/// The file with its content. Everything is written in a fixed order, so that equal recordings give equal bytes.
struct Writer<'a> {
    recording: &'a Recording,
    units: &'a UnitSystem,
    file: hdf5::File,
    numbers: RefCell<Numbers>,
}

impl Writer<'_> {
    fn group(&self, name: &str) -> hdf5::Result<DescribedGroup<'_>> {
        Ok(self.described(make(&self.file, name)?))
    }

    fn described(&self, group: hdf5::Group) -> DescribedGroup<'_> {
        DescribedGroup { group, units: self.units, numbers: &self.numbers }
    }

    fn instants(&self) -> usize {
        self.recording.time.len()
    }

    fn number(&self, name: &str, value: f64) -> hdf5::Result<()> {
        self.file.new_attr::<f64>().create(name)?.write_scalar(&value)
    }

    /// Writes format, program, scene and body.
    fn origin(&self) -> hdf5::Result<()> {
        put_text(&self.file, "format", FORMAT)?;
        self.file.new_attr::<i64>().create("format_version")?.write_scalar(&VERSION)?;
        put_text(&self.file, "generator", &generator())?;
        put_text(&self.file, "scene", &self.recording.scene)?;
        put_text(&self.file, "body", &self.recording.body)?;
        let carrier = self.recording.setting.carrier.as_ref();
        carrier.map_or(Ok(()), |carrier| put_text(&self.file, "carrier", carrier))
    }

    /// Writes the integration method and its settings.
    fn method(&self) -> hdf5::Result<()> {
        put_text(&self.file, "method", self.recording.scheme.name())?;
        match self.recording.scheme {
            Scheme::Adaptive { tolerance } => self.number("tolerance", tolerance),
            Scheme::Conserving { order, step } => {
                self.file.new_attr::<i64>().create("order")?.write_scalar(&(order as i64))?;
                step.map_or(Ok(()), |step| self.number("step", step))
            }
        }
    }

    /// Writes the drift of conserved quantities, and the largest deflection.
    fn summary(&self) -> hdf5::Result<()> {
        let drift = self.recording.drift();
        self.number("energy_drift", drift.energy)?;
        self.number("linear_momentum_drift", drift.linear)?;
        self.number("angular_momentum_drift", drift.angular)?;
        self.number("largest_deflection", self.recording.extremes.deflection.value)
    }

    /// Writes position, attitude and velocities of the frame.
    fn frame(&self) -> hdf5::Result<()> {
        let Recording { states, setting, .. } = self.recording;
        let frame = self.group("frame")?;
        frame.vectors(
            "origin",
            unit(0, 1, 0),
            &format!("{}, origin of the frame; world axes", setting.origin_in_words()),
            states.iter().map(|s| &s.origin),
        )?;
        let in_model = "origin of the frame in the coordinates of the model";
        frame.put_rows("origin_in_model", unit(0, 1, 0), in_model, 1, setting.origin.as_slice())?;
        let attitudes: Vec<f64> = states.iter().flat_map(|s| s.attitude.0).collect();
        frame.put_rows(
            "attitude",
            ONE,
            "Euler parameters of the frame, from axes of the model, turning with the body, to world axes; the cosine of half the angle first",
            self.instants(),
            &attitudes,
        )?;
        let velocities = states.iter().map(|s| &s.velocity);
        frame.vectors("velocity", unit(0, 1, -1), "velocity of the origin, world axes", velocities)?;
        frame.vectors(
            "angular_velocity",
            unit(0, 0, -1),
            "angular velocity of the frame, axes of the model, turning with the body",
            states.iter().map(|s| &s.omega),
        )
    }

    /// Writes modal coordinates and their rates.
    fn modes(&self) -> hdf5::Result<()> {
        let states = &self.recording.states;
        let modes = self.group("modes")?;
        let q: Vec<f64> = states.iter().flat_map(|s| s.q.iter().copied()).collect();
        let description = if self.recording.setting.is_in_mean_axes {
            "modal coordinates of the body in mean axes, which has other modes than its file"
        } else {
            "modal coordinates"
        };
        modes.put_rows("q", unit(1, 1, 0), description, self.instants(), &q)?;
        let qd: Vec<f64> = states.iter().flat_map(|s| s.qd.iter().copied()).collect();
        modes.put_rows("qd", unit(1, 1, -1), "their rates", self.instants(), &qd)
    }

    fn energy(&self) -> hdf5::Result<()> {
        let balances = &self.recording.balances;
        let energy = self.group("energy")?;
        let put = |name: &str, description: &str, part: fn(&Balance) -> f64| {
            let values: Vec<f64> = balances.iter().map(part).collect();
            energy.put(name, unit(2, 2, -2), description, &values)
        };
        put("kinetic", "kinetic energy", |b| b.kinetic)?;
        put("elastic", "elastic energy", |b| b.elastic)?;
        put("work", "work of loads, damping and prescribed motion since the start", |b| b.work)
    }

    /// Writes momenta, and the impulses that change them.
    fn momentum(&self) -> hdf5::Result<()> {
        let momentum = self.group("momentum")?;
        let put = |name: &str, units: Units, description: &str, part: fn(&Balance) -> &Vector3<f64>| {
            momentum.vectors(name, units, description, self.recording.balances.iter().map(part))
        };
        let (linear, angular) = (unit(2, 1, -1), unit(2, 2, -1));
        put("linear", linear, "linear momentum, world axes", |b| &b.linear)?;
        let about_start = "angular momentum about the origin of the frame at the start, world axes";
        put("angular", angular, about_start, |b| &b.angular)?;
        put("impulse", linear, "impulse of the forces since the start, world axes", |b| &b.impulse)?;
        let about_same = "their angular impulse about the same point";
        put("angular_impulse", angular, about_same, |b| &b.angular_impulse)
    }

    /// Writes force and torque of prescribed motion, if the scene has it.
    fn reaction(&self) -> hdf5::Result<()> {
        let Some(reactions) = &self.recording.reactions else { return Ok(()) };
        let reaction = self.group("reaction")?;
        let description = "force that the prescribed motion takes, axes of the model, turning with the body";
        reaction.vectors("force", unit(2, 1, -2), description, reactions.iter().map(|r| &r.0))?;
        let description = "torque about the origin of the frame that the prescribed motion takes, axes of the model, turning with the body";
        reaction.vectors("torque", unit(2, 2, -2), description, reactions.iter().map(|r| &r.1))
    }

    /// Writes the torque of the reference conditions, if the frame is a mean one.
    fn conditions(&self) -> hdf5::Result<()> {
        let Some(torques) = &self.recording.conditions else { return Ok(()) };
        let description = "torque about the origin of the frame that the reference conditions (mean axes) carry, axes of the model, turning with the body; their force is zero";
        self.group("conditions")?.vectors("torque", unit(2, 2, -2), description, torques.iter())
    }

    /// Writes the paths of watched points, if there are any.
    fn points(&self) -> hdf5::Result<()> {
        if self.recording.paths.is_empty() {
            return Ok(());
        }
        let points = self.group("points")?;
        for path in &self.recording.paths {
            let point = self.described(make(&points.group, &names::encode(&path.name))?);
            point.vectors("place", unit(0, 1, 0), "place, world axes", path.place.iter())?;
            let description = "deflection from the undeformed body, axes of the model, turning with the body";
            point.vectors("deflection", unit(0, 1, 0), description, path.deflection.iter())?;
            point.vectors("velocity", unit(0, 1, -1), "velocity, world axes", path.velocity.iter())?;
            point.vectors(
                "acceleration",
                unit(0, 1, -2),
                "acceleration, world axes",
                path.acceleration.iter(),
            )?;
        }
        Ok(())
    }
}

// Reads the file of a simulation as needed for pictures: the motion of the frame and of the modes.

/// Reads the motion that `flexbody simulate` wrote to `path`.
///
/// # Errors
/// FB101 if the file cannot be read; FB734 if it is another file, one of another version, or a damaged one.
pub fn read_simulation(path: impl AsRef<Path>) -> Result<RecordedMotion> {
    let path = path.as_ref();
    let (file, bytes) = open_with_checked_texts(path, "motion", Code::MotionUnreadable)?;
    let mut reading = RecordingReader { file, bytes, stored: Stored::new(bytes) };
    reading
        .motion()
        .map_err(|problem| Error::from(Diagnostic::new(Code::MotionUnreadable, problem).in_file(path)))
}

struct RecordingReader {
    file: hdf5::File,
    /// Size of the file.
    bytes: u64,
    stored: Stored,
}

impl RecordingReader {
    fn motion(&mut self) -> std::result::Result<RecordedMotion, String> {
        let root = self.file.as_group().map_err(|e| e.to_string())?;
        match hdf5_file::text(&root, "format")? {
            Some(format) if format == FORMAT => {}
            found => return Err(format!("the attribute `format` is {found:?}, expected `{FORMAT}`")),
        }
        let sealed = match hdf5_file::int(&root, "format_version")? {
            Some(VERSION) => true,
            Some(WITHOUT_DIGESTS) => false,
            found => return Err(format!("format version {found:?}, expected {VERSION}")),
        };
        if let Some(difference) = broken_seal(&self.file, &mut Stored::new(self.bytes), sealed)? {
            return Err(format!("the motion was changed after it was written; {difference}"));
        }
        let (time, _) = self.rows("/", "time", None)?;
        let instants = time.len();
        let (q, modes) = self.rows("/modes", "q", Some(instants))?;
        let mut vectors =
            |group: &str, name: &str, width: usize, rows: usize| match self.rows(group, name, Some(rows))? {
                (values, columns) if columns == width => Ok(values),
                (_, columns) => Err(format!("{group}/{name}: expected {width} columns, found {columns}")),
            };
        let origins = vectors("/frame", "origin", 3, instants)?;
        let attitudes = vectors("/frame", "attitude", 4, instants)?;
        let origin_in_model = vectors("/frame", "origin_in_model", 3, 1)?;
        if time.windows(2).any(|pair| pair[0] > pair[1]) {
            return Err("time: expected ascending instants".to_owned());
        }
        Ok(RecordedMotion {
            scene: hdf5_file::text(&root, "scene")?.unwrap_or_default(),
            body: hdf5_file::text(&root, "body")?.unwrap_or_default(),
            carrier: self.carrier(&root)?,
            origin_in_model: origin_in_model.try_into().map_err(|_| "/frame/origin_in_model")?,
            time,
            modes,
            q,
            origins,
            attitudes,
            largest_deflection: hdf5_file::float(&root, "largest_deflection")?
                .filter(|v| v.is_finite())
                .unwrap_or(0.0),
        })
    }

    /// Returns the carrier of the body. Files of earlier versions state that there is one, but not which.
    fn carrier(&self, root: &hdf5::Group) -> std::result::Result<Option<Carrier>, String> {
        if let Some(words) = hdf5_file::text(root, "carrier")? {
            let carrier = Carrier::from_words(&words);
            return carrier
                .map(Some)
                .ok_or(format!("the attribute `carrier` is {words:?}, expected an interface or a node"));
        }
        let frame = open_group(&self.file, "/frame").map_err(|found| format!("/frame: found {found}"))?;
        let origin = hdf5_file::open_dataset(&frame, "origin")?;
        let described = origin.map(|origin| hdf5_file::text(&origin, "description")).transpose()?.flatten();
        match described {
            Some(text) if text.starts_with("reference point") => {
                Err("the body is carried, but the file does not state by which interface or node: run flexbody simulate again".to_owned())
            }
            _ => Ok(None),
        }
    }

    /// Returns finite numbers with a row for every instant, and their number of columns. `rows` is the required number
    /// of rows, if it is known.
    fn rows(
        &mut self,
        group: &str,
        name: &str,
        rows: Option<usize>,
    ) -> std::result::Result<(Vec<f64>, usize), String> {
        let about = |problem: String| format!("{}/{name}: {problem}", group.trim_end_matches('/'));
        let place = open_group(&self.file, group)
            .map_err(|found| about(format!("expected a group, found {found}")))?;
        let fit = |dims: &[usize]| match *dims {
            [own] | [own, _] if rows.is_none_or(|rows| rows == own) => elements(dims),
            _ => Err(format!(
                "expected {} rows, found shape {dims:?}",
                rows.map_or("some".to_owned(), |n| n.to_string())
            )),
        };
        let read = dataset::<f64>(&place, name, &mut self.stored, fit).map_err(about)?;
        let (values, dims) = read.ok_or_else(|| about("expected a dataset, found nothing".to_owned()))?;
        if values.is_empty() || values.iter().any(|v| !v.is_finite()) {
            return Err(about("expected finite numbers".to_owned()));
        }
        Ok((values, dims.get(1).copied().unwrap_or(1)))
    }
}

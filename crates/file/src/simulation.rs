//! The file of a simulation: a small HDF5 file with a separate format, described in `docs/reference/simulate.md`.

use super::names;
use super::value::Units;
use super::write::system_error;
use flexbody_base::error::Result;
use flexbody_base::hdf5_file::{create, make, put_text};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::generator;
use flexbody_base::units::UnitSystem;
use flexbody_motion::dynamics::Balance;
use flexbody_motion::scene::{Recording, Scheme};
use hdf5_metno as hdf5;
use nalgebra::Vector3;
use std::path::Path;

/// Value of the root attribute `format`.
pub(super) const FORMAT: &str = "flexbody-simulation";
/// Version of the format.
pub(super) const VERSION: i64 = 2;

/// Returns the unit with these exponents of mass^(1/2), length and time.
const fn unit(mass_halves: i8, length: i8, time: i8) -> Units {
    Units::Of { mass_halves, length, time }
}

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
        let builder = self.group.new_dataset::<f64>().obj_track_times(false);
        let dataset = builder.shape(shape.to_vec()).create(name)?;
        dataset.write_raw(values)?;
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
    let writer = Writer { recording, units, file: create(path)? };
    writer.origin()?;
    writer.method()?;
    writer.summary()?;
    let top = DescribedGroup { group: writer.file.as_group()?, units };
    top.put("time", unit(0, 0, 1), "instants", &recording.time)?;
    writer.frame()?;
    writer.modes()?;
    writer.energy()?;
    writer.momentum()?;
    writer.reaction()?;
    writer.conditions()?;
    writer.points()?;
    writer.file.flush()?;
    writer.file.close()
}

/// The file with its content. Everything is written in a fixed order, so that equal recordings give equal bytes.
struct Writer<'a> {
    recording: &'a Recording,
    units: &'a UnitSystem,
    file: hdf5::File,
}

impl Writer<'_> {
    fn group(&self, name: &str) -> hdf5::Result<DescribedGroup<'_>> {
        Ok(DescribedGroup { group: make(&self.file, name)?, units: self.units })
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
            Units::One,
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
        modes.put_rows("q", unit(1, 1, 0), "modal coordinates", self.instants(), &q)?;
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
            let point =
                DescribedGroup { group: make(&points.group, &names::encode(&path.name))?, units: self.units };
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

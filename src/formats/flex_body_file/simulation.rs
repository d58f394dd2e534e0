//! The file of a simulation: a small HDF5 file of its own format, described in `docs/simulate.md`.

use super::names;
use super::value::Units;
use super::write::system_error;
use crate::base::error::Result;
use crate::base::hdf5_file::{create, make, put_text};
use crate::base::output::OutputSlot;
use crate::base::provenance::generator;
use crate::base::units::UnitSystem;
use crate::motion::dynamics::Balance;
use crate::motion::scene::{Recording, Scheme};
use hdf5_metno as hdf5;
use nalgebra::Vector3;
use std::path::Path;

const FORMAT: &str = "flexbody-simulation";
const VERSION: i64 = 2;

/// Unit exponents of mass^(1/2), length and time.
const fn of(mass_halves: i8, length: i8, time: i8) -> Units {
    Units::Of { mass_halves, length, time }
}

/// Writes the motion of a body whose numbers are in `units` to the temporary file of `slot`; it appears with the slot's commit.
///
/// # Errors
/// FB104, FB602.
pub fn fill_simulation(recording: &Recording, units: &UnitSystem, slot: &OutputSlot) -> Result<()> {
    fill(recording, units, slot.temporary()).map_err(|e| slot.failure(&system_error(&e.to_string())))
}

/// A group and what describes the numbers in it.
struct Place<'a> {
    group: hdf5::Group,
    units: &'a UnitSystem,
}

impl Place<'_> {
    /// A dataset with a row for every instant.
    fn put(
        &self,
        name: &str,
        units: Units,
        description: &str,
        rows: usize,
        values: &[f64],
    ) -> hdf5::Result<()> {
        let columns = values.len() / rows.max(1);
        let builder = self.group.new_dataset::<f64>().obj_track_times(false);
        let dataset = match columns {
            1 => builder.shape([rows]).create(name)?,
            _ => builder.shape([rows, columns]).create(name)?,
        };
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
        self.put(name, units, description, values.len() / 3, &values)
    }
}

fn fill(recording: &Recording, units: &UnitSystem, path: &Path) -> hdf5::Result<()> {
    let Recording { states, balances, time, .. } = recording;
    let n = time.len();
    let file = create(path)?;
    put_text(&file, "format", FORMAT)?;
    file.new_attr::<i64>().create("format_version")?.write_scalar(&VERSION)?;
    for (name, text) in [("generator", &generator()), ("scene", &recording.scene), ("body", &recording.body)]
    {
        put_text(&file, name, text)?;
    }
    let number = |name: &str, value: f64| file.new_attr::<f64>().create(name)?.write_scalar(&value);
    match recording.scheme {
        Scheme::Adaptive { tolerance } => {
            put_text(&file, "method", "adaptive")?;
            number("tolerance", tolerance)?;
        }
        Scheme::Conserving { order, step } => {
            put_text(&file, "method", "conserving")?;
            file.new_attr::<i64>().create("order")?.write_scalar(&(order as i64))?;
            step.map_or(Ok(()), |step| number("step", step))?;
        }
    }
    let drift = recording.drift();
    for (name, value) in [
        ("energy_drift", drift.energy),
        ("linear_momentum_drift", drift.linear),
        ("angular_momentum_drift", drift.angular),
        ("largest_deflection", recording.extremes.deflection.value),
    ] {
        number(name, value)?;
    }

    let group = |name: &str| Ok::<_, hdf5::Error>(Place { group: make(&file, name)?, units });
    let top = Place { group: file.as_group()?, units };
    top.put("time", of(0, 0, 1), "instants", n, time)?;

    let frame = group("frame")?;
    frame.vectors(
        "origin",
        of(0, 1, 0),
        &format!("{}, origin of the frame; world axes", recording.setting.origin_in_words()),
        states.iter().map(|s| &s.origin),
    )?;
    let in_model = "origin of the frame in the coordinates of the model";
    frame.put("origin_in_model", of(0, 1, 0), in_model, 1, recording.setting.origin.as_slice())?;
    let attitudes: Vec<f64> = states.iter().flat_map(|s| s.attitude.0).collect();
    frame.put(
        "attitude",
        Units::One,
        "Euler parameters of the frame, from axes of the model, turning with the body, to world axes; the cosine of half the angle first",
        n,
        &attitudes,
    )?;
    let velocities = states.iter().map(|s| &s.velocity);
    frame.vectors("velocity", of(0, 1, -1), "velocity of the origin, world axes", velocities)?;
    let rates = states.iter().map(|s| &s.omega);
    frame.vectors(
        "angular_velocity",
        of(0, 0, -1),
        "angular velocity of the frame, axes of the model, turning with the body",
        rates,
    )?;

    let modes = group("modes")?;
    let q: Vec<f64> = states.iter().flat_map(|s| s.q.iter().copied()).collect();
    modes.put("q", of(1, 1, 0), "modal coordinates", n, &q)?;
    let qd: Vec<f64> = states.iter().flat_map(|s| s.qd.iter().copied()).collect();
    modes.put("qd", of(1, 1, -1), "their rates", n, &qd)?;

    let energy = group("energy")?;
    let numbers = |of: fn(&Balance) -> f64| balances.iter().map(of).collect::<Vec<f64>>();
    for (name, description, values) in [
        ("kinetic", "kinetic energy", numbers(|b| b.kinetic)),
        ("elastic", "elastic energy", numbers(|b| b.elastic)),
        ("work", "work of loads, damping and prescribed motion since the start", numbers(|b| b.work)),
    ] {
        energy.put(name, of(2, 2, -2), description, n, &values)?;
    }

    let momentum = group("momentum")?;
    let (linear, angular) = (of(2, 1, -1), of(2, 2, -1));
    momentum.vectors("linear", linear, "linear momentum, world axes", balances.iter().map(|b| &b.linear))?;
    let about_start = "angular momentum about the origin of the frame at the start, world axes";
    momentum.vectors("angular", angular, about_start, balances.iter().map(|b| &b.angular))?;
    let impulses = balances.iter().map(|b| &b.impulse);
    momentum.vectors("impulse", linear, "impulse of the forces since the start, world axes", impulses)?;
    let impulses = balances.iter().map(|b| &b.angular_impulse);
    momentum.vectors("angular_impulse", angular, "their angular impulse about the same point", impulses)?;

    if let Some(reactions) = &recording.reactions {
        let reaction = group("reaction")?;
        let description = "force that the prescribed motion takes, axes of the model, turning with the body";
        reaction.vectors("force", of(2, 1, -2), description, reactions.iter().map(|r| &r.0))?;
        let description = "torque about the origin of the frame that the prescribed motion takes, axes of the model, turning with the body";
        reaction.vectors("torque", of(2, 2, -2), description, reactions.iter().map(|r| &r.1))?;
    }
    if !recording.paths.is_empty() {
        let points = group("points")?;
        for path in &recording.paths {
            let point = Place { group: make(&points.group, &names::encode(&path.name))?, units };
            point.vectors("place", of(0, 1, 0), "place, world axes", path.place.iter())?;
            let description = "deflection from the undeformed body, axes of the model, turning with the body";
            point.vectors("deflection", of(0, 1, 0), description, path.deflection.iter())?;
        }
    }
    file.flush()?;
    file.close()
}

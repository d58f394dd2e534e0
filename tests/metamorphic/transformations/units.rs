//! Transformation of the units of length, mass and time.

use super::Pair;
use super::histories::{Clock, Driven, for_driving};
use super::model::rows;
use crate::correspondence::Correspondence;
use crate::draws::pick;
use crate::subject::Subject;
use crate::{carried_mass, named_loads, recoveries};
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_linalg::CscMatrix;
use flexbody_model::{Damping, LoadKind, RawMatrix, RawModel, Reference};
use flexbody_motion::scene::{Range, Scene, Scheme};
use oracle::mesh::entries;
use oracle::random::Random;

/// Ratios of the new to the old numbers of a length, a mass and a time.
#[derive(Debug, Clone, Copy)]
struct Units {
    length: f64,
    mass: f64,
    time: f64,
}

/// Writes all quantities in other units.
pub fn change(subject: &Subject, random: &mut Random) -> Result<Option<Pair>> {
    const FACTORS: [f64; 5] = [1e-3, 0.5, 1.0, 39.37, 1e3];
    let mut factor = || FACTORS[pick(random, FACTORS.len())];
    let units = Units { length: factor(), mass: factor(), time: factor() };
    let mut changed = subject.clone();
    changed.raw = units.raw(&subject.raw);
    changed.scene = units.scene(&subject.scene);
    let map = Correspondence { units: [units.length, units.mass, units.time], ..Correspondence::default() };
    Ok(Some(Pair::new(subject, changed, map)))
}

impl Units {
    /// Returns the ratio of the new to the old number of a stiffness.
    fn stiffness(&self) -> f64 {
        self.mass / (self.time * self.time)
    }

    fn force(&self) -> f64 {
        self.stiffness() * self.length
    }

    /// Returns the matrix of a model times a factor, and a factor of length for every rotation.
    fn matrix(&self, raw: &RawModel, own: &RawMatrix, factor: f64) -> RawMatrix {
        let labels = rows(raw);
        let length = |row: u32| if labels[row as usize].direction > 3 { self.length } else { 1.0 };
        let all: Vec<_> = entries(&own.matrix)
            .map(|(i, j, value)| (i, j, value * (factor * length(i) * length(j))))
            .collect();
        RawMatrix { matrix: CscMatrix::from_triplets(labels.len(), labels.len(), &all), ..own.clone() }
    }

    fn raw(&self, raw: &RawModel) -> RawModel {
        let mut changed = raw.clone();
        let place = |x: &mut [f64; 3]| x.iter_mut().for_each(|x| *x *= self.length);
        changed.nodes.positions.iter_mut().for_each(place);
        for set in &mut changed.data.interfaces {
            if let Reference::Point(x) = &mut set.reference {
                place(x);
            }
        }
        changed.stiffness = self.matrix(raw, &raw.stiffness, self.stiffness());
        changed.mass = self.matrix(raw, &raw.mass, self.mass);
        match &mut changed.data.damping {
            Some(Damping::Rayleigh { alpha, beta }) => {
                (*alpha, *beta) = (*alpha / self.time, *beta * self.time)
            }
            Some(Damping::Matrix(matrix)) => *matrix = self.matrix(raw, matrix, self.mass / self.time),
            _ => {}
        }
        for own in &mut changed.data.geometric_stiffness {
            let load = match own.load.kind {
                LoadKind::Acceleration => self.length / (self.time * self.time),
                LoadKind::AngularAcceleration | LoadKind::Spin => 1.0 / (self.time * self.time),
                LoadKind::Force(_) => self.force(),
                LoadKind::Moment(_) => self.force() * self.length,
                LoadKind::Named(_) => 1.0,
            };
            own.matrix = self.matrix(raw, &own.matrix, self.stiffness() / load);
        }
        changed.data.recoveries = recoveries::scaled(raw, self.length);
        changed.data.named_loads = named_loads::scaled(raw, self.force(), self.length);
        changed.followers = carried_mass::scaled(raw, self.length, self.mass);
        changed.data.description.units = self.named(&raw.data.description.units);
        changed
    }

    /// Returns the new units: smaller units for larger numbers.
    fn named(&self, old: &UnitSystem) -> UnitSystem {
        let name = |si: f64, factor: f64| format!("{:e}", si / factor);
        let names = [
            name(old.length.to_si(), self.length),
            name(old.mass.to_si(), self.mass),
            name(old.time.to_si(), self.time),
        ];
        let mut units = UnitSystem::parse(&names[0], &names[1], &names[2]).expect("numbers");
        units.stated = old.stated;
        units
    }

    fn scene(&self, scene: &Scene) -> Scene {
        let mut changed = scene.clone();
        let (velocity, rate) = (self.length / self.time, 1.0 / self.time);
        changed.run.duration = scene.run.duration.map(|duration| duration * self.time);
        if let Scheme::Conserving { step: Some(step), .. } = &mut changed.run.scheme {
            *step *= self.time;
        }
        changed.initial.origin *= self.length;
        changed.initial.velocity *= velocity;
        changed.initial.angular_velocity *= rate;
        for start in &mut changed.initial.modes {
            let amplitude = self.length * self.mass.sqrt();
            (start.amplitude, start.rate) = (start.amplitude * amplitude, start.rate * amplitude * rate);
        }
        changed.gravity = scene.gravity.map(|gravity| gravity * (velocity * rate));
        Clock { factor: self.time, delay: 0.0 }.scene(&mut changed);
        for load in changed.loads.iter_mut().filter(|load| !load.is_named()) {
            load.force = load.force.scaled(self.force());
            load.torque = load.torque.scaled(self.force() * self.length);
        }
        for_driving(&mut changed, |history, driven| {
            *history = history.scaled(match driven {
                Driven::Turned => rate,
                Driven::Moved(0) => self.length,
                Driven::Moved(1) => velocity,
                Driven::Moved(_) => velocity * rate,
            });
        });
        if let Some(spin) = changed.carried.as_mut().and_then(|carried| carried.spin.as_mut()) {
            spin.through = spin.through.map(|x| x * self.length);
        }
        let demands = &mut changed.requirements;
        demands.band = demands.band.map(|band| band * rate);
        demands.attachment.inertia *= self.mass * self.length * self.length;
        demands.attachment.first_frequency = demands.attachment.first_frequency.map(|own| own * rate);
        for range in [&mut demands.motion.angular_velocity, &mut demands.motion.angular_acceleration] {
            if let Some(Range::Any(length)) = range {
                *length *= rate;
            }
        }
        demands.tolerance.least_deflection =
            demands.tolerance.least_deflection.map(|least| least * self.length);
        changed
    }
}

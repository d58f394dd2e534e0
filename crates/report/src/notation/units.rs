//! Units of a model, and masses, lengths and times in them.

use super::numbers::{LENGTH_UNITS, MASS_UNITS, TIME_UNITS, engineering, significant};
use flexbody_base::units::UnitSystem;
use serde::Serialize;

/// Names of the units of a model whose quantities are written with SI prefixes.
const METRIC: [&str; 12] = ["m", "mm", "cm", "um", "km", "kg", "g", "t", "tonne", "s", "ms", "us"];

/// Units of a model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct UnitFacts {
    pub length: String,
    pub mass: String,
    pub time: String,
    pub stated: bool,
    #[serde(skip)]
    pub system: UnitSystem,
}

impl UnitFacts {
    pub(crate) fn new(units: &UnitSystem) -> Self {
        Self {
            length: units.length.name().to_owned(),
            mass: units.mass.name().to_owned(),
            time: units.time.name().to_owned(),
            stated: units.stated,
            system: units.clone(),
        }
    }

    pub(crate) fn mass(&self) -> String {
        self.system.mass_name()
    }

    pub(crate) fn length(&self) -> String {
        self.system.length_name()
    }

    pub(crate) fn time(&self) -> String {
        self.system.time_name()
    }

    pub(crate) fn energy(&self) -> String {
        self.system.energy_name()
    }

    pub(crate) fn force(&self) -> String {
        self.system.force_name()
    }

    pub(crate) fn torque(&self) -> String {
        self.system.moment_name()
    }

    pub(crate) fn inertia(&self) -> String {
        format!("{} {}^2", self.mass(), self.length())
    }

    /// Returns the three units, with a remark if they are assumed.
    pub(crate) fn in_words(&self) -> String {
        let assumed = if self.stated { "" } else { " assumed, none stated" };
        format!("{}, {}, {}{assumed}", self.length(), self.mass(), self.time())
    }

    /// Returns a mass in a metric unit that fits its size: `237 g`. A mass in another unit keeps that unit:
    /// `0.52 lb`.
    ///
    /// * `mass`: the mass. Unit: unit of mass of the model.
    pub(crate) fn mass_of(&self, mass: f64, digits: usize) -> String {
        match self.metric(&self.mass).map(|units| units.mass.to_si()) {
            Some(size) if mass != 0.0 && mass.is_finite() => engineering(mass * size, digits, MASS_UNITS),
            _ => format!("{} {}", significant(mass, digits), self.mass()),
        }
    }

    /// Returns a length in a metric unit that fits its size: `12.3 \u{b5}m`. A length in another unit keeps
    /// that unit: `0.52 in`.
    ///
    /// * `length`: the length. Unit: unit of length of the model.
    pub(crate) fn length_of(&self, length: f64, digits: usize) -> String {
        match self.metric(&self.length).map(|units| units.length.to_si()) {
            Some(size) if length != 0.0 && length.is_finite() => {
                engineering(length * size, digits, LENGTH_UNITS)
            }
            _ => format!("{} {}", significant(length, digits), self.length()),
        }
    }

    /// Returns a time in the unit that fits its size: `2.5 ms`. A time in a unit without a name keeps that
    /// unit.
    ///
    /// * `time`: the time. Unit: unit of time of the model.
    pub(crate) fn time_of(&self, time: f64, digits: usize) -> String {
        match self.metric(&self.time).map(|units| units.time.to_si()) {
            Some(size) if time != 0.0 && time.is_finite() => engineering(time * size, digits, TIME_UNITS),
            _ => format!("{} {}", significant(time, digits), self.time()),
        }
    }

    /// Returns the units of the model if `unit`, the name of one of them, is metric.
    fn metric(&self, unit: &str) -> Option<&UnitSystem> {
        METRIC.contains(&unit).then_some(&self.system)
    }

    /// Returns the unit of acceleration: `mm/s^2`.
    pub(crate) fn acceleration(&self) -> String {
        format!("{}/{}^2", self.length(), self.time())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_have_the_names_that_engineers_know() {
        for ([length, mass, time], [energy, force, torque]) in [
            (["m", "kg", "s"], ["J", "N", "N m"]),
            (["mm", "tonne", "s"], ["mJ", "N", "N mm"]),
            (["mm", "kg", "ms"], ["J", "kN", "kN mm"]),
            (["um", "kg", "s"], ["pJ", "\u{b5}N", "\u{b5}N um"]),
            (["in", "lb", "s"], ["lb in^2/s^2", "lb in/s^2", "lb in^2/s^2"]),
        ] {
            let units = UnitFacts::new(&UnitSystem::parse(length, mass, time).expect("known names"));
            assert_eq!([units.energy(), units.force(), units.torque()], [energy, force, torque]);
            assert_eq!(units.acceleration(), format!("{length}/{time}^2"));
        }
    }

    #[test]
    fn quantities_have_the_fitting_prefix() {
        let of = |length: &str, mass: &str, time: &str| {
            UnitFacts::new(&UnitSystem::parse(length, mass, time).expect("known names"))
        };
        let tonnes = of("mm", "tonne", "ms");
        for (mass, digits, expected) in [
            (0.0, 3, "0 t"),
            (2.371_23e-4, 4, "237.1 g"),
            (-2.371_23e-4, 3, "-237 g"),
            (9.9995e-7, 3, "1 g"),
            (1e-6, 7, "1 g"),
            (0.025, 3, "25 kg"),
            (1.25, 3, "1.25 t"),
            (1e-14, 3, "10 ng"),
            (f64::NAN, 3, "not finite t"),
        ] {
            assert_eq!(tonnes.mass_of(mass, digits), expected);
        }
        assert_eq!(
            [12.5, 0.0123, 1234.0, 0.0].map(|x| tonnes.length_of(x, 3)),
            ["12.5 mm", "12.3 \u{b5}m", "1.23 m", "0 mm"]
        );
        assert_eq!([2.5, 2500.0, 0.02].map(|t| tonnes.time_of(t, 3)), ["2.5 ms", "2.5 s", "20 \u{b5}s"]);
        let pounds = of("in", "lb", "s");
        assert_eq!(
            (pounds.mass_of(0.000_52, 3), pounds.length_of(1e4, 3)),
            ("0.00052 lb".into(), "10000 in".into())
        );
        let unnamed = of("0.5", "2.5", "60");
        assert_eq!(unnamed.mass_of(2000.0, 3), "2000 [2.5 kg]");
        assert_eq!(unnamed.length_of(0.001, 3), "0.001 [0.5 m]");
        assert_eq!(unnamed.time_of(0.001, 3), "0.001 [60 s]");
    }
}

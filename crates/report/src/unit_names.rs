//! Units in common notation: mJ, N mm and mm/s^2 instead of powers of the units of a model.

use super::facts::UnitFacts;
use super::numbers::{LENGTH_UNITS, MASS_UNITS, TIME_UNITS, engineering, significant};
use flexbody_base::units::UnitSystem;

/// SI prefixes by power of ten.
const PREFIXES: [(i32, &str); 8] =
    [(-12, "p"), (-9, "n"), (-6, "\u{b5}"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G")];

/// Names of the units of a model whose quantities are written with SI prefixes.
const METRIC: [&str; 12] = ["m", "mm", "cm", "um", "km", "kg", "g", "t", "tonne", "s", "ms", "us"];

impl UnitFacts {
    /// Returns a mass in a metric unit that fits its size: `237 g`. A mass in another unit keeps that unit:
    /// `0.52 lb`.
    ///
    /// * `mass`: the mass. Unit: unit of mass of the model.
    pub(super) fn mass_of(&self, mass: f64, digits: usize) -> String {
        match self.metric(&self.mass).map(|units| units.mass.to_si()) {
            Some(size) if mass != 0.0 && mass.is_finite() => engineering(mass * size, digits, MASS_UNITS),
            _ => format!("{} {}", significant(mass, digits), self.mass()),
        }
    }

    /// Returns a length in a metric unit that fits its size: `12.3 \u{b5}m`. A length in another unit keeps
    /// that unit: `0.52 in`.
    ///
    /// * `length`: the length. Unit: unit of length of the model.
    pub(super) fn length_of(&self, length: f64, digits: usize) -> String {
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
    pub(super) fn time_of(&self, time: f64, digits: usize) -> String {
        match self.metric(&self.time).map(|units| units.time.to_si()) {
            Some(size) if time != 0.0 && time.is_finite() => engineering(time * size, digits, TIME_UNITS),
            _ => format!("{} {}", significant(time, digits), self.time()),
        }
    }

    /// Returns the units of the model if `unit`, the name of one of them, is metric.
    fn metric(&self, unit: &str) -> Option<UnitSystem> {
        let units = UnitSystem::parse(&self.length, &self.mass, &self.time).ok()?;
        METRIC.contains(&unit).then_some(units)
    }

    /// Returns the unit of energy: `mJ`, or `lb in^2/s^2` if no prefix fits.
    pub(super) fn energy(&self) -> String {
        let named = self.in_si(2).and_then(prefix).map(|prefix| format!("{prefix}J"));
        named.unwrap_or_else(|| format!("{} {}^2/{}^2", self.mass(), self.length(), self.time()))
    }

    /// Returns the unit of force: `N`, or `lb in/s^2`.
    pub(super) fn force(&self) -> String {
        let named = self.in_si(1).and_then(prefix).map(|prefix| format!("{prefix}N"));
        named.unwrap_or_else(|| format!("{} {}/{}^2", self.mass(), self.length(), self.time()))
    }

    /// Returns the unit of torque: `N mm`, or `lb in^2/s^2`.
    pub(super) fn torque(&self) -> String {
        match self.in_si(1).and_then(prefix) {
            Some(prefix) => format!("{prefix}N {}", self.length()),
            None => format!("{} {}^2/{}^2", self.mass(), self.length(), self.time()),
        }
    }

    /// Returns the unit of acceleration: `mm/s^2`.
    pub(super) fn acceleration(&self) -> String {
        format!("{}/{}^2", self.length(), self.time())
    }

    /// Returns mass length^power / time^2 in kg m^power / s^2.
    fn in_si(&self, power: i32) -> Option<f64> {
        let units = UnitSystem::parse(&self.length, &self.mass, &self.time).ok()?;
        let (length, time) = (units.length.to_si(), units.time.to_si());
        Some(units.mass.to_si() * length.powi(power) / (time * time))
    }
}

/// Returns the SI prefix of a factor.
fn prefix(factor: f64) -> Option<&'static str> {
    let fits = |power: i32| (factor / 10f64.powi(power) - 1.0).abs() < 1e-9;
    PREFIXES.iter().find(|(power, _)| fits(*power)).map(|(_, prefix)| *prefix)
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

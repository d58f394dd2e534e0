//! Units in common notation: mJ, N mm and mm/s^2 instead of powers of the units of a model.

use super::facts::UnitFacts;
use flexbody_base::units::UnitSystem;

/// SI prefixes by power of ten.
const PREFIXES: [(i32, &str); 8] =
    [(-12, "p"), (-9, "n"), (-6, "\u{b5}"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G")];

impl UnitFacts {
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
}

//! Unit systems: numbers stay in the units of the model; unit systems name these and give their size in SI.

/// Unit of length, mass or time: its name as the user wrote it and its size in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    name: String,
    to_si: f64,
}

impl Unit {
    /// Returns the name as the user wrote it (`mm`, `tonne`, or a number).
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the size in m, kg or s.
    pub fn to_si(&self) -> f64 {
        self.to_si
    }

    fn parse(text: &str, table: &[(&str, f64)]) -> Option<Self> {
        let to_si = table
            .iter()
            .find(|(name, _)| *name == text)
            .map(|(_, to_si)| *to_si)
            .or_else(|| text.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0))?;
        Some(Self { name: text.to_owned(), to_si })
    }
}

const LENGTH: &[(&str, f64)] =
    &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6), ("km", 1e3), ("in", 0.0254), ("ft", 0.3048)];

const MASS: &[(&str, f64)] = &[
    ("kg", 1.0),
    ("g", 1e-3),
    ("t", 1e3),
    ("tonne", 1e3),
    ("lb", 0.453_592_37),
    // Mass that one pound-force accelerates at 1 ft/s^2 and 1 in/s^2; lbf = 0.45359237 * 9.80665 N.
    ("slug", 4.448_221_615_260_5 / 0.3048),
    ("slinch", 4.448_221_615_260_5 / 0.0254),
];

const TIME: &[(&str, f64)] = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

/// Units of a model. The units of force, stress and frequency follow from the three base units.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitSystem {
    /// Unit of length.
    pub length: Unit,
    /// Unit of mass.
    pub mass: Unit,
    /// Unit of time.
    pub time: Unit,
    /// True if the user stated the units; otherwise they are m, kg and s.
    pub stated: bool,
}

impl UnitSystem {
    /// Parses three unit names (or factors to SI); `Err` names the unknown unit.
    pub fn parse(length: &str, mass: &str, time: &str) -> Result<Self, String> {
        Ok(Self {
            length: Unit::parse(length, LENGTH).ok_or_else(|| format!("length `{length}`"))?,
            mass: Unit::parse(mass, MASS).ok_or_else(|| format!("mass `{mass}`"))?,
            time: Unit::parse(time, TIME).ok_or_else(|| format!("time `{time}`"))?,
            stated: true,
        })
    }

    /// Returns the names of the units of length, mass and time.
    pub fn names() -> [Vec<&'static str>; 3] {
        [LENGTH, MASS, TIME].map(|table| table.iter().map(|(name, _)| *name).collect())
    }

    /// Returns one frequency unit (cycles per time unit) in hertz.
    pub fn hertz(&self) -> f64 {
        1.0 / self.time.to_si()
    }

    /// Returns f = sqrt(lambda) / (2 pi) in hertz, for an eigenvalue lambda in 1/time^2.
    pub fn frequency_of(&self, eigenvalue: f64) -> f64 {
        eigenvalue.sqrt() / std::f64::consts::TAU * self.hertz()
    }

    /// Returns lambda = (2 pi f)^2 in 1/time^2, for a frequency f in hertz.
    pub fn eigenvalue_of(&self, frequency_hz: f64) -> f64 {
        (std::f64::consts::TAU * frequency_hz / self.hertz()).powi(2)
    }
}

impl Default for UnitSystem {
    /// Returns m, kg and s, not stated by the user.
    fn default() -> Self {
        let mut units = Self::parse("m", "kg", "s").expect("names of the tables");
        units.stated = false;
        units
    }
}

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

    /// Returns the name, or the size in brackets, such as `[0.2 m]`, if that is the name.
    fn name_or_size(&self, si: &str) -> String {
        if self.name.parse::<f64>().is_ok() { format!("[{} {si}]", self.name) } else { self.name.clone() }
    }

    /// Returns the unit with a name of the table.
    pub(crate) fn named(text: &str, table: &[(&str, f64)]) -> Option<Self> {
        let (name, to_si) = table.iter().find(|(name, _)| *name == text)?;
        Some(Self { name: (*name).to_owned(), to_si: *to_si })
    }

    fn parse(text: &str, table: &[(&str, f64)]) -> Option<Self> {
        let of_size = |to_si: f64| Self { name: text.to_owned(), to_si };
        Self::named(text, table)
            .or_else(|| text.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0).map(of_size))
    }
}

/// SI prefixes by power of ten.
pub(crate) const PREFIXES: [(i32, &str); 8] =
    [(-12, "p"), (-9, "n"), (-6, "\u{b5}"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G")];

pub(crate) const LENGTH: &[(&str, f64)] =
    &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6), ("km", 1e3), ("in", 0.0254), ("ft", 0.3048)];

pub(crate) const MASS: &[(&str, f64)] = &[
    ("kg", 1.0),
    ("g", 1e-3),
    ("t", 1e3),
    ("tonne", 1e3),
    ("lb", 0.453_592_37),
    // Mass that one pound-force accelerates at 1 ft/s^2 and 1 in/s^2; lbf = 0.45359237 * 9.80665 N.
    ("slug", 4.448_221_615_260_5 / 0.3048),
    ("slinch", 4.448_221_615_260_5 / 0.0254),
];

pub(crate) const TIME: &[(&str, f64)] = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

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

// Names of derived units in common notation: mJ, N mm and mm/s^2 instead of powers of the units of a model.
impl UnitSystem {
    /// Returns the unit of mass: `t`, or `[0.2 kg]` for a unit that is given by its size.
    pub fn mass_name(&self) -> String {
        if self.mass.name == "tonne" { "t".to_owned() } else { self.mass.name_or_size("kg") }
    }

    /// Returns the unit of length: `mm`, or `[0.2 m]` for a unit that is given by its size.
    pub fn length_name(&self) -> String {
        self.length.name_or_size("m")
    }

    /// Returns the unit of time: `s`, or `[0.2 s]` for a unit that is given by its size.
    pub fn time_name(&self) -> String {
        self.time.name_or_size("s")
    }

    /// Returns the unit of energy: `mJ`, or `lb in^2/s^2` if no prefix fits.
    pub fn energy_name(&self) -> String {
        let named = prefix(self.in_si(2)).map(|prefix| format!("{prefix}J"));
        named.unwrap_or_else(|| {
            format!("{} {}^2/{}^2", self.mass_name(), self.length_name(), self.time_name())
        })
    }

    /// Returns the unit of force: `N`, or `lb in/s^2` if no prefix fits.
    pub fn force_name(&self) -> String {
        let named = prefix(self.in_si(1)).map(|prefix| format!("{prefix}N"));
        named.unwrap_or_else(|| format!("{} {}/{}^2", self.mass_name(), self.length_name(), self.time_name()))
    }

    /// Returns the unit of moments of forces: `N mm`, or `lb in^2/s^2` if no prefix fits.
    pub fn moment_name(&self) -> String {
        match prefix(self.in_si(1)) {
            Some(prefix) => format!("{prefix}N {}", self.length_name()),
            None => format!("{} {}^2/{}^2", self.mass_name(), self.length_name(), self.time_name()),
        }
    }

    /// Returns the unit of stress: `MPa`, or `lb/(in s^2)` if no prefix fits.
    pub fn stress_name(&self) -> String {
        let named = prefix(self.in_si(-1)).map(|prefix| format!("{prefix}Pa"));
        named.unwrap_or_else(|| {
            format!("{}/({} {}^2)", self.mass_name(), self.length_name(), self.time_name())
        })
    }

    /// Returns mass length^power / time^2 in kg m^power / s^2.
    fn in_si(&self, power: i32) -> f64 {
        self.mass.to_si * self.length.to_si.powi(power) / self.time.to_si.powi(2)
    }
}

/// Returns the SI prefix of a factor.
fn prefix(factor: f64) -> Option<&'static str> {
    let fits = |power: i32| (factor / 10f64.powi(power) - 1.0).abs() < 1e-9;
    PREFIXES.iter().find(|(power, _)| fits(*power)).map(|(_, prefix)| *prefix)
}

impl Default for UnitSystem {
    /// Returns m, kg and s, not stated by the user.
    fn default() -> Self {
        let mut units = Self::parse("m", "kg", "s").expect("names of the tables");
        units.stated = false;
        units
    }
}

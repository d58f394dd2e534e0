//! Metals, and the systems of units in which numbers of a model are those of a metal.

use flexbody_base::units::UnitSystem;

/// Largest relative difference of a density, and of a speed of sound, from those of a metal.
const METAL_TOLERANCE: f64 = 0.1;

/// Solid metal: density in kg/m^3, Young's modulus in Pa, Poisson's ratio.
struct Metal {
    name: &'static str,
    density: f64,
    modulus: f64,
    poisson: f64,
}

const fn metal(name: &'static str, density: f64, modulus: f64, poisson: f64) -> Metal {
    Metal { name, density, modulus, poisson }
}

/// Common metals and alloys, the most common first.
const METALS: [Metal; 14] = [
    metal("steel", 7850.0, 208e9, 0.3),
    metal("aluminium", 2700.0, 70e9, 0.33),
    metal("titanium", 4450.0, 114e9, 0.33),
    metal("cast iron", 7150.0, 115e9, 0.26),
    metal("ductile iron", 7150.0, 170e9, 0.28),
    metal("magnesium", 1780.0, 45e9, 0.33),
    metal("copper", 8930.0, 122e9, 0.34),
    metal("brass", 8500.0, 105e9, 0.34),
    metal("nickel alloy", 8400.0, 206e9, 0.3),
    metal("zinc", 6900.0, 90e9, 0.27),
    metal("tin", 7300.0, 47e9, 0.36),
    metal("lead", 11_340.0, 16e9, 0.43),
    metal("molybdenum", 10_200.0, 320e9, 0.31),
    metal("tungsten", 19_000.0, 400e9, 0.28),
];

impl Metal {
    /// Returns the speed of sound in m/s as the checks measure it: the root of (2 l + 3 m) / density, with
    /// Lame's constants l and m.
    fn speed(&self) -> f64 {
        let nu = self.poisson;
        (self.modulus * (3.0 - 2.0 * nu) / (2.0 * (1.0 + nu) * (1.0 - 2.0 * nu)) / self.density).sqrt()
    }
}

/// Returns the name of the metal with this density (kg/m^3) and speed of sound (m/s).
pub(crate) fn metal_with(density: f64, speed: f64) -> Option<&'static str> {
    let is_near = |value: f64, expected: f64| (value / expected - 1.0).abs() <= METAL_TOLERANCE;
    METALS.iter().find(|m| is_near(density, m.density) && is_near(speed, m.speed())).map(|m| m.name)
}

/// Density and speed of sound of solid elements in the numbers of a model.
#[derive(Clone, Copy)]
pub(crate) struct Solid {
    /// Mass per volume.
    pub density: f64,
    /// Length per time.
    pub speed: f64,
}

/// System of units: its names as `--units` takes them, and sizes in SI.
struct System {
    names: String,
    length: f64,
    mass: f64,
    time: f64,
}

/// Names of units, with their sizes in SI.
type Units = &'static [(&'static str, f64)];

const METRIC_LENGTHS: Units = &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6)];
const METRIC_MASSES: Units = &[("kg", 1.0), ("t", 1e3), ("g", 1e-3)];
const TIMES: Units = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

/// Systems in common use: names, length in m, mass in kg; time is in s.
const COMMON_METRIC: [(&str, f64, f64); 3] =
    [("m, kg, s", 1.0, 1.0), ("mm, t, s", 1e-3, 1e3), ("cm, g, s", 1e-2, 1e-3)];
const COMMON_OTHERS: [(&str, f64, f64); 2] =
    [("in, slinch, s", 0.0254, 175.126_835_246_476_36), ("ft, slug, s", 0.3048, 14.593_902_937_206_364)];

/// Ranges of density (kg/m^3) and of speed of sound (m/s) that advice on units takes for those of a material.
const COMMON_DENSITIES: std::ops::Range<f64> = 500.0..20_000.0;
const COMMON_SPEEDS: std::ops::Range<f64> = 500.0..20_000.0;

impl System {
    fn common((names, length, mass): (&str, f64, f64)) -> Self {
        Self { names: names.to_owned(), length, mass, time: 1.0 }
    }

    /// Returns every mixture of metric units of length and mass with some of the units of time.
    fn metric(times: Units) -> impl Iterator<Item = Self> {
        let pairs =
            METRIC_LENGTHS.iter().flat_map(|length| METRIC_MASSES.iter().map(move |mass| (length, mass)));
        let mixed = move |(length, mass): (&(&str, f64), &(&str, f64)), time: &(&str, f64)| Self {
            names: format!("{}, {}, {}", length.0, mass.0, time.0),
            length: length.1,
            mass: mass.1,
            time: time.1,
        };
        times.iter().flat_map(move |time| pairs.clone().map(move |pair| mixed(pair, time)))
    }

    fn density(&self, solid: Solid) -> f64 {
        solid.density * self.mass / self.length.powi(3)
    }

    fn speed(&self, solid: Solid) -> f64 {
        solid.speed * self.length / self.time
    }

    fn metal(&self, solid: Solid) -> Option<&'static str> {
        metal_with(self.density(solid), self.speed(solid))
    }

    fn fits(&self, solid: Solid) -> bool {
        COMMON_DENSITIES.contains(&self.density(solid)) && COMMON_SPEEDS.contains(&self.speed(solid))
    }
}

/// Returns the systems of units in which numbers are those of a material: where there is a metal, only those with
/// a metal; metric systems, mixtures included, or else others.
pub(crate) fn fitting_units(solid: Solid) -> Vec<String> {
    let others = || COMMON_OTHERS.into_iter().map(System::common);
    let common = || COMMON_METRIC.into_iter().map(System::common);
    let is_metal = |system: &System| system.metal(solid).is_some();
    let fits = |system: &System| system.fits(solid);
    let groups: [Vec<System>; 5] = [
        System::metric(TIMES).filter(is_metal).collect(),
        others().filter(is_metal).collect(),
        common().filter(fits).collect(),
        System::metric(&TIMES[..1]).filter(fits).collect(),
        others().filter(fits).collect(),
    ];
    let first = groups.into_iter().find(|group| !group.is_empty()).unwrap_or_default();
    first.into_iter().map(|system| system.names).collect()
}

/// Returns the common systems of units in which a speed of sound is that of a material, metric ones first.
pub(crate) fn units_of_speed(speed: f64) -> Vec<&'static str> {
    let fits = |&(_, length, _): &(&str, f64, f64)| COMMON_SPEEDS.contains(&(speed * length));
    COMMON_METRIC.into_iter().chain(COMMON_OTHERS).filter(fits).map(|(names, ..)| names).collect()
}

/// Units in which numbers that mix metric units pass for those of another material.
const OTHER_UNITS: [&str; 5] = ["in", "ft", "lb", "slug", "slinch"];

/// Metal that numbers are in a system of units.
pub(crate) struct MetalIn {
    /// Name of the metal.
    pub metal: &'static str,
    /// Names of the units, as `--units` takes them.
    pub units: String,
}

/// Returns the metal of numbers in metric units that are no metal in the stated `units`, if these are inches, feet,
/// pounds, slugs or slinches, or if their speed of sound is implausible.
pub(crate) fn metal_in_metric_units(
    solid: Solid,
    units: &UnitSystem,
    is_implausible: bool,
) -> Option<MetalIn> {
    let is_other = [units.length.name(), units.mass.name()].iter().any(|name| OTHER_UNITS.contains(name));
    if !(is_other || is_implausible) || stated(units).metal(solid).is_some() {
        return None;
    }
    let found = |system: System| Some(MetalIn { metal: system.metal(solid)?, units: system.names });
    System::metric(&TIMES[..1]).find_map(found)
}

fn stated(units: &UnitSystem) -> System {
    System {
        names: String::new(),
        length: units.length.to_si(),
        mass: units.mass.to_si(),
        time: units.time.to_si(),
    }
}

/// Stiffness in another unit than mass, length and time.
pub(crate) struct StiffnessUnit {
    /// Metal that the stiffness has in that unit.
    pub metal: &'static str,
    /// Factor by which the stiffness must be multiplied.
    pub factor: f64,
}

/// Factors between units of stress: the powers of 1000 between Pa, kPa, MPa and GPa, and the acceleration of
/// gravity in in/s^2, by which lbf/in differs from lb/s^2.
const STRESS_FACTORS: [f64; 7] = [1e3, 1e6, 1e9, 1e-3, 1e-6, 1e-9, 386.088_58];

/// Returns the unit in which the stiffness is that of the metal whose density (kg/m^3) the model has; `speed` is
/// in m/s.
pub(crate) fn stiffness_unit(density: f64, speed: f64) -> Option<StiffnessUnit> {
    if metal_with(density, speed).is_some() {
        return None;
    }
    let found =
        |&factor: &f64| Some(StiffnessUnit { metal: metal_with(density, speed * factor.sqrt())?, factor });
    STRESS_FACTORS.iter().find_map(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_of_metals_are_those_of_tables() {
        let steel = METALS.iter().find(|m| m.name == "steel").expect("in the table");
        assert!((steel.speed() / 7820.0 - 1.0).abs() < 0.01, "{}", steel.speed());
        assert_eq!(metal_with(2700.0, 8190.0), Some("aluminium"));
        assert_eq!(metal_with(2330.0, 11_657.0), None);
    }

    #[test]
    fn every_metal_is_found_in_every_common_system() {
        for metal in &METALS {
            for system in COMMON_METRIC.into_iter().chain(COMMON_OTHERS).map(System::common) {
                let density = metal.density * system.length.powi(3) / system.mass;
                let found = fitting_units(Solid { density, speed: metal.speed() / system.length });
                assert!(found.contains(&system.names), "{} in {}: {found:?}", metal.name, system.names);
            }
        }
    }
}

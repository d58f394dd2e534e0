//! Common units in which numbers of a model agree with materials.

/// Returns advice on numbers without stated units, with the units in which they are plausible.
pub(super) fn state_units(fitting: &str) -> String {
    let reason =
        if fitting.is_empty() { String::new() } else { format!(": the numbers fit materials in {fitting}") };
    format!(
        "state the units with --units LENGTH,MASS,TIME, or [model.units] in the manifest{reason}; use --allow-implausible (or allow_implausible in [model]) if m, kg, s are intended"
    )
}

/// Common units: their names, length in m and mass in kg; time is in s.
const COMMON_UNITS: [(&str, f64, f64); 5] = [
    ("m, kg, s", 1.0, 1.0),
    ("mm, t, s", 1e-3, 1e3),
    ("cm, g, s", 1e-2, 1e-3),
    ("in, slinch, s", 0.0254, 175.126_835_246_476_36),
    ("ft, slug, s", 0.3048, 14.593_902_937_206_364),
];

/// Returns the common units in which a density and a speed of sound are plausible.
pub(super) fn fitting_units(density: f64, speed: f64) -> Vec<&'static str> {
    let of_speed = units_of_speed(speed);
    let fits = |&&(name, length, mass): &&(&str, f64, f64)| {
        (500.0..20_000.0).contains(&(density * mass / length.powi(3))) && of_speed.contains(&name)
    };
    COMMON_UNITS.iter().filter(fits).map(|&(name, ..)| name).collect()
}

/// Returns the common units in which a speed of sound is plausible.
pub(super) fn units_of_speed(speed: f64) -> Vec<&'static str> {
    let fits = |&&(_, length, _): &&(&str, f64, f64)| (500.0..20_000.0).contains(&(speed * length));
    COMMON_UNITS.iter().filter(fits).map(|&(name, ..)| name).collect()
}

//! Numbers in readable form. JSON never uses these functions: its floats round-trip.

pub(crate) use flexbody_base::numbers::significant;

/// Returns a relative error in percent with three digits.
pub(crate) fn percent(ratio: f64) -> String {
    format!("{} %", significant(100.0 * ratio, 3))
}

/// Units of a quantity: size in the SI unit and name, ascending in size. One of them has the size 1.
pub(super) type PrefixedUnits = [(f64, &'static str)];

const FREQUENCY_UNITS: &PrefixedUnits = &[(1.0, "Hz"), (1e3, "kHz"), (1e6, "MHz"), (1e9, "GHz")];

pub(super) const MASS_UNITS: &PrefixedUnits =
    &[(1e-12, "ng"), (1e-9, "\u{b5}g"), (1e-6, "mg"), (1e-3, "g"), (1.0, "kg"), (1e3, "t")];

pub(super) const LENGTH_UNITS: &PrefixedUnits = &[(1e-9, "nm"), (1e-6, "\u{b5}m"), (1e-3, "mm"), (1.0, "m")];

pub(super) const TIME_UNITS: &PrefixedUnits = &[(1e-9, "ns"), (1e-6, "\u{b5}s"), (1e-3, "ms"), (1.0, "s")];

/// Returns a value in SI units with the prefix that leaves one to three digits before the point: `17.1 kHz`.
/// Values beyond the smallest or the largest unit have that unit; zero has the unit without a prefix.
pub(super) fn engineering(value: f64, digits: usize, units: &PrefixedUnits) -> String {
    let (size, name) = fitting_unit(value, digits, units);
    format!("{} {name}", significant(value / size, digits))
}

/// Returns the largest unit that does not exceed the value after its rounding to `digits`: 999.95 Hz to three
/// digits are 1 kHz.
fn fitting_unit(value: f64, digits: usize, units: &PrefixedUnits) -> (f64, &'static str) {
    let rounded = significant(value, digits).parse::<f64>().unwrap_or(0.0).abs();
    if rounded == 0.0 {
        return units.iter().copied().find(|(size, _)| *size == 1.0).unwrap_or((1.0, ""));
    }
    let fitting = units.iter().rev().find(|(size, _)| *size <= rounded);
    fitting.or(units.first()).copied().unwrap_or((1.0, ""))
}

/// Returns a frequency in Hz, kHz, MHz or GHz.
///
/// * `hertz`: frequency. Unit: Hz.
pub(crate) fn frequency(hertz: f64, digits: usize) -> String {
    engineering(hertz, digits, FREQUENCY_UNITS)
}

/// Returns two frequencies with `to` between them: `812.5 Hz to 4.4 kHz`, or `1.2 to 4.4 kHz` if both have
/// the same unit.
///
/// * `ends`: the frequencies. Unit: Hz.
pub(crate) fn frequency_range(ends: [f64; 2], digits: usize) -> String {
    let [first, last] = ends.map(|hertz| fitting_unit(hertz, digits, FREQUENCY_UNITS));
    if first == last {
        return format!("{} to {}", significant(ends[0] / first.0, digits), frequency(ends[1], digits));
    }
    ends.map(|hertz| frequency(hertz, digits)).join(" to ")
}

/// Returns frequencies in the unit of the smallest, and the name of the unit.
///
/// * `hertz`: frequencies. Unit: Hz.
pub(crate) fn frequencies(hertz: &[f64], digits: usize) -> (Vec<String>, &'static str) {
    let least = hertz.iter().copied().fold(f64::INFINITY, f64::min);
    let (size, name) = fitting_unit(least, digits, FREQUENCY_UNITS);
    (hertz.iter().map(|value| significant(value / size, digits)).collect(), name)
}

/// Returns a duration.
pub(crate) fn duration(seconds: f64) -> String {
    if seconds > 0.0 && seconds < 9.995e-4 {
        engineering(seconds, 3, TIME_UNITS)
    } else if seconds < 0.9995 {
        format!("{:.0} ms", 1e3 * seconds)
    } else if seconds < 99.5 {
        format!("{seconds:.2} s")
    } else {
        format!("{seconds:.0} s")
    }
}

/// Returns the times of a run: `3.25 s wall, 6.26 s CPU`.
pub(crate) fn times(wall_seconds: f64, cpu_seconds: f64) -> String {
    format!("{} wall, {} CPU", duration(wall_seconds), duration(cpu_seconds))
}

/// Returns a size in memory or on disk with a decimal prefix.
pub(crate) fn bytes(count: u64) -> String {
    let prefixes = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let found = prefixes.iter().find(|(size, _)| count as f64 >= *size);
    found.map_or(format!("{count} B"), |(size, unit)| {
        format!("{} {unit}", significant(count as f64 / size, 3))
    })
}

/// Returns `count` with an English noun in singular or plural.
pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Returns a fragment with an upper-case first letter.
pub(crate) fn sentence(fragment: &str) -> String {
    let mut characters = fragment.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// Returns three values and their unit.
pub(crate) fn triple(values: &[f64; 3], unit: &str) -> String {
    let [x, y, z] = values.map(|v| significant(v, 6));
    format!("{x}, {y}, {z} {unit}")
}

/// Returns three coordinates; values that are rounding relative to `size` are written as zero.
pub(crate) fn coordinates(values: &[f64; 3], size: f64, unit: &str) -> String {
    triple(&values.map(|v| if v.abs() <= 1e-12 * size { 0.0 } else { v }), unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_durations_have_the_fitting_unit() {
        assert_eq!(
            [bytes(0), bytes(999), bytes(1000), bytes(1_234_567_890)],
            ["0 B", "999 B", "1 kB", "1.23 GB"]
        );
        assert_eq!(
            [0.0, 3.2e-7, 9.996e-4, 0.0125, 0.9996, 59.999, 100.0].map(duration),
            ["0 ms", "320 ns", "1 ms", "12 ms", "1.00 s", "60.00 s", "100 s"]
        );
    }

    #[test]
    fn frequencies_have_the_fitting_prefix() {
        for (hertz, digits, expected) in [
            (0.0, 3, "0 Hz"),
            (-0.0, 3, "0 Hz"),
            (0.0123, 3, "0.0123 Hz"),
            (812.5, 5, "812.5 Hz"),
            (999.94, 4, "999.9 Hz"),
            (999.95, 5, "999.95 Hz"),
            (999.95, 3, "1 kHz"),
            (17_087.0, 3, "17.1 kHz"),
            (-17_087.0, 3, "-17.1 kHz"),
            (2.5e6, 3, "2.5 MHz"),
            (4e13, 3, "40000 GHz"),
            (f64::NAN, 3, "not finite Hz"),
            (f64::INFINITY, 3, "not finite Hz"),
        ] {
            assert_eq!(frequency(hertz, digits), expected);
        }
    }

    #[test]
    fn frequencies_of_a_range_and_of_a_list_share_their_unit() {
        assert_eq!(frequency_range([812.5, 4412.5], 5), "812.5 Hz to 4.4125 kHz");
        assert_eq!(frequency_range([1204.0, 4412.5], 5), "1.204 to 4.4125 kHz");
        assert_eq!(frequency_range([10.0, 999.96], 3), "10 Hz to 1 kHz");
        assert_eq!(frequencies(&[812.5, 4412.5], 5), (vec!["812.5".to_owned(), "4412.5".to_owned()], "Hz"));
        assert_eq!(frequencies(&[17_087.0, 1204.0], 3), (vec!["17.1".to_owned(), "1.2".to_owned()], "kHz"));
        assert_eq!(frequencies(&[], 3), (Vec::new(), "Hz"));
    }
}
